"""The kernels against plain Runge-Kutta steps: the rest rule as printed, and what is proved, for ten seconds."""

from __future__ import annotations

import numpy as np
import pytest

import boulder_kernels as bk
from benchmarks.designs import first, sample
from boulder_kernels import DesignTable, Status
from docs.studies.random_designs import random_table
from tests import rk4
from tests.accuracy.box import LIMIT, rows
from tests.kernels.samples import table_of
from tests.kernels.test_settling import weak_designs

PRESETS = {"corrected": bk.corrected(), "as_printed": bk.as_printed()}
PROVED = (Status.SETTLED, Status.BELOW_LIMIT)


def by_kernels(table: DesignTable, preset: str, h: float, longest: float = 0.0) -> bk.OutcomeTable:
    control = bk.Control(h, 1.0, LIMIT, 0, False, longest_horizon=longest)
    return bk.simulate_table(table, PRESETS[preset], control)


def by_runge_kutta(table: DesignTable, preset: str, step: float, horizon: float) -> rk4.Result:
    return rk4.follow_table(table._asdict(), tuple(PRESETS[preset]), step, horizon, LIMIT)


def differences(table: DesignTable, preset: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Differences after a second [deg], [m], [m]: rotation; displacement of the truck and crush where nothing stops."""
    found, known = by_kernels(table, preset, 5e-4), by_runge_kutta(table, preset, 1e-4, 1.0)
    turned = np.degrees(np.abs(found.theta_max - np.minimum(known.theta, LIMIT)))
    stands = found.status != Status.LIMIT
    return turned, np.abs(found.x_v_max - known.x_v)[stands], np.abs(found.crush_max - known.crush)[stands]


def test_a_boulder_that_the_paper_holds_does_not_turn() -> None:
    """Eq 37 cancels every moment on this one; let go at the first that points back, it overturns."""
    table = rows(sample(6631), slice(6630, 6631))
    found = by_kernels(table, "as_printed", 5e-4)
    assert found.status[0] != Status.LIMIT
    assert found.theta_max[0] == 0.0
    assert by_runge_kutta(table, "as_printed", 2e-5, 1.0).theta[0] < np.radians(1e-3)


@pytest.mark.parametrize("preset", PRESETS)
def test_the_same_motion(preset: str) -> None:
    turned, moved, crushed = differences(first(sample(120), 120), preset)
    assert turned.max() < 0.01
    assert moved.max() < 1e-3
    assert crushed.max() < 1e-3


@pytest.mark.compiled
@pytest.mark.nightly
@pytest.mark.parametrize("preset", ["corrected", "as_printed"])
def test_the_same_motion_of_many(preset: str) -> None:
    """Designs that graze the printed jump, or the limit, may differ; no more than one in a thousand does."""
    turned, moved, crushed = differences(sample(4000), preset)
    assert np.count_nonzero(turned > 0.02) <= 4
    assert np.quantile(moved, 0.999) < 1e-3
    assert np.quantile(crushed, 0.999) < 1e-3


def wild_tables() -> dict[str, DesignTable]:
    """Families of designs far from usual ones."""
    usual = random_table(3000, 31)
    turn = np.random.default_rng(32).uniform
    return {
        "usual": random_table(9000, 33),
        "slender in weak soil": table_of(weak_designs(2500, seed=34)),
        "soil of any stiffness": usual._replace(beta=np.exp(turn(np.log(0.2), np.log(300.0), 3000))),
        "soft truck": usual._replace(k_v=0.1 * usual.k_v, c_v=0.5 * usual.c_v),
        "light boulder": usual._replace(rho_b=0.3 * usual.rho_b, v_0=0.4 * usual.v_0),
        "hardly buried": usual._replace(d=0.3 * usual.d, v_0=0.15 * usual.v_0),
    }


def check_proved(table: DesignTable) -> int:
    """Follow what is proved for ten seconds by Runge-Kutta steps; return how many designs that were.

    A proof is one of the motion that was computed. A boulder that rocks for seconds amplifies every error, so what is
    nearer to the limit than its estimated error is not looked at, and what the Runge-Kutta method overturns is followed
    again by steps ten times as short.
    """
    control = bk.Control(5e-4, 1.0, LIMIT, 0, True, longest_horizon=10.0)
    found = bk.simulate_table(table, bk.corrected(), control)
    apart = LIMIT - found.theta_max > np.maximum(found.theta_error, np.radians(0.05))
    proved = np.flatnonzero(np.isin(found.status, PROVED) & apart)
    later = by_runge_kutta(rows(table, proved), "corrected", 2e-4, 10.0)
    again = proved[np.isfinite(later.t_limit)]
    assert np.all(np.isinf(by_runge_kutta(rows(table, again), "corrected", 2e-5, 10.0).t_limit))
    assert np.quantile(later.x_v - found.x_v_max[proved], 0.999) < 0.01
    return int(proved.size)


def test_what_is_proved_stays_below_the_limit() -> None:
    assert check_proved(random_table(400, 35)) > 20


@pytest.mark.nightly
@pytest.mark.compiled
def test_what_is_proved_stays_below_the_limit_in_wild_families() -> None:
    counts = {name: check_proved(table) for name, table in wild_tables().items()}
    assert min(counts.values()) > 50, counts
    assert sum(counts.values()) > 2000, counts


def test_most_rows_without_an_end_at_the_horizon_are_proved_soon_after() -> None:
    """Of 6000 usual designs no more than one in a thousand is left open at ten seconds."""
    found = by_kernels(random_table(6000, 36), "corrected", 8e-3, longest=10.0)
    assert np.count_nonzero(np.isin(found.status, (Status.HORIZON, Status.OUTWARD))) <= 6
    assert np.count_nonzero(found.t_end > 1.0) > 0
    assert np.all(found.t_end <= 10.0)


def test_as_printed_nothing_is_proved() -> None:
    """The printed forces feed energy: some designs that stand for a second overturn within ten."""
    table = first(sample(1200), 1200)
    early, late = (by_kernels(table, "as_printed", 1e-3, longest) for longest in (0.0, 10.0))
    assert not np.isin(early.status, PROVED).any()
    stood = early.status == Status.UNPROVABLE
    assert np.count_nonzero(late.status[stood] == Status.LIMIT) >= 5
    assert np.all(late.t_end[late.status == Status.UNPROVABLE] == 10.0)
