"""Numbers in the documentation: blocks between markers, each made by a function, written and checked by a command.

A block stands between ``<!-- name -->`` and ``<!-- end -->``; everything in between is replaced where it differs from
what is computed by more than rounding.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

_BLOCK = re.compile(r"<!-- (?P<name>[a-z0-9-]+) -->\n(?P<text>.*?)\n?<!-- end -->", re.DOTALL)
_NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?")
_SPACES = re.compile(r"[ \t]+|-{3,}")


@dataclass(frozen=True)
class Block:
    """One block of a page."""

    page: Path
    name: str
    text: str


class DocumentError(Exception):
    """A page holds a block that nothing computes, or none that something does."""


def pages(root: Path) -> list[Path]:
    """Return the pages of the documentation, whose numbers are computed."""
    return sorted((root / "docs").glob("*.md"))


def blocks(root: Path) -> Iterator[Block]:
    """Yield every block of every page."""
    for page in pages(root):
        for match in _BLOCK.finditer(page.read_text(encoding="utf-8")):
            yield Block(page, match["name"], match["text"])


def differences(root: Path, computed: Mapping[str, str]) -> list[str]:
    """Return where pages differ from what is computed now.

    Parameters
    ----------
    root
        Folder of the repository.
    computed
        Text of every block by its name.

    Returns
    -------
    list of str
        One entry for each line that differs, for each block that is unknown, and for each that stands nowhere.
    """
    found = []
    seen = set()
    for block in blocks(root):
        seen.add(block.name)
        where = f"{block.page.relative_to(root)}: {block.name}"
        if block.name not in computed:
            found.append(f"{where}: nothing computes this block")
            continue
        found += [f"{where}:\n{line}" for line in drift(block.text, computed[block.name])]
    return [*found, *(f"{name}: stands on no page" for name in computed if name not in seen)]


def write(root: Path, computed: Mapping[str, str], others: Collection[str] = ()) -> list[Path]:
    """Put what is computed into the pages; return those that changed.

    Parameters
    ----------
    root
        Folder of the repository.
    computed
        Text of blocks by name.
    others
        Names of blocks that stay as they are.

    Raises
    ------
    DocumentError
        A page has a block that nothing computes.
    """
    changed = []
    for page in pages(root):
        text = page.read_text(encoding="utf-8")
        if (now := renewed(text, computed, others)) != text:
            page.write_text(now, encoding="utf-8")
            changed.append(page)
    return changed


def renewed(text: str, computed: Mapping[str, str], others: Collection[str] = ()) -> str:
    """Return the text of a page with its blocks as `write` puts them."""

    def block(match: re.Match[str]) -> str:
        name = match["name"]
        if name not in computed and name not in others:
            raise DocumentError(f"nothing computes the block {name}")
        if name not in computed or not drift(match["text"], computed[name]):
            return match[0]  # rounding alone is no reason to change a page
        return f"<!-- {name} -->\n{computed[name].strip()}\n<!-- end -->"

    return _BLOCK.sub(block, text)


def points(*texts: str) -> str:
    """Return texts as a list."""
    return "\n".join(f"- {text}" for text in texts)


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
