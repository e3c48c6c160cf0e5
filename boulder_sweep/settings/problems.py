"""Problems in files that people write: where each one is, what is allowed instead, and files that cannot be read."""

from __future__ import annotations

import stat
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.locations import Location, opened, stat_of
from boulder_sweep.text import why

MAX_REPORTED = 100
"""Most problems reported at once: a longer list does not help, and a hostile file could make it endless."""
MAX_ALIKE = 5
"""Most problems reported of one column, and of lines with a wrong number of cells."""
_SHORT_WORD = 3
"""Letters of a word in which a single one makes another word."""


@dataclass(frozen=True, slots=True)
class Position:
    """A position in a file (or in a ``--set`` option): file, line and column counted from 1."""

    file: str
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        return ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake in a file, or one note on it."""

    position: Position
    message: str  # what is wrong and what is allowed
    key: str = ""  # dotted key it is about, ``boulder.height``; empty if it is about the whole file

    @property
    def file(self) -> str:
        """The file as the user named it, or the option."""
        return self.position.file

    @property
    def line(self) -> int | None:
        """The line, counted from 1; None of an option, and of a file that cannot be read."""
        return self.position.line

    @property
    def column(self) -> int | None:
        """The column, counted from 1; None where there is no line."""
        return self.position.column

    def __str__(self) -> str:
        """Format as ``file:line:column: key: message``."""
        return ": ".join(part for part in (str(self.position), self.key, self.message) if part)


class SettingsError(BoulderSweepError):
    """The settings, or a part of them, cannot be used.

    Attributes
    ----------
    found : list of Problem
        Everything that was found, in the order in which it was.
    problems : list of Problem
        Every mistake once, in the order of the file; of very many the first `MAX_REPORTED`, and how many more there
        are.
    """

    def __init__(self, found: Iterable[Problem]) -> None:
        self.found = list(found)
        self.problems = _in_order(self.found)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def user_message(self) -> str:
        """Return the problems, one a line; each begins with its position in the file."""
        return str(self)

    def __reduce__(self) -> tuple[type[SettingsError], tuple[list[Problem]]]:
        """Pickle by the problems, so that the error can pass between processes."""
        return type(self), (self.found,)


def _in_order(found: list[Problem]) -> list[Problem]:
    """Return the first problems in the order of their positions, each file and option by itself."""
    each = list(dict.fromkeys(found))
    kept, dropped = each[:MAX_REPORTED], len(each) - MAX_REPORTED
    files = list(dict.fromkeys(problem.file for problem in kept))
    ordered = sorted(kept, key=lambda one: (files.index(one.file), one.line or 0, one.column or 0))
    if dropped > 0:
        ordered.append(Problem(Position(ordered[-1].file), f"and {dropped} more problems"))
    return ordered


class Problems(list[Problem]):
    """Problems of a file or of an entry, collected so that all are reported at once."""

    @property
    def full(self) -> bool:
        """Whether further problems would only be counted in a report."""
        return len(self) >= MAX_REPORTED

    def add(self, position: Position, message: str, key: str = "") -> None:
        """Add one problem to what was found."""
        self.append(Problem(position, message, key))

    @contextmanager
    def under(self, key: str = "", named: Position | None = None) -> Iterator[None]:
        """Take the problems of a part; what follows the block is read all the same.

        Where the part has a `key`, a key within it becomes part of the message. Where it is a file of its own, problems
        of the whole of it are reported at the position at which it is `named`.
        """
        try:
            yield
        except SettingsError as error:
            for one in error.found:
                position, message = one.position, one.message
                if named is not None and position.line is None and position.file != named.file:
                    position, message = named, f"{position.file}: {message}"
                within = f"{one.key}: " if key and one.key else ""
                self.add(position, within + message, key or one.key)

    def raise_if_any(self) -> None:
        """Raise SettingsError if there is a problem."""
        if self:
            raise SettingsError(self)

    def raise_unlike(self) -> None:
        """Raise SettingsError if there is a problem; the same one in many values is reported where it comes first."""
        Problems({(one.key, one.message): one for one in self[::-1]}.values()).raise_if_any()


def wrong(position: Position, message: str) -> SettingsError:
    """Return the error for an entry with one mistake."""
    return SettingsError([Problem(position, message)])


def refuse(file: str, message: str, line: int | None = None, column: int | None = None) -> SettingsError:
    """Return the error for a file that cannot be used at all."""
    return wrong(Position(file, line, column), message)


def check_regular_file(path: Location, max_bytes: int, what: str) -> None:
    """Raise SettingsError for anything but a regular file of at most `max_bytes`, before a byte is read.

    `what` is advice for a file that is too large.
    """
    label = str(path)
    try:
        status = stat_of(path)
    except FileNotFoundError:
        raise refuse(label, "there is no such file") from None
    except (OSError, ValueError) as error:
        reason = why(error) if isinstance(error, OSError) else error
        raise refuse(label, f"cannot be opened ({reason})") from None
    if stat.S_ISDIR(status.st_mode):
        raise refuse(label, "is a directory; a file is needed")
    if not stat.S_ISREG(status.st_mode):
        raise refuse(label, "is not a regular file (pipes and devices are not read)")
    if status.st_size > max_bytes:
        raise refuse(label, f"has {status.st_size / 1e6:.1f} MB; at most {max_bytes / 1e6:g} MB is read. {what}")


def content_of(path: Location, max_bytes: int) -> bytes:
    """Return the content of a file; raise SettingsError where it has grown too large since `check_regular_file`."""
    try:
        with opened(path) as stream:
            data = stream.read(max_bytes + 1)
    except OSError as error:
        raise refuse(str(path), f"cannot be read ({why(error)})") from None
    if len(data) > max_bytes:
        raise refuse(str(path), f"is larger than {max_bytes / 1e6:g} MB")
    return data


class Alike:
    """Reports problems of one kind up to a limit, then counts them."""

    def __init__(self, problems: Problems) -> None:
        self.problems = problems
        self.counts: Counter[tuple[str, str]] = Counter()
        self.last: dict[tuple[str, str], Position] = {}

    def add(self, kind: str, position: Position, message: str, key: str = "", most: int = MAX_ALIKE) -> None:
        """Report a problem, or count it if there were enough of its kind and key."""
        self.counts[kind, key] += 1
        self.last[kind, key] = Position(position.file, position.line)
        if self.counts[kind, key] <= most:
            self.problems.add(position, message, key)

    def finish(self) -> None:
        """Say how many more there are."""
        for (kind, key), count in self.counts.items():
            if kind and count > MAX_ALIKE:
                self.problems.add(self.last[kind, key], f"and {count - MAX_ALIKE} more {kind} like these", key)


def shorten(text: str, limit: int = 60) -> str:
    """Return text that can be quoted in a message: one line, printable, not longer than `limit`."""
    head = text[: 10 * limit]  # of a text of a hundred thousand characters, too
    flat = "".join(char if char.isprintable() else "?" for char in " ".join(head.split()))
    return flat if len(flat) <= limit and len(head) == len(text) else flat[: limit - 3] + "..."


def nearest(word: str, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """Return the known word nearest to `word`, None if none is as similar as `cutoff` (1 for the same word).

    A number in a word, and every letter of a short one, is its meaning: ``n60`` is not ``n1_60``, nor ``ax`` ``x``.
    """
    # difflib takes a few milliseconds to import and is needed for mistakes only.
    from difflib import get_close_matches

    candidates = {name.lower(): name for name in known}
    near = get_close_matches(word.lower()[:80], candidates, n=3, cutoff=cutoff)
    return next((candidates[one] for one in near if _may_be_meant(word.lower(), one)), None)


def _may_be_meant(word: str, known: str) -> bool:
    """Return whether a word may be a slip of a known one, both in lower case."""
    letters = [{*filter(str.isalnum, one)} for one in (word, known)]
    numbers = ["".join(filter(str.isdigit, one)) for one in (word, known)]
    is_short = max(len(word), len(known)) <= _SHORT_WORD
    return numbers[0] == numbers[1] and (letters[0] == letters[1] or not is_short)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean ...?"`` for the known word nearest to `word`, or an empty string."""
    near = nearest(word, known)
    return f"; did you mean {near}?" if near else ""


def unknown_word(word: str, what: str, known: Collection[str]) -> str:
    """Say that a word is not `what`; list the known ones, and name the nearest."""
    return f"'{shorten(word)}' is not {what} ({', '.join(known)}){did_you_mean(word, known)}"
