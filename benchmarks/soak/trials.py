"""What is done to runs in one trial, drawn from the seed and its number, and how its table is judged."""

from __future__ import annotations

import math
import random
import shutil
import signal
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

import boulder_sweep

from .processes import HANG_S, Changes, Cluster, Parts, Run, Store, Time, Watch, Writes, data_files, ended, meets
from .store_server import BUCKET

GRID = """\
name: soak
boulder:  {length: 1.65 m, width: {from: 1.4 m, to: 2.4 m, count: 25}, height: {from: 1.8 m, to: 3.6 m, count: 37}, \
density: 2600 kg/m^3}
site:     {embedment_ratio: {from: 0.45, to: 0.75, count: 27}}
soil:     {density: 1860 kg/m^3, friction_angle: [36, 40] deg, subgrade_reaction: {from: 45 MN/m^3, to: 108 MN/m^3, \
count: 8}}
vehicle:  {mass: 6800 kg, speed: 13.4 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
solver:   {accuracy: fast}
"""
"""399,600 designs in four parts, about a second of computing."""
LARGE = ("--set", "boulder.width={from: 1.4 m, to: 2.4 m, count: 100}")
"""Four times as many: thirteen parts, and a part for every task of a cluster."""
OTHER_SPEED = ("--set", "vehicle.speed=11 m/s")
HELD_S = 2.0
"""How long the run that overwrites stands still while the workers of the earlier one go on [s]."""
INTERRUPTED = (130, 143)
TASKS = 10
"""About so many files does a run on a cluster write before it merges them."""
STOPPED = (0, 143, -signal.SIGTERM)
"""Exit codes after SIGTERM: it was done already, has stopped in order, or had not begun to catch signals."""


class Tally(NamedTuple):
    """Rows of a table that are not as they should be."""

    lost: int
    doubled: int
    wrong: int


class Reference:
    """The table of a run that nothing was done to, ready to be compared with, bit by bit."""

    def __init__(self, frame: pd.DataFrame):
        self.rows = len(frame)
        self._words: dict[Any, int] = {}
        self._bits = {name: self._bits_of(frame[name]) for name in frame}
        if not np.array_equal(frame["design_id"], np.arange(self.rows)):
            raise ValueError("the uninterrupted table has not every row once")

    def tally(self, frame: pd.DataFrame, *, wanted: np.ndarray | None = None) -> Tally:
        """Compare a table with this one.

        Parameters
        ----------
        frame
            The table, in any order.
        wanted
            Which rows it must have, shape (rows,); all by default.
        """
        ids = frame["design_id"].to_numpy() if "design_id" in frame else np.full(len(frame), -1)
        known = (ids >= 0) & (ids < self.rows)
        there = np.bincount(ids[known], minlength=self.rows)
        wrong = ~known
        if {name: self._kind(frame[name]) for name in frame} != {name: kind for name, (kind, _) in self._bits.items()}:
            wrong[:] = True
        else:
            at = np.where(known, ids, 0)
            for name, (_, bits) in self._bits.items():
                wrong |= self._bits_of(frame[name])[1] != bits[at]
        lost = there == 0 if wanted is None else (there == 0) & wanted
        return Tally(int(lost.sum()), int(np.maximum(there - 1, 0).sum()), int(wrong.sum()))

    def _bits_of(self, column: pd.Series) -> tuple[str, np.ndarray]:
        """Return the kind of a column and its values as whole numbers."""
        kind = self._kind(column)
        if kind == "words":
            of_words = column.astype("category")
            codes = [self._words.setdefault(word, len(self._words)) for word in of_words.cat.categories]
            return kind, np.array([*codes, -1])[of_words.cat.codes]
        values = column.to_numpy()
        return kind, values.view(f"i{values.dtype.itemsize}")

    @staticmethod
    def _kind(column: pd.Series) -> str:
        """Return the type of numbers; what is no number is a word, however it is kept."""
        return str(column.dtype) if isinstance(column.dtype, np.dtype) and column.dtype.kind in "iufb" else "words"


@dataclass
class Found:
    """What one kind of fault has done so far."""

    name: str
    disturbed: int = 0
    tables: int = 0
    halfway: int = 0
    """How often some of the rows were there just then, and not all."""
    lost: int = 0
    doubled: int = 0
    wrong: int = 0
    hangs: int = 0
    longest_s: float = 0.0
    failures: list[str] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def add(self, other: Found) -> None:
        """Add what a trial has found."""
        with self.lock:
            for name in ("disturbed", "tables", "halfway", "lost", "doubled", "wrong", "hangs"):
                setattr(self, name, getattr(self, name) + getattr(other, name))
            self.longest_s = max(self.longest_s, other.longest_s)
            self.failures += other.failures

    @property
    def right(self) -> bool:
        """Whether nothing is wrong."""
        return not (self.lost or self.doubled or self.wrong or self.hangs or self.failures)


