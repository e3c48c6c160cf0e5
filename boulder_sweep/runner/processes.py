"""The side of a worker process: what it is given once, what it does with a block, how it hands over the result.

Tasks and answers that travel through pipes are kept short. A pipe passes a few hundred bytes whole or not at
all, so a worker that dies in the middle of its work leaves nothing half-said for which the others would wait
for ever. What is large goes another way: the settings once, when a worker begins, and judged rows through a
file in memory that only this run can see.
"""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from boulder_sweep.judge.judged import Judged

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock

MakeBlock = Callable[[int, int], "DesignBlock"]
Evaluate = Callable[["DesignBlock"], Judged]
_MEMORY = Path("/dev/shm")
_PREFIX = "boulder-sweep-"
_ABANDONED_AFTER_S = 600.0
_LOOK_FOR_PARENT_S = 0.2
_LONGEST_TEXT = 200


class Failure(NamedTuple):
    """A block raised."""

    text: str


class NoRoom(NamedTuple):
    """A worker could not hand over its result."""

    text: str


class Parcel(NamedTuple):
    """A result that lies ready in a file."""

    path: str


Outcome = Judged | Failure | NoRoom | Parcel | None
"""What becomes of a block; None where nobody waits for it any more."""


@dataclass(frozen=True, eq=False)
class Work:
    """What the workers of a run do.

    Parameters
    ----------
    evaluate
        What to do with a block.
    make_block
        Gives the block of some rows.
    exchange
        Folder for results of worker processes, into which only this user can look; None for other workers.
    """

    evaluate: Evaluate
    make_block: MakeBlock
    exchange: Path | None


def new_exchange() -> Path:
    """Make a folder for results, in memory where there is such a place.

    Folders left by runs that were killed together with all their workers are removed.
    """
    place = _MEMORY if os.access(_MEMORY, os.W_OK) else Path(tempfile.gettempdir())
    for folder in place.glob(f"{_PREFIX}*"):
        if _is_abandoned(folder):
            shutil.rmtree(folder, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-", dir=place))


def _is_abandoned(folder: Path) -> bool:
    """Whether the run that made a folder for results has gone, for some time and on this machine."""
    owner = folder.name.removeprefix(_PREFIX).partition("-")[0]
    try:
        old = time.time() - folder.stat().st_mtime > _ABANDONED_AFTER_S
        return old and folder.owner() == Path("/proc/self").owner() and not Path(f"/proc/{int(owner)}").exists()
    except (OSError, ValueError, KeyError):
        return False


_work: Work | None = None


def begin_worker(parent: int, work: Work) -> None:
    """Begin as a worker process: remember the work, leave signals to the parent, end when the parent ends."""
    global _work
    _work = work
    # Ctrl-C and batch systems signal all processes of a job. The parent decides then, and kills its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_FOR_PARENT_S)
        if work.exchange is not None:
            shutil.rmtree(work.exchange, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=watch, name="parent watch", daemon=True).start()


def compute_here(start: int, stop: int) -> Parcel | Failure | NoRoom:
    """Compute some rows in a worker process."""
    work = _work
    if work is None or work.exchange is None:
        return NoRoom("a worker process was not told what to do")
    outcome = compute(work.evaluate, work.make_block, start, stop)
    if isinstance(outcome, Failure):
        return outcome
    path = work.exchange / f"{start}-{stop}-{os.getpid()}"
    try:
        with path.open("wb") as file:
            pickle.dump(outcome, file, protocol=pickle.HIGHEST_PROTOCOL)
    except OSError as problem:
        return NoRoom(f"{work.exchange}: {problem.strerror}")
    return Parcel(str(path))


def opened(parcel: Parcel) -> Judged:
    """Take a result out of its file. Only files that a worker of this very run has just written come here."""
    path = Path(parcel.path)
    with path.open("rb") as file:
        judged = pickle.load(file)
    path.unlink()
    return judged


def compute(evaluate: Evaluate, make_block: MakeBlock, start: int, stop: int) -> Judged | Failure:
    """Compute some rows; a mistake is returned, not raised."""
    try:
        return evaluate(make_block(start, stop))
    except Exception as problem:
        return Failure(one_line(problem))


def one_line(problem: BaseException) -> str:
    """Return one line for a problem."""
    words = " ".join(str(problem).split())
    text = f"{type(problem).__name__}: {words}" if words else type(problem).__name__
    return text if len(text) <= _LONGEST_TEXT else f"{text[: _LONGEST_TEXT - 3]}..."
