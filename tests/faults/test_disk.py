"""Disks that are full, too small, or read-only."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from boulder_sweep.runner import progress as limits
from boulder_sweep.runner.run import run
from boulder_sweep.store.failures import DoesNotFitError, StoreError, WriteError
from tests.faults.processes import ROOT
from tests.runner.grids import grid, grid_of, plausible
from tests.store.folders import nothing_left, parts_of, rows_done

pytestmark = pytest.mark.faults

ROWS = 60_000
MEGABYTES = 3
"""The table of so many rows takes about 4 MB."""


class Failing:
    """Refuses a call of the system when it is made for the so manieth time, and from then on."""

    def __init__(self, monkeypatch, call):
        self.calls, self.failing_at, self._real = 0, 0, getattr(os, call)
        monkeypatch.setattr(os, call, self)

    def __call__(self, *arguments, **named):
        self.calls += 1
        if self.calls >= self.failing_at > 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return self._real(*arguments, **named)


@pytest.fixture
def filling(small_disk):
    """A disk that will be full before the table is, and a function that makes room."""
    disk = small_disk(MEGABYTES)
    if not disk.real:
        pytest.skip("this machine mounts no disk for us")
    return disk.path, lambda: disk.remount("size=50m")


def test_a_table_that_cannot_fit_is_refused_before_any_work(filling):
    disk, _ = filling
    with pytest.raises(DoesNotFitError, match=r"needs about .* MB of disk, and .* MB are free.*choose another folder"):
        run(grid_of(ROWS), disk / "out", simulate=plausible)
    assert list(disk.iterdir()) == []


def test_a_disk_that_fills_up_stops_the_run_and_loses_nothing(filling, tmp_path, monkeypatch):
    """As where another program takes what was free at the beginning."""
    disk, make_room = filling
    monkeypatch.setattr(limits, "_disk_free", lambda out: None)
    out = disk / "out"
    words = r"No space left on device; free some space and try again. .* rows are safe. Resume with:\n  "
    with pytest.raises(WriteError, match=words):
        run(grid_of(ROWS), out, simulate=plausible)
    assert nothing_left(out)
    done = rows_done(out)
    assert 0 < done < ROWS
    make_room()
    summary = run(grid_of(ROWS), out, resume=True, simulate=plausible)
    assert summary.rows_computed == ROWS - done
    run(grid_of(ROWS), tmp_path / "whole", simulate=plausible)
    assert parts_of(out) == parts_of(tmp_path / "whole")


@pytest.mark.parametrize("call", ["mkdir", "open", "fsync", "rename"])
def test_a_disk_that_is_full_at_any_call_loses_nothing(tmp_path, monkeypatch, call):
    """The k-th call fails, for every k there is."""
    run(grid(), tmp_path / "whole", jobs=2, simulate=plausible)
    whole = parts_of(tmp_path / "whole")
    failing = Failing(monkeypatch, call)
    for number in range(1, 100):
        out = tmp_path / f"out-{number}"
        failing.calls, failing.failing_at = 0, number
        finished = True
        try:
            run(grid(), out, jobs=2, simulate=plausible)
        except (WriteError, OSError):
            finished = False
        was_reached, failing.failing_at = failing.calls >= number, 0
        assert nothing_left(out)
        if out.exists():
            assert parts_of(out).items() <= whole.items()
        run(grid(), out, resume=True, simulate=plausible)
        assert parts_of(out) == whole
        if not was_reached:
            break
    assert finished
    assert number > 1


def test_a_read_only_disk_is_refused_before_any_work(small_disk, tmp_path):
    disk = small_disk(1)
    (disk.path / "out").mkdir()
    if disk.remount("ro"):
        place = disk.path
    elif os.geteuid() == 0:
        place = Path("/sys")  # no rights help there
    else:
        (disk.path / "out").chmod(0o555)
        disk.path.chmod(0o555)
        place = disk.path
    for name in ("out", "other"):
        with pytest.raises(StoreError, match=r"cannot (write into|create the folder)"):
            run(grid(), place / name, simulate=_never)


def _never(table, readings, control):
    raise AssertionError("nothing may be computed")


_NO_LONG_FILES = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
from boulder_sweep.store.failures import WriteError
from boulder_sweep.runner.run import run
from tests.store.folders import nothing_left, parts_of, rows_done
from tests.runner.grids import grid_of, plausible
try:
    run(grid_of(20_000), sys.argv[1], simulate=plausible)
except WriteError as problem:
    print(problem)
    sys.exit(problem.exit_code)
"""


def test_a_limit_on_the_size_of_files_stops_the_run_with_words(tmp_path):
    command = [sys.executable, "-c", _NO_LONG_FILES, str(tmp_path / "out")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "File too large" in done.stdout
    assert list(tmp_path.iterdir()) == []
