"""Public text is short and plain: README, documentation, contributing guide and changelog; so are words in code."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from docs.studies.documents import pages

ROOT = Path(__file__).parents[2]
MADE = re.compile(r"```.*?```|<!-- [a-z0-9-]+ -->.*?<!-- end -->", re.DOTALL)
"""Code, and what commands print."""
NAMES = re.compile(r"`[^`\n]*`|(?<=\])\([^)\s]*\)|\*[^*\n]+\*")
"""Names in code, where links lead, and titles."""


def prose(text: str) -> str:
    """Return what people wrote, in one line."""
    return " ".join(NAMES.sub("·", MADE.sub("", text)).split())


def top_of_the_changelog() -> str:
    """Return the newest section."""
    return (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## [")[1]


PUBLIC: dict[str, Callable[[], str]] = {
    **{page.name: lambda page=page: page.read_text(encoding="utf-8") for page in pages(ROOT)},
    "the README": (ROOT / "README.md").read_text,
    "CONTRIBUTING.md": (ROOT / "CONTRIBUTING.md").read_text,
    "the changelog": top_of_the_changelog,
}
BANNED = {
    "a clause with a noun in its place": r"\b(that|those|the one|the ones) of (?!the paper,)\w+",
    "about or on, which it means": r"\bas of\b",
    "next to, besides": r"\bbeside\b",
    "the outcome": r"\bwhat (came|becomes|became) of\b",
    "what it says in place of where": r"[(,;:.] ?see (·|\[|the )",
    "proved:": r"\bit is proved that\b",
    "boulder": r"(?<!crushed )(?<!the )\bstones?\b(?! of 6)",
    "foot": r"\bbases?\b",
    "soil model": r"\b(soil laws?|laws? of (the )?(soil|resistance|ultimate)|the paper's laws?)\b",
    "a noun": r"(?<=[.:] )(?-i:What) [^.?]{0,80}\.(?= |$)",
}
"""Patterns by what to write in their place."""


def found(pattern: str, text: str) -> list[str]:
    """Return every place of a pattern in the prose of a text, with some words around it."""
    words = prose(text)
    return [
        words[max(0, match.start() - 30) : match.end() + 30] for match in re.finditer(pattern, words, re.IGNORECASE)
    ]


@pytest.mark.parametrize("name", PUBLIC)
def test_public_text_is_plain(name: str) -> None:
    text = PUBLIC[name]()
    assert {better: places for better, pattern in BANNED.items() if (places := found(pattern, text))} == {}


@pytest.mark.parametrize("name", PUBLIC)
def test_no_sentence_goes_on_behind_code(name: str) -> None:
    assert re.findall(r"^```\n\n[a-z].*", PUBLIC[name](), re.MULTILINE) == []


@pytest.mark.parametrize(
    ("text", "better"),
    [
        ("the angle and that of the slope", "a clause with a noun in its place"),
        ("the speeds and those of a car", "a clause with a noun in its place"),
        ("four units, as of -15", "about or on, which it means"),
        ("mass beside\nthe density", "next to, besides"),
        ("What came of a task.", "the outcome"),
        ("It moves; see `dynamics`.", "what it says in place of where"),
        ("It is proved that it stands.", "proved:"),
        ("A quarry sells stones.", "boulder"),
        ("at its base", "foot"),
        ("a soil law", "soil model"),
        ("It is fast. What came out stays there.", "a noun"),
    ],
)
def test_a_banned_pattern_is_seen(text: str, better: str) -> None:
    assert found(BANNED[better], text)
    assert not found(BANNED[better], f"```text\n{text}\n```")


@pytest.mark.parametrize(
    ("what", "words", "most"),
    [
        ("README", lambda: (ROOT / "README.md").read_text(encoding="utf-8").split(), 900),
        (
            "documentation",
            lambda: [w for page in pages(ROOT) for w in page.read_text(encoding="utf-8").split()],
            16_000,
        ),
        ("pages", lambda: pages(ROOT), 18),
    ],
)
def test_it_is_short(what: str, words: Callable[[], list[object]], most: int) -> None:
    assert len(words()) <= most, what


LEAST_WORDS = 4
"""Words of a docstring; what a name says already needs no docstring."""
CODE_PATTERN = r"\b(that|those|as)\s+of\b"


def texts(source: str) -> Iterator[tuple[int, str, bool]]:
    """Yield the line, the text and whether it is a docstring, of every string in a module."""
    tree = ast.parse(source)
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value, id(node) in alone


def faults(source: str) -> list[tuple[int, str]]:
    """Return the line and the words of each string that has a banned pattern or is a docstring of too few words."""
    return [
        (line, text)
        for line, text, is_docstring in texts(source)
        if re.search(CODE_PATTERN, text, re.IGNORECASE) or (is_docstring and len(text.split()) < LEAST_WORDS)
    ]


@pytest.mark.parametrize("package", ["boulder_sweep", "kernels"])
def test_words_in_code_are_plain(package: str) -> None:
    files = {file: faults(file.read_text(encoding="utf-8")) for file in sorted((ROOT / package).rglob("*.py"))}
    assert len(files) > 10
    assert {file.relative_to(ROOT).as_posix(): found for file, found in files.items() if found} == {}


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ("def f():\n    '''Return the slope of it.'''\n", 0),
        ("X = 1\n'''Mass of the boulder.'''\n", 0),
        ("def f():\n    '''Add rows.'''\n", 1),
        ("X = 1\n'''Its mass [kg].'''\n", 1),
        ("X = '''the angle and\nthat\nof the slope'''\n", 1),
        ("def f():\n    '''Compare the speeds with those of a car.'''\n", 1),
        ("def f(x):\n    '''As of `g`, with other units.'''\n    return f'as of {x}'\n", 2),
        ("X = 'short'  # that of a comment\n", 0),
    ],
)
def test_a_fault_in_code_is_seen(source: str, count: int) -> None:
    assert len(faults(source)) == count
