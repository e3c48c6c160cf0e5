"""What the command line shows on stderr while it works: a bar on a terminal, occasional lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from boulder_sweep.cli.output import say
from boulder_sweep.text import duration_text, printable

if TYPE_CHECKING:
    from collections.abc import Callable

    from boulder_sweep.runner.summary import Progress
    from boulder_sweep.settings import Sweep

PLAIN_EVERY_S = 10.0
"""Time between two lines of progress where there is no terminal."""
COMPILED = {
    "table": ("lanes.run_lanes", "f81,boulder_kernels.lanes:Queue", 15.0),
    "design": ("impact.simulate", "", 20.0),
    "elements-table": ("table.run_rows", "f82,n,n,n,n", 20.0),
    "springs-table": ("table.run_rows", "f82,n,n,n,f82", 20.0),
    "springs-design": ("impact.simulate", "SecondSpring", 20.0),
    "layers-table": ("lanes.run_lanes", "LayeredLanes", 20.0),
    "layers-design": ("impact.simulate", "SoilProfile", 30.0),
    "tapers-table": ("lanes.run_lanes", "TaperedLanes", 20.0),
    "tapers-design": ("impact.simulate", "OutlinedPieces", 30.0),
    "outlines-table": ("lanes.run_lanes", "OutlinedLanes", 40.0),
    "outlines-design": ("impact.simulate", "OutlinedPieces", 30.0),
    "plastic-table": ("impact.simulate_motion", "Memory", 30.0),
    "plastic-design": ("impact.simulate_motion", "Memory", 30.0),
}
"""Kernels for tables, and for one design over time: the one that takes longest to compile, what tells this kind of
problem from others among the types that it is compiled for (`boulder_kernels._arguments.flatten`), and seconds where
unknown."""


def kernels_for(sweep: Sweep, of: Literal["table", "design"] = "table") -> str:
    """Return which of the kernels above a sweep needs, for tables or for one design over time."""
    from boulder_sweep.designs import SECOND_SPRING
    from boulder_sweep.soils import is_layered

    if sweep.model.unloading != "elastic":
        return f"plastic-{of}"
    if not sweep.model.shape.is_box:
        layered = is_layered(sweep.model.resistance, sweep.model.ground, sweep.model.shape)
        return f"outlines-{of}" if layered else f"tapers-{of}"
    if not sweep.model.ground.is_proportional:
        return f"layers-{of}"
    if SECOND_SPRING in sweep.plan.columns:
        return f"springs-{of}"
    return f"elements-{of}" if sweep.model.soil_elements and of == "table" else of


def cold_start(kernels: str | None) -> str | None:
    """Return what to say before kernels are compiled; None if their compiled code is there.

    Parameters
    ----------
    kernels
        Name in `COMPILED`; None where no kernel is called.
    """
    if kernels is None:
        return None
    from boulder_kernels._ahead import is_compiled
    from boulder_kernels._cache import CACHE_FOLDER

    kernel, types, seconds = COMPILED[kernels]
    if is_compiled(kernel, types):
        return None
    if CACHE_FOLDER is not None:
        with suppress(OSError, ValueError):  # no earlier compilation on this machine
            seconds = float(_seconds_file(kernels).read_text())
    return f"compiling kernels, once on this machine, about {max(seconds, 1.0):.0f} s"


def _seconds_file(kernels: str) -> Path:
    """Return the file with the seconds that the last compilation took, of whatever version of the kernels."""
    from boulder_kernels._cache import CACHE_FOLDER

    return Path(CACHE_FOLDER or "").parent / f"compilation-of-{kernels}-kernels-in-seconds"


@contextmanager
def working(
    quiet: bool, kernels: str | None = "table", doing: str = "simulating", of: str = "designs"
) -> Iterator[Callable[[int, int], None] | None]:
    """Give a function that shows how many of how many are done, called with 0 once the kernels are compiled.

    It is None where nothing is to be shown.

    Parameters
    ----------
    quiet
        Show nothing.
    kernels
        What the work begins with: where these must be compiled, this is said, with a moving bar on a terminal.
    doing, of
        Word beside the bar, and what is counted.
    """
    with progress(quiet, Notes(), kernels, doing, of) as shown:
        if shown is None:
            yield None
            return
        from boulder_sweep.runner.summary import Progress

        begun = time.monotonic()

        def update(done: int, total: int) -> None:
            nonlocal begun
            now = time.monotonic()
            if done == 0:  # what went before was compiling, and does not count as simulation
                begun = now
                if not sys.stderr.isatty():
                    return
            seconds = max(now - begun, 1e-9)
            left = seconds / done * (total - done) if done else None
            shown(Progress(done, total, seconds, done / seconds, left))

        yield update


@contextmanager
def progress(
    quiet: bool, notes: Notes, kernels: str | None = "table", doing: str = "simulating", of: str = "designs"
) -> Iterator[Callable[[Progress], None] | None]:
    """Give a function that shows progress and notes: a bar on a terminal, occasional lines elsewhere.

    Nothing is compiled here: commands refuse what they must before they compile, and act on signals while they do.

    Parameters
    ----------
    quiet
        Show nothing.
    notes
        What was shown already.
    kernels, doing, of
        See `working`.
    """
    if quiet:
        yield None
        return
    cold, begun = cold_start(kernels), time.monotonic()
    if sys.stderr.isatty():
        with _bar(notes, cold, doing) as show:
            yield show
    else:
        if cold:
            say(cold)
        yield _PlainLines(notes, of)
    if cold and kernels is not None:
        from boulder_sweep.judge.evaluation import warm_up_s

        seconds = time.monotonic() - begun if kernels.endswith("design") else warm_up_s()
        if seconds is not None:
            _remember(kernels, seconds)


def _remember(kernels: str, seconds: float) -> None:
    """Keep how long a compilation took, for the next version of the kernels."""
    with suppress(OSError):
        _seconds_file(kernels).write_text(f"{seconds:.1f}")


class Notes:
    """The notes of a run that were shown already."""

    def __init__(self) -> None:
        self._shown = 0

    def new(self, notes: Sequence[str]) -> Sequence[str]:
        """Return the notes that were not shown yet; they count as shown now."""
        fresh, self._shown = notes[self._shown :], len(notes)
        return fresh


class _PlainLines:
    """Writes a plain line every `PLAIN_EVERY_S`: for logs of batch jobs."""

    def __init__(self, notes: Notes, of: str) -> None:
        self.last = time.monotonic()
        self._notes, self._of = notes, of

    def __call__(self, now: Progress) -> None:
        for note in self._notes.new(now.notes):
            say(f"note: {note}")
        if time.monotonic() - self.last < PLAIN_EVERY_S:
            return
        self.last = time.monotonic()
        left = "" if now.seconds_left is None else f", {duration_text(now.seconds_left)} left"
        say(
            f"{now.rows_done / max(now.rows, 1):6.1%}  {now.rows_done:,} of {now.rows:,} {self._of}, "
            f"{now.rows_per_second:,.0f} per second{left}"
        )


@contextmanager
def _bar(notes: Notes, cold: str | None, doing: str) -> Iterator[Callable[[Progress], None]]:
    """Show a bar; give the function that shows progress."""
    # rich is for terminals only. It honours NO_COLOR by itself.
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.fields[numbers]}"))
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
        # Before the first block is done there is no progress to show; the bar pulses.
        task = bars.add_task(printable(cold or doing), total=None, numbers="")

        def show(now: Progress) -> None:
            for note in notes.new(now.notes):
                bars.console.print(f"note: {printable(note)}", markup=False, highlight=False)
            left = "" if now.seconds_left is None else f", {duration_text(now.seconds_left)} left"
            numbers = f"{now.rows_done:,} of {now.rows:,}, {now.rows_per_second:,.0f}/s{left}"
            bars.update(task, description=doing, total=now.rows, completed=now.rows_done, numbers=numbers)

        yield show
