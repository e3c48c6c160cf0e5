"""A whole sweep: every design of a grid simulated, judged and stored.

Workers compute ranges of rows and write their parts themselves; the calling thread reports progress and watches for
signals. What the table holds depends on the settings alone, not on workers, speed or interruptions.
"""

from __future__ import annotations

import itertools
import shlex
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boulder_kernels import simulate_table
from boulder_sweep.errors import BackendError, ClusterLostError, ComputationError, Interrupted, safe_words
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, Simulate, evaluation_of
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.locations import Location, location_of, names_in
from boulder_sweep.runner.pool import (
    DASK,
    THREADING,
    Pool,
    available_cores,
    call,
    check_backend,
    check_jobs,
    cluster,
    fingerprint,
)
from boulder_sweep.runner.progress import (
    Estimate,
    Progress,
    Summary,
    take_sample,
    time_and_disk,
    too_large,
)
from boulder_sweep.runner.ranges import BLOCK_S, PartReport, StoppedError, Work, planned, seconds_per_row
from boulder_sweep.settings.sweep import SECTION
from boulder_sweep.signals import Signals, noted_signals, undone
from boulder_sweep.store import failures
from boulder_sweep.store.folder import Ranges, check_writable, clear, locked, make, part_file, part_files, remove_parts
from boulder_sweep.store.provenance import differences, file_metadata, identity
from boulder_sweep.store.reading import Contents, FinishedRows, PartSummary, Table, contents, refuse_two
from boulder_sweep.text import why

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

__all__ = ["Estimate", "Interrupted", "Progress", "Summary", "estimate", "run"]

Report = Callable[[Progress], None]
_LOOK_EVERY_S = 0.1
_PATIENCE_S = 3.0
"""How long a run that was stopped waits for the blocks in hand; they then end with the process."""
_MOST_BYTES_PER_ROW = 1000
"""More than a row takes; where so many fit on the disk, no sample is taken."""


@dataclass
class _Plan:
    """What is to be done."""

    sweep: Sweep
    evaluation: Evaluation
    identity: dict[str, Any]
    ranges: Ranges
    there: Contents = field(default_factory=Contents)

    def missing(self) -> Iterator[tuple[int, int]]:
        """Yield the ranges that are not there, or damaged."""
        there = {(part.first, part.stop) for part in self.there.intact}
        return (bounds for bounds in self.ranges if bounds not in there)

    @property
    def parts_missing(self) -> int:
        """Number of such ranges."""
        return self.ranges.count - len(self.there.intact)

    @property
    def rows_done(self) -> int:
        """Rows that are there."""
        return sum(part.stop - part.first for part in self.there.intact)

    @property
    def metadata(self) -> dict[bytes, bytes]:
        """What all parts say."""
        return file_metadata(self.identity, rows=self.ranges.rows, ranges=self.ranges.count)


