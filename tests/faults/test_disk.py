"""Disks that are full, too small, or read-only."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from boulder_sweep.runner import progress as limits
from boulder_sweep.runner.run import run
from boulder_sweep.store.failures import DoesNotFitError, StoreError, WriteError
from boulder_sweep.store.reading import finished_table
from tests.faults.processes import ROOT
from tests.runner.grids import grid, grid_of, plausible, same_bits

pytestmark = pytest.mark.faults

ROWS = 60_000
MEGABYTES = 3
"""The table of so many rows takes about 4 MB."""


@pytest.fixture
def filling(small_disk, monkeypatch):
    """A disk that will be full before the table is, and a function that makes room."""
    disk = small_disk(MEGABYTES)
    if disk.real:
        yield disk.path, lambda: disk.remount("size=50m")
        return
    write, written = os.write, [0]

    def limited(descriptor, content):
        written[0] += len(content)
        if written[0] > MEGABYTES * 1_000_000:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, content)

    monkeypatch.setattr(files.os, "write", limited)
    yield disk.path, lambda: monkeypatch.setattr(files.os, "write", write)


def test_a_table_that_cannot_fit_is_refused_before_any_work(filling, monkeypatch):
    disk, _ = filling
    if not os.path.ismount(disk):
        monkeypatch.setattr(limits, "_disk_free", lambda out: MEGABYTES * 1_000_000)
    with pytest.raises(DoesNotFitError, match=r"needs about .* MB of disk, and .* MB are free.*choose another folder"):
        run(grid_of(ROWS), disk / "out", simulate=plausible)
    assert list(disk.iterdir()) == []


def test_a_disk_that_fills_up_stops_the_run_and_loses_nothing(filling, tmp_path, monkeypatch):
    """As where another program takes what was free at the beginning."""
    disk, make_room = filling
    monkeypatch.setattr(limits, "_disk_free", lambda out: None)
    out = disk / "out"
    with pytest.raises(WriteError, match=r"No space left on device.*rows are safe; free some space and resume with"):
        run(grid_of(ROWS), out, rows_per_part=5000, simulate=plausible)
    found = status(out, verify=True)
    assert found.damaged == {}
    assert 0 < found.rows_done < ROWS
    assert not found.running
    # A part may have found room behind one that did not.
    rows = finished_table(out)["design_id"].to_numpy()
    assert len(rows) == found.rows_done
    assert (np.diff(rows) > 0).all()
    make_room()
    summary = run(grid_of(ROWS), out, resume=True, simulate=plausible)
    assert summary.rows_computed == ROWS - found.rows_done
    run(grid_of(ROWS), tmp_path / "whole", rows_per_part=5000, simulate=plausible)
    assert same_bits(finished_table(out), finished_table(tmp_path / "whole"))


@pytest.mark.parametrize("named", [False, True], ids=["nameless files", "named files"])
def test_a_disk_that_is_full_at_any_write_loses_nothing(tmp_path, monkeypatch, named):
    """The k-th write fails, for every k there is."""
    if named:
        monkeypatch.delattr(os, "O_TMPFILE")
    sweep, how = grid(), {"rows_per_part": 100, "commit_every_s": 0.0, "simulate": plausible}
    run(sweep, tmp_path / "whole", **how)
    whole = finished_table(tmp_path / "whole")
    write = os.write
    for failing in range(0, 60, 5):
        calls = []

        def full(descriptor, content, calls=calls, failing=failing):
            calls.append(1)
            if len(calls) > failing:
                raise OSError(errno.ENOSPC, "No space left on device")
            return write(descriptor, content)

        out = tmp_path / f"out-{failing}"
        monkeypatch.setattr(files.os, "write", full)
        try:
            run(sweep, out, **how)
            finished = True
        except WriteError:
            finished = False
        monkeypatch.setattr(files.os, "write", write)
        if not finished and (out / "_manifest.parquet").exists():
            assert status(out, verify=True).damaged == {}
            assert not [path for path in out.iterdir() if path.name.endswith(".writing")]
        run(sweep, out, resume=True, **how)
        assert same_bits(finished_table(out), whole)
        if finished:
            break
    assert failing > 5


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
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
from boulder_sweep.store.failures import WriteError
from boulder_sweep.runner.run import run
from tests.runner.grids import grid_of, plausible
try:
    run(grid_of(20_000), sys.argv[1], rows_per_part=10_000, simulate=plausible)
except WriteError as problem:
    print(problem)
    sys.exit(problem.exit_code)
"""


def test_a_limit_on_the_size_of_files_stops_the_run_with_words(tmp_path):
    command = [sys.executable, "-c", _NO_LONG_FILES, str(tmp_path / "out")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "File too large" in done.stdout
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["_manifest.parquet"]
