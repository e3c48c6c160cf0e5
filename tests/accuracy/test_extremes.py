"""Each extreme has a right answer, or a refusal that names its cause."""

from __future__ import annotations

import numpy as np
import pytest

from boulder_kernels import SIMULATED, Control, Design, DesignTable, OutcomeTable, Readings, Status, simulate_table
from boulder_sweep.judge.verdict import STATUS_REASONS, Limits, judge
from tests.accuracy.box import LIMIT, PRESETS, how
from tests.judge.plain import plain_designs

RWG = Design(
    L=1.65, W=1.68, H=2.9, rho_b=2596.0, d=2.03, e=0.685, rho_s=1859.9, phi=np.radians(43.2), beta=95.0,
    K_epsilon=1.0, m_v=6800.0, v_0=13.4, k_v=3103.3e3, c_v=138.91e3, e_bumper=0.5,
)  # fmt: skip
REFUSALS = set(STATUS_REASONS) - {Status.UNSTABLE, Status.INVALID}


def run(control: Control | None = None, preset: str = "corrected", **changes: float) -> OutcomeTable:
    """Simulate the boulder that held, changed."""
    table = DesignTable(*(np.array([value]) for value in RWG._replace(**changes)))
    return simulate_table(table, PRESETS[preset], control or how())


def ends_well(out: OutcomeTable) -> bool:
    """Whether a row has numbers, or a refusal with a named cause."""
    status = Status(int(out.status[0]))
    return status in REFUSALS if np.isnan(out.theta_max[0]) else bool(np.isfinite(out.x_v_max[0]))


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("factor", [1e-6, 1e6])
@pytest.mark.parametrize("name", ["beta", "rho_b", "rho_s", "m_v", "k_v", "c_v"])
def test_a_million_times_off(name: str, factor: float, preset: str) -> None:
    assert ends_well(run(preset=preset, **{name: getattr(RWG, name) * factor}))


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize(
    "changes",
    [
        {"d": 1e-6, "e": 1.0},
        {"d": RWG.H * (1 - 1e-9), "e": 0.0, "e_bumper": 0.0},
        {"phi": np.radians(1.0)},
        {"phi": np.radians(60.0)},
        {"v_0": 100.0},
        {"L": 20.0, "W": 20.0, "H": 20.0, "d": 10.0, "e": 1.0},
        {"L": 0.01, "W": 0.01, "H": 0.01, "d": 0.004, "e": 0.003, "e_bumper": 0.001},
    ],
)
def test_edges_of_the_box(changes: dict[str, float], preset: str) -> None:
    assert ends_well(run(preset=preset, **changes))


def test_no_speed_no_motion() -> None:
    out = run(v_0=0.0)
    assert (out.theta_max[0], out.x_b_max[0], out.x_v_max[0], out.F_v_max[0]) == (0.0, 0.0, 0.0, 0.0)


def test_heavy_boulder_is_a_wall_and_a_featherweight_truck_does_nothing() -> None:
    assert run(rho_b=2596e6).theta_max[0] < 1e-4
    assert run(m_v=0.68).x_b_max[0] < 1e-4
    assert run(m_v=6800e-6).status[0] == Status.STIFF_VEHICLE  # 7 g before a truck's spring rebound within microseconds


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({"k_v": 1e13}, Status.WEAK_DAMPER),
        ({"c_v": 0.1}, Status.WEAK_DAMPER),
        ({"beta": 1e9}, Status.STIFF_SOIL),
        ({"m_v": 1e-3, "c_v": 1e12}, Status.STIFF_VEHICLE),
    ],
)
def test_refusals_name_their_cause(changes: dict[str, float], status: Status) -> None:
    out = run(**changes)
    assert out.status[0] == status
    reasons = judge(out, plain_designs(L=1.65), Limits(LIMIT, "P1"))
    assert "time steps" in reasons.reasons[reasons.reason[0]]


