"""Numbers, progress and problems as short text, and text of users' files made harmless where it is shown."""

from __future__ import annotations

import errno
import json
import math
import os
import re
from collections.abc import Callable
from typing import Any

_LONGEST_LINE = 200
_WORD = re.compile(r"[A-Z][A-Z0-9]*(?![a-z])|[A-Z]?[a-z0-9]+")
"""One word of a name such as OSError or ClientError."""
ProgressCallback = Callable[[int, int], None]
"""Called with how much is done, and of how much."""
NO_SPACE = (errno.ENOSPC, errno.EDQUOT)
NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"


def install(extra: str) -> str:
    """Return how to install what a command lacks; no package index has boulder-sweep, a clone has everything."""
    return f"in a clone of boulder-sweep, pip install '.[{extra}]'"


def size_text(size: float) -> str:
    """Format a number of bytes: ``512 bytes``, ``1.5 MB``."""
    for unit in ("bytes", "kB", "MB", "GB", "TB"):
        if size < 1000:
            return f"{size:.0f} bytes" if unit == "bytes" else f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:,.0f} PB"


def duration_text(seconds: float) -> str:
    """Format a time: ``0.8 s``, ``2 min 05 s``, ``3 h 10 min``."""
    if seconds < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    return f"{minutes // 60:,} h {minutes % 60:02d} min"


def counted(count: int, noun: str) -> str:
    """Return a number with its noun: ``1 design``, ``2,736 designs``."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def chance_text(chance: float) -> str:
    """Format a probability: three decimals, or enough for two digits of it and of its complement: ``0.0012``."""
    rarer = min(chance, 1.0 - chance)
    if rarer < 1e-12:
        return f"{chance:.0f}"
    return f"{chance:.{max(3, 1 - math.floor(math.log10(rarer)))}f}"


def printable(text: str) -> str:
    """Escape what a terminal or a log would act on: control characters, line breaks, invisible marks of direction."""
    return "".join(
        one if one.isprintable() or one == NO_BREAK_SPACE else one.encode("unicode_escape").decode("ascii")
        for one in text
    )


def script_data(data: Any) -> str:
    """Write plain data as JSON that stays data inside a script element of an HTML page, whatever its texts hold."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def one_line(problem: BaseException) -> str:
    """Describe an exception in one line of bounded length: ``OS error: ...``, ``endpoint connection error: ...``."""
    kind = " ".join(word if word.isupper() else word.lower() for word in _WORD.findall(type(problem).__name__))
    words = " ".join(str(problem).split())
    text = f"{kind}: {words}" if words else kind
    return text if len(text) <= _LONGEST_LINE else f"{text[: _LONGEST_LINE - 3]}..."


def why(problem: OSError) -> str:
    """Say why a file cannot be written, in the words of the system, and what helps where there is no space."""
    unknown = not problem.errno or problem.errno == errno.EIO  # of a store; its own words tell more
    words = problem.strerror or str(problem) if unknown else os.strerror(problem.errno or 0)
    return f"{words}; free some space and try again" if problem.errno in NO_SPACE else words
