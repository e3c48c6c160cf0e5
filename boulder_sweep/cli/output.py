"""What commands write to a terminal goes through here, so that text from users' files stays text.

Lines of results go to stdout, notes to stderr; so does, while a command works, a bar or, elsewhere than on a terminal,
an occasional line.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from boulder_sweep.text import printable

if TYPE_CHECKING:
    from collections.abc import Callable

    from boulder_sweep.runner.progress import Progress

PLAIN_EVERY_S = 10.0
"""Time between two lines of progress where there is no terminal."""


def ready_streams() -> None:
    """Open stdout and stderr where they are closed; characters that the encoding of stdout lacks become ``?``."""
    # A file opened later would take the number of a closed stream, and what is printed would get into it.
    if sys.stdout is None:
        sys.stdout = _nowhere()
    if sys.stderr is None:
        sys.stderr = _nowhere()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # one for one, so that tables keep their columns


def _nowhere() -> TextIO:
    """Open a file that keeps nothing."""
    return Path(os.devnull).open("w", encoding="utf-8")


def show(*lines: str) -> None:
    """Write lines to stdout; what a terminal would act on is escaped, line breaks within a line as well."""
    print("\n".join(map(printable, lines)))


def say(text: str) -> None:
    """Write one or more lines to stderr; what a terminal would act on is escaped, and long lines are wrapped for it.

    Where stderr cannot be written, nothing more is said: the exit code stands.
    """
    lines: Iterable[str] = map(printable, text.split("\n"))
    width = _columns()
    if width:
        wrapper = textwrap.TextWrapper(width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
        lines = (part for line in lines for part in wrapper.wrap(line) or [""])
    try:
        print("\n".join(lines), file=sys.stderr, flush=True)
    except OSError:
        # What is left in the buffer would be tried again at the end of the process, and change its exit code.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def say_written(quiet: bool, *files: object) -> None:
    """Name files that were written on stderr, unless quiet; None is one that was not asked for."""
    for file in files:
        if file is not None and not quiet:
            say(f"written  {file}")


def _columns() -> int | None:
    """Return the width of the terminal that stderr is; None for a file or a pipe, where lines stay whole."""
    return shutil.get_terminal_size().columns if sys.stderr.isatty() else None


def wrap(text: str, width: int = 80) -> list[str]:
    """Return a sentence as lines for a terminal of 80 columns."""
    return textwrap.wrap(text, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


@contextmanager
def announced(say_so: Callable[[str], None], resume: Callable[[], None]) -> Iterator[None]:
    """Say, once, that kernels are compiled, if any are.

    `say_so` shows a line before the first kernel is compiled; `resume` is called whenever one has been compiled.
    """
    from boulder_kernels import _jit
    from boulder_kernels._jit import CACHE_FOLDER

    said = False

    @contextmanager
    def compiling(_: str) -> Iterator[None]:
        nonlocal said
        if not said:
            said = True
            say_so("compiling kernels; later commands load them" if CACHE_FOLDER else "compiling kernels")
        try:
            yield
        finally:
            resume()

    before, _jit.announce = _jit.announce, compiling
    try:
        yield
    finally:
        _jit.announce = before


@contextmanager
def working(quiet: bool, doing: str = "simulating", of: str = "designs") -> Iterator[Callable[[int, int], None] | None]:
    """Give a function that shows how many of how many are done, called with 0 once the kernels are compiled.

    It is None where nothing is to be shown (`quiet`). `doing` stands beside the bar, and `of` is what is counted.
    """
    with progress(quiet, doing, of) as shown:
        if shown is None:
            yield None
            return
        from boulder_sweep.runner.progress import Progress

        begun = time.monotonic()

        def update(done: int, total: int) -> None:
            nonlocal begun
            now = time.monotonic()
            if done == 0:  # what went before was compiling, and does not count as simulation
                begun = now
                if not sys.stderr.isatty():
                    return
            shown(Progress(0, done, total, now - begun))

        yield update


@contextmanager
def progress(
    quiet: bool, doing: str = "simulating", of: str = "designs"
) -> Iterator[Callable[[Progress], None] | None]:
    """Give a function that shows progress: a bar on a terminal, occasional lines elsewhere; None if quiet.

    Nothing is compiled here: commands refuse what they must before they compile, and act on signals while they do.
    `doing` and `of`: see `working`.
    """
    if quiet:
        yield None
        return
    if sys.stderr.isatty():
        with _bar(doing) as show:
            yield show
    else:
        with announced(say, lambda: None):
            yield _plain_lines(of)


def _plain_lines(of: str) -> Callable[[Progress], None]:
    """Return what writes a plain line every `PLAIN_EVERY_S`: for logs of batch jobs."""
    last = time.monotonic()

    def show(now: Progress) -> None:
        nonlocal last
        if time.monotonic() - last >= PLAIN_EVERY_S:
            last = time.monotonic()
            share, speed = now.rows_done / max(now.rows, 1), now.rows_per_second
            say(f"{share:6.1%}  {now.rows_done:,} of {now.rows:,} {of}, {speed:,.0f} per second")

    return show


@contextmanager
def _bar(doing: str) -> Iterator[Callable[[Progress], None]]:
    """Show a bar; give the function that shows progress."""
    # rich is for terminals only. It honours NO_COLOR by itself.
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    words, numbers = TextColumn("{task.description}"), TextColumn("{task.fields[numbers]}")
    times = TimeElapsedColumn(), numbers, TextColumn("left:"), TimeRemainingColumn()  # at the speed of the last 30 s
    with Bars(words, BarColumn(), *times, console=Console(stderr=True), transient=True) as bars:
        # Before the first block is done there is no progress to show; the bar pulses.
        task = bars.add_task(printable(doing), total=None, numbers="")

        def show(now: Progress) -> None:
            numbers = f"{now.rows_done:,} of {now.rows:,}, {now.rows_per_second:,.0f}/s"
            bars.update(task, total=now.rows, completed=now.rows_done, numbers=numbers)

        def describe(words: str = doing) -> None:
            bars.update(task, description=printable(words))

        with announced(describe, describe):
            yield show
