"""The third-order pair: its conditions, and its order on impacts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.heave import Base, HeaveConstants, HeaveOptions, heave_constants, prepare
from boulder_kernels.runge_kutta import AA, ERROR, STAGES, START, TRIAL, WORKSPACE, A, C, first_rate, step
from tests import oracle

from .samples import design_of

RWG = design_of(oracle.RWG)


def test_the_pair_meets_the_conditions_of_third_and_second_order() -> None:
    a, c, error = np.array(A), np.array(C), np.array(ERROR)
    assert a.sum(axis=1) == pytest.approx(c)
    assert np.array(AA) == pytest.approx(a @ a)
    b = a[-1]
    second = b - error
    for weights, order in ((b, 3), (second, 2)):
        assert weights.sum() == pytest.approx(1.0)
        assert weights @ c == pytest.approx(1 / 2)
        assert (weights @ c**2 == pytest.approx(1 / 3)) == (order == 3)
        assert (weights @ a @ c == pytest.approx(1 / 6)) == (order == 3)
    assert a[-1, -1] == 0.0  # the last stage is the first of the next step
    assert len(c) == STAGES


def moved(f: HeaveConstants, h: float, steps: int) -> tuple[np.ndarray, float]:
    """State after some steps of the impact, and the error that the last of them states."""
    work = np.full(WORKSPACE, np.nan)
    prepare(work, f)
    work[START : START + 8] = 0.0
    work[START + 7] = f.c.v_0
    error = np.nan
    for _ in range(steps):
        first_rate(work, True, f)
        error, _ = step(work, h, True, f)
        work[START : START + 8] = work[TRIAL : TRIAL + 8]
    return work[START : START + 8].copy(), error


def test_steps_are_of_third_order_and_state_an_error_of_fourth() -> None:
    """While the truck pushes and the soil yields nowhere; without friction, whose kink at rest is narrow."""
    f = heave_constants(RWG, constants_of(RWG, bk.corrected(), 0), HeaveOptions(False, False), Base(), 1)
    until, counts = 4e-3, (2, 4, 8, 16)
    exact, _ = moved(f, until / 256, 256)
    found = [moved(f, until / count, count) for count in counts]
    gaps = [np.abs(state - exact).max() for state, _ in found]
    orders = [np.log2(one / next_one) for one, next_one in pairwise(gaps)]
    assert orders[-1] == pytest.approx(3.0, abs=0.3), gaps
    stated = [np.log2(one / next_one) for (_, one), (_, next_one) in pairwise(found)]
    assert stated[-1] == pytest.approx(4.0, abs=0.3), stated
