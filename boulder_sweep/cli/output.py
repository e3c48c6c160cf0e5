"""Everything that commands write to a terminal goes through here, so that text from users' files stays text."""

from __future__ import annotations

import io
import os
import shutil
import sys
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

from boulder_sweep.text import printable


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


def _columns() -> int | None:
    """Return the width of the terminal that stderr is; None for a file or a pipe, where lines stay whole."""
    return shutil.get_terminal_size().columns if sys.stderr.isatty() else None
