"""The kernels against those before their last change, in one process and in turn: a step, an event, a design.

Git has the earlier sources. They are imported under another name, so both are compiled by the same compiler for the
same processor, and whatever else the machine does hits both alike.
"""

from __future__ import annotations

import importlib
import io
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import boulder_kernels as bk
from boulder_kernels import DesignTable

from .designs import HORIZON, ROTATION_LIMIT, sample
from .report import FOLDER
from .timing import cpu_seconds

ROOT = FOLDER.parent
SOURCES = "kernels/boulder_kernels"
NAME = "earlier_boulder_kernels"
LONG_S, SHORT_S = 0.012, 0.002
"""The steps from whose times the cost of one step and that of all else of a design are told apart."""
ROWS = 8192
"""So many that calling a kernel, slower for one of two packages alike, does not count."""
ROUNDS = 15


class Costs(NamedTuple):
    """CPU times of a design, in any unit, or their ratios."""

    step: float
    """Of its steps, each as likely as another to be attempted and accepted."""
    events: float
    """Of the rest: its start, events, peaks and end."""
    design: float
    """Of all, at `LONG_S`."""


def commit_before(root: Path = ROOT) -> str | None:
    """Find the commit before the kernels' last change: the newest with other kernels than the files here.

    Returns
    -------
    str or None
        None where git does not know: no repository, no git, or a history cut short.
    """
    try:
        changed = _git(root, "status", "--porcelain", "--", SOURCES)
        last = "HEAD" if changed else f"{_git(root, 'log', '-1', '--format=%H', '--', SOURCES)}^"
        commit = _git(root, "rev-parse", "--verify", "--quiet", last)
        return commit if _git(root, "ls-tree", commit, SOURCES) else None
    except (OSError, subprocess.CalledProcessError):
        return None


def kernels_of(commit: str, folder: Path, root: Path = ROOT) -> Any | None:
    """Import and compile the kernels of a commit, their sources written into a folder; None if called differently."""
    archive = subprocess.run(
        ["git", "-C", str(root), "archive", "--format=zip", commit, SOURCES], check=True, capture_output=True
    ).stdout
    with zipfile.ZipFile(io.BytesIO(archive)) as sources:
        sources.extractall(folder)
    (folder / SOURCES).rename(folder / NAME)
    sys.path.insert(0, str(folder))
    try:
        kernels = importlib.import_module(NAME)
        _simulation(kernels, sample(1), LONG_S)()
    except (AttributeError, TypeError):
        return None
    finally:
        sys.path.remove(str(folder))
    return kernels


def ratios_to(earlier: Any, rounds: int = ROUNDS) -> Costs:
    """Time the kernels in turn with others; the ratios of the costs.

    Parameters
    ----------
    earlier
        A package with the same interface.
    rounds
        How often each is timed.

    Returns
    -------
    Costs
        Medians of the ratios of the rounds, or the ratios of the least times where they are less: what other programs
        take from the caches lengthens either.
    """
    designs = sample(ROWS)
    works = [_simulation(kernels, designs, step) for kernels in (bk, earlier) for step in (LONG_S, SHORT_S)]
    for work in works:
        work()
    times = []
    for place in range(rounds):
        order = range(len(works)) if place % 2 else range(len(works) - 1, -1, -1)
        taken = {each: cpu_seconds(works[each]) for each in order}
        times.append([taken[each] for each in range(len(works))])
    own, other = _costs(*(min(values) for values in zip(*times, strict=True)))
    of_rounds = [_costs(*taken) for taken in times]
    medians = (median(now[i] / before[i] for now, before in of_rounds) for i in range(len(Costs._fields)))
    return Costs(*(min(found, a / b) for found, a, b in zip(medians, own, other, strict=True)))


def _simulation(kernels: Any, designs: DesignTable, step_s: float) -> Callable[[], object]:
    table = kernels.DesignTable(**designs._asdict())
    control, readings = kernels.Control(step_s, HORIZON, ROTATION_LIMIT, 0, False), kernels.corrected()
    return lambda: kernels.simulate_table(table, readings, control)


def _costs(long: float, short: float, long_before: float, short_before: float) -> tuple[Costs, Costs]:
    """Costs now and before from the times with the long and the short step, which have steps in proportion to 1/h."""
    found = []
    for at_long, at_short in ((long, short), (long_before, short_before)):
        of_steps = (at_short - at_long) * SHORT_S / (LONG_S - SHORT_S)
        found.append(Costs(of_steps, at_long - of_steps, at_long))
    return found[0], found[1]


def _git(root: Path, *words: str) -> str:
    return subprocess.run(
        ["git", "-C", str(root), *words], check=True, capture_output=True, text=True, encoding="utf-8"
    ).stdout.strip()