class Aim(NamedTuple):
    """When to do something to a run."""

    by_time: bool
    """Else by the changes of its folder, or the writes into it."""
    share: float
    """Of the time, or of the changes, of an undisturbed run."""
    before: bool
    """Before a write is carried out, or after it."""
    pause_s: float
    """From the moment to the deed."""
    signal: int


class Usual(NamedTuple):
    """What an undisturbed run takes."""

    seconds: float
    changes: int


def plan(seed: int, kind: str, number: int) -> list[Aim]:
    """Draw the deeds of one trial: mostly kills, and some stops in order, which leave small parts to be merged."""
    chance = random.Random(f"{seed} {kind} {number}")
    aims = []
    for attempt in range(1 + chance.choice((0, 0, 1, 1, 2))):
        # A resumed run is shorter than the first one.
        share = chance.uniform(0.0, 1.0) * 0.7**attempt
        stop = chance.random() < 0.15
        aims.append(
            Aim(
                by_time=chance.random() < 0.25,
                share=share,
                before=chance.random() < 0.5,
                pause_s=chance.choice((0.0, chance.uniform(0.0, 0.03))),
                signal=signal.SIGTERM if stop else signal.SIGKILL,
            )
        )
    return aims


class Trial:
    """One table, from the first run to the last look.

    Parameters
    ----------
    name
        Kind and number.
    folder
        Of the kind; what belongs to a trial that went well is removed.
    reference
        What the table must be; None for runs that nothing is done to.
    store
        Where the table is to be on a store.
    """

    def __init__(self, name: str, folder: Path, reference: Reference | None, store: Store | None = None):
        self.found = Found(name)
        self._name, self._folder, self._store = name, folder, store
        self.reference = reference
        self.local = folder / f"{name}.sweep"
        self.out = str(self.local) if store is None else f"s3://{BUCKET}/{name}"
        self._seen = np.zeros(0 if reference is None else reference.rows, dtype=bool)
        self._grid = folder / "grid.yaml"
        self._grid.write_text(GRID)

    def run(self, *options: str) -> Run:
        """Start a run into the table."""
        return Run(self._grid, self.out, self._folder / f"{self._name}.log", *options)

    def undisturbed(self, *options: str) -> tuple[pd.DataFrame, Usual]:
        """Run once and do nothing to it; return the table, and what it took.

        Raises
        ------
        RuntimeError
            The run failed.
        """
        begun = time.monotonic()
        never = Writes(self._store, self._name, 10**9, False) if self._store else Changes(self.local, math.inf)
        run = self.run(*options)
        meets(run, never)
        if run.end() != 0:
            raise RuntimeError(f"an undisturbed run failed: {run.complaint()}")
        seconds = time.monotonic() - begun
        changes = never.seen if isinstance(never, Changes) else never.count()
        never.done()
        frame = boulder_sweep.read(self.out)
        self._remove()
        return frame, Usual(seconds, changes)

    def watch(self, aim: Aim, usual: Usual) -> Watch:
        """Return what waits for a moment of a run about to be started."""
        if aim.by_time:
            return Time(aim.share * usual.seconds)
        number = max(1, math.ceil(aim.share * usual.changes))
        if self._store is None:
            return Changes(self.local, number)
        return Writes(self._store, self._name, number, aim.before)

    def wait(self, run: Run, allowed: tuple[int, ...] = (0,), limit_s: float = HANG_S) -> int | None:
        """Wait for the end of a run, and note if it hangs or ends in another way than allowed."""
        code = run.end(max(1.0, run.since + limit_s - time.monotonic()))
        self.found.longest_s = max(self.found.longest_s, time.monotonic() - run.since)
        if code is None:
            self.found.hangs += 1
        elif code not in allowed:
            self.found.failures.append(f"{self._name}: exit code {code}: {run.complaint()}")
        return code

    def look(self, *, finished: bool = False, others: bool = False) -> None:
        """Read the table as it is now: right rows, each once, and all that were seen before.

        Parameters
        ----------
        finished
            All rows must be there.
        others
            Also by pandas alone, which knows nothing of manifests; not while a run merges parts.
        """
        assert self.reference is not None
        readers: list[Any] = [boulder_sweep.read]
        if others and self._store is None and any(name[0] not in "_." for name in data_files(self.local)):
            readers.append(pd.read_parquet)
        for read in readers:
            own = read is boulder_sweep.read
            try:
                frame = read(self.out)
            except Exception as problem:
                nothing_yet = type(problem).__name__ == "NotASweepError" and not self._seen.any() and not finished
                if not nothing_yet:
                    self.found.failures.append(f"{self._name}: cannot be read: {type(problem).__name__}: {problem}")
                continue
            # Others miss the rows of a merged part that was killed between the removal of its sources and its naming.
            wanted = None if finished else self._seen if own else np.zeros_like(self._seen)
            tally = self.reference.tally(frame, wanted=wanted)
            if any(tally):
                self.found.failures.append(f"{self._name}: {tally._asdict()} as {read.__module__} reads it")
            self.found.lost += tally.lost
            self.found.doubled += tally.doubled
            self.found.wrong += tally.wrong
            if own and not tally.wrong:
                self._seen[frame["design_id"].to_numpy()] = True

    def is_halfway(self) -> bool:
        """Whether some rows have been seen, and not all."""
        return bool(self._seen.any() and not self._seen.all())

    def finish(self) -> Found:
        """Look for the last time, and remove what went well."""
        self.look(finished=True, others=True)
        self.found.tables = 1
        if self.found.right or self._store is not None:
            self._remove()
        return self.found

    def _remove(self) -> None:
        """Remove the table."""
        if self._store is None:
            shutil.rmtree(self.local)
        else:
            self._store.remove(self._name)