def test_a_weak_damper_leaves_the_boulder_alone_and_a_strong_one_is_a_spring() -> None:
    """Where the relaxation can still be followed, the limits are approached from either side."""
    horizon = how(1e-4, horizon_s=0.3)
    weak = run(horizon, c_v=1.3e3, k_v=3e6)
    assert weak.x_b_max[0] < 0.05 * run(horizon).x_b_max[0]
    strong, stronger = (run(horizon, c_v=c).x_b_max[0] for c in (1e9, 1e12))
    assert strong == pytest.approx(stronger, rel=1e-3)


@pytest.mark.parametrize("preset", PRESETS)
def test_a_step_of_the_whole_horizon_is_shortened(preset: str) -> None:
    assert ends_well(run(Control(1.0, 1.0, LIMIT, 0, False), preset))


def test_a_step_far_too_short_is_refused_in_words() -> None:
    out = run(Control(1e-7, 1.0, LIMIT, 0, False))
    assert out.status[0] == Status.STEP_BUDGET
    assert "too short" in STATUS_REASONS[Status.STEP_BUDGET]


@pytest.mark.parametrize("preset", PRESETS)
def test_horizon_of_one_step(preset: str) -> None:
    out = run(Control(1e-4, 1e-4, LIMIT, 0, False), preset)
    assert out.t_end[0] == 1e-4
    assert out.status[0] == Status.OUTWARD


def test_one_element_and_a_million() -> None:
    short = Control(0.008, 0.008, LIMIT, 0, False)
    closed = run(short).x_v_max[0]
    assert run(short._replace(elements=1_000_000)).x_v_max[0] == pytest.approx(closed, rel=1e-9)
    assert np.isfinite(run(how(elements=1)).theta_max[0])


@pytest.mark.parametrize("off", [-1e-9, 0.0, 1e-9])
def test_a_limit_exactly_at_the_peak(off: float) -> None:
    """The peak is the limit to the last digits: it is located, or the row is undecided; never a pass by luck."""
    peak = run(how(0.004)).theta_max[0] * (1.0 + off)
    out = run(Control(0.008, 1.0, float(peak), 0, True))
    rows = judge(out, plain_designs(L=1.65), Limits(float(peak), "P1"))
    assert rows.verdict[0] in (1, 2)  # fail or undecided


@pytest.mark.parametrize(
    "readings", [Readings(*map(bool, bits)) for bits in ((1, 1, 1, 1, 0), (0, 1, 0, 0, 1), (1, 0, 1, 0, 1))]
)
@pytest.mark.parametrize("step_s", [0.004, 0.016, 0.1, 1.0])
def test_many_events_in_a_step(readings: Readings, step_s: float) -> None:
    """Long steps hold several events each; the answer agrees with short ones as far as such steps allow."""
    table = DesignTable(*(np.array([value]) for value in RWG))
    long = simulate_table(table, readings, Control(step_s, 1.0, LIMIT, 0, False))
    short = simulate_table(table, readings, Control(5e-4, 1.0, LIMIT, 0, False))
    assert long.status[0] in SIMULATED
    if step_s <= 0.016:
        assert long.theta_max[0] == pytest.approx(short.theta_max[0], abs=np.radians(0.2))


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("below", [1e-3, 1e-6, 1e-9])
def test_a_limit_just_below_the_peak(below: float, preset: str) -> None:
    """Beyond the limit and back within one step: the time is found, and nothing beyond the limit is reported."""
    for step_s in (0.004, 0.008, 0.012):
        plain = run(how(step_s), preset)
        limit = float(plain.theta_max[0]) * (1.0 - below)
        out = run(Control(step_s, 1.0, limit, 0, False), preset)
        assert out.status[0] == Status.LIMIT
        assert out.theta_max[0] == limit
        assert out.t_limit[0] == out.t_end[0] < plain.t_end[0]
        to_the_end = run(Control(step_s, 1.0, limit, 0, False, False), preset)
        assert np.isfinite(to_the_end.t_limit[0]) == (to_the_end.theta_max[0] >= limit)
