"""How strongly a blow lifts a boulder: by the laws of a box that turns about its corner, written out once more."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boulder_sweep.judge.uplift import blow_lift, run_by_run, side_friction
from tests.judge.plain import plain_designs

F = 8e5


def test_it_is_the_force_that_raises_the_centre_over_weight_and_friction() -> None:
    """The moment of inertia by quadrature over the box, the friction by a sum over depth."""
    table = plain_designs(L=1.1, W=1.7, H=2.9, rho_b=2700.0, d=1.6, e=0.8, rho_s=1800.0, phi=0.7).table
    x, y = np.meshgrid((np.arange(400) + 0.5) / 400 * 1.1, (np.arange(400) + 0.5) / 400 * 2.9)
    mass = 2700.0 * 1.1 * 1.7 * 2.9
    about_corner = mass * (x**2 + y**2).mean()
    depth = (np.arange(2000) + 0.5) / 2000 * 1.6
    pressure = (1.0 - math.sin(0.7)) * 1800.0 * 9.80665 * depth
    sides = 2.0 * (pressure * math.tan(0.7 * 2.0 / 3.0)).sum() * 1.6 / 2000 * 1.1
    assert side_friction(table)[0] == pytest.approx(sides, rel=1e-6)
    rise = F * (0.8 + 1.6) / about_corner * 0.55
    assert blow_lift(np.array([F]), table)[0] == pytest.approx(mass * rise / (mass * 9.80665 + sides), rel=1e-5)


@pytest.mark.parametrize(
    ("change", "more"),
    [
        ({"rho_b": 3000.0}, False),
        ({"W": 2.0}, False),
        ({"e": 1.2}, True),
        ({"rho_s": 1.0}, True),
    ],
)
def test_weight_and_friction_hold_it_down(change: dict[str, float], more: bool) -> None:
    plain, changed = (float(blow_lift(np.array([F]), plain_designs(**own).table)[0]) for own in ({}, change))
    assert (changed > plain) is more


def test_no_force_lifts_nothing_and_none_is_none() -> None:
    lifts = blow_lift(np.array([0.0, math.nan]), plain_designs(2).table)
    assert lifts[0] == 0.0
    assert math.isnan(lifts[1])


@pytest.mark.parametrize(
    "values", [[], [0.3], [0.3] * 9, [0.3] * 8 + [0.4] * 7, [0.1, 0.2, 0.3, 0.1], [0.3, np.nan] * 4]
)
def test_equal_neighbours_are_computed_once(values: list[float]) -> None:
    """The same bits as row by row, for one function and for two; four equal neighbours are one call of it."""
    column, seen = np.array(values), []

    def both(x: np.ndarray) -> np.ndarray:
        seen.append(len(x))
        return np.stack([np.sin(x), np.exp(x)])

    assert run_by_run(both, column).tobytes() == np.stack([np.sin(column), np.exp(column)]).tobytes()
    assert run_by_run(np.tan, column).tobytes() == np.tan(column).tobytes()
    runs = 1 + np.count_nonzero(column[1:] != column[:-1])
    assert seen == [runs if 4 * (runs - 1) < len(column) else len(column)]
