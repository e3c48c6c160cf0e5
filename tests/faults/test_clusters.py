"""Dask clusters that lose workers or their scheduler, have none, or stop answering."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from distributed import Future, LocalCluster

import boulder_sweep
from boulder_sweep.errors import BackendError, ClusterLostError
from boulder_sweep.runner import cluster as backend
from boulder_sweep.runner import dispatch, remote
from boulder_sweep.runner.sweeper import run
from boulder_sweep.runner.workers import Computation
from boulder_sweep.store.files import LOCK_NAME
from boulder_sweep.store.reader import finished_table
from boulder_sweep.store.writer import EncodedPart
from tests.faults import faulty
from tests.faults.clusters import Cluster
from tests.faults.faulty import Bar, held, slowly
from tests.faults.processes import ROOT
from tests.runner.grids import grid_of, plausible, same_bits
from tests.store.states import status
from tests.waiting import HANG_GUARD_S, wait_until

pytestmark = pytest.mark.faults

WORKER_KILLS, SCHEDULER_KILLS = 20, 10
ASKED_AGAIN = 3
"""After so many questions for a lost result, the worker that is to compute it anew is let go."""


@pytest.fixture(autouse=True)
def _busy_machines_connect_slowly(monkeypatch):
    monkeypatch.setattr(backend, "CONNECT_S", HANG_GUARD_S)  # hang guard
    monkeypatch.setattr(backend, "FIRST_WORKER_S", HANG_GUARD_S)  # hang guard


@pytest.fixture
def bar(tmp_path, monkeypatch):
    """Hold runs of 20,000 rows at their middle; workers that are started later know."""
    bar = Bar(tmp_path / "held", 20_000)
    bar.allow(10_000)
    for name, value in bar.environment.items():
        monkeypatch.setenv(name, value)
    return bar


@pytest.mark.nightly  # by chance, and long
def test_many_kills_lose_no_row_and_double_none(tmp_path):
    seed = int(os.environ.get("TEST_SEED", "20262"))
    kills = (str(WORKER_KILLS), str(SCHEDULER_KILLS))
    command = [sys.executable, "-m", "tests.faults.cluster_kills", str(tmp_path), *kills, str(seed)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)  # it ends itself if it hangs
    assert done.returncode == 0, f"TEST_SEED={seed}: {done.stderr[-3000:]}"
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["kills"] == {"worker": WORKER_KILLS, "scheduler": SCHEDULER_KILLS}
    assert found["faults"] == [], f"TEST_SEED={seed}"
    assert found["tables"] >= 2


def test_a_scheduler_without_workers_says_how_to_start_one(tmp_path, monkeypatch):
    monkeypatch.setattr(backend, "FIRST_WORKER_S", 0.5)  # none comes, however long it is
    with Cluster(0, tmp_path) as cluster:
        command = f"dask worker {cluster.address}"
        with pytest.raises(BackendError, match=f"the Dask scheduler at {cluster.address} has no worker.*{command}$"):
            run(grid_of(10), tmp_path / "out", backend="dask", scheduler=cluster.address, simulate=plausible)
    assert not (tmp_path / "out").exists()


def test_losing_the_last_worker_ends_the_run_resumable(tmp_path, monkeypatch, bar):
    monkeypatch.setattr(dispatch, "NO_WORKER_S", 2.0)  # none comes, however long it is
    rows, out, told = 20_000, tmp_path / "out", []
    with Cluster(1, tmp_path) as cluster:

        def progress(now):
            told.append(now)
            if cluster.workers and now.rows_done:
                cluster.kill_worker()

        how = {"backend": "dask", "scheduler": cluster.address, "rows_per_part": 5000, "simulate": held}
        with pytest.raises(
            ClusterLostError, match=r"has no worker; start one with.*rows are safe. Resume with"
        ) as lost:
            run(grid_of(rows), out, progress=progress, **how)
        assert lost.value.exit_code == 130
        notes = told[-1].notes
        assert any(note.startswith("lost worker tcp://127.0.0.1") for note in notes)
        assert any(note.startswith("no worker left; waiting 2 s") for note in notes)
        assert not status(out).running
        cluster.start_worker(wait=True)
        bar.allow()
        run(grid_of(rows), out, resume=True, **how)
    run(grid_of(rows), tmp_path / "whole", rows_per_part=5000, simulate=plausible)
    assert same_bits(finished_table(out), finished_table(tmp_path / "whole"))


def test_a_result_lost_with_its_worker_is_computed_again(tmp_path, monkeypatch):
    """The worker dies after finishing a task, before its result is fetched."""
    rows, how = 4000, {"rows_per_part": 500, "simulate": plausible}
    receive, lost, asked = dispatch.Dispatcher._received, [], Counter()
    expect, looks = dispatch.Dispatcher._expect_lost, []
    with Cluster(1, tmp_path) as cluster:

        def receive_late(self, future):
            if not lost:
                cluster.start_worker(wait=True)
                other = cluster.workers[-1]
                other.send_signal(signal.SIGSTOP)  # so that it computes nothing anew before the loss is seen
                cluster.kill_worker()
                wait_until(lambda: future.status != "finished", "the loss is seen")
                lost.append(future.status)
            asked[future.key] += 1
            if asked[future.key] == ASKED_AGAIN:
                cluster.workers[-1].send_signal(signal.SIGCONT)
            return receive(self, future)

        def expect_lost(self):
            looks.append(len(self._lost))
            expect(self)

        monkeypatch.setattr(dispatch.Dispatcher, "_received", receive_late)
        monkeypatch.setattr(dispatch.Dispatcher, "_expect_lost", expect_lost)
        run(grid_of(rows), tmp_path / "out", backend="dask", scheduler=cluster.address, **how)
    assert lost == ["lost"]
    assert max(asked.values()) >= ASKED_AGAIN, "a lost result is asked for again"
    assert sum(asked.values()) <= rows // 500 + 1 + sum(looks), "and once a look"
    run(grid_of(rows), tmp_path / "whole", **how)
    assert same_bits(finished_table(tmp_path / "out"), finished_table(tmp_path / "whole"))


def test_a_result_that_does_not_come_is_asked_for_again(tmp_path, monkeypatch):
    """As where its worker has just died, and the scheduler still tries to reach it."""
    rows, how = 2000, {"rows_per_part": 500, "simulate": plausible}
    result, limits, in_flight = Future.result, [], threading.Barrier(2)

    def comes_at_last(self, timeout=None):
        limits.append(timeout)
        if timeout < 8.0:
            if timeout > 2.0:
                in_flight.wait(HANG_GUARD_S)  # hang guard
            raise TimeoutError
        return result(self, HANG_GUARD_S)  # hang guard

    monkeypatch.setattr(Future, "result", comes_at_last)
    run(grid_of(rows), tmp_path / "out", backend="dask", jobs=1, **how)
    assert limits[:3] == [2.0, 4.0, 4.0], "both in flight wait longer after the first"
    assert set(limits[3:]) == {8.0}, "a slow connection is not found out again for every result, or twice at once"
    run(grid_of(rows), tmp_path / "whole", **how)
    assert same_bits(finished_table(tmp_path / "out"), finished_table(tmp_path / "whole"))


def test_a_scheduler_that_hangs_is_noticed(tmp_path, monkeypatch, bar):
    """By the first question that it does not answer."""
    out, threads, under_way, unanswered = tmp_path / "out", backend.Cluster.threads, [], []

    def ask(self):
        if under_way:
            monkeypatch.setattr(backend, "CONNECT_S", 0.5)  # no answer comes, however long it is
            cluster.pause_scheduler()
        try:
            return threads(self)
        except ClusterLostError:
            unanswered.append(self.address)
            raise

    with Cluster(1, tmp_path) as cluster:

        def progress(now):
            if now.rows_done:
                under_way.append(now)

        monkeypatch.setattr(backend.Cluster, "threads", ask)
        how = {"backend": "dask", "scheduler": cluster.address, "progress": progress, "simulate": held}
        with pytest.raises(ClusterLostError, match=rf"scheduler at {cluster.address} was lost.*Resume with"):
            run(grid_of(20_000), out, rows_per_part=2500, **how)
        assert unanswered == [cluster.address]
    assert status(out, verify=True).damaged == {}


@pytest.mark.nightly
def test_a_design_that_ends_every_worker_becomes_an_error_row(tmp_path, monkeypatch):
    out, rows = tmp_path / "out", 8
    run(grid_of(rows), tmp_path / "whole", simulate=plausible)
    whole = finished_table(tmp_path / "whole")
    poison = whole["subgrade_reaction_MN_m3"][5].as_py()
    monkeypatch.setenv(faulty.POISON, str(round(poison, 6)))
    monkeypatch.setenv(faulty.MAIN_PROCESS, str(os.getpid()))
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    with Cluster(1, tmp_path) as cluster:
        stop = threading.Event()

        def replace_workers() -> None:
            while not stop.wait(0.1):
                for worker in [worker for worker in cluster.workers if worker.poll() is not None]:
                    cluster.workers.remove(worker)
                    cluster.start_worker()

        replacing = threading.Thread(target=replace_workers)
        replacing.start()
        try:
            run(grid_of(rows), out, backend="dask", scheduler=cluster.address, simulate=faulty.ends_its_worker)
        finally:
            stop.set()
            replacing.join()
    table = finished_table(out)
    assert table["reason"][5].as_py() == "every worker that computed this design died"
    others = [row for row in range(rows) if row != 5]
    assert same_bits(table.take(others), whole.take(others))


@pytest.mark.nightly
def test_an_adaptive_cluster_starts_workers_for_a_run(tmp_path):
    """From none: work that waits is what makes it start them."""
    rows, how = 4000, {"rows_per_part": 500, "simulate": slowly}
    with LocalCluster(
        n_workers=0, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address=None
    ) as cluster:
        cluster.adapt(minimum=0, maximum=2, interval="100 ms", wait_count=1)
        run(grid_of(rows), tmp_path / "out", backend="dask", scheduler=cluster.scheduler_address, **how)
    run(grid_of(rows), tmp_path / "whole", **how)
    assert same_bits(finished_table(tmp_path / "out"), finished_table(tmp_path / "whole"))


def test_a_worker_that_comes_back_after_the_run_writes_nothing(tmp_path):
    """It was stopped while it computed."""
    (tmp_path / LOCK_NAME).touch()

    class Stopped(Computation):
        def judged(self, start, stop, tries=1):
            (tmp_path / LOCK_NAME).unlink()

        def encoded(self, first, pieces):
            return EncodedPart(first, 10, b"late", {})

    work = remote.Work("a run that has ended", Stopped(None, None, {}), 10, 10, str(tmp_path), 20, remote.fingerprint())
    assert remote.compute(work, 0, 10, relayed=False) == remote.Done([], [])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.nightly
def test_a_worker_that_hangs_is_named_and_others_get_its_tasks(tmp_path):
    """It comes back when others have computed them, and does no harm."""
    rows, how = 40_000, {"rows_per_part": 2000, "simulate": plausible}
    with Cluster(2, tmp_path) as cluster:
        stopped, told = cluster.workers[0], []

        def progress(now):
            if not told:
                stopped.send_signal(signal.SIGSTOP)
            elif any("is silent for 30 s; others get" in note for note in now.notes):
                stopped.send_signal(signal.SIGCONT)
            told.append(now)

        dask = {"backend": "dask", "scheduler": cluster.address}
        run(grid_of(rows), tmp_path / "out", progress=progress, **dask, **how)
        assert any("is silent for 30 s; others get" in note for note in told[-1].notes)
        assert stopped.poll() is None
    run(grid_of(rows), tmp_path / "whole", **how)
    assert same_bits(finished_table(tmp_path / "out"), finished_table(tmp_path / "whole"))


@pytest.mark.nightly
def test_answers_do_not_wait_for_a_worker_that_hangs(tmp_path, monkeypatch):
    monkeypatch.setattr(backend, "CONNECT_S", 10.0)
    angles = "soil.friction_angle={from: 34 deg, to: 44 deg, count: 400}"
    sweep = boulder_sweep.load(ROOT / "configs" / "site.yaml", [angles])
    with Cluster(2, tmp_path) as cluster:
        stopped, calls = cluster.workers[0], []

        def progress(done, total):
            if not calls:
                stopped.send_signal(signal.SIGSTOP)
            calls.append((done, total))

        answers = boulder_sweep.need(
            sweep, "embedment_depth", backend="dask", scheduler=cluster.address, progress=progress
        )
        stopped.send_signal(signal.SIGCONT)
    assert len(calls) > 2
    assert answers.frame.equals(boulder_sweep.need(sweep, "embedment_depth").frame)


@pytest.mark.nightly
def test_a_new_run_does_not_wait_for_a_worker_that_hangs(tmp_path, monkeypatch):
    monkeypatch.setattr(backend, "CONNECT_S", 10.0)
    with Cluster(2, tmp_path) as cluster:
        cluster.workers[0].send_signal(signal.SIGSTOP)
        dask = {"backend": "dask", "scheduler": cluster.address, "simulate": plausible}
        summary = run(grid_of(2000), tmp_path / "out", rows_per_part=500, **dask)
    assert any("is silent, and not given any tasks" in note for note in summary.notes)


def test_a_worker_makes_itself_ready_once_and_refuses_other_versions():
    calls, begun = [], []

    def ready():
        wait_until(lambda: len(begun) == 4, "all threads have begun")
        calls.append(1)

    def prepare():
        begun.append(1)
        remote.prepare(work)

    computation = Computation(None, None, {}, ready)
    work = remote.Work("a run", computation, 10, 10, "", 10, remote.fingerprint())
    threads = [threading.Thread(target=prepare) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(calls) == 1
    versions, _, rules = remote.fingerprint()
    other = replace(work, name="another", fingerprint=(versions, "0" * 64, rules))
    with pytest.raises(BackendError, match="a worker and this machine have different versions"):
        remote.prepare(other)
    assert len(calls) == 1


def test_workers_that_do_not_share_the_folder_send_their_parts(tmp_path, monkeypatch):
    """Their bytes are written here, and are the same."""
    monkeypatch.setattr(remote, "LOCK_NAME", "a file that no worker sees")
    rows, how = 3000, {"rows_per_part": 1000, "simulate": plausible}
    summary = run(grid_of(rows), tmp_path / "out", backend="dask", jobs=2, **how)
    assert any("does not share the output folder" in note for note in summary.notes)
    run(grid_of(rows), tmp_path / "whole", **how)
    for path in (tmp_path / "whole").glob("rows-*.parquet"):
        assert (tmp_path / "out" / path.name).read_bytes() == path.read_bytes()


def test_whatever_dask_opens_here_is_bound_to_loopback(tmp_path):
    """Ports of a cluster that is started by the run itself."""
    before = _listening()
    cluster = backend.Cluster(1, None)
    try:
        opened = _listening() - before
    finally:
        cluster.close()
    assert opened
    assert {address for address, _ in opened} == {"0100007F"}


def test_a_cluster_of_this_process_ends_while_its_worker_computes():
    """Dask would wait for half a minute, and tell of it in a traceback when the process ends."""
    _may_end.clear()
    cluster = backend.Cluster(1, None)
    futures = [cluster.client.submit(_wait, pure=False) for _ in range(2)]
    try:
        wait_until(lambda: cluster.tasks_of(cluster.threads()) == {one.key for one in futures}, "it computes")
        cluster.close()
        assert cluster._local.status.name == "closed"
    finally:
        _may_end.set()


_may_end = threading.Event()


def _wait() -> None:
    """Compute until it may end."""
    _may_end.wait(HANG_GUARD_S)  # hang guard


def _listening() -> set[tuple[str, str]]:
    """Addresses, in hexadecimal, and ports on which this process listens."""
    own = {link.readlink().name for link in Path("/proc/self/fd").iterdir() if link.is_symlink() and link.exists()}
    found = set()
    for name in ("tcp", "tcp6"):
        for line in Path(f"/proc/self/net/{name}").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == "0A" and f"socket:[{words[9]}]" in own:
                address, port = words[1].split(":")
                found.add((address, port))
    return found
