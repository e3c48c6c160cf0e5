"""A worker that outlives its run, and a folder that does not."""

from __future__ import annotations

import multiprocessing
import shutil

import pytest

from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.runner import remote
from boulder_sweep.runner.sweeper import run
from boulder_sweep.runner.workers import Computation
from boulder_sweep.store.failures import FolderRemovedError
from boulder_sweep.store.files import MANIFEST_NAME, is_part_name
from boulder_sweep.store.reader import finished_table
from boulder_sweep.store.writer import OutputFolder
from tests.faults.faulty import Bar, held
from tests.runner.grids import grid_of, plausible, same_bits
from tests.store.folders import open_folder
from tests.waiting import HANG_GUARD_S

pytestmark = pytest.mark.faults

ROWS, SIZE = 2000, 500


def before_the_first_commit(monkeypatch, act):
    """Do something when the first parts are staged and none is committed."""
    commit, done = OutputFolder.commit, []

    def watched(folder, staged):
        if not done:
            done.append(act())
        commit(folder, staged)

    monkeypatch.setattr(OutputFolder, "commit", watched)


def test_a_worker_of_a_killed_run_that_goes_on_changes_no_row_of_the_next(tmp_path, monkeypatch):
    """It was stopped in a task; the other run overwrites the folder with other settings and has staged its parts."""
    out, bar = tmp_path / "out", Bar(tmp_path / "held", ROWS)
    bar.allow(0)
    for name, value in bar.environment.items():
        monkeypatch.setenv(name, value)
    killed = open_folder(out, rows=ROWS)
    slow = grid_of(ROWS, friction="36 deg")
    evaluation = evaluation_of(slow, accuracy_of(slow), held)
    computation = Computation(evaluation, slow.block, {}, evaluation.warm_up)
    work = remote.Work(killed.token, computation, SIZE, SIZE, str(out), ROWS, remote.fingerprint())
    worker = multiprocessing.get_context("spawn").Process(target=remote.compute, args=(work, 0, 2 * SIZE, False))
    worker.start()
    try:
        bar.wait_for(1)
        killed._lock.release()

        def go_on():
            bar.allow()
            worker.join(HANG_GUARD_S)  # hang guard
            assert worker.exitcode == 0

        before_the_first_commit(monkeypatch, go_on)
        how = {"jobs": 1, "rows_per_part": SIZE, "simulate": plausible}
        run(grid_of(ROWS), out, overwrite=True, **how)
    finally:
        worker.kill()
        worker.join()
    run(grid_of(ROWS), tmp_path / "whole", **how)
    assert same_bits(finished_table(out), finished_table(tmp_path / "whole"))
    assert all(is_part_name(path.name) or path.name == MANIFEST_NAME for path in out.iterdir())


def test_a_folder_removed_during_a_run_ends_it_with_one_line_that_says_so(tmp_path, monkeypatch):
    out = tmp_path / "out"

    def remove():
        while out.exists():  # a worker may just be writing
            shutil.rmtree(out, ignore_errors=True)

    before_the_first_commit(monkeypatch, remove)
    with pytest.raises(FolderRemovedError, match=f"^{out} was removed, moved or replaced during the run") as told:
        run(grid_of(ROWS), out, jobs=1, rows_per_part=SIZE, simulate=plausible)
    assert told.value.exit_code == 2
    assert "\n" not in told.value.user_message()
    assert not out.exists()
