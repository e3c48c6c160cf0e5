"""What plastic soil does: to both crash tests, to a grid, and how many elements it takes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from boulder_kernels import OutcomesAtRest, simulate_table
from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import accuracy_of, control_of, readings_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import sampled_designs
from boulder_sweep.judge.judged import PASS, Judged
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.model import UNLOADINGS

LONGEST_S = 5.0
"""Time in which elastic soil is watched for its swing back [s]."""
DESIGNS, FEW = 256, 64
STEP_S = 0.002
ELEMENTS, MOST = (25, 50, 100, 200, 400), 1600


def _by(way: str, sweep: Sweep) -> Sweep:
    return replace(sweep, model=replace(sweep.model, unloading=way))


def _shown(value: float | None, digits: int) -> str:
    return "" if value is None else number(round(value, digits) + 0.0, digits)


def tests_table() -> Table:
    """Return the crash tests by every way of unloading, corrected readings."""
    table = Table(
        ("test", "unloading", "verdict", "max rotation [deg]", "max x_b [m]", "swings back by [deg]", "rests at [deg]")
    )
    for name, title in NAMES.items():
        for way in UNLOADINGS:
            sweep = _by(way, crash_test(name))
            found = simulate(sweep).summary()
            swing, rest = found.get("swing_back_deg"), ""
            if found["verdict"] == "pass" and way == UNLOADINGS[0]:
                theta = np.degrees(simulate(sweep, horizon_s=LONGEST_S).rotation_rad)
                swing, rest = float(theta.max() - theta[theta.argmax() :].min()), "0"
            elif found.get("permanent_tilt_deg") is not None:
                rest = f"{_shown(found['permanent_tilt_deg'], 2)} ± {number(found['permanent_tilt_error_deg'], 2)}"
            table.add(
                title,
                f"`{way}`",
                found["verdict"],
                number(found["max_rotation_deg"], 2),
                number(found["max_displacement_m"], 3),
                _shown(swing, 2),
                rest,
            )
    return table


def _judged(sweep: Sweep) -> Judged:
    return evaluation_of(sweep, accuracy_of(sweep)).judged(sampled_designs(sweep, DESIGNS))


def grid_table(grid: Path) -> Table:
    """Return what a sample of a grid does by every way of unloading."""
    of_passes = ("max rotation [deg]", "swings back by [deg]", "rests at [deg]")
    table = Table(("unloading", "passes", *(f"median {words}" for words in of_passes)))
    for way in UNLOADINGS:
        found = _judged(_by(way, load(grid)))
        passes = found.verdict == PASS
        medians = [
            _shown(float(np.nanmedian(found[name][passes])), 2) if name in found.columns else ""
            for name in ("max_rotation_deg", "swing_back_deg", "permanent_tilt_deg")
        ]
        table.add(f"`{way}`", f"{passes.mean():.1%}", *medians)
    return table


def _with_elements(sweep: Sweep, elements: int) -> OutcomesAtRest:
    own = replace(sweep, model=replace(sweep.model, soil_elements=elements))
    control = control_of(own, accuracy_of(own))._replace(error_estimate=False, h=STEP_S, longest_horizon=1.0)
    return simulate_table(sampled_designs(own, FEW).table, readings_of(own), control)


def elements_table(grid: Path) -> Table:
    """Return the largest errors by the number of elements, over the designs of a sample that do not overturn."""
    table = Table(("elements", "max rotation [deg]", "swing back [deg]"))
    sweep = _by(UNLOADINGS[1], load(grid))
    known = _with_elements(sweep, MOST)
    standing = np.isfinite(known.swing_back)
    for elements in ELEMENTS:
        found = _with_elements(sweep, elements)
        both = standing & np.isfinite(found.swing_back)
        errors = (
            np.abs(one - other)[both].max()
            for one, other in ((found.theta_max, known.theta_max), (found.swing_back, known.swing_back))
        )
        table.add(str(elements), *(f"{math.degrees(error):.1g}" for error in errors))
    return table
