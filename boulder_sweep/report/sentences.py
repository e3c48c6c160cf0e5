"""Parts of sentences in a report: numbers with their units, designs worth naming, shares and lists."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Quantity(NamedTuple):
    """A number in a sentence, in a unit of the table; the page shows it in the reader's."""

    value: float
    unit: str


Sentence = tuple[str | Quantity, ...]


@dataclass(frozen=True)
class Named:
    """A design worth naming."""

    title: str
    number: int
    """Its row."""


def verb(count: int, many: str, one: str) -> str:
    """The form of a verb that goes with a number."""
    return one if count == 1 else many


def share(n: int, total: int) -> str:
    """Share of a total in per cent; never rounded to 0 % or 100 % unless exact."""
    return f"{n / total if n in (0, total) else min(max(n / total, 0.001), 0.999):.1%}"


def listed(words: tuple[str, ...] | list[str]) -> str:
    """Words as a list in a sentence."""
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else words[0]
