"""Designs, readings and states to hold the kernels against the oracle at, and translations between the two."""

from __future__ import annotations

import itertools
from math import exp, log, radians
from typing import Any

import numpy as np

import boulder_kernels as bk
from boulder_kernels.design import ultimate_pressure
from boulder_kernels.dynamics import State, constants_in, contact_displacement, profile_of, spring_compression
from boulder_kernels.pieces import table_in_layers
from tests import oracle

BUMPER = 0.5  # height of the underside of the bumper [m]

SWITCHES = ("inertia", "impact_arm", "contact", "restoring", "separation")
"""The five readings by the oracle's names, in the order of the fields of the kernels' `Readings`."""

ALL_READINGS = [bk.Readings(*map(bool, bits)) for bits in itertools.product((0, 1), repeat=5)]
"""All 32 combinations."""


def single_switches() -> dict[str, bk.Readings]:
    """Readings that differ from either preset in one switch, by what they are called."""
    found = {"as_printed": bk.as_printed(), "corrected": bk.corrected()}
    for i, name in enumerate(SWITCHES):
        for preset, readings in (("as_printed", bk.as_printed()), ("corrected", bk.corrected())):
            turned = [value != (i == j) for j, value in enumerate(readings)]
            found[f"{preset} but {name}"] = bk.Readings(*turned)
    return found


def oracle_readings(readings: bk.Readings) -> oracle.Readings:
    """Readings of the kernels in the oracle's words."""
    words = oracle.inputs.CORRECTED_NAMES
    return oracle.Readings(
        **{name: words[name] if corrected else "printed" for name, corrected in zip(SWITCHES, readings, strict=True)}
    )


def design_of(inputs: oracle.Inputs, e_bumper: float = BUMPER) -> bk.Design:
    """Inputs of the oracle as a design of the kernels; floats of NumPy, which divide by zero without raising."""
    values = {name: getattr(inputs, name) for name in bk.Design._fields if name != "e_bumper"}
    return bk.Design(**{name: np.float64(value) for name, value in (values | {"e_bumper": e_bumper}).items()})


def inputs_of(design: bk.Design) -> oracle.Inputs:
    """Return a design as inputs of the oracle."""
    return oracle.Inputs(**{name: float(v) for name, v in design._asdict().items() if name != "e_bumper"})


def random_design(rng: np.random.Generator) -> bk.Design:
    """Draw a design from the realistic ranges."""
    H = rng.uniform(1.8, 4.0)
    d = rng.uniform(0.35, 0.75) * H
    return bk.Design(
        L=rng.uniform(0.6, 2.0),
        W=rng.uniform(0.8, 2.5),
        H=H,
        rho_b=rng.uniform(2400.0, 3074.0),
        d=d,
        e=(min(H - d, 1.4) + BUMPER) / 2,
        rho_s=rng.uniform(1520.0, 2240.0),
        phi=radians(rng.uniform(27.0, 49.0)),
        beta=exp(rng.uniform(log(2.0), log(110.0))),
        K_epsilon=rng.uniform(1.0, 1.2),
        m_v=rng.uniform(5000.0, 9000.0),
        v_0=rng.uniform(8.0, 25.0),
        k_v=rng.uniform(2e6, 5e6),
        c_v=rng.uniform(0.7e5, 2.5e5),
        e_bumper=BUMPER,
    )


def random_designs(count: int, seed: int) -> list[bk.Design]:
    """Draw designs that the truck meets, as all do whose top is over the bumper."""
    rng = np.random.default_rng(seed)
    found: list[bk.Design] = []
    while len(found) < count:
        design = random_design(rng)
        if design.H - design.d > design.e_bumper:
            found.append(design)
    return found


def random_layers(designs: list[bk.Design], count: int, seed: int) -> Any:
    """Put designs into soils of as many layers, some of them below the boulder, the uppermost one with cohesion.

    The vertical stress is continuous, so that a layer lighter than what lies over it begins with more than its own.
    """
    rng = np.random.default_rng(seed)
    rows = np.empty((len(designs), count, 6))
    for layers, design in zip(rows, designs, strict=True):
        bottoms = [*np.sort(rng.uniform(0.05, 1.2, count - 1)) * design.d, np.inf]
        top = stress = 0.0
        for m, bottom in enumerate(bottoms):
            density, friction = rng.uniform(1500.0, 2200.0), radians(rng.uniform(28.0, 44.0))
            slope = ultimate_pressure(1.0, friction, density, 1.0)
            p_0 = slope / density * (stress - density * top) + (3e3 if m == 0 else 0.0)
            layers[m] = bottom, density, friction, exp(rng.uniform(log(10.0), log(100.0))), p_0, slope
            top, stress = bottom, stress + density * (bottom - top)
    return table_in_layers(table_of(designs), rows)


def table_of(designs: list[bk.Design]) -> bk.DesignTable:
    """Designs as columns."""
    return bk.DesignTable(*(np.array(column, dtype=float) for column in zip(*designs, strict=True)))


def random_state(rng: np.random.Generator, theta_range: tuple[float, float] = (-1.4, 3.1)) -> State:
    """Draw a state, by preference a moderate one, sometimes far out."""
    far = 1.0 if rng.random() < 0.3 else 0.2
    low, high = theta_range
    return State(
        x_b=far * rng.normal(),
        v_b=far * 6.0 * rng.normal(),
        theta_b=rng.uniform(low, high) if far == 1.0 else float(np.clip(0.3 * rng.normal(), low, high)),
        omega_b=far * 8.0 * rng.normal(),
        x_v=far * rng.normal(),
        v_v=10.0 * rng.normal(),
    )


def compression(y: State, c: bk.Constants) -> float:
    """Compression u of the vehicle's spring [m]."""
    x_c = contact_displacement(y.x_b, np.sin(y.theta_b), 1.0 - np.cos(y.theta_b), c)
    return float(spring_compression(y.x_v, y.v_v, x_c, c))


def literal_state(y: State, c: bk.Constants) -> np.ndarray:
    """Seven states of Eq 52: the kernels' six, and the acceleration of the truck that follows from them."""
    return np.array([y.x_b, y.v_b, y.theta_b, y.omega_b, y.x_v, y.v_v, -c.k_m * compression(y, c)])


def control(
    h: float = 1e-3,
    horizon: float = 0.5,
    theta_limit: float = 9.0,
    elements: int = 0,
    *,
    error_estimate: bool = False,
    stop_at_limit: bool = False,
) -> bk.Control:
    """How to run a simulation; without more, to the horizon with no stop at a limit of rotation."""
    return bk.Control(h, horizon, theta_limit, elements, error_estimate, stop_at_limit)


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two arrays of floats are equal bit for bit, NaN and the sign of zero included."""
    return a.shape == b.shape and a.tobytes() == b.tobytes()


def layered_constants(design: bk.Design, layers: np.ndarray, readings: bk.Readings, elements: int) -> Any:
    """Constants of one design in layers of soil, by elements or, where there are none, exactly."""
    return constants_in(design, readings, elements, profile_of(layers, elements))
