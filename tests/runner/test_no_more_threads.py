"""Runs with more workers than the system can start: told in one line, and no folder is left behind."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from boulder_sweep.errors import BackendError
from boulder_sweep.runner.run import run
from tests.conftest import Command
from tests.runner.grids import grid_of, plausible
from tests.store.folders import rows_done

ONE_LINE = "the system cannot start 64 threads; give a smaller number of --jobs"
CASE = Path(__file__).parents[2] / "configs" / "wet_backfill.yaml"


@pytest.mark.parametrize("started", [0, 2])
def test_a_new_folder_is_not_left_behind(
    no_more_threads: Callable[[int], None], tmp_path: Path, sweep: Command, started: int
) -> None:
    no_more_threads(started)
    out = tmp_path / "out"
    assert sweep("run", CASE, "-q", "-o", out, "--jobs", 64) == (2, "", f"error: {ONE_LINE}\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["interruptible work", "run"])
def test_threads_of_the_run_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str) -> None:
    start = threading.Thread.start

    def refuse(thread: threading.Thread) -> None:
        if thread.name == name:
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with pytest.raises(BackendError, match=ONE_LINE):
        run(grid_of(1000), tmp_path / "out", jobs=64, simulate=plausible)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_was_there_stays(no_more_threads: Callable[[int], None], tmp_path: Path) -> None:
    no_more_threads(0)
    with pytest.raises(BackendError, match=ONE_LINE):
        run(grid_of(1000), tmp_path, jobs=64, simulate=plausible)
    assert not list(tmp_path.iterdir())


def test_rows_that_were_there_stay(no_more_threads: Callable[[int], None], tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(grid_of(1000), out, jobs=1, simulate=plausible)
    for part in sorted(out.iterdir())[:2]:
        part.unlink()
    no_more_threads(10)
    with pytest.raises(BackendError, match=ONE_LINE):
        run(grid_of(1000), out, jobs=64, resume=True, simulate=plausible)
    no_more_threads(100)
    assert rows_done(out) == 500
    run(grid_of(1000), out, jobs=1, resume=True, simulate=plausible)
    assert rows_done(out) == 1000
