"""A boulder that nothing can move is a rigid wall: the analytic solution of Eq 45 (Eqs 49 to 51, put right)."""

import numpy as np
import pytest

import boulder_kernels as bk
from tests import oracle
from tests.oracle.vehicle import WallImpact

from .samples import control, design_of, record_at

KNOWN = {
    # m = 6800 kg, v_0 = 13.4 m/s, k = 3103.3e3 N/m, c = 138.91e3 N s/m
    "x_v_max_m": (0.8267, 5e-5),
    "at_s": (0.1165, 5e-5),
    "peak_force_kN": (1040.8, 0.05),
    "peak_at_s": (0.0560, 5e-5),
}


def wall(**changes: float) -> bk.Design:
    """RWG a billion times as dense, before the truck of the known figures; more where asked for."""
    values = {"rho_b": 2.596e12, "m_v": 6800.0, "v_0": 13.4} | changes
    return design_of(oracle.RWG)._replace(**{name: np.float64(value) for name, value in values.items()})


def simulate(design: bk.Design, readings: bk.Readings, horizon: float = 0.5) -> tuple[bk.Outcome, bk.Record]:
    record = record_at(np.linspace(0.0, horizon, 201))
    return bk.simulate_design(design, readings, control(2e-4, horizon), record), record


def solution(design: bk.Design) -> WallImpact:
    return WallImpact(float(design.m_v), float(design.v_0), float(design.k_v), float(design.c_v))


@pytest.mark.parametrize("readings", [bk.as_printed(), bk.corrected()], ids=["as_printed", "corrected"])
def test_known_figures(readings: bk.Readings) -> None:
    m = simulate(wall(), readings)[0].maxima
    for name, value in zip(KNOWN, (m.x_v, m.t_x_v, m.F_v / 1e3, m.t_F_v), strict=True):
        figure, tolerance = KNOWN[name]
        assert value == pytest.approx(figure, abs=1.02 * tolerance)
    assert m.x_b < 1e-6
    assert m.theta < 1e-6


@pytest.mark.parametrize("damper", [20.0, 2.0, 1.0, 0.7])
@pytest.mark.parametrize("readings", [bk.as_printed(), bk.corrected()], ids=["as_printed", "corrected"])
def test_under_damped(readings: bk.Readings, damper: float) -> None:
    """Peak force, largest displacement, and separation; the damper as a multiple of the paper's."""
    design = wall(c_v=damper * 138.91e3)
    known = solution(design)
    assert known.discriminant < 0.0
    found, record = simulate(design, readings)
    assert found.maxima.F_v == pytest.approx(known.peak_force()[0], rel=1e-7)
    assert found.maxima.t_F_v == pytest.approx(known.peak_force()[1], abs=1e-6)
    assert found.maxima.x_v == pytest.approx(known.largest_displacement()[0], rel=1e-7)
    assert found.maxima.t_x_v == pytest.approx(known.largest_displacement()[1], abs=1e-6)
    t_off, v_off = known.separation()
    if t_off >= record.times[-1]:
        return
    on = record.times < t_off
    assert np.all(record.touching[on])
    assert np.all(~record.touching[~on][:10])
    if readings.separation_released:
        assert record.states[~on, 5] == pytest.approx(v_off, abs=1e-6)
    else:
        x, v, _ = known.response(record.times)
        assert record.states[:, 4] == pytest.approx(x, abs=1e-6)
        assert record.states[:, 5] == pytest.approx(v, abs=1e-4)


@pytest.mark.parametrize("damper", [0.5, 0.1])
def test_over_damped(damper: float) -> None:
    """A truck that creeps to a stop and never comes off: Eqs 49 to 51 with real roots."""
    design = wall(c_v=damper * 138.91e3)
    known = solution(design)
    assert known.discriminant > 0.0
    found, record = simulate(design, bk.corrected())
    x, v, _ = known.response(record.times)
    assert record.states[:, 4] == pytest.approx(x, abs=1e-6)
    assert record.states[:, 5] == pytest.approx(v, abs=1e-4)
    assert np.all(record.touching)
    assert found.maxima.F_v == pytest.approx(known.peak_force()[0], rel=1e-7)
    assert found.maxima.x_v == pytest.approx(x[-1], abs=1e-6)


def test_an_immovable_boulder_by_its_soil() -> None:
    """A light boulder in soil a million times too stiff and strong: the wall again, to the little it gives."""
    design = wall(rho_b=2596.0, beta=95e4, K_epsilon=1e6)
    found, _ = simulate(design, bk.corrected(), 0.15)
    known = solution(design)
    assert found.maxima.F_v == pytest.approx(known.peak_force()[0], rel=1e-3)
    assert found.maxima.x_v == pytest.approx(known.largest_displacement()[0], rel=1e-3)
    assert found.maxima.theta < 1e-3
