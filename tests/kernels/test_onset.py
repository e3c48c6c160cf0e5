"""The first step of an impact: it ends where the boulder begins to turn, in lanes and in the single impact alike."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import boulder_kernels as bk
from boulder_kernels.control import BEHIND, RETRY, first_length, onset_of
from boulder_kernels.design import Constants, Design, constants_of
from boulder_kernels.dormand_prince import step
from boulder_kernels.dynamics import SEATED, TURNING_FORWARD, Acceleration, State
from boulder_kernels.events import AT_END, TOLERANCE, initial_modes
from boulder_kernels.impact import RUNNING, begin_to_turn, enter_modes, first_touch, go_on
from boulder_kernels.lanes import LANES, empty_groups, load_impact, store_state
from boulder_kernels.pieces import PRESSURE, SUBGRADE, TO, uniform_layers
from boulder_kernels.table import follow_lane, start_designs
from tests import oracle
from tests.kernels.samples import layered_constants
from tests.oracle import dynamics, events, restoring

from .samples import control, design_of, inputs_of, random_designs, table_of

LIMIT = np.radians(20.0)
CORRECTED = bk.corrected()
RWG = design_of(oracle.RWG)


def length(h: float, readings: bk.Readings, c: Constants) -> float:
    factors = enter_modes(initial_modes(readings, c), readings, LIMIT, False, TOLERANCE, c)[1]
    return first_length(h, factors, c)


def onset_by_the_oracle(design: Design) -> float:
    """Time at which the net moment exceeds the couple of the weight by the factor BEHIND [s]."""
    impact = oracle.problem(inputs_of(design), oracle.CORRECTED)
    modes = events.first_modes(impact)
    hold = BEHIND * restoring.gravity_hold(impact.inputs, impact.constants)

    def short(_: float, y: np.ndarray) -> float:
        return hold - dynamics.loads(impact, y, modes).net

    short.__dict__["terminal"] = True
    found = solve_ivp(
        lambda _, y: oracle.rate(impact, y, modes),
        (0.0, 0.1),
        impact.start,
        "DOP853",
        events=short,
        rtol=1e-11,
        atol=1e-14,
    )
    return float(found.t_events[0][0])


def test_the_onset_is_that_of_the_oracle() -> None:
    """To within the precision with which events are located; where it is early, far closer."""
    for design in [RWG, *random_designs(30, seed=151)]:
        c = constants_of(design, CORRECTED, 0)
        if c.h > 0.0:
            known = onset_by_the_oracle(design)
            assert onset_of(c) == pytest.approx(known, rel=1e-5 if known < 4e-3 else AT_END * TOLERANCE)
    assert onset_by_the_oracle(RWG) < 4e-3


def test_a_step_to_the_onset_ends_just_behind_it() -> None:
    c = constants_of(RWG, CORRECTED, 0)
    how = control(0.014, 1.0, LIMIT, stop_at_limit=True)
    i = first_touch(0.014, 0.014, c, CORRECTED, how)
    assert i.modes.turning == SEATED
    assert i.clock.h == onset_of(c)
    y_end, k_end, error = step(i.y, i.k, i.clock.h, i.switches, c)
    assert 1.0 < k_end.M / c.C_cos < 1.0 + AT_END * TOLERANCE
    assert not go_on(i, y_end, k_end, error, c)[0]
    turns, after = begin_to_turn(i, y_end, k_end, error, c, CORRECTED, how)
    assert turns
    assert (after.y, after.modes.turning, after.clock.t) == (y_end, TURNING_FORWARD, i.clock.h)
    # Only the moment that holds the boulder may be exceeded, and by no more.
    for M in (0.99, 1.01):
        other = Acceleration(k_end.a_b, k_end.alpha_b, k_end.a_v, M * c.C_cos)
        assert not begin_to_turn(i, y_end, other, error, c, CORRECTED, how)[0]


def test_the_onset_is_the_same_by_every_law_of_the_soil() -> None:
    """In one layer, by elements, and with cohesion; in a softer layer it is another."""
    known = onset_of(constants_of(RWG, CORRECTED, 0))
    layers = uniform_layers(RWG)
    assert onset_of(layered_constants(RWG, layers, CORRECTED, 0)) == pytest.approx(known, rel=1e-9)
    strong = layers.copy()
    strong[0, PRESSURE] = 1e4
    assert onset_of(layered_constants(RWG, strong, CORRECTED, 0)) == pytest.approx(known, rel=1e-9)
    for elements in (200, 400):
        in_layers = layered_constants(RWG, layers, CORRECTED, elements)
        for c in (constants_of(RWG, CORRECTED, elements), in_layers):
            assert onset_of(c) == pytest.approx(known, rel=20.0 / elements**2)
    soft = np.vstack([layers, layers])
    soft[0, TO], soft[0, SUBGRADE] = 0.5 * RWG.d, 0.01 * RWG.beta
    assert abs(onset_of(layered_constants(RWG, soft, CORRECTED, 0)) / known - 1.0) > 1e-6


def test_when_the_first_step_is_like_any() -> None:
    """Where the onset lies behind it, and where the boulder is not held, or not turned forward."""
    h = 0.014
    c = constants_of(RWG, CORRECTED, 0)
    assert length(h, CORRECTED, c) == onset_of(c) < h
    assert length(0.5 * onset_of(c), CORRECTED, c) == 0.5 * onset_of(c)
    printed = constants_of(RWG, bk.as_printed(), 0)
    below = constants_of(RWG._replace(e=np.float64(-2.0)), CORRECTED, 0)
    still = constants_of(RWG._replace(v_0=np.float64(0.0)), CORRECTED, 0)
    assert below.h < 0.0
    for readings, other in ((bk.as_printed(), printed), (CORRECTED, below), (CORRECTED, still)):
        with np.errstate(divide="ignore", invalid="ignore"):
            assert length(h, readings, other) == h


def test_designs_enter_their_lanes_behind_the_onset() -> None:
    """A lane whose boulder has begun to turn stands at the onset; one that met more in its step has yet to make it."""
    slow = RWG._replace(v_0=np.float64(0.01))  # never overcomes the weight
    below = RWG._replace(e=np.float64(-2.0))
    how, onset = control(0.014, 1.0, LIMIT, stop_at_limit=True), onset_of(constants_of(RWG, CORRECTED, 0))
    for first in (RWG, slow, below):
        ws = empty_groups()[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            start_designs(ws, np.stack(table_of([first] + [RWG] * (LANES - 1))), 0, CORRECTED, how)
        for lane, design in {0: first, LANES - 1: RWG if LANES > 1 else first}.items():
            i = load_impact(ws, lane)
            clock, turning = i.clock, i.modes.turning
            if design is RWG:
                assert clock.t == pytest.approx(onset, rel=1e-12)
                assert (clock.h, turning) == (0.014, TURNING_FORWARD)
                assert i.y.x_v == pytest.approx(RWG.v_0 * onset, rel=0.1)
            else:
                assert (clock.t, clock.h, turning) == (0.0, 0.014, SEATED)


def numbers_in(groups: np.ndarray) -> np.ndarray:
    """Every number of every lane, shape (n, LANES)."""
    return np.frombuffer(groups.tobytes()).reshape(-1, LANES)


def test_a_design_whose_motion_is_no_number_is_started_again() -> None:
    """By shorter steps, in its own lane; no other lane is touched."""
    how, groups = control(0.014, 1.0, LIMIT, stop_at_limit=True), empty_groups()
    ws = groups[0]
    start_designs(ws, np.stack(table_of([RWG] * LANES)), 0, CORRECTED, how)
    store_state(ws.y_end, 0, State(*[np.nan] * 6))
    before, others = numbers_in(groups), np.arange(LANES) != 0
    assert follow_lane(ws, 0, CORRECTED, how) == RUNNING
    i = load_impact(ws, 0)
    assert (i.clock.t, i.clock.attempts, i.modes.turning) == (0.0, 0.0, SEATED)
    assert i.clock.h_full == i.pace.h_touching == RETRY * 0.014
    assert np.array_equal(numbers_in(groups)[:, others], before[:, others])
