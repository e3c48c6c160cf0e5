"""Sobol indices against cases of which the answer is known."""

from __future__ import annotations

import numpy as np
from scipy.stats import sobol_indices, uniform

from boulder_sweep.answers.chance import FIRST, Points
from boulder_sweep.answers.doubts import drivers, estimators, indices


def ishigami(u: np.ndarray) -> np.ndarray:
    x = np.pi * (2.0 * u - 1.0)
    return (np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))[None]


def test_sobol_indices_of_ishigami() -> None:
    found = indices(ishigami, 3, seed=0, base=4096, confidence=0.99, uniform=True)
    for name, exact in (("first", (0.3139, 0.4424, 0.0)), ("total", (0.5576, 0.4424, 0.2437))):
        assert np.allclose(getattr(found, name)[0], exact, atol=0.02)
        assert (getattr(found, f"{name}_low")[0] <= exact).all()
        assert (getattr(found, f"{name}_high")[0] >= exact).all()


def test_estimators_are_those_of_scipy() -> None:
    rng = np.random.default_rng(3)
    A, B = rng.random((64, 3)), rng.random((64, 3))
    mixed = np.repeat(A[None], 3, axis=0)
    for place in range(3):
        mixed[place, :, place] = B[:, place]
    f_A, f_B, f_AB = ishigami(A), ishigami(B), np.stack([ishigami(own) for own in mixed])
    reference = sobol_indices(func={"f_A": f_A, "f_B": f_B, "f_AB": f_AB}, n=64, dists=[uniform()] * 3)
    first, total = estimators(f_A[0], f_B[0], f_AB[:, 0])
    assert np.allclose(first, reference.first_order)
    assert np.allclose(total, reference.total_order)


def test_what_does_not_vary_has_no_indices() -> None:
    found = indices(lambda z: np.ones((1, len(z))), 2, seed=0, base=64)
    assert np.isnan(found.first).all()
    assert drivers(np.random.default_rng(1).standard_normal((512, 2)), np.ones((1, 512))).tolist() == [-1]


def test_driver_is_the_input_that_decides() -> None:
    z = Points(3, 0).upto(FIRST).reshape(-1, 3)
    outputs = np.stack([z[:, 0] + 0.3 * z[:, 1], z[:, 2] ** 3 - z[:, 0], (z[:, 1] > 0.5).astype(float)])
    assert drivers(z, outputs).tolist() == [0, 2, 1]
