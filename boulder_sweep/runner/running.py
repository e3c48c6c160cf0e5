"""One run, from finding workers to the last row written; the steps of `sweeper.run`.

One thread records staged parts in the manifest, if possible in the order of the designs, while others are computed.
"""

from __future__ import annotations

import math
import queue
import shlex
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boulder_sweep.errors import BackendError, ClusterLostError
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.firmness import firmness_of
from boulder_sweep.locations import Location
from boulder_sweep.parquet import ParquetError, TableFile
from boulder_sweep.runner.estimate import RowCost, take_sample, time_and_disk, too_large
from boulder_sweep.runner.interruption import Signals
from boulder_sweep.runner.pool import DASK, telling_start_failure
from boulder_sweep.runner.summary import Progress, progress_of
from boulder_sweep.runner.workers import (
    Computation,
    Computed,
    Ended,
    InOrder,
    Message,
    Note,
    ThreadWorkers,
    Workers,
    blocks,
    rows_in_progress,
    rows_per_block,
    rows_per_task,
    tasks,
)
from boulder_sweep.store.failures import DamagedError, DoesNotFitError
from boulder_sweep.store.manifest import Manifest
from boulder_sweep.store.provenance import cpu_name, file_metadata
from boulder_sweep.store.writer import OutputFolder, StagedPart

if TYPE_CHECKING:
    from boulder_sweep.runner.cluster import Cluster
    from boulder_sweep.settings import Sweep

Report = Callable[[Progress], None]
FINISHED = "finished"
COMMIT_SHARE = 0.02
"""Share of one processor that writing manifests may take."""
GAP_S = 30.0
"""How long parts wait for the one before them, which may never come, before they are committed without it [s]."""
_LOOK_EVERY_S = 0.1
_PATIENCE_S = 0.6
"""How long an interrupted run waits for what is being written."""
_PATIENCE_AFTER_PROBLEM_S = 6.0
"""The same for a run stopped by a problem: no user waits, and no worker may write into a folder already released."""


class Committer(threading.Thread):
    """Commits staged parts; merges small ones at the end.

    Parameters
    ----------
    folder
        Open for writing.
    computation
        Encodes merged parts.
    workers
        Told what is staged, and asked for the rows that are ready when the run is stopped.
    clock, work_clock
        Give the time, and the processor time of the calling thread [s].
    """

    def __init__(
        self,
        folder: OutputFolder,
        computation: Computation,
        workers: Workers | None = None,
        clock: Callable[[], float] = time.monotonic,
        work_clock: Callable[[], float] = time.thread_time,
    ):
        super().__init__(name="committer", daemon=True)
        self.problem: BaseException | None = None
        self._folder = folder
        self._computation = computation
        self._workers = workers or Workers()
        self._clock = clock
        self._work_clock = work_clock
        self._arrived: queue.SimpleQueue[StagedPart | None] = queue.SimpleQueue()
        self._waiting: InOrder[StagedPart] = InOrder(folder.manifest.missing())
        self._gap_until = math.inf
        self._stopped = threading.Event()
        self._rest_until = -math.inf

    def put(self, staged: StagedPart) -> None:
        """Hand over a staged part; never waits."""
        self._arrived.put(staged)

    def finish(self) -> None:
        """Commit everything that was handed over, merge small parts, and end."""
        self._arrived.put(None)

    def stop(self) -> None:
        """Commit what is there, and end."""
        self._stopped.set()
        self._arrived.put(None)

    def run(self) -> None:
        """Commit parts; called by `start`."""
        try:
            while (staged := self._next_item()) is not None:
                self._waiting.put(staged.part.first, staged.part.stop, staged)
                self._workers.release(staged.part.rows)
            if self._stopped.is_set():
                for staged in self._workers.flush():
                    self._waiting.put(staged.part.first, staged.part.stop, staged)
            self._commit(self._stopped.is_set())
            self._merge()
        except BaseException as problem:
            self.problem = problem

    def _next_item(self) -> StagedPart | None:
        """Wait for a staged part, None for the end; commit meanwhile what has arrived when it is time to.

        The manifest is written as a whole, and grows with the table. So after each commit there is a rest, long
        enough for the commits to take no more than `COMMIT_SHARE` of a processor; what arrives meanwhile shares the
        next manifest.
        """
        while True:
            due = self._rest_until - self._clock()
            if self._waiting.is_next_there:
                self._gap_until = math.inf
            elif self._waiting:
                self._gap_until = min(self._gap_until, self._clock() + GAP_S)
                due = self._gap_until - self._clock()
            try:
                return self._arrived.get(timeout=max(due, 0.0) if self._waiting else None)
            except queue.Empty:
                begun = self._work_clock()
                all_there = self._clock() >= self._gap_until
                self._commit(all_there)
                if all_there:
                    self._gap_until = math.inf
                self._rest_until = self._clock() + (self._work_clock() - begun) / COMMIT_SHARE

    def _commit(self, all_there: bool = False) -> None:
        """Commit the parts that continue the table, or all that are there."""
        ready = list(self._waiting.take())
        if all_there:
            ready += self._waiting.take_early()
        if ready:
            self._folder.commit(ready)

    def _merge(self) -> None:
        """Replace small parts, once all rows are there, by those that a fast run writes directly."""
        import pyarrow as pa  # heavy, and only needed where there are small parts

        from boulder_sweep.store.schema import judged_rows

        for names in self._folder.manifest.mergeable():
            if self._stopped.is_set():
                return
            try:
                contents = [(self._folder.path / name).read_bytes() for name in names]
                sources = [pa.BufferReader(content) for content in contents]
                tables = [TableFile(source).read() for source in sources]
            except (OSError, ParquetError) as problem:
                self._folder.check()
                raise DamagedError(f"{self._folder.path} was damaged during the run: {problem}") from problem
            first = self._folder.manifest.parts[names[0]].first
            merged = self._computation.encoded(first, [judged_rows(table) for table in tables])
            self._folder.merge(names, merged.content)


