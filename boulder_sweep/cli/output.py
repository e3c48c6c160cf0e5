"""Everything that commands write to a terminal goes through here, so that text from users' files stays text."""

from __future__ import annotations

import sys

from boulder_sweep.text import printable


def show(*lines: str) -> None:
    """Write lines to stdout; what a terminal would act on is escaped, line breaks within a line as well."""
    print("\n".join(map(printable, lines)))


def say(text: str) -> None:
    """Write one or more lines to stderr; what a terminal would act on is escaped."""
    print("\n".join(map(printable, text.split("\n"))), file=sys.stderr, flush=True)
