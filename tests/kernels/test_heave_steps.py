"""What cuts a step of a second opinion, and what is kept at its end."""

from __future__ import annotations

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import G, constants_of
from boulder_kernels.dormand_prince import Track
from boulder_kernels.heave import PIECES, SETS, Base, HeaveOptions, heave_constants, prepare
from boulder_kernels.heave_steps import START, WORKSPACE, Tracks, foot_rises, press_in
from tests import oracle

from .samples import design_of

RWG, BASE, BOTH = design_of(oracle.RWG), Base(), HeaveOptions(True, True)


def test_a_step_ends_where_a_strip_that_is_pressed_in_comes_back() -> None:
    """The step is cut at the greatest depth of the first strip, and what is pressed in is that of the interpolant."""
    f = heave_constants(RWG, constants_of(RWG, bk.corrected(), 0), BOTH, BASE)
    work, h = np.zeros(WORKSPACE), 4e-3
    prepare(work, f)
    still = Track(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    capacity = f.q_strip / f.k_strip
    for beyond, end in ((0.004, 0.4), (-0.004, 1.0)):
        # It sinks to its greatest depth at 0.4 of the step.
        start = f.s_0 - capacity - beyond
        sinking = Track(start, -0.8 * 1e-3, 1e-3, 0.0, 0.0, 0.0)
        q = Tracks(still, still, sinking, still)
        assert foot_rises(work, q, 1.0, h, f) == pytest.approx(end, abs=1e-6)
        assert foot_rises(work, q, 0.3, h, f) == 0.3
    assert foot_rises(work, Tracks(still, still, Track(np.nan, np.nan, 0, 0, 0, 0), still), 1.0, h, f) == 1.0


def test_pressing_in_by_hand() -> None:
    """What a strip is pressed in beyond q/k_b stays, once, and adds up (Eq 133)."""
    f = heave_constants(RWG, constants_of(RWG, bk.corrected(), 0), BOTH, BASE)
    work = np.zeros(WORKSPACE)
    prepare(work, f)
    deepest = RWG.rho_s * G * RWG.d * np.exp(np.pi * np.tan(RWG.phi)) * np.tan(np.pi / 4 + RWG.phi / 2) ** 2 / 100e6
    settlement = f.m_b * G / (100e6 * RWG.L * RWG.W)
    for depth, known, pressed in (
        (0.9 * deepest, 0.0, False),
        (deepest + 0.01, 0.01, True),
        (deepest + 0.005, 0.01, False),
        (deepest + 0.03, 0.03, True),
    ):
        work[START + 2] = settlement - depth
        assert press_in(work, f) == pressed
        assert work[SETS : SETS + PIECES] == pytest.approx(np.full(PIECES, known), abs=1e-12)
