"""Dask workers that hang: found out by counting looks, their tasks given to others, and what they do later unused."""

from __future__ import annotations

import itertools
import threading

import pytest

from boulder_sweep.errors import BackendError, ClusterLostError
from boulder_sweep.runner.cluster import answers
from boulder_sweep.runner.dispatch import FETCH_S, Silence, received
from boulder_sweep.runner.remote import ClusterWorkers, Done
from boulder_sweep.runner.workers import Computed, Ended, Note
from boulder_sweep.store.files import part_name
from boulder_sweep.store.manifest import Manifest, Part
from boulder_sweep.store.writer import StagedPart

ROWS, SIZE = 100, 10
LOOKS = 6
"""Of five seconds each: half a minute."""


class Call:
    """Stands for a future."""

    numbers = itertools.count()

    def __init__(self, worker, rows):
        self.worker, self.rows, self.key = worker, rows, f"call-{next(self.numbers)}"
        self.status, self.callbacks = "pending", []

    def add_done_callback(self, tell):
        self.callbacks.append(tell)
        if self.done():
            tell(self)

    def done(self):
        return self.status != "pending"

    def cancelled(self):
        return self.status == "cancelled"

    def result(self, timeout):
        first, stop = self.rows
        part = Part(first, stop - first, 0, "", {}, "")
        return Done([StagedPart(part_name(first, stop, ROWS), part)], [])

    def release(self):
        if not self.done():
            self.end("cancelled")

    def end(self, status="finished"):
        self.status = status
        for tell in self.callbacks:
            tell(self)


class Workers:
    """Stands for a cluster and its client: workers that compute at once, that hang, or that wait for those."""

    status = "running"

    def __init__(self, *names, hung=(), silent=(), waiting=()):
        self.names, self.hung, self.silent = list(names), set(hung), set(silent)
        self.waiting = set(waiting)
        self.client, self.address = self, "tcp://scheduler"
        self.calls, self.shared = [], []
        self._beats, self._turn = itertools.count(), itertools.count()
        self._last = dict.fromkeys(names, -1)

    def submit(self, function, *arguments, workers=None, pure=True):
        others = [name for name in workers or self.names if name in self.names]
        if function is received:
            self.shared.append(workers)
            return Call(None, None)
        call = Call(others[next(self._turn) % len(others)] if others else None, arguments[1:3])
        self.calls.append(call)
        if call.worker not in self.hung and not (call.worker in self.waiting and workers is None):
            call.end()
        return call

    def threads(self):
        return dict.fromkeys(self.names, 1)

    def last_seen(self):
        self._last |= {name: next(self._beats) for name in self.names if name not in self.hung}
        return {name: self._last[name] for name in self.names}

    def tasks_of(self, workers):
        return {call.key for call in self.calls if call.worker in workers}

    def lost_text(self):
        return "the scheduler was lost"


class Folder:
    """Stands for an output folder in which everything is that was staged."""

    manifest = Manifest({}, ROWS, SIZE, "")
    token = "0" * 16

    def __init__(self, path):
        self.path = path

    def is_staged(self, staged):
        return True


@pytest.fixture
def work_off(tmp_path, monkeypatch):
    """Run to the end on a cluster whose clock goes on by five seconds each time it is read; messages that came."""

    def work(cluster, rows=ROWS):
        rows = ((first, first + SIZE) for first in range(0, rows, SIZE))
        clock = itertools.count(step=5.0).__next__
        workers = ClusterWorkers(cluster, None, rows, SIZE, Folder(tmp_path), clock)
        workers.run()
        messages = []
        while not isinstance(message := workers.messages.get_nowait(), Ended):
            messages.append(message)
        return messages, message.problem

    return work


def notes(messages):
    return [message.text for message in messages if isinstance(message, Note)]


def rows_of(messages):
    return sorted(message.part.first for message in messages if isinstance(message, StagedPart))


def test_a_worker_is_silent_after_half_a_minute_without_a_heartbeat():
    cluster = Workers("a", "b", hung="b")
    silence = Silence(cluster)
    for look in range(LOOKS + 1):
        assert silence.silent == set()
        assert silence.look(5.0 * look, {}) == []
        silence.look(5.0 * look + 4.9, {})  # too soon to count
    assert silence.silent == {"b"}
    assert silence.notes == []
    cluster.hung.clear()
    silence.look(5.0 * (LOOKS + 1), {})
    assert silence.silent == set()
    assert silence.notes == ["heard again of worker b"]


def test_a_machine_that_was_suspended_makes_nobody_silent():
    """However long it was, it is one look without a heartbeat."""
    cluster = Workers("a", "b", hung="ab")
    silence = Silence(cluster)
    for moment in (0.0, 1e5, 2e5):
        silence.look(moment, {})
    assert silence.silent == set()


def test_the_tasks_of_a_silent_worker_are_given_to_others(work_off):
    cluster = Workers("a", "b", hung="b")
    messages, problem = work_off(cluster)
    assert problem is None
    assert rows_of(messages) == list(range(0, ROWS, SIZE))
    assert sum(message.rows for message in messages if isinstance(message, Computed)) == ROWS
    (told,) = [note for note in notes(messages) if "silent" in note]
    theirs = [call for call in cluster.calls if call.worker == "b"]
    assert told == f"worker b is silent for 30 s; others get {len(theirs)} tasks"
    assert all(call.cancelled() for call in theirs)
    assert cluster.shared == [None, ["a"]], "what all tasks need is not fetched from the one that is silent"


def test_the_last_tasks_of_all_are_given_to_others_too(work_off):
    messages, problem = work_off(Workers("a", "b", hung="b"), rows=2 * SIZE)
    assert problem is None
    assert rows_of(messages) == [0, SIZE]


