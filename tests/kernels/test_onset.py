"""The first step of an impact: it ends where the boulder begins to turn, in lanes and in the single impact alike."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import boulder_kernels as bk
from boulder_kernels.after_step import RUNNING, enter_modes, initial_state, passes
from boulder_kernels.control import BEHIND, first_length, onset_of
from boulder_kernels.design import Constants, Design, constants_of
from boulder_kernels.dormand_prince import step
from boulder_kernels.dynamics import SEATED, TURNING_FORWARD, Acceleration, rate_of
from boulder_kernels.lane_steps import start_designs
from boulder_kernels.lanes import start_again
from boulder_kernels.layered import PRESSURE, SUBGRADE, TO, uniform_layers
from boulder_kernels.modes import AT_END, TOLERANCE, initial_modes
from boulder_kernels.numerics import field
from boulder_kernels.workspace import (
    CONSTANTS,
    EVENTS,
    LANES,
    MODES,
    SIZE,
    STARTS,
    STATE,
    STEP,
    STEP_FULL,
    TIME,
    WHOLE,
    load,
)
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
    modes = initial_modes(CORRECTED, c)
    assert modes.turning == SEATED
    switches, factors = enter_modes(modes, CORRECTED, LIMIT, False, TOLERANCE, c)
    y = initial_state(c)
    k = rate_of(y, switches, c)
    y_end, k_end, _ = step(y, k, onset_of(c), switches, c)
    assert 1.0 < k_end.M / c.C_cos < 1.0 + AT_END * TOLERANCE
    for beyond, passing in ((0.0, False), (AT_END * TOLERANCE * c.C_cos, True)):
        assert passes(y, y_end, k_end, factors, switches, c, beyond)[0] == passing
    # Only the moment that holds the boulder may be exceeded, and by no more.
    far = Acceleration(k_end.a_b, k_end.alpha_b, k_end.a_v, 1.01 * c.C_cos)
    assert not passes(y, y_end, far, factors, switches, c, AT_END * TOLERANCE * c.C_cos)[0]


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
    designs = [RWG, slow, below, *[RWG] * (LANES - 3)]
    ws, how = np.zeros(WHOLE), control(0.014, 1.0, LIMIT, stop_at_limit=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        start_designs(ws, np.stack(table_of(designs)), 0, CORRECTED, how, how.h)
    onset = onset_of(constants_of(RWG, CORRECTED, 0))
    for lane in (0, LANES - 1):
        assert field(ws, TIME, lane) == pytest.approx(onset, rel=1e-12)
        assert field(ws, STEP, lane) == 0.014
        assert load(ws, MODES, lane).turning == TURNING_FORWARD
        assert load(ws, STATE, lane).x_v == pytest.approx(RWG.v_0 * onset, rel=0.1)
    assert (field(ws, TIME, 1), load(ws, MODES, 1).turning) == (0.014, SEATED)
    assert (field(ws, TIME, 2), field(ws, STEP, 2)) == (0.0, 0.014)


def test_a_design_is_started_again_with_shorter_steps() -> None:
    """In a lane of its own, whichever row it is of: the same design, and none of those that wait for a lane is lost."""
    designs, how = random_designs(2 * LANES + 3, seed=152), control(0.014, 1.0, LIMIT, stop_at_limit=True)
    ws, table = np.zeros(WHOLE), np.stack(table_of(designs))
    start_designs(ws[STARTS:], table, 0, CORRECTED, how, how.h)
    waiting = ws[STARTS : STARTS + SIZE].copy()
    for row in (0, LANES - 1, LANES, 2 * LANES + 2):
        assert start_again(ws, EVENTS + 3, table, row, CORRECTED, how, 1e-3) == RUNNING
        assert field(ws, STEP_FULL, EVENTS + 3) <= 1e-3
        found, known = load(ws, CONSTANTS, EVENTS + 3), constants_of(designs[row], CORRECTED, 0)
        for name in ("m_eff", "J_eff", "d", "K_soil", "x_yield", "k_v"):
            assert getattr(found, name) == pytest.approx(getattr(known, name), rel=1e-14)
    assert np.array_equal(ws[STARTS : STARTS + SIZE], waiting)
