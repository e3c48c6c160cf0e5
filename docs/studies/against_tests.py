"""The soil of the model against published formulas and tests: a slow push, and the speed of a guardrail post."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from boulder_kernels import Design, constants_of, corrected
from boulder_kernels.design import G, design_at, passive_pressure_coefficient
from boulder_kernels.soil import spring_force
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.inputs import sampled_designs
from boulder_sweep.settings.model import RESISTANCES
from boulder_sweep.soils import with_law

Soil = Callable[[float, float], float]
"""From the displacement [m] at a depth [m] to the force of the soil per metre of depth [N/m]."""
SLICES = 400
ROTATIONS_DEG = (1.0, 2.0, 5.0, 10.0, 13.8, 20.0)
SPEEDS_M_S = (5.5, 8.9, 13.4)
POST_DEPTH_M, LOAD_HEIGHT_M, POST_ANGLE_DEG, TURNS_AT = 1.092, 0.632, 45.0, 0.7
"""Embedment of 43 in and height of the load of 24 7/8 in, both of other tests of this laboratory; friction angle of a
crushed limestone and depth of the point the post turns about, over its embedment: assumed."""


def api_sand(design: Design) -> Soil:
    """Return the p-y curve of API RP 2GEO for sand under static load (Reese et al., 1974; Murchison and O'Neill, 1984).

    p = A p_u tanh(k z y / (A p_u)), p_u = min((C_1 z + C_2 W) gamma z, C_3 W gamma z), A = max(3 - 0.8 z/W, 0.9). The
    design gives the initial stiffness k.
    """
    phi, width, gamma = design.phi, design.W, design.rho_s * G
    alpha, beta, K_0 = 0.5 * phi, 0.25 * math.pi + 0.5 * phi, 0.4
    K_a = math.tan(0.25 * math.pi - 0.5 * phi) ** 2
    tan_b, tan_d = math.tan(beta), math.tan(beta - phi)
    beside = math.tan(phi) * math.sin(beta)
    C_1 = tan_b**2 * math.tan(alpha) / tan_d
    C_1 += K_0 * (beside / (math.cos(alpha) * tan_d) + tan_b * (beside - math.tan(alpha)))
    C_2 = tan_b / tan_d - K_a
    C_3 = K_a * (tan_b**8 - 1.0) + K_0 * math.tan(phi) * tan_b**4
    stiffness = 1e6 * design.beta

    def force(y: float, z: float) -> float:
        ultimate = min(C_1 * z + C_2 * width, C_3 * width) * gamma * z * max(3.0 - 0.8 * z / width, 0.9)
        return ultimate * math.tanh(stiffness * z * y / ultimate)

    return force


def model_soil(design: Design) -> Soil:
    """Return the spring of the model, limited to the ultimate resistance of the design."""
    c = constants_of(design, corrected(), 0)
    return lambda y, z: spring_force(y, z, 1.0, c)


def pushed(design: Design, soil: Soil, rotation: float) -> float:
    """Return the horizontal force at the height of the blow that turns a rigid boulder so far, by the soil alone [N].

    Parameters
    ----------
    design
        Its depth and the height of the force.
    soil
        The soil.
    rotation
        Rotation of the boulder [rad].
    """
    depths = (np.arange(SLICES) + 0.5) * design.d / SLICES
    thick = design.d / SLICES

    def sums(top: float) -> tuple[float, float]:
        p = np.array([soil(top - math.sin(rotation) * z, z) for z in depths.tolist()])
        return float(p.sum() * thick), float((p * (depths + design.e)).sum() * thick)

    far = 2.0 * design.d * math.sin(rotation)
    top = brentq(lambda place: sums(place)[1], 0.0, far)
    return sums(top)[0]


def pushover_table() -> Table:
    """Return the force that turns the boulder of the test that passed slowly, by every law and by API's curve."""
    table = Table(("rotation", *(f"`{law}` [kN]" for law in RESISTANCES), "API sand [kN]"))
    given = sampled_designs(crash_test("rwg"), 1).table
    designs = [design_at(with_law(given, law), 0) for law in RESISTANCES]
    soils = [*map(model_soil, designs), api_sand(designs[0])]
    for degrees in ROTATIONS_DEG:
        forces = [pushed(designs[0], soil, math.radians(degrees)) for soil in soils]
        table.add(f"{degrees:g}°", *(f"{force / 1e3:.0f}" for force in forces))
    return table


def drag_share(speed: float) -> float:
    """Return the drag of the model's soil over its ultimate resistance, above the point a struck post turns about.

    Width and density of the soil cancel: both are proportional to them.
    """
    turned = TURNS_AT * POST_DEPTH_M
    at_surface = speed * turned / (turned + LOAD_HEIGHT_M)
    K_p = passive_pressure_coefficient(math.radians(POST_ANGLE_DEG))
    return (at_surface**2 * turned / 3.0) / (K_p**2 * G * turned**2 / 2.0)


def post_table() -> Table:
    """Return what the drag adds to the resistance of the soil at the speeds of the tests of guardrail posts."""
    table = Table(("speed [m/s]", "drag over ultimate resistance"))
    for speed in SPEEDS_M_S:
        table.add(f"{speed:g}", f"{drag_share(speed):.1%}")
    return table
