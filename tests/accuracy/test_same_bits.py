"""Workers, blocks and the place of a design among its neighbours change no bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boulder_kernels import OutcomeTable, Readings, simulate_table
from tests.accuracy.box import PRESETS, box_table, how, rows
from tests.runner.grids import grid, same_bits


def assert_same(one: OutcomeTable, other: OutcomeTable) -> None:
    for name, a, b in zip(OutcomeTable._fields, one, other, strict=True):
        assert a.tobytes() == b.tobytes(), name


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("estimate", [False, True])
def test_place_and_neighbours_do_not_matter(preset: str, estimate: bool) -> None:
    table, readings, control = box_table(150, 9), PRESETS[preset], how(estimate=estimate)
    whole = simulate_table(table, readings, control)
    order = np.random.default_rng(3).permutation(table.L.size)
    shuffled = simulate_table(rows(table, order), readings, control)
    assert_same(OutcomeTable(*(column[order] for column in whole)), shuffled)
    for size in (1, 7, 16, 17):
        part = simulate_table(rows(table, slice(20, 20 + size)), readings, control)
        assert_same(OutcomeTable(*(column[20 : 20 + size] for column in whole)), part)


def test_a_hopeless_neighbour_does_not_matter() -> None:
    """A design that is NaN throughout leaves the other fifteen lanes as they are."""
    table = box_table(16, 5)
    broken = table._replace(rho_b=np.where(np.arange(16) == 6, np.nan, table.rho_b))
    readings = Readings(*(True,) * 5)
    one, other = (simulate_table(designs, readings, how(estimate=True)) for designs in (table, broken))
    keep = np.arange(16) != 6
    assert_same(OutcomeTable(*(c[keep] for c in one)), OutcomeTable(*(c[keep] for c in other)))


@pytest.mark.parametrize("accuracy", ["balanced", "fine"])
def test_workers_and_parts_do_not_matter(accuracy: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pyarrow.parquet as pq

    from boulder_sweep.runner.run import run
    from boulder_sweep.settings import load_text
    from tests.runner.grids import DEFAULTS, GRID

    text = GRID.format(**DEFAULTS).replace("step: 4 ms", f"accuracy: {accuracy}")
    found = []
    for jobs, work_s in ((1, 1e9), (2, 1e-9)):
        monkeypatch.setattr("boulder_sweep.runner.ranges.WORK_S", work_s)
        out = tmp_path / f"{jobs}"
        run(load_text(text, Path("grid.yaml")), out, jobs=jobs)
        found.append(pq.read_table(out))
    assert len(found[0]) == grid().n_designs
    assert same_bits(*found)
