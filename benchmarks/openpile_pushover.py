"""A slow push of a stiff pile in sand by openpile, to hold ``docs.studies.against_tests`` against.

openpile supports Python 3.8 to 3.10 only, so it is no dependency. In an environment of its own:

    python3.10 -m venv piles && piles/bin/pip install openpile==1.0.3
    piles/bin/python benchmarks/openpile_pushover.py > docs/studies/openpile_pushover.csv

The pile has the width, depth and soil of the boulder that passed its test, and is as stiff as the equations of openpile
bear: much stiffer, and its rotation is lost in rounding.
"""

import contextlib
import io
import math
import sys

from openpile.construct import BoundaryForce, CircularPileSection, Layer, Model, Pile, SoilProfile
from openpile.materials import PileMaterial
from openpile.soilmodels import API_sand
from openpile.winkler import winkler

WIDTH_M, DEPTH_M, HEIGHT_M = 1.68, 2.03, 0.938
DENSITY_KG_M3, ANGLE_DEG, SUBGRADE_MN_M3 = 1859.9, 43.2, 95.0
STIFFNESS_KPA = 1e7
FORCES_KN = (50.0, 100.0, 150.0, 175.0, 200.0, 215.0)


def rotation_deg(force_kN: float) -> float:
    """Return the rotation of the pile under a horizontal force at its head."""
    material = PileMaterial(name="stiff", uw=1.0, E=STIFFNESS_KPA, nu=0.3)
    section = CircularPileSection(top=HEIGHT_M, bottom=-DEPTH_M, diameter=WIDTH_M, thickness=0.3)
    sand = API_sand(phi=ANGLE_DEG, kind="static", initial_subgrade_modulus=1e3 * SUBGRADE_MN_M3)
    weight = 1e-3 * DENSITY_KG_M3 * 9.80665
    layer = Layer(name="sand", top=0.0, bottom=-10.0, weight=weight, lateral_model=sand)
    model = Model(
        name="pushed",
        pile=Pile(name="stiff", material=material, sections=[section]),
        soil=SoilProfile(name="sand", top_elevation=0.0, water_line=-100.0, layers=[layer]),
        boundary_conditions=[BoundaryForce(elevation=HEIGHT_M, y=force_kN)],
        element_type="EulerBernoulli",
        coarseness=0.05,
        distributed_moment=False,
        base_shear=False,
        base_moment=False,
        distributed_axial=False,
        base_axial=False,
    )
    with contextlib.redirect_stdout(io.StringIO()):
        line = winkler(model, max_iter=300).deflection.to_numpy()
    (top, y_top), (base, y_base) = line[0], line[-1]
    return math.degrees(math.atan((y_top - y_base) / (top - base)))


if __name__ == "__main__":
    sys.stdout.write("force_kN,rotation_deg\n")
    for force in FORCES_KN:
        sys.stdout.write(f"{force:g},{rotation_deg(force):.4f}\n")
