"""The polynomials within a step: exact for polynomials, of the order of the step for motions."""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dormand_prince import dense_output, displacement_at, slope_at, state_at, step, track
from boulder_kernels.dynamics import TURNING_FORWARD, Modes, State, acceleration, switches_of
from tests import oracle

from .samples import design_of
from .stepping import SCALE, Start, advance, with_compression


def test_a_polynomial_of_degree_five_is_itself() -> None:
    rng = np.random.default_rng(51)
    for _ in range(20):
        motion = np.polynomial.Polynomial(rng.normal(size=6))
        v, a = motion.deriv(), motion.deriv(2)
        h = rng.uniform(0.1, 2.0)
        q = track(h, motion(0.0), v(0.0), a(0.0), motion(h), v(h), a(h))
        for tau in (0.0, 0.2, 0.5, 0.9, 1.0):
            assert displacement_at(q, tau) == pytest.approx(motion(tau * h), abs=1e-12)
            assert slope_at(q, tau) == pytest.approx(h * v(tau * h), abs=1e-11)


def test_order_six_within_a_step() -> None:
    """On a sine: the displacement of order six in the step, the velocity of order five."""
    steps = np.array([0.8, 0.4, 0.2, 0.1])
    gaps = []
    for h in steps:
        q = track(h, np.sin(1.0), np.cos(1.0), -np.sin(1.0), np.sin(1.0 + h), np.cos(1.0 + h), -np.sin(1.0 + h))
        tau = np.linspace(0.0, 1.0, 41)
        x = np.array([displacement_at(q, s) for s in tau]) - np.sin(1.0 + h * tau)
        v = np.array([slope_at(q, s) for s in tau]) / h - np.cos(1.0 + h * tau)
        gaps.append([np.max(np.abs(x)), np.max(np.abs(v))])
    orders = np.polyfit(np.log(steps), np.log(gaps), 1)[0]
    assert orders == pytest.approx([6.0, 5.0], abs=0.15)


def test_within_a_step_of_the_integrator() -> None:
    """Both ends are met, and in between the polynomial is as near to the motion as a step of the method itself."""
    readings = bk.corrected()
    design = design_of(oracle.RWG)._replace(K_epsilon=np.float64(1e4))
    c = constants_of(design, readings, 0)
    y = with_compression(State(0.0, 6.0, 0.1, 0.5, 0.0, 10.0), 0.05, c)
    modes = Modes(TURNING_FORWARD, True, 1.0, 1.0, 0, 0)
    switches = switches_of(modes, readings, c)
    k = acceleration(y, switches, c)
    gaps, steps = [], np.array([8e-3, 4e-3, 2e-3])
    for h in steps:
        y_end, k_end, _ = step(y, k, h, switches, c)
        dense = dense_output(y, k, y_end, k_end, h)
        assert np.array(state_at(dense, 0.0)) == pytest.approx(np.array(y), rel=1e-13, abs=1e-13)
        assert np.array(state_at(dense, 1.0)) == pytest.approx(np.array(y_end), rel=1e-12, abs=1e-12)
        inside = [0.2, 0.5, 0.8]
        exact = [advance(Start(c, readings, y, modes), tau * h, 20)[0] for tau in inside]
        found = [np.array(state_at(dense, tau)) for tau in inside]
        gaps.append(max(np.linalg.norm((f - x) / SCALE) for f, x in zip(found, exact, strict=True)))
    assert np.polyfit(np.log(steps), np.log(gaps), 1)[0] > 4.8
    assert gaps[-1] < 1e-7
