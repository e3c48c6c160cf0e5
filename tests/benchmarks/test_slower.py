"""Passes of random shallow boulders, tried in other soils and against slower trucks."""

from pathlib import Path

import numpy as np

from benchmarks.slower import RATIOS, SPEEDS, table_of, tried


def test_no_pass_of_a_few_fails_in_another_soil_or_by_a_slower_truck(tmp_path: Path) -> None:
    found = tried(tmp_path, 42.0, 150, 7)
    assert found.designs == 150
    assert found.passes > 3
    assert (found.lost_in_soil, found.lost_by_slower) == (0, 0)


def test_designs_are_shallow_and_the_same_for_the_same_seed() -> None:
    first, again = (table_of(50, np.random.default_rng(3)) for _ in range(2))
    assert first.equals(again)
    assert first["embedment_ratio"].between(*RATIOS).all()
    assert SPEEDS == 9
