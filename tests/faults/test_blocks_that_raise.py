"""Blocks that raise: retried, then rows of verdict error; all other rows are unchanged."""

from __future__ import annotations

import numpy as np
import pytest

from boulder_sweep.errors import ComputationError
from boulder_sweep.runner import ranges
from boulder_sweep.runner.run import run
from boulder_sweep.store.reading import finished_table
from tests.faults import faulty
from tests.faults.processes import run_driver
from tests.runner.grids import grid_of, plausible, same_bits
from tests.store.folders import nothing_left, rows_done

pytestmark = pytest.mark.faults

ROWS = 80
OPTIONS = ("--rows", str(ROWS))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The table without faults."""
    out = tmp_path_factory.mktemp("whole") / "out"
    run(grid_of(ROWS), out, simulate=plausible)
    return finished_table(out)


def poison(whole, rows) -> str:
    values = whole["subgrade_reaction_MN_m3"].take(rows).to_pylist()
    return " ".join(str(round(value, 6)) for value in values)


def assert_only_these_are_errors(out, whole, rows, words):
    found = finished_table(out)
    assert found["design_id"].to_pylist() == list(range(ROWS))
    for row in rows:
        assert found["verdict"][row].as_py() == "error"
        assert words in found["reason"][row].as_py()
    others = np.setdiff1d(np.arange(ROWS), rows)
    assert same_bits(found.take(others), whole.take(others))


@pytest.mark.parametrize("backend", ["threading", "dask"])
def test_designs_that_raise(tmp_path, whole, backend):
    rows = [0, 41, 79]
    environment = {faulty.POISON: poison(whole, rows)}
    options = (*OPTIONS, "--simulate", "raises", "--backend", backend)
    code, told, complaints = run_driver(tmp_path / "out", *options, **environment)
    assert (code, told["rows"], complaints) == (3, ROWS, "")
    assert_only_these_are_errors(tmp_path / "out", whole, rows, "failed: arithmetic error: this design cannot be")


@pytest.mark.parametrize("backend", ["threading", "dask"])
def test_a_run_of_which_most_raises_stops_and_can_be_resumed(tmp_path, whole, monkeypatch, backend):
    monkeypatch.setattr(ranges, "_FAILURES_BUDGET", 10)
    monkeypatch.setenv(faulty.POISON, poison(whole, list(range(35, 80))))
    out = tmp_path / "out"
    with pytest.raises(ComputationError, match=r"1\d attempts .*arithmetic error.* 80 rows are safe\. Resume"):
        run(grid_of(ROWS), out, jobs=1, backend=backend, simulate=faulty.raises)
    assert rows_done(out) < ROWS
    assert nothing_left(out)
    monkeypatch.setenv(faulty.POISON, "0")
    run(grid_of(ROWS), out, backend=backend, resume=True, simulate=faulty.raises)
    assert same_bits(finished_table(out), whole)
