"""The model with its switches inside the right-hand side: the printed restoring moment is that of the oracle."""

from __future__ import annotations

import numpy as np
import pytest

import boulder_kernels as bk
from benchmarks.literal import printed_restoring_moment
from boulder_kernels.design import constants_of
from tests import oracle
from tests.kernels.samples import inputs_of, random_designs
from tests.oracle.restoring import printed_forward, printed_limit, printed_sign


def test_printed_restoring_moment() -> None:
    """Eqs 37 to 39 at any net moment, and none at all where the boulder does not turn forward."""
    rng = np.random.default_rng(45)
    for design in random_designs(4, seed=46):
        c = constants_of(design, bk.as_printed(), 0)
        known = oracle.constants(inputs_of(design), oracle.AS_PRINTED)
        for theta in c.theta_corner + np.pi * rng.uniform(-0.99, 0.99, 10):
            sin, versin = float(np.sin(theta)), float(1.0 - np.cos(theta))
            limit, sign = printed_limit(known, theta), printed_sign(known, theta)
            for M in np.array([-3.0, -1.01, -0.3, 0.0, 0.3, 0.99, 3.0]) * limit:
                found = printed_restoring_moment(M, theta, 1.0, sin, versin, c)
                assert found == pytest.approx(printed_forward(limit, sign, M), abs=1e-11 * limit)
                for omega in (0.0, -1.0):
                    assert printed_restoring_moment(M, theta, omega, sin, versin, c) == 0.0
