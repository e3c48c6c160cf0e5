"""The sample that all benchmarks share stays the same and is realistic."""

import numpy as np

import boulder_kernels as bk
from benchmarks.designs import API, API_ANGLES, ROTATION_LIMIT, TERZAGHI, first, sample


def test_rows_do_not_depend_on_the_count() -> None:
    for few, many in zip(sample(20), first(sample(50), 20), strict=True):
        assert np.array_equal(few, many)


def test_families_of_the_subgrade_reaction_are_not_mixed() -> None:
    designs = sample(500)
    on_curve = np.isclose(designs.beta, np.interp(np.degrees(designs.phi), API_ANGLES, API), rtol=1e-12)
    terzaghi = (designs.beta >= TERZAGHI[0]) & (designs.beta <= TERZAGHI[1])
    assert np.all(on_curve | terzaghi)
    assert 0.4 < np.mean(on_curve) < 0.6


def test_truck_meets_every_boulder() -> None:
    designs = sample(500)
    assert np.all(designs.H - designs.d > designs.e_bumper)
    out = bk.simulate_table(designs, bk.corrected(), bk.Control(0.008, 1.0, ROTATION_LIMIT, 0, False))
    assert set(out.status) <= set(bk.SIMULATED)
    assert 0.05 < np.mean(out.status == bk.Status.LIMIT) < 0.95