def run(
    sweep: Sweep,
    out: str | Location,
    *,
    jobs: int | None = None,
    backend: str = THREADING,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: Report | None = None,
    simulate: Simulate = simulate_table,
) -> Summary:
    """Simulate every design of a sweep and store the table.

    Parameters
    ----------
    sweep
        What `boulder_sweep.load` returned.
    out
        Folder of the table; it is made. A path, or a URL such as ``s3://bucket/m30.sweep``.
    jobs
        Workers; as many as this process may use cores by default, and one for a single design.
    backend
        ``threading`` or ``dask``.
    scheduler
        Address of a Dask scheduler; with ``dask`` only.
    resume
        Continue what `out` holds, if it is the same sweep; damaged parts are computed again. Starts from the
        beginning if `out` does not exist.
    overwrite
        Replace what a sweep wrote into `out` before.
    progress
        Called up to ten times a second, from the calling thread.
    simulate
        Function that simulates a table of designs; tests inject faults with it.

    Returns
    -------
    Summary
        Counts and times of the finished run.

    Raises
    ------
    StoreError
        `out` cannot be used, see `boulder_sweep.store.failures`; nothing has been computed then. `WriteError`
        also when the disk fills up during the run: what is written is whole, and the run can be resumed.
    TypeError, ValueError
        An argument is of the wrong type, or a count is below one.
    BackendError
        The workers are not available.
    ClusterLostError
        Scheduler or workers were lost; the run can be resumed.
    ComputationError
        Thousands of attempts to compute designs failed; the run can be resumed.
    Interrupted
        SIGINT or SIGTERM arrived (main thread only); the run can be resumed.
    """
    begun, started = time.monotonic(), datetime.now(UTC).isoformat(timespec="seconds")
    out = location_of(out)
    _check_arguments(sweep, jobs, progress)
    if resume and overwrite:
        raise failures.StoreError("--resume and --overwrite cannot be used together")
    sweep = at_values(sweep)
    check_backend(backend, scheduler)
    again = resuming(sweep, out, jobs, backend, scheduler)
    jobs = jobs or (1 if sweep.n_designs == 1 else available_cores())
    with noted_signals() as signals, _folder(out):
        signals.defer()
        whole = _Run(out, signals, sweep.n_designs, jobs, backend, scheduler)
        whole.before = None if resume else 0
        try:
            signals.call(lambda: _refuse_taken(out, resume, overwrite))
            if said := too_large(sweep.n_designs, "at least", sweep.n_designs if not resume else 0, out):
                raise failures.DoesNotFitError(said)  # a row takes a byte or more; nothing is compiled yet
            plan = signals.call(lambda: _planned(sweep, simulate))
            plan.there = signals.call(lambda: _there(plan, out, overwrite))
            whole.before = plan.rows_done
            signals.call(lambda: _refuse_too_large(plan, out))
            whole.compute(plan, progress)
            signals.call(lambda: _check_whole(out, plan, whole.written))
        except Interrupted as stop:
            raise Interrupted(stop.signum, whole.rows_safe, sweep.n_designs, again) from None
        except (ClusterLostError, ComputationError, failures.WriteError) as problem:
            safe = safe_words(whole.rows_safe, sweep.n_designs)
            raise type(problem)(f"{problem}. {safe}. Resume with:\n  {again}") from problem
    parts: list[PartSummary | PartReport] = [*plan.there.intact.values(), *whole.written]
    reasons = sum((Counter(part.verdicts) for part in parts), Counter[str]())
    model = plan.identity["settings"]["model"]
    return Summary(
        out,
        sweep.n_designs,
        rows_computed=sum(part.rows for part in whole.written),
        reasons=dict(sorted(reasons.items())),
        seconds=time.monotonic() - begun,
        started=started,
        host=socket.gethostname(),
        jobs=whole.jobs,
        backend=backend,
        parts=len(parts),
        bytes=sum(part.bytes for part in parts),
        accuracy=plan.identity["accuracy"],
        notes=_notes(plan),
        boulder={name: model[name] for name in ("foot", "rock_assumed") if name in model},
    )


class _Run:
    """The computing part of a run, with the parts that it has written; `before` are the rows of an earlier run."""

    def __init__(
        self, out: Location, signals: Signals, rows: int, jobs: int, backend: str, scheduler: str | None
    ) -> None:
        self.before: int | None = None  # not counted yet
        self.written, self.jobs = list[PartReport](), jobs
        self._out, self._signals, self._rows = out, signals, rows
        self._backend, self._scheduler = backend, scheduler
        self._stopped = threading.Event()
        self._ticked = 0
        self._problem: BaseException | None = None

    @property
    def rows_safe(self) -> int | None:
        """Rows that are safe; None where nobody knows yet."""
        return None if self.before is None else self.before + self._rows_written

    @property
    def _rows_written(self) -> int:
        return sum(part.rows for part in self.written)

    def compute(self, plan: _Plan, progress: Report | None) -> None:
        """Compute and write what is missing; raises as `run`."""
        size = max(int(BLOCK_S / seconds_per_row(plan.sweep, plan.evaluation)), 1)
        work = Work(plan.evaluation, plan.sweep.block, plan.metadata, str(self._out), size)
        thread = threading.Thread(target=self._work, args=(plan, work), name="run", daemon=True)
        thread.start()
        before, begun = plan.rows_done, time.monotonic()
        try:
            while thread.is_alive():
                thread.join(_LOOK_EVERY_S)
                self._signals.check()
                if progress is not None:
                    progress(Progress(before, self._ticked, self._rows, time.monotonic() - begun))
        except BaseException:
            self._stopped.set()
            thread.join(_PATIENCE_S)
            if thread.is_alive():
                self._signals.abandon(thread)
            raise
        if self._problem is not None and not isinstance(self._problem, StoppedError):
            raise self._problem
        self._signals.check()

    def _work(self, plan: _Plan, work: Work) -> None:
        """Have everything computed, in a thread that may be left behind."""
        try:
            if plan.parts_missing:
                plan.evaluation.warm_up()
                compute = self._by_cluster if self._backend == DASK else self._by_threads
                compute(work, plan)
        except BaseException as problem:
            self._problem = problem

    def _by_threads(self, work: Work, plan: _Plan) -> None:
        calls = (call(_written, work, *bounds, self._tick) for bounds in self._missing(plan))
        for part in Pool(self.jobs)(calls, in_order=False):
            self._note(part)

    def _by_cluster(self, work: Work, plan: _Plan) -> None:
        work.made_by = fingerprint()
        if isinstance(self._out, Path):
            work.out = str(self._out.absolute())  # workers have working folders of their own
        with cluster(self.jobs, self._scheduler) as workers:
            self.jobs = workers.jobs
            for part in workers((call(_written, work, *bounds) for bounds in self._missing(plan)), work):
                self._note(part)
                self._ticked = self._rows_written
                if self._stopped.is_set():
                    return

    def _missing(self, plan: _Plan) -> Iterator[tuple[int, int]]:
        """Yield the ranges that are not there, until something goes wrong."""
        return itertools.takewhile(lambda _: not self._stopped.is_set(), plan.missing())

    def _note(self, part: PartReport | Exception) -> None:
        if isinstance(part, PartReport):
            self.written.append(part)
        else:  # what is in hand ends, and nothing more is begun
            self._problem = self._problem or part
            self._stopped.set()

    def _tick(self, rows: int) -> None:
        """Count a block; called by the threads of this process."""
        if self._stopped.is_set():
            raise StoppedError
        self._ticked += rows