def killed(trial: Trial, aims: list[Aim], usual: Usual) -> Found:
    """Kill a run and those that resume it, let the last one finish, and read all the while."""
    for aim in aims:
        watch = trial.watch(aim, usual)
        run = trial.run("--resume")
        met = meets(run, watch)
        if met:
            time.sleep(aim.pause_s)
            run.signal(aim.signal)
        stopping = met and aim.signal == signal.SIGTERM
        if stopping:
            watch.done()  # a write that is held would hold it up
        code = trial.wait(run, STOPPED if stopping else (0, -signal.SIGKILL) if met else (0,))
        if not stopping:
            watch.done()
        trial.found.disturbed += code == -signal.SIGKILL
        trial.look(others=True)
        if code == 0:
            return trial.finish()
        trial.found.halfway += code == -signal.SIGKILL and trial.is_halfway()
    run = trial.run("--resume")
    meets(run, Time(aims[0].share * usual.seconds))
    trial.look()
    trial.wait(run)
    return trial.finish()


def without_a_worker(trial: Trial, aim: Aim, usual: Usual, cluster: Cluster, number: int) -> Found:
    """Kill or stop one worker of a cluster in the middle of a run, which must finish."""
    options = ["--backend", "dask", "--scheduler", cluster.address]
    run = trial.run(*options)
    worker = cluster.workers[number % len(cluster.workers)]
    if meets(run, Parts(trial.local, 1 + int(aim.share * TASKS))):
        time.sleep(aim.pause_s)
        if not run.has_ended():
            worker.send_signal(aim.signal)
            run.since = time.monotonic()
            trial.found.disturbed = 1
    trial.look()
    trial.found.halfway = int(trial.found.disturbed and trial.is_halfway())
    lost = aim.signal == signal.SIGKILL
    code = trial.wait(run, (0, *INTERRUPTED) if lost else (0,), HANG_S if lost else HANG_S + usual.seconds)
    if code != 0:
        trial.look(others=True)
        if code not in INTERRUPTED:  # it hung, or failed: is what it has written safe?
            options = []
        trial.wait(trial.run("--resume", *options))
    if trial.found.disturbed:
        ended(worker)  # one that is stopped would be there for the next run
    return trial.finish()


def left_over(trial: Trial, chance: random.Random, cluster: Cluster) -> Found:
    """Overwrite the table of a killed run while workers of that run, stopped meanwhile, go on with their tasks.

    The run that overwrites is held for a while where it comes to the parts that the workers had in hand, or will take
    next: both may have the same part in hand just then.
    """
    first = trial.run(*LARGE, "--backend", "dask", "--scheduler", cluster.address)
    if not meets(first, Parts(trial.local, chance.randint(1, 5))):
        trial.wait(first)
        return Found(trial.found.name)
    time.sleep(chance.uniform(0.0, 0.3))
    for worker in cluster.workers:
        worker.send_signal(signal.SIGSTOP)
    first.signal(signal.SIGKILL)
    trial.wait(first, (0, -signal.SIGKILL))
    parts = len(data_files(trial.local)) + chance.randint(1, 4)
    second = trial.run(*LARGE, *OTHER_SPEED, "--overwrite", "--jobs", "2")
    if meets(second, Parts(trial.local, parts)):
        second.signal(signal.SIGSTOP)
        trial.found.disturbed = 1
    for worker in cluster.workers:
        worker.send_signal(signal.SIGCONT)
    time.sleep(HELD_S)
    second.signal(signal.SIGCONT)
    trial.wait(second)
    return trial.finish()
