"""Workers that are silent: connected, but the scheduler has not heard of them for long, as where a machine hangs.

Dask drops such a worker after minutes, and until then waits for it. A run gives its tasks to others: they are submitted
again under new names, and the first ones are given up, so that what a worker does when it comes back goes nowhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any, Protocol

from boulder_sweep.errors import BackendError
from boulder_sweep.text import counted

SILENT_S = 30.0
"""Time without a heartbeat after which a worker gets no more tasks, and others get those that it has [s]."""
_LOOK_EVERY_S = 5.0
_LOOKS = round(SILENT_S / _LOOK_EVERY_S)
_DOUBT_S = 10.0
"""How long a task that may wait for something on a silent worker has to end, before it is given to others, too [s]."""
_LAG_S = 5.0
"""How far the last heartbeat of a worker that does not answer is behind those of others [s]."""


class Heard(Protocol):
    """A cluster, as far as it is asked for its workers."""

    silent: set[str]

    def last_seen(self) -> dict[str, float]:
        """Return when the scheduler last heard of every worker [s]."""

    def tasks_of(self, workers: Collection[str]) -> set[str]:
        """Return the keys of tasks and results that workers have."""


class Silence:
    """Finds out which workers are silent, and which tasks others must get.

    It counts looks at which there was no new heartbeat. Times are not compared: the clocks of two machines differ, and
    a machine may have been suspended.

    Parameters
    ----------
    cluster
        Where the workers are; says which are silent at the beginning.

    Attributes
    ----------
    silent : set of str
        Addresses of workers.
    notes : list of str
        What has changed at the last look, for the user.
    """

    def __init__(self, cluster: Heard):
        self._cluster = cluster
        self.silent = set(cluster.silent)
        self.notes: list[str] = []
        self._seen: dict[str, float] = {}
        self._looks = dict.fromkeys(self.silent, _LOOKS)
        self._looked = -math.inf
        self._doubtful: list[Any] = []
        """Futures that may wait for something that a silent worker holds."""
        self._doubtful_until = math.inf

    def look(self, now: float, in_flight: Mapping[Any, Collection[str]]) -> list[Any]:
        """Look for silent workers if it is time to.

        Parameters
        ----------
        now
            Time [s].
        in_flight
            Futures, and the workers that each was given to; empty for all.

        Returns
        -------
        list
            Futures whose tasks others must get.
        """
        self.notes = []
        if now - self._looked < _LOOK_EVERY_S:
            return []
        self._looked = now
        before, last_seen = self.silent, self._cluster.last_seen()
        looks = {}
        for worker, moment in last_seen.items():
            known = self._seen.get(worker, moment if worker in before else None)
            looks[worker] = self._looks.get(worker, 0) + 1 if moment == known else 0
        self._looks = looks
        self._seen = last_seen
        self.silent = {worker for worker, count in looks.items() if count >= _LOOKS}
        again: list[Any] = []
        fallen, back = self.silent - before, (before - self.silent) & last_seen.keys()
        if fallen:
            theirs = self._cluster.tasks_of(fallen)
            again = [future for future in in_flight if future.key in theirs]
            self._doubtful, self._doubtful_until = [one for one in in_flight if one not in again], now + _DOUBT_S
            self.notes.append(f"{named(fallen)} silent for {SILENT_S:.0f} s; others get {counted(len(again), 'task')}")
        elif now >= self._doubtful_until:
            again, self._doubtful_until = [future for future in self._doubtful if future in in_flight], math.inf
            self._doubtful = []
        if back:
            self.notes.append(f"heard again of worker {', '.join(sorted(back))}")
        bound = (future for future, workers in in_flight.items() if workers and not last_seen.keys() & set(workers))
        return again + [future for future in bound if future not in again]


def named(workers: Collection[str]) -> str:
    """Begin a sentence on workers."""
    return f"worker{'s' if len(workers) > 1 else ''} {', '.join(sorted(workers))} {'are' if len(workers) > 1 else 'is'}"


def seen(identity: Mapping[str, Any]) -> dict[str, float]:
    """Return when a scheduler last heard of every worker, from what it tells of itself [s]."""
    return {worker: float(record["last_seen"]) for worker, record in identity["workers"].items()}


def answers(client: Any, function: Callable[[], Any], limit_s: float) -> tuple[dict[str, Any], set[str]]:
    """Call a function on every worker.

    Returns
    -------
    dict
        The result or the exception of every worker that answers.
    set of str
        Workers that are silent.

    Raises
    ------
    BackendError
        No worker answers in time.
    TimeoutError
        The scheduler does not answer.
    """
    silent: set[str] = set()
    workers: list[str] | None = None
    while True:
        # What `client.run` does, but for the limit of time: the scheduler waits for every worker.
        ask = partial(client._run, function, workers=workers, on_error="return")
        try:
            return client.sync(ask, callback_timeout=limit_s), silent
        except TimeoutError:
            last_seen = seen(client.sync(client.scheduler.identity, callback_timeout=limit_s))
        newest = max(last_seen.values(), default=0.0)
        workers = [worker for worker, moment in last_seen.items() if newest - moment <= _LAG_S]
        if silent >= last_seen.keys() - set(workers):
            raise BackendError("no worker of the Dask scheduler answers: look whether they hang, and start others")
        silent = last_seen.keys() - set(workers)
