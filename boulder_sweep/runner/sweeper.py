"""A whole sweep: every design of a grid simulated, judged and stored.

The calling thread only coordinates: it passes results on, reports progress and watches for signals.
Workers compute, encode and write parts; the `Committer` thread records them in the order of the designs.
What the table holds depends on the settings alone, not on workers, blocks, speed or interruptions.
"""

from __future__ import annotations

import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.errors import ClusterLostError, ComputationError, Interrupted
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Simulate, by_kernels, evaluation_of
from boulder_sweep.judge.firmness import firmness_of
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.locations import RemotePath, location_of
from boulder_sweep.runner.estimate import Estimate, take_sample, time_and_disk, too_large
from boulder_sweep.runner.interruption import noted_signals
from boulder_sweep.runner.pool import available_cores, check_backend, check_count, check_jobs, telling_start_failure
from boulder_sweep.runner.running import FINISHED, Report, Run, repeat_command
from boulder_sweep.runner.running import resume_command as default_resume_command
from boulder_sweep.runner.summary import Progress, Summary, summary_of
from boulder_sweep.runner.workers import COMMIT_EVERY_S
from boulder_sweep.store.failures import DoesNotFitError, NotASweepError
from boulder_sweep.store.manifest import Manifest
from boulder_sweep.store.provenance import file_metadata, identity, new_session
from boulder_sweep.store.storage import storage_of
from boulder_sweep.store.verify import load_checked
from boulder_sweep.store.writer import ROWS_PER_PART, ClaimedFolder, claim_output, refuse_other_settings
from boulder_sweep.text import one_line

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

__all__ = ["Estimate", "Interrupted", "Progress", "Summary", "estimate", "run"]


def run(
    sweep: Sweep,
    out: str | Path | RemotePath,
    *,
    jobs: int | None = None,
    backend: str = "threading",
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: Report | None = None,
    command: str | None = None,
    resume_command: str | None = None,
    rows_per_part: int = ROWS_PER_PART,
    commit_every_s: float = COMMIT_EVERY_S,
    simulate: Simulate = by_kernels,
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
    command
        The command that started this run, kept in the manifest.
    resume_command
        The command that resumes it; built from the arguments by default.
    rows_per_part
        Rows per file of a new table.
    commit_every_s
        How often finished rows are written before their file is full [s].
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
    begun = time.monotonic()
    out = location_of(out)
    _check_arguments(sweep, jobs, rows_per_part, commit_every_s, progress)
    sweep = at_values(sweep)
    check_backend(backend, scheduler)
    again = resume_command or default_resume_command(sweep, out, jobs, backend, scheduler)
    jobs = jobs or (1 if sweep.n_designs == 1 else available_cores())
    with noted_signals() as signals, signals.deferred():
        # A store may be silent, and a signal must end the run all the same: only threads of their own wait for it.
        remote = isinstance(out, RemotePath)
        claim = partial(claim_output, out, resume=resume, overwrite=overwrite)
        claimed = signals.call(claim, ClaimedFolder.release) if remote else claim()
        whole: Run | None = None

        def ended(how: str) -> int:
            if whole is not None:
                return whole.end(how)
            if remote:
                signals.attempt(claimed.release, hurry=True)
            else:
                claimed.release()
            return claimed.rows_done

        try:
            with telling_start_failure(jobs):
                if said := too_large(sweep.n_designs, "at least", sweep.n_designs - claimed.rows_done, out):
                    raise DoesNotFitError(said)  # a row takes a byte or more; nothing is compiled or computed yet
                accuracy = signals.call(lambda: accuracy_of(sweep))
                evaluation = evaluation_of(sweep, accuracy, simulate)
                manifest = Manifest(
                    identity(sweep.resolved(), *evaluation.settings(), accuracy.to_dict()),
                    sweep.n_designs,
                    rows_per_part,
                    again,
                )
                session = new_session(command or "boulder_sweep.run", jobs, backend)
                begin = partial(claimed.open, manifest, session)
                folder = signals.call(begin, lambda late: late.close("interrupted")) if remote else begin()
                whole = Run(sweep, evaluation, folder, signals)
                whole.prepare(backend, jobs, scheduler)
                whole.compute(progress, commit_every_s)
        except Interrupted as stop:
            done = ended(f"interrupted by signal {stop.signum}")
            raise Interrupted(stop.signum, done, sweep.n_designs, again) from None
        except (ClusterLostError, ComputationError) as problem:
            done = ended(str(problem))
            safe = f"{done:,} of {sweep.n_designs:,} rows are safe"
            raise type(problem)(f"{problem}. {safe}. Resume with: {again}") from problem
        except BaseException as problem:
            ended(f"stopped by {one_line(problem)}")
            raise
        whole.end(FINISHED)
    return summary_of(
        out,
        whole.manifest,
        rows_computed=whole.rows_computed,
        seconds=time.monotonic() - begun,
        jobs=whole.jobs,
        backend=backend,
        firmness=whole.firmness,
        notes=whole.notes,
    )


def estimate(
    sweep: Sweep,
    out: str | Path | RemotePath | None = None,
    *,
    jobs: int | None = None,
    resume: bool = False,
    simulate: Simulate = by_kernels,
) -> Estimate:
    """Estimate what a run will take from a timed sample of a tenth of a second; nothing is written.

    Parameters
    ----------
    sweep, out, jobs, simulate
        As of `run`.
    resume
        Count only the rows that are missing in `out` or damaged there.

    Returns
    -------
    Estimate
        Rows, time and disk.

    Raises
    ------
    TypeError, ValueError
        The number of jobs is not a whole number, or out of range.
    StoreError
        A run cannot be resumed in `out`.
    """
    check_jobs(jobs)
    sweep = at_values(sweep)
    accuracy = accuracy_of(sweep)
    evaluation = evaluation_of(sweep, accuracy, simulate)
    folder = None if out is None else location_of(out)
    described = identity(sweep.resolved(), *evaluation.settings(), accuracy.to_dict())
    there = Manifest(described, sweep.n_designs, ROWS_PER_PART, "")
    damaged: dict[str, str] = {}
    if resume and folder is not None:
        with suppress(NotASweepError):
            there, damaged = load_checked(folder, read_parts=not storage_of(folder).checks_content)
            refuse_other_settings(there, described, sweep.n_designs, folder)
    evaluation.warm_up()
    metadata = file_metadata(described, repeat_command(sweep), firmness_of(sweep).to_dict())
    missing, cores = sweep.n_designs - there.rows_done, available_cores()
    jobs = jobs or cores
    cost = take_sample(evaluation, sweep, metadata)
    needed = time_and_disk(cost, missing, min(jobs, cores), there.rows_per_part)
    return Estimate(sweep.n_designs, missing, *needed, jobs, damaged)


def _check_arguments(
    sweep: Sweep, jobs: int | None, rows_per_part: int, commit_every_s: float, progress: Report | None
) -> None:
    """Refuse arguments of wrong types and counts below one, by name.

    Raises
    ------
    TypeError, ValueError
        Says what is allowed.
    """
    from boulder_sweep.settings import Sweep

    if not isinstance(sweep, Sweep):
        raise TypeError(f"sweep must be what boulder_sweep.load returns, not {type(sweep).__name__}")
    check_jobs(jobs)
    check_count("rows_per_part", rows_per_part)
    if not commit_every_s >= 0.0:
        raise ValueError(f"commit_every_s must not be negative, but is {commit_every_s}")
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function, not {type(progress).__name__}")
