"""Order of the integrator: five where motions are smooth and across located events, less across other kinks."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import (
    FREE,
    HELD,
    LIMITED_BACK,
    LIMITED_FORWARD,
    SEATED,
    TURNING_FORWARD,
    Modes,
    State,
    acceleration,
    signed_arm,
    switches_of,
)
from boulder_kernels.events import CONTACT, CORNER, COUPLE, ROTATION, TOLERANCE
from boulder_kernels.impact import Problem
from boulder_kernels.outcomes import no_record
from boulder_kernels.table import simulate_table
from tests import oracle
from tests.oracle.dynamics import motion_of

from .samples import control, design_of, inputs_of, literal_state, oracle_readings, table_of
from .stepping import SCALE, Start, advance, errors, order, with_compression

RWG = design_of(oracle.RWG)
LINEAR_SOIL = {"x_yield": 1e6, "R_soil": 1e-9}  # no ultimate resistance, no drag: no kink but those asked for
NO_WEIGHT = {"C_cos": 0.0, "C_sin": 0.0}
HELD_DOWN = {"C_cos": 1e12}  # whatever the moment, the boulder stays seated


def modes(turning: int, touching: bool) -> Modes:
    return Modes(turning, touching, 1.0, 1.0, 0, 0)


def printed_modes(y: State, c: bk.Constants) -> Modes:
    """Modes that belong to a state in contact under the printed rule."""
    arm = signed_arm(np.sin(y.theta_b), 1.0 - np.cos(y.theta_b), c)
    corner = 1.0 if y.theta_b < c.theta_corner else -1.0
    free = Modes(FREE, True, corner, 1.0 if arm >= 0.0 else -1.0, 0, 0)
    M = acceleration(*y, switches_of(free, bk.as_printed(), c), c).M
    if y.omega_b <= 0.0:
        return free
    if abs(M) <= abs(arm):
        return free._replace(turning=HELD)
    return free._replace(turning=LIMITED_FORWARD if M > 0.0 else LIMITED_BACK)


# smooth


def test_order_five_over_six_steps() -> None:
    """Against DOP853 on the oracle's right-hand side, while all soil moves forward below its ultimate resistance."""
    design = RWG._replace(beta=np.float64(20.0), K_epsilon=np.float64(1e4))
    readings = bk.corrected()
    c = constants_of(design, readings, 0)
    y = State(0.0, 6.0, 0.1, 0.5, 0.4, 10.0)
    T, steps = 0.03, [3, 6, 12, 24, 48, 96]
    problem = oracle.problem(inputs_of(design), oracle_readings(readings))
    frozen = oracle.Modes("clockwise", "touching")
    exact = solve_ivp(
        lambda t, z: oracle.rate(problem, z, frozen),
        (0.0, T),
        literal_state(y, c),
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        t_eval=np.linspace(0.0, T, 20),
    )
    for z in exact.y.T:  # it is smooth, then
        assert np.all(problem.soil.end_velocity(motion_of(z)) > 0.0)
        assert np.all(np.abs(problem.soil.end_stretch(motion_of(z))) < c.x_yield)
        assert z[6] < 0.0 < z[2]
    found = []
    for n in steps:
        end, met = advance(Start(c, readings, y, modes(TURNING_FORWARD, True)), T, n)
        assert met == []
        found.append(np.linalg.norm((end - exact.y[:6, -1]) / SCALE))
    assert order(steps, np.array(found)) == pytest.approx(5.0, abs=0.2)
    assert found[-1] < 1e-12


# events that are located


def gravity_starts() -> dict[str, tuple[Start, float, set[int]]]:
    """Motions that meet an event under the gravity reading: start, duration [s], events."""
    readings = bk.corrected()
    c = constants_of(RWG, readings, 0)._replace(**LINEAR_SOIL)
    soft = c._replace(K_soil=c.K_soil / 20)
    forward, back = State(0.02, 4.0, 0.3, 0.5, 0.0, 2.0), State(0.02, 1.0, 0.02, -2.5, 0.0, 4.0)

    def start(c: bk.Constants, y: State, u: float, turning: int, touching: bool) -> Start:
        return Start(c, readings, with_compression(y, u, c), modes(turning, touching))

    return {
        "the weight is overcome": (start(c, State(0.0, 0.0, 0.0, 0.0, 0.0, 14.5), 0.0, SEATED, True), 0.05, {ROTATION}),
        "forward, then back": (start(soft, back, 0.1, TURNING_FORWARD, True), 0.05, {ROTATION}),
        "contact lost": (start(soft, forward, 0.03, TURNING_FORWARD, True), 0.05, {CONTACT}),
        "contact regained": (
            start(soft, forward._replace(v_v=10.0), -0.02, TURNING_FORWARD, False),
            0.05,
            {CONTACT},
        ),
    }


def printed_starts() -> dict[str, tuple[Start, float, set[int]]]:
    """Return starts under the printed restoring rule."""
    readings = bk.as_printed()
    c = constants_of(RWG, readings, 0)
    c = c._replace(**LINEAR_SOIL, K_soil=c.K_soil / 20)

    def start(y: State, u: float) -> Start:
        y = with_compression(y, u, c)
        return Start(c, readings, y, printed_modes(y, c))

    at_rest = start(State(0.0, 0.0, 0.0, 0.0, 0.0, 12.0), 0.1)
    return {
        "limit of the restoring moment passed at rest": (
            at_rest._replace(modes=modes(HELD, True)),
            0.05,
            {COUPLE},
        ),
        "limit passed while turning": (start(State(0.0, 0.5, 0.1, 1.0, 0.0, 14.0), 0.25), 0.05, {COUPLE}),
        "turning back": (start(State(0.0, 0.5, c.theta_corner - 0.02, 2.0, 0.0, 10.0), 0.1), 0.05, {ROTATION}),
        "over the corner and back": (
            start(State(0.0, 0.5, c.theta_corner - 0.01, 2.0, 0.0, 10.0), 0.25),
            0.05,
            {CORNER, ROTATION},
        ),
    }