class Run:
    """One run into a folder that is open for writing."""

    def __init__(self, sweep: Sweep, evaluation: Evaluation, folder: OutputFolder, signals: Signals):
        self.rows_computed = 0
        self.notes = [f"{name} was damaged ({what}) and is computed again" for name, what in folder.damaged.items()]
        self._sweep = sweep
        self._evaluation = evaluation
        self._folder = folder
        self._signals = signals
        self.firmness: dict[str, Any] = {}
        self._metadata: dict[bytes, bytes] = {}
        self._rows_before = folder.manifest.rows_done
        self.jobs = 1
        self._cluster: Cluster | None = None
        self._cost: RowCost | None = None
        others = {session.cpu for session in folder.manifest.sessions} - {cpu_name()}
        if self._rows_before and others:
            self.notes.append(f"earlier rows were computed on another processor ({', '.join(sorted(others))})")

    @property
    def manifest(self) -> Manifest:
        """What is recorded of the folder."""
        return self._folder.manifest

    def prepare(self, backend: str, jobs: int, scheduler: str | None) -> None:
        """Connect to workers, warm up the kernels, and check that the result will fit."""
        self.jobs = jobs
        try:
            if backend == DASK:
                from boulder_sweep.runner.cluster import Cluster

                self._cluster = self._signals.call(lambda: Cluster(jobs, scheduler), Cluster.close)
                self.jobs = max(sum(self._signals.call(self._cluster.threads).values()), 1)
                self.manifest.sessions[-1].jobs = self.jobs
            self.firmness = self._signals.call(lambda: firmness_of(self._sweep).to_dict())
            identity, command = self._folder.manifest.identity, repeat_command(self._sweep)
            self._metadata = file_metadata(identity, command, self.firmness)
            if self._rows_before < self._sweep.n_designs:
                self._cost = self._signals.call(self._sampled)
                rows, out = self._sweep.n_designs, self._folder.path
                needed = time_and_disk(self._cost, self._missing, self.jobs, self.manifest.rows_per_part)
                if said := too_large(rows, "about", needed[1], out):
                    raise DoesNotFitError(said)
        except BaseException:
            self._discard()
            raise

    def compute(self, progress: Report | None, commit_every_s: float) -> None:
        """Compute and write what is missing."""
        evaluation = self._evaluation
        computation = Computation(evaluation, self._sweep.block, self._metadata, evaluation.warm_up)
        workers = self._workers(computation, commit_every_s)
        committer = Committer(self._folder, computation, workers)
        try:
            with telling_start_failure(self.jobs):
                committer.start()
                workers.start()
            self._coordinate(workers, committer, progress)
        except BaseException as stop:
            patience = _PATIENCE_S if isinstance(stop, KeyboardInterrupt) else _PATIENCE_AFTER_PROBLEM_S
            workers.stop()
            _join(workers, patience / 3)
            while not workers.messages.empty():  # parts written meanwhile
                message = workers.messages.get()
                if isinstance(message, StagedPart):
                    committer.put(message)
            committer.stop()
            _join(committer, patience)
            if isinstance(stop, BackendError) and not isinstance(stop, ClusterLostError):
                self._discard()  # unless something was written, there is nothing to resume
            raise

    def end(self, how: str) -> int:
        """Release folder and workers.

        Parameters
        ----------
        how
            `FINISHED`, or what stopped the run.

        Returns
        -------
        int
            Rows that are safe.
        """
        last: list[Callable[[], None]] = [] if self._cluster is None else [self._cluster.close]
        if isinstance(self._folder.path, Path):
            self._folder.close(how)
        else:
            last.append(partial(self._folder.close, how))
        if last:
            self._signals.attempt(*last, hurry=how != FINISHED)
        return self._folder.rows_safe

    def _discard(self) -> None:
        """Release the folder and remove all traces, but do not wait for a silent store."""
        if isinstance(self._folder.path, Path):
            self._folder.discard()
        else:
            self._signals.attempt(self._folder.discard, hurry=True)

    @property
    def _missing(self) -> int:
        """Rows to compute."""
        return self._sweep.n_designs - self._rows_before

    def _sampled(self) -> RowCost:
        """Measure what a row costs."""
        self._evaluation.warm_up()
        return take_sample(self._evaluation, self._sweep, self._metadata)

    def _workers(self, computation: Computation, commit_every_s: float) -> Workers:
        """Return the workers for the missing rows."""
        if self._cost is None:  # no row is missing
            return Workers()
        manifest, each = self._folder.manifest, (self._cost.seconds_per_row, self._missing, self.jobs)
        size = rows_per_block(*each)
        if self._cluster is not None:
            rows = rows_per_task(*each, manifest.rows_per_part)
            from boulder_sweep.runner.remote import ClusterWorkers

            return ClusterWorkers(self._cluster, computation, tasks(manifest.missing(), rows), size, self._folder)
        most = rows_in_progress(size, self.jobs, manifest.rows_per_part)
        ranges = blocks(manifest.missing(), size)
        return ThreadWorkers(self.jobs, computation, ranges, most, self._folder, commit_every_s)

    def _coordinate(self, workers: Workers, committer: Committer, progress: Report | None) -> None:
        """Pass messages on until everything is written."""
        begun = reported = time.monotonic()
        ended = False
        while committer.is_alive():
            self._signals.check()
            if ended:
                committer.join(_LOOK_EVERY_S)
            else:
                with suppress(queue.Empty):
                    ended = self._received(workers.messages.get(timeout=_LOOK_EVERY_S), committer)
            self._folder.heartbeat()
            now = time.monotonic()
            if progress is not None and (now - reported >= _LOOK_EVERY_S or ended):
                reported = now
                rows = self._sweep.n_designs
                progress(progress_of(self._rows_before, self.rows_computed, rows, now - begun, self.notes))
        if committer.problem is not None:
            raise committer.problem
        if self._folder.manifest.rows_done != self._sweep.n_designs:
            raise RuntimeError("the run ended before every row was written")

    def _received(self, message: Message, committer: Committer) -> bool:
        """Act on a message of the workers; True for the last one."""
        if isinstance(message, Computed):
            self.rows_computed += message.rows
        elif isinstance(message, StagedPart):
            committer.put(message)
        elif isinstance(message, Note):
            self.notes.append(message.text)
        elif isinstance(message, Ended):
            if message.problem is not None:
                raise message.problem
            committer.finish()
            return True
        return False


