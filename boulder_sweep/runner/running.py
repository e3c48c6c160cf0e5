"""One run from workers wanted to all rows written; the steps of `sweeper.run`."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from boulder_sweep.errors import Interrupted
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.runner.admission import Admission
from boulder_sweep.runner.backends import Backend
from boulder_sweep.runner.collector import Collector
from boulder_sweep.runner.commands import repeat_command
from boulder_sweep.runner.estimate import Estimate, blocks, estimated, rows_in_progress, take_sample
from boulder_sweep.runner.interruption import Signals
from boulder_sweep.runner.summary import Progress, progress_of
from boulder_sweep.runner.workers import Ended, Workers
from boulder_sweep.store.errors import DoesNotFitError
from boulder_sweep.store.provenance import cpu_name, file_metadata
from boulder_sweep.store.writer import OutputFolder

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

Report = Callable[[Progress], None]
"""What is told of the progress."""
_LOOK_UP_S = 0.1
_PATIENCE_S = 0.6
"""How long an interrupted run waits for what is being written."""


class Run:
    """One run into a folder that is open for writing."""

    def __init__(self, sweep: Sweep, evaluation: Evaluation, folder: OutputFolder, signals: Signals):
        self.rows_computed = 0
        self.notes = [f"{name} was damaged ({what}) and is computed again" for name, what in folder.damaged.items()]
        self._sweep = sweep
        self._evaluation = evaluation
        self._folder = folder
        self._signals = signals
        self._metadata = file_metadata(folder.manifest.identity, repeat_command(sweep))
        self._rows_before = folder.manifest.rows_done
        self._backend: Backend | None = None
        self._estimate: Estimate | None = None
        others = {session.cpu for session in folder.manifest.sessions} - {cpu_name()}
        if self._rows_before and others:
            self.notes.append(f"earlier rows were computed on another processor ({', '.join(sorted(others))})")

    def prepare(self, backend: str, jobs: int, scheduler: str | None, force: bool) -> None:
        """Get workers, warm up the kernels, and see that the result will fit."""
        to_compute = self._sweep.n_designs - self._rows_before
        try:
            self._backend = Backend(backend, jobs, scheduler)
            if to_compute:
                self._evaluation.warm_up()
                rows = self._sweep.n_designs
                self._estimate = estimated(
                    take_sample(self._evaluation, self._sweep.block, rows, self._metadata),
                    rows=rows,
                    rows_to_compute=to_compute,
                    jobs=self._backend.jobs,
                    out=self._folder.path,
                    rows_per_part=self._folder.manifest.rows_per_part,
                )
                objections = self._estimate.objections
                if objections and not force:
                    raise DoesNotFitError("; ".join(objections) + ". --force runs all the same")
        except BaseException:
            self._folder.discard()
            raise

    def compute(self, progress: Report | None, commit_every_s: float) -> None:
        """Compute and write what is missing."""
        self._signals.prompt = False
        manifest, make_block = self._folder.manifest, self._sweep.block
        admission = Admission(0)
        collector = Collector(self._folder, make_block, self._metadata, admission, commit_every_s)
        collector.start()
        workers = None
        try:
            if self._backend is not None and self._estimate is not None:
                size = self._estimate.rows_per_block
                admission.limit = rows_in_progress(size, self._backend.jobs, manifest.rows_per_part)
                ranges = blocks(manifest.missing(), size)
                workers = Workers(self._backend, self._evaluation, make_block, ranges, admission)
                workers.start()
            self._coordinate(workers, collector, progress)
        except BaseException:
            if workers is not None:
                workers.stop()
            collector.stop()
            collector.join(_PATIENCE_S)
            if workers is not None:
                workers.join(_PATIENCE_S / 3)
            raise

    def end(self, how: str) -> int:
        """Let folder and workers go.

        Parameters
        ----------
        how
            ``finished``, or what stopped the run.

        Returns
        -------
        int
            Rows that are safe.
        """
        self._folder.close(how)
        if self._backend is not None:
            self._backend.close()
        return self._folder.manifest.rows_done

    def _coordinate(self, workers: Workers | None, collector: Collector, progress: Report | None) -> None:
        """Pass results on until everything is written."""
        begun = reported = time.monotonic()
        ended = workers is None
        if ended:
            collector.finish()
        while collector.is_alive():
            if self._signals.caught is not None:
                raise Interrupted(self._signals.caught)
            if workers is None or ended:
                collector.join(_LOOK_UP_S)
            else:
                try:
                    item = workers.results.get(timeout=_LOOK_UP_S)
                except queue.Empty:
                    item = None
                if isinstance(item, Ended):
                    ended = True
                    if item.problem is not None:
                        raise item.problem
                    collector.finish()
                elif item is not None:
                    self.rows_computed += len(item.judged.verdict)
                    collector.put(item.start, item.judged)
            self._folder.sign_of_life()
            now = time.monotonic()
            if progress is not None and (now - reported >= _LOOK_UP_S or ended):
                reported = now
                rows = self._sweep.n_designs
                progress(progress_of(self._rows_before, self.rows_computed, rows, now - begun))
        if collector.problem is not None:
            raise collector.problem
        if self._folder.manifest.rows_done != self._sweep.n_designs:
            raise RuntimeError("the run ended before every row was written")