LOCATED = gravity_starts() | printed_starts()
FLOOR = 5e-11  # below it, the precision with which events are located shows and the order does not


@pytest.mark.parametrize("name", LOCATED)
def test_a_located_event_costs_no_order(name: str) -> None:
    start, T, expected = LOCATED[name]
    steps = np.array([6, 8, 12, 16, 24, 32])
    found, met = errors(start, T, steps, fine=600, phases=12)
    assert {event for events in met for event in events} == expected
    above = found > FLOOR
    assert np.count_nonzero(above) >= 3
    assert 4.6 < order(steps[above], found[above]) < 5.8


# kinks that are not located


def kinks() -> dict[str, tuple[Start, float, float]]:
    """Motions over a kink in the force of the soil: start, duration [s], and the order that the kink leaves.

    A force whose derivative of order n jumps leaves the order n + 1. Upright, all depths reach the ultimate
    resistance at once (a bend, n = 1) or turn round at once (v|v|, n = 2); turned, one depth does after the other,
    and the integral over them is smoother by one order.
    """
    readings = bk.corrected()
    c = constants_of(RWG, readings, 0)
    yielding, dragged = {"x_yield": 0.05, "R_soil": 1e-9}, {"x_yield": 1e6, "R_soil": 50 * c.R_soil}

    def start(y: State, turning: int, **constants: float) -> Start:
        changed = c._replace(**constants)
        return Start(changed, readings, with_compression(y, -1.0, changed), modes(turning, False))

    upright, turned = State(0.03, 2.5, 0.0, 0.0, 0.0, 6.0), State(0.03, 2.0, 0.1, 0.0, 0.0, 6.0)
    turning = State(0.0, 1.0, 0.1, 1.0, 0.0, 6.0)
    return {
        "ultimate resistance, upright": (start(upright, SEATED, **yielding, **HELD_DOWN), 0.025, 2.0),
        "ultimate resistance, turned": (start(turned, TURNING_FORWARD, **yielding, **NO_WEIGHT), 0.025, 3.0),
        "drag turns round, upright": (start(upright, SEATED, **dragged, **HELD_DOWN), 0.05, 3.0),
        "drag turns round, turned": (start(turning, TURNING_FORWARD, **dragged, **NO_WEIGHT), 0.03, 4.0),
    }


KINKS = kinks()


@pytest.mark.parametrize("name", KINKS)
def test_a_kink_that_is_not_located_costs_order(name: str) -> None:
    start, T, expected = KINKS[name]
    steps = [8, 12, 16, 24, 32, 48, 64]
    found, met = errors(start, T, steps, fine=600, phases=12)
    assert met == {()}
    assert order(steps, found) == pytest.approx(expected, abs=0.5)


# how precisely kinks are located

SHALLOW = bk.Design(
    *(1.65, 1.97436, 3.6, 2600.0, 0.803, 0.95, 1860.0, 0.610865, 60.0, 1.0, 6803.89, 13.4112, 3.1033e6, 1.3891e5, 0.5)
)
"""A boulder that begins to turn half a millisecond before the soil yields, and then rocks for four seconds."""


def turned(step_s: float, tolerance: float) -> float:
    """Return the angular velocity of that boulder 10 ms after the soil has yielded [rad/s]."""
    record = no_record()._replace(
        **{name: np.zeros(1, value.dtype) for name, value in no_record()._asdict().items() if value.ndim == 1},
        states=np.zeros((1, 6)),
        exchanged=np.zeros((1, 4)),
    )
    record.times[0] = 0.04
    how = control(step_s, 0.05, np.radians(20.0))._replace(locate_yield=True, event_tolerance=tolerance)
    bk.simulate(Problem(SHALLOW, None), bk.corrected(), how, record)
    return float(record.states[0, 3])


@pytest.mark.parametrize("step_s", [1e-3, 5e-4])
def test_what_is_left_at_the_kink_goes_with_the_square_of_the_precision(step_s: float) -> None:
    exact = turned(1e-5, 1e-5)
    usual, precise = (abs(turned(step_s, tolerance) - exact) for tolerance in (TOLERANCE, 1e-2 * TOLERANCE))
    assert 1e-9 < usual < 1e-7
    assert precise < 1e-3 * usual


@pytest.mark.compiled
def test_late_motions_agree_in_lanes_where_kinks_are_precise() -> None:
    """Of solutions by 0.75 and 0.1875 ms: rocking amplifies what is left at the first kink, some ten thousand times."""
    differences = []
    for tolerance in (TOLERANCE, 1e-2 * TOLERANCE):
        how = control(7.5e-4, 1.0, np.radians(20.0), stop_at_limit=True)
        how = how._replace(locate_yield=True, longest_horizon=10.0, event_tolerance=tolerance, refined=True)
        found = [simulate_table(table_of([SHALLOW]), bk.corrected(), how._replace(h=h)) for h in (7.5e-4, 1.875e-4)]
        assert found[0].t_end[0] >= 3.0
        differences.append(abs(found[1].theta_max[0] - found[0].theta_max[0]))
    assert differences[1] < 1e-8
    assert differences[1] < 0.05 * differences[0]
