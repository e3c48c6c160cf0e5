"""Everything that commands write to a terminal goes through here, so that text from users' files stays text."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Iterable

from boulder_sweep.text import printable


def show(*lines: str) -> None:
    """Write lines to stdout; what a terminal would act on is escaped, line breaks within a line as well."""
    print("\n".join(map(printable, lines)))


def say(text: str) -> None:
    """Write one or more lines to stderr; what a terminal would act on is escaped, and long lines are wrapped for it."""
    lines: Iterable[str] = map(printable, text.split("\n"))
    width = _columns()
    if width:
        wrapper = textwrap.TextWrapper(width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
        lines = (part for line in lines for part in wrapper.wrap(line) or [""])
    print("\n".join(lines), file=sys.stderr, flush=True)


def _columns() -> int | None:
    """Return the width of the terminal that stderr is; None for a file or a pipe, where lines stay whole."""
    return shutil.get_terminal_size().columns if sys.stderr.isatty() else None
