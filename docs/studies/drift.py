"""Text with numbers against the same text computed again: what differs by more than rounding."""

from __future__ import annotations

import re
from itertools import zip_longest

_NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?")
_SPACES = re.compile(r"[ \t]+|-{3,}")


def drift(written: str, computed: str) -> list[str]:
    """Return where two texts differ, line by line; empty where they agree.

    Parameters
    ----------
    written
        What stands in a document.
    computed
        What the command gives now.

    Returns
    -------
    list of str
        One entry for each line that differs. Numbers agree if they differ by not more than one unit of their last
        digit, because another processor rounds otherwise; everything else must be the same but for its spacing.
    """
    found = []
    for before, now in zip_longest(written.strip().splitlines(), computed.strip().splitlines(), fillvalue=""):
        if not _same(before, now):
            found.append(f"written  {before.strip()}\ncomputed {now.strip()}")
    return found


def _same(before: str, now: str) -> bool:
    words = [_SPACES.sub(" ", _NUMBER.sub("#", line)).strip() for line in (before, now)]
    if words[0] != words[1]:
        return False
    pairs = zip(_NUMBER.findall(before), _NUMBER.findall(now), strict=True)
    return all(_close(one, other) for one, other in pairs)


def _close(one: str, other: str) -> bool:
    if one == other:
        return True
    values = [float(text.replace(",", "")) for text in (one, other)]
    unit = max(_last_digit(one), _last_digit(other))
    return abs(values[0] - values[1]) <= 1.000001 * unit


def _last_digit(text: str) -> float:
    """Value of one unit of the last digit of a number."""
    mantissa, _, exponent = text.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - decimals)
