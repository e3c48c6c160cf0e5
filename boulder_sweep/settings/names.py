"""What an option calls an entry: ``boulder.width`` as in the file, ``width`` alone, or its column of the table."""

from __future__ import annotations

from collections.abc import Sequence

from boulder_sweep.settings.fields import BY_NAME, INPUTS, Field
from boulder_sweep.settings.problems import did_you_mean, shorten

BOULDER_MASS = BY_NAME["boulder_mass_kg"]
"""The mass of the boulder: an input where a file gives it; else it follows from four others."""


class UnknownNameError(ValueError):
    """A word names no entry, or several.

    Parameters
    ----------
    word
        The word.
    what
        What is wrong with it, and which entries there are.
    """

    def __init__(self, word: str, what: str):
        super().__init__(word, what)
        self.word, self.what = word, what

    def __str__(self) -> str:
        return f"'{shorten(self.word)}' {self.what}"


def named(word: str, among: Sequence[Field] = INPUTS) -> Field:
    """Return the entry that a word names; an input goes before a setting of the same key.

    Parameters
    ----------
    word
        Path of the entry (``boulder.width``), its key (``width``) or its column (``boulder_width_m``).
    among
        Entries that may be meant; the inputs by default.

    Raises
    ------
    UnknownNameError
        No entry has this name, or several have this key.
    """
    matches = [field for field in among if word in (field.path, field.name)]
    matches = matches or [field for field in among if word == field.key]
    matches = [field for field in matches if field in INPUTS] or matches
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise UnknownNameError(word, f"is ambiguous; use {' or '.join(field.path for field in matches)}")
    keys = [field.key for field in among]
    short = [field.path if keys.count(field.key) > 1 else field.key for field in among]
    near = [known for known in short if word.lower() in known] or [
        known for known, field in zip(short, among, strict=True) if word.lower() in field.also
    ]
    every = (*short, *(field.path for field in among), *(field.name for field in among))
    hint = f"; did you mean {' or '.join(near)}?" if near else did_you_mean(word, every)
    what = "an input" if all(field in INPUTS for field in among) else "an entry of the file"
    known = hint or f" ({', '.join(short)})"
    raise UnknownNameError(word, f"is not {what}{known}")