def _written(work: Work, first: int, stop: int, *tick: Callable[[int], None]) -> PartReport | Exception:
    """Compute a range and write its part, or return what went wrong: a call on a worker."""
    try:
        return work.write(first, stop, *tick)
    except Exception as problem:  # joblib would not wait for the other threads
        return problem


@contextmanager
def _folder(out: Location) -> Iterator[None]:
    """Make and lock the folder; leave nothing behind but parts."""

    def leave(is_new: bool) -> None:
        clear(out)
        if is_new and isinstance(out, Path):
            with suppress(OSError):  # parts are in it
                out.rmdir()

    with locked(out), undone(lambda: make(out), leave):
        clear(out)
        yield


def _names_in(out: Location) -> list[str]:
    """Return the names in a folder of parts."""
    try:
        return names_in(out)
    except OSError as problem:
        raise failures.WriteError(f"cannot write into {out}: {why(problem)}") from problem


def _refuse_taken(out: Location, resume: bool, overwrite: bool) -> None:
    """Refuse a folder that holds something else, or a result that is neither continued nor replaced."""
    names = _names_in(out)
    parts = part_files(names)
    strange = [name for name in names if not part_file(name) and not name.startswith(".")]
    if parts:  # readers would take other tables for rows
        strange = [name for name in strange if name.endswith(".parquet")]
    if strange:
        shown = ", ".join(strange[:5]) + (f" and {len(strange) - 5} more" if len(strange) > 5 else "")
        raise failures.ForeignFilesError(
            f"{out} contains files that no sweep wrote ({shown}): choose another folder or move them"
        )
    if parts and not (resume or overwrite):
        there = FinishedRows(out)
        state = f"is finished: see it with `sweep report {out}`, or"
        if there.rows_done < there.rows:
            state = f"holds {there.rows_done:,} of {there.rows:,} rows: use --resume to continue it, or"
        raise failures.OutputExistsError(f"{out} exists and {state} use --overwrite to start again")
    check_writable(out)


def _planned(sweep: Sweep, simulate: Simulate) -> _Plan:
    """Return what the settings alone decide."""
    accuracy = accuracy_of(sweep)
    evaluation = evaluation_of(sweep, accuracy, simulate)
    described = identity(sweep.resolved(), *evaluation.settings(), accuracy.to_dict())
    return _Plan(sweep, evaluation, described, planned(sweep, evaluation))


def _there(plan: _Plan, out: Location, overwrite: bool) -> Contents:
    """Return what a folder holds of a table; what is damaged or to be replaced is removed."""
    if overwrite:
        remove_parts(out, [part.name for part in part_files(_names_in(out))])
        return Contents()
    found = _same(plan, out)
    remove_parts(out, list(found.damaged))
    if found.intact:  # the heading may be another, and all parts keep one
        plan.identity = plan.identity | {"settings": next(iter(found.intact.values())).table.identity["settings"]}
    return found