def test_what_comes_of_a_task_that_was_given_away_is_not_used(work_off, monkeypatch):
    """The worker comes back after others have its tasks, with results."""
    cluster = Workers("a", "b", hung="b")
    submit = cluster.submit

    def submit_after_it_came_back(function, *arguments, workers=None, pure=True):
        if workers == ["a"]:
            for call in cluster.calls:
                if call.worker == "b":
                    call.end()
        return submit(function, *arguments, workers=workers, pure=pure)

    monkeypatch.setattr(cluster, "submit", submit_after_it_came_back)
    messages, problem = work_off(cluster)
    assert problem is None
    assert rows_of(messages) == list(range(0, ROWS, SIZE))


def test_tasks_that_wait_for_something_on_a_silent_worker_are_submitted_again(work_off, monkeypatch):
    """Worker b hangs, and c cannot get from it what its tasks need."""
    cluster = Workers("a", "b", "c", hung="b", waiting="c")
    messages, problem = work_off(cluster)
    assert problem is None
    assert rows_of(messages) == list(range(0, ROWS, SIZE))
    assert all(call.cancelled() for call in cluster.calls[:6] if call.worker == "c")


def test_when_every_worker_is_silent_the_run_ends_resumable(work_off):
    messages, problem = work_off(Workers("a", "b", hung="ab"))
    assert isinstance(problem, ClusterLostError)
    assert str(problem) == "workers a, b are silent, and there is no other"
    assert "workers a, b are silent for 30 s; others get 4 tasks" in notes(messages)


def test_a_worker_that_is_silent_from_the_beginning_gets_nothing(work_off):
    cluster = Workers("a", "b", hung="b", silent="b")
    messages, problem = work_off(cluster)
    assert problem is None
    assert rows_of(messages) == list(range(0, ROWS, SIZE))
    assert {call.worker for call in cluster.calls} == {"a"}
    assert notes(messages) == ["worker b is silent, and not given any tasks"]


class Asked:
    """Stands for the client of a cluster of which some workers do not answer."""

    def __init__(self, hung, heard):
        self.hung, self.heard, self.asked = hung, heard, []
        self.scheduler = self

    def _run(self, function, *, workers, on_error):
        self.asked.append(workers)
        workers = list(self.heard) if workers is None else workers
        if set(workers) & set(self.hung):
            raise TimeoutError
        return {worker: function() for worker in workers}

    def identity(self):
        return {"workers": {worker: {"last_seen": moment} for worker, moment in self.heard.items()}}

    def sync(self, question, callback_timeout):
        return question()


def test_workers_that_hang_are_not_waited_for_when_a_run_begins():
    client = Asked("b", {"a": 100.0, "b": 90.0, "c": 99.0})
    assert answers(client, lambda: 7, 10.0) == ({"a": 7, "c": 7}, {"b"})
    assert client.asked == [None, ["a", "c"]]


def test_where_no_worker_answers_that_is_told():
    with pytest.raises(BackendError, match="no worker of the Dask scheduler answers: look whether they hang"):
        answers(Asked("ab", {"a": 100.0, "b": 99.0}), lambda: 7, 10.0)


def test_what_all_tasks_need_is_sent_again_where_those_that_had_it_are_gone(work_off, monkeypatch):
    """Worker a is silent, so only b may have it; b is lost, and c comes."""
    cluster = Workers("a", "b", hung="a", silent="a")
    submit, homes = cluster.submit, set()

    def submit_where_it_is(function, *arguments, workers=None, pure=True):
        if function is received:
            homes.update(workers)
        if len(cluster.calls) == 3:
            cluster.names = ["a", "c"]
        if homes & set(cluster.names):
            return submit(function, *arguments, workers=workers, pure=pure)
        cluster.calls.append(Call(None, arguments[1:3]))
        return cluster.calls[-1]

    monkeypatch.setattr(cluster, "submit", submit_where_it_is)
    messages, problem = work_off(cluster)
    assert problem is None
    assert rows_of(messages) == list(range(0, ROWS, SIZE))
    assert cluster.shared == [["b"], ["c"]]


def test_nothing_is_sent_while_all_workers_are_silent(work_off, monkeypatch):
    """Dask would take no worker for any; what tasks need goes to the first that comes."""
    cluster = Workers("a", hung="a", silent="a")
    threads, looks = cluster.threads, itertools.count()

    def another_comes():
        if next(looks) == 2:
            cluster.names.append("b")
        return threads()

    monkeypatch.setattr(cluster, "threads", another_comes)
    messages, problem = work_off(cluster)
    assert problem is None
    assert rows_of(messages) == list(range(0, ROWS, SIZE))
    assert cluster.shared == [["b"]]


def test_nobody_waits_long_for_a_result_that_a_silent_worker_holds(work_off, monkeypatch):
    """Worker b hangs after its tasks have ended: a longer wait for them is not where workers are looked at."""
    cluster = Workers("a", "b", hung="b")
    submit, result, asked = cluster.submit, Call.result, []

    def submit_to_the_end(*arguments, **options):
        call = submit(*arguments, **options)
        if call.worker == "b":
            call.end()
        return call

    def held(self, timeout):
        if self.worker != "b":
            return result(self, timeout)
        asked.append((timeout, threading.current_thread() is threading.main_thread()))
        raise TimeoutError

    monkeypatch.setattr(cluster, "submit", submit_to_the_end)
    monkeypatch.setattr(Call, "result", held)
    messages, problem = work_off(cluster)
    assert problem is None
    assert rows_of(messages) == list(range(0, ROWS, SIZE))
    assert {seconds for seconds, is_here in asked if is_here} == {FETCH_S}
    assert max(seconds for seconds, is_here in asked if not is_here) > FETCH_S
