"""Small numerical tools: sine and versine, roots, the longest stable step."""

from math import atan2, cos, pi, sin, tan

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.control import rates_of, stable_step
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import FREE, SEATED, Modes, State, Switches, acceleration, switches_of
from boulder_kernels.numerics import ITERATIONS, Bracket, direction, half_tangent, narrowed, next_guess, sine_versine
from tests import oracle

from .samples import design_of, random_designs
from .stepping import with_compression


def versine(theta: float) -> float:
    return 2.0 * sin(theta / 2.0) ** 2


@pytest.mark.parametrize(
    "angles",
    [
        pytest.param(np.linspace(-pi, pi, 20_001), id="all the way round"),
        pytest.param(np.linspace(-0.35, 0.35, 20_001), id="up to 20 degrees"),
        pytest.param(np.concatenate([s * np.geomspace(1e-300, 1e-2, 500) for s in (-1.0, 1.0)]), id="tiny"),
    ],
)
def test_sine_and_versine(angles: np.ndarray) -> None:
    found = np.array([sine_versine(theta) for theta in angles])
    known = np.array([(sin(theta), versine(theta)) for theta in angles])
    assert np.max(np.abs(found - known)) <= 1e-15
    near = np.abs(angles) < 1.0
    relative = np.abs(found - known)[near] / np.maximum(np.abs(known[near]), 1e-320)
    small = known[near] > 1e-290  # the square of a tiny angle leaves the range of numbers
    assert np.max(relative[small], initial=0.0) <= 1e-15


def test_half_tangent_and_direction() -> None:
    """Against the library's functions, from tiny to a right angle."""
    for angle in [*np.linspace(-0.5 * pi, 0.5 * pi, 2001), *np.geomspace(1e-300, 1e-2, 100)]:
        assert half_tangent(angle) == pytest.approx(tan(0.5 * angle), rel=1e-15, abs=1e-320)
    for angle in [*np.linspace(0.0, 0.5 * pi, 2001), 1e-12, 0.5 * pi - 1e-12]:
        for size in (1e-3, 1.0, 1e9):
            x, y = size * abs(cos(angle)), size * sin(angle)
            assert direction(x, y) == pytest.approx(atan2(y, x), rel=4e-15)


def test_sine_and_versine_exactly() -> None:
    assert tuple(sine_versine(0.0)) == (0.0, 0.0)
    for theta in np.linspace(0.0, pi, 101):
        there, back = sine_versine(theta), sine_versine(-theta)
        assert (there.sin, there.versin) == (-back.sin, back.versin)


def solve(function, low: float, high: float, enough: float) -> tuple[float, int]:
    """Root by the tools of the kernels, and how many evaluations it took."""
    bracket = Bracket(low, function(low), high, function(high), 0)
    guess = high
    for count in range(1, ITERATIONS + 1):
        before, guess = guess, next_guess(bracket)
        assert low <= guess <= high
        if abs(guess - before) <= enough:
            return guess, count
        bracket = narrowed(bracket, guess, function(guess))
    return guess, ITERATIONS


@pytest.mark.parametrize(
    ("function", "root"),
    [
        (lambda x: x - 0.3, 0.3),
        (lambda x: 0.3 - x, 0.3),
        (lambda x: x**9 - 0.1**9, 0.1),
        (lambda x: cos(x) - x, 0.7390851332151607),
        (lambda x: np.tanh(80.0 * (x - 0.9)), 0.9),
        (lambda x: (x - 0.2) * (0.25 if x < 0.2 else 1.0), 0.2),
    ],
)
def test_roots(function, root: float) -> None:
    found, count = solve(function, 0.0, 1.0, 1e-13)
    assert found == pytest.approx(root, abs=1e-10)
    assert count < ITERATIONS


def test_a_root_at_the_end_of_the_bracket() -> None:
    """Where the chord leaves the bracket by rounding, the middle is taken, so that it always narrows."""
    assert next_guess(Bracket(0.0, 1e-300, 1.0, -1.0, 0)) == 0.5
    found, _ = solve(lambda x: 1e-18 - x, 0.0, 1.0, 1e-13)
    assert found == pytest.approx(0.0, abs=1e-10)


def jacobian(y: State, s: Switches, c: bk.Constants) -> np.ndarray:
    """Derivative of the rate of the six states by central differences."""

    def rate(z: np.ndarray) -> np.ndarray:
        k = acceleration(State(*z), s, c)
        return np.array([z[1], k.a_b, z[3], k.alpha_b, z[5], k.a_v])

    columns = []
    for i in range(6):
        nudge = np.zeros(6)
        nudge[i] = 1e-7
        columns.append((rate(np.array(y) + nudge) - rate(np.array(y) - nudge)) / 2e-7)
    return np.array(columns).T


@pytest.mark.parametrize("scale", [1.0, 1e-2, 1e2])
def test_no_eigenvalue_is_beyond_the_stable_step(scale: float) -> None:
    """The bounds cover the fastest oscillation and the fastest decay of the linearised motion at the start."""
    for design in random_designs(20, seed=61):
        design = design._replace(beta=design.beta * scale, k_v=design.k_v * scale)
        for readings in (bk.as_printed(), bk.corrected()):
            c = constants_of(design, readings, 0)
            for turning in (FREE, SEATED) if readings.restoring_gravity else (FREE,):
                modes = Modes(turning, True, 1.0, 1.0, 0, 0)
                y = with_compression(State(1e-4, 1e-4, 0.0, 0.0, 0.0, design.v_0), 1e-4, c)
                values = np.linalg.eigvals(jacobian(y, switches_of(modes, readings, c), c))
                r = rates_of(np.radians(20.0), c)
                oscillation, decay = np.sqrt(r.soil + r.truck + r.turning), r.relaxation + r.drag
                assert np.max(np.abs(values.imag)) <= oscillation * (1 + 1e-6)
                assert np.max(-values.real) <= (decay + oscillation) * (1 + 1e-6)


def test_a_step_is_shortened_where_the_design_is_stiff() -> None:
    c = constants_of(design_of(oracle.RWG), bk.corrected(), 0)
    limit = np.radians(20.0)
    assert stable_step(rates_of(limit, c)) > 1e-2
    stiff = rates_of(limit, c._replace(K_soil=1e6 * c.K_soil))
    assert stable_step(stiff) == pytest.approx(1.5 / np.sqrt(stiff.soil + stiff.truck + stiff.turning))
    damped = rates_of(limit, c._replace(tau_v=1e4 * c.tau_v))
    assert stable_step(damped) == pytest.approx(3.0 / (damped.relaxation + damped.drag))


@pytest.mark.parametrize("change", [{"beta": 1e4}, {"k_v": 1e4}, {"c_v": 1e-4}])
def test_a_step_far_too_long_is_made_stable(change: dict[str, float]) -> None:
    """Soil, spring or damper ten thousand times out of the ordinary: a long step gives the answer of a short one."""
    design = design_of(oracle.RWG)
    design = design._replace(**{name: np.float64(getattr(design, name) * factor) for name, factor in change.items()})
    found = [
        bk.simulate_design(design, bk.corrected(), bk.Control(h, 0.02, 0.35, 0, False), bk.no_record())
        for h in (0.02, 5e-5)
    ]
    assert found[0].status == found[1].status
    assert found[0].maxima.theta == pytest.approx(found[1].maxima.theta, abs=2e-3)
    assert found[0].maxima.x_v == pytest.approx(found[1].maxima.x_v, rel=1e-2)