def _same(plan: _Plan, out: Location) -> Contents:
    """Return what a folder holds of a table."""
    found = contents(out)
    here = Table(plan.identity, plan.ranges).described
    for table in {id(one.table): one.table for one in found.intact.values()}.values():
        if unlike := differences(table.described, here):
            lines = "\n  ".join(["Differences (there -> here):", *unlike])
            raise failures.SettingsDifferError(
                f"{out} was started with other settings or another version, and rows must not be mixed. {lines}\n"
                f"Resume with the original settings, use --overwrite, or choose another folder"
            )
    return found


def _refuse_too_large(plan: _Plan, out: Location) -> None:
    """Refuse a table that does not fit on its disk."""
    rows = plan.ranges.rows
    if plan.parts_missing and too_large(rows, "", (rows - plan.rows_done) * _MOST_BYTES_PER_ROW, out):
        plan.evaluation.warm_up()
        cost = take_sample(plan.evaluation, plan.sweep, plan.metadata)
        needed = time_and_disk(cost, rows - plan.rows_done, plan.parts_missing, 1)[1]
        if said := too_large(rows, "about", needed, out):
            raise failures.DoesNotFitError(said)


def _check_whole(out: Location, plan: _Plan, written: list[PartReport]) -> None:
    """Check that the parts of all workers are in the folder as this machine sees it."""
    names = _names_in(out)
    refuse_two(out, part_files(names))
    if missing := {part.name for part in written} - {*names}:
        raise BackendError(
            f"{len(missing)} of {len(written)} parts that workers wrote are not in {out} as this machine sees it: "
            f"workers on other machines need a file system that all share, or a URL"
        )


def _notes(plan: _Plan) -> list[str]:
    notes = [f"{name} was damaged ({what}) and is computed again" for name, what in plan.there.damaged.items()]
    if plan.identity["settings"].get(SECTION, {}) != plan.sweep.heading.given():
        notes.append("the table keeps the heading of its first run; `sweep report` takes another by its options")
    return notes


def estimate(
    sweep: Sweep,
    out: str | Location | None = None,
    *,
    jobs: int | None = None,
    resume: bool = False,
    simulate: Simulate = simulate_table,
) -> Estimate:
    """Estimate what a run will take from a timed sample of a tenth of a second; nothing is written.

    With `resume`, only the rows that are missing in `out` or damaged there are counted. Raise StoreError where a run
    cannot be resumed in it, and for other arguments what `run` raises.
    """
    check_jobs(jobs)
    sweep = at_values(sweep)
    plan = _planned(sweep, simulate)
    if resume and out is not None:
        plan.there = _same(plan, location_of(out))
    plan.evaluation.warm_up()
    cores = available_cores()
    cost = take_sample(plan.evaluation, sweep, plan.metadata)
    missing = sweep.n_designs - plan.rows_done
    needed = time_and_disk(cost, missing, plan.parts_missing, min(jobs or cores, cores))
    return Estimate(sweep.n_designs, missing, *needed, jobs or cores, plan.there.damaged)


def _check_arguments(sweep: Sweep, jobs: int | None, progress: Report | None) -> None:
    """Refuse arguments of wrong types and counts below one, by name."""
    from boulder_sweep.settings import Sweep

    if not isinstance(sweep, Sweep):
        raise TypeError(f"sweep must be what boulder_sweep.load returns, not {type(sweep).__name__}")
    check_jobs(jobs)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function, not {type(progress).__name__}")


def resuming(sweep: Sweep, out: Location, jobs: int | None, backend: str, scheduler: str | None) -> str:
    """Return the command that resumes a run with the given arguments."""
    from boulder_sweep.settings.loader import NO_SECOND_OPINION, SECOND_OPINION

    if sweep.path is None:
        return f"boulder_sweep.run(sweep, {str(out)!r}, resume=True)"
    words = ["sweep", "run", str(sweep.path), "-o", str(out)]
    for name, value in (("jobs", jobs), ("backend", backend), ("scheduler", scheduler)):
        if value not in (None, THREADING):
            words += [f"--{name}", str(value)]
    if sweep.taken_at:
        words += ["--at", next(iter(sweep.taken_at.values())).partition(" ")[0]]
    for entry in sweep.overrides:
        if entry in (SECOND_OPINION, NO_SECOND_OPINION):
            words.append(entry.partition("=")[0])
        else:  # as it was given
            words += entry.split("=", 1) if entry.startswith("--") else ["--set", entry]
    return shlex.join([*words, "--resume"])