def _join(thread: threading.Thread, patience_s: float) -> None:
    """Wait for a thread, which may not have been started."""
    if thread.ident is not None:
        thread.join(patience_s)


def repeat_command(sweep: Sweep) -> str:
    """Return the command that computes the same table, the same on every machine."""
    if sweep.path is None:
        return "boulder_sweep.run(sweep, out)"
    return shlex.join(["sweep", "run", sweep.path.name, *_overrides(sweep)])


def resume_command(sweep: Sweep, out: Location, jobs: int | None, backend: str, scheduler: str | None) -> str:
    """Return the command that resumes a run with the given arguments."""
    if sweep.path is None:
        return f"boulder_sweep.run(sweep, {str(out)!r}, resume=True)"
    words = ["sweep", "run", str(sweep.path), "-o", str(out)]
    if jobs is not None:
        words += ["--jobs", str(jobs)]
    if backend != "threading":
        words += ["--backend", backend]
    if scheduler is not None:
        words += ["--scheduler", scheduler]
    if sweep.taken_at:
        words += ["--at", next(iter(sweep.taken_at.values())).partition(" ")[0]]
    return shlex.join([*words, *_overrides(sweep), "--resume"])


def _overrides(sweep: Sweep) -> list[str]:
    """Return the options that replace entries of the file, as they were given."""
    words = []
    for entry in sweep.overrides:
        words += entry.split("=", 1) if entry.startswith("--") else ["--set", entry]
    return words
