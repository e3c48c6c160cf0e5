"""The paper keeps to the form of its journal, and every figure in it stands where a command wrote it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "docs" / "paper" / "paper.md"
*_, BODY = PAPER.read_text(encoding="utf-8").split("---\n", 2)


def test_it_is_no_longer_than_the_journal_asks_for() -> None:
    assert len(BODY.split()) <= 1000


def test_every_source_is_in_the_bibliography_and_cited() -> None:
    entries = set(re.findall(r"^@\w+\{(\w+),", (PAPER.parent / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"(?<!\w)@(\w+)", BODY)) == entries


def test_its_pictures_are_there() -> None:
    assert all((PAPER.parent / name).is_file() for name in re.findall(r"!\[.*?\]\((.+?)\)", BODY))


@pytest.mark.parametrize(
    ("claim", "file", "source"),
    [
        ("at least 99.8 % of the true errors", "docs/accuracy.md", "at least 99.8 % of the true errors"),
        ("thirteen families of designs far from usual", "docs/accuracy.md", "thirteen families of designs far"),
        ("3.39 us of one core", "docs/accuracy.md", "| `balanced` | 4 ms | 3.39 us |"),
        ("some 14 thousand times", "docs/accuracy.md", "some 14 thousand times"),
        ("by its compiler, 10 times", "benchmarks/README.md", "| none | 0.0013 deg | 17.4 us | 10 |"),
        ("Of 107 008 designs", "README.md", "simulates 107 008 designs"),
        ("31,380 pass", "README.md", "  pass             31,380 "),
        ("16,844 of these are robust", "README.md", "   robust 16,844,"),
        ("more than a factor of two", "docs/model.md", "from 7.69° to 18.27°, 2.4 times as far"),
    ],
)  # fmt: skip
def test_a_figure_is_that_of_a_page_that_a_command_writes(claim: str, file: str, source: str) -> None:
    assert claim in " ".join(BODY.split())
    text = (ROOT / file).read_text(encoding="utf-8")
    assert source in text or source in " ".join(text.split())


def test_the_verdict_on_both_crash_tests_is_that_of_all_laws() -> None:
    """One stands under all three laws, the other under none."""
    text = (ROOT / "docs" / "confidence.md").read_text(encoding="utf-8")
    block = text.split("<!-- forms-tests -->")[1].split("<!-- end -->")[0]
    rows = [[cell.strip() for cell in line.split("|")[2:5]] for line in block.splitlines() if "Granite |" in line]
    assert len(rows) == 2
    assert all("after" in cell for cell in rows[0])
    assert not any("after" in cell for cell in rows[1])
