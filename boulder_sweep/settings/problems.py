"""Problems in files that people write: where each one is, what is allowed instead, and files that cannot be read."""

from __future__ import annotations

import stat
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.locations import Location, stat_of

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
    """One mistake in a settings file, or one note on it.

    Attributes
    ----------
    file : str
        The file as the user named it, or the ``--set`` option.
    line, column : int or None
        Position counted from 1, None where there is none (a file that cannot be read, a ``--set`` option).
    key : str
        Dotted key it is about, for example ``boulder.height``; empty if it is about the whole file.
    message : str
        What is wrong and what is allowed.
    """

    file: str
    line: int | None
    column: int | None
    key: str
    message: str

    def __str__(self) -> str:
        """Format as ``file:line:column: key: message``."""
        head = str(Position(self.file, self.line, self.column))
        return ": ".join(part for part in (head, self.key, self.message) if part)


class SettingsError(BoulderSweepError):
    """The settings are not valid.

    Attributes
    ----------
    problems : list of Problem
        Every mistake that was found, in the order of the file.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def user_message(self) -> str:
        """Return the problems, one a line; each begins with its position in the file."""
        return str(self)

    def __reduce__(self) -> tuple[type[SettingsError], tuple[list[Problem]]]:
        """Pickle by the problems, so that the error can pass between processes."""
        return type(self), (self.problems,)


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake within an entry."""

    position: Position
    message: str


class LeafError(Exception):
    """An entry that cannot be used, with every mistake in it."""

    def __init__(self, *mistakes: Mistake) -> None:
        super().__init__("; ".join(mistake.message for mistake in mistakes))
        self.mistakes = mistakes


class Mistakes(list[Mistake]):
    """Mistakes of an entry, collected so that all are reported at once.

    ``with mistakes:`` takes the mistakes of a part of the entry; what follows the block is read all the same.
    """

    def add(self, position: Position, message: str) -> None:
        """Add one mistake to the list."""
        self.append(Mistake(position, message))

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> bool:
        if isinstance(error, LeafError):
            self.extend(error.mistakes)
        return isinstance(error, LeafError)

    def raise_if_any(self) -> None:
        """Raise LeafError if there is a mistake."""
        if self:
            raise LeafError(*self)

    def raise_unlike(self) -> None:
        """Raise LeafError if there is a mistake; the same one in many values is reported once, where it comes first."""
        Mistakes({mistake.message: mistake for mistake in self[::-1]}.values()).raise_if_any()


def wrong(position: Position, message: str) -> LeafError:
    """Return the error for an entry with one mistake."""
    return LeafError(Mistake(position, message))


def refuse(file: str, message: str, line: int | None = None, column: int | None = None) -> SettingsError:
    """Return the error for a file that cannot be used at all."""
    return SettingsError([Problem(file, line, column, "", message)])


def check_regular_file(path: Location, max_bytes: int, what: str) -> None:
    """Refuse anything but a regular file of at most `max_bytes`, before a byte is read.

    Parameters
    ----------
    path : Path or UPath
        The file.
    max_bytes : int
        Largest size admitted.
    what : str
        Advice for a file that is too large.

    Raises
    ------
    SettingsError
        Missing, a directory, a device or pipe, not readable, or too large.
    """
    label = str(path)
    try:
        status = stat_of(path)
    except FileNotFoundError:
        raise refuse(label, "there is no such file") from None
    except (OSError, ValueError) as error:
        raise refuse(label, f"cannot be opened ({reason_of(error)})") from None
    if stat.S_ISDIR(status.st_mode):
        raise refuse(label, "is a directory; a file is needed")
    if not stat.S_ISREG(status.st_mode):
        raise refuse(label, "is not a regular file (pipes and devices are not read)")
    if status.st_size > max_bytes:
        raise refuse(label, f"has {status.st_size / 1e6:.1f} MB; at most {max_bytes / 1e6:g} MB is read. {what}")


def reason_of(error: Exception) -> str:
    """Return why a file cannot be opened or read, without its name."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


@dataclass
class ProblemList:
    """Collects problems; counts those beyond `MAX_REPORTED` and keeps none of them."""

    problems: list[Problem] = field(default_factory=list)
    dropped: int = 0

    @property
    def full(self) -> bool:
        """Whether further problems are only counted."""
        return len(self.problems) >= MAX_REPORTED

    def add(self, position: Position, key: str, message: str) -> None:
        """Add one problem, once."""
        if self.full:
            self.dropped += 1
            return
        problem = Problem(position.file, position.line, position.column, key, message)
        if problem not in self.problems:
            self.problems.append(problem)

    def __bool__(self) -> bool:
        return bool(self.problems)

    def in_order(self) -> list[Problem]:
        """Return the problems in the order of their positions, each file and option by itself."""
        files = list(dict.fromkeys(problem.file for problem in self.problems))
        ordered = sorted(self.problems, key=lambda p: (files.index(p.file), p.line or 0, p.column or 0))
        if self.dropped:
            last = ordered[-1]
            ordered.append(Problem(last.file, None, None, "", f"and {self.dropped} more problems"))
        return ordered

    def raise_if_any(self) -> None:
        """Raise SettingsError if there is a problem."""
        if self.problems:
            raise SettingsError(self.in_order())


class Alike:
    """Reports problems of one kind up to a limit, then counts them."""

    def __init__(self, problems: ProblemList) -> None:
        self.problems = problems
        self.counts: Counter[tuple[str, str]] = Counter()
        self.last: dict[tuple[str, str], Position] = {}

    def add(self, kind: str, position: Position, key: str, message: str, most: int = MAX_ALIKE) -> None:
        """Report a problem, or count it if there were enough of its kind and key."""
        self.counts[kind, key] += 1
        self.last[kind, key] = Position(position.file, position.line)
        if self.counts[kind, key] <= most:
            self.problems.add(position, key, message)

    def finish(self) -> None:
        """Say how many more there are."""
        for (kind, key), count in self.counts.items():
            if kind and count > MAX_ALIKE:
                self.problems.add(self.last[kind, key], key, f"and {count - MAX_ALIKE} more {kind} like these")


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
