"""The equation register is complete, and would say so if it were not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.register import EQUATIONS, entries, mentioned, problems

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "equations.tsv").read_text(encoding="utf-8")


def test_register_is_complete() -> None:
    assert problems(TEXT, ROOT) == []
    assert [entry.number for entry in entries(TEXT)] == list(EQUATIONS)


def test_readings_stand_at_their_equations() -> None:
    where = {entry.number: entry.reading for entry in entries(TEXT)}
    assert "`inertia`" in where[16]
    for number in (5, 6):
        assert "`impact_arm`" in where[number]
    for number in (45, 48, 52):
        assert "`contact`" in where[number]
    for number in (37, 38, 39):
        assert "`restoring`" in where[number]
    assert "`separation`" in where[47]


def changed(pattern: str, replacement: str) -> str:
    found, count = re.subn(pattern, replacement, TEXT, flags=re.MULTILINE)
    assert count, f"nothing matches {pattern}"
    return found


@pytest.mark.parametrize(
    ("pattern", "replacement", "problem"),
    [
        (r"^16\t.*\n", "", "16: missing"),
        (r"^(16\t.*\n)", r"\1\1", "16: stands twice"),
        (r"boulder_kernels\.design\.boulder_mass", "boulder_kernels.design.boulder_weight", "there is no function"),
        (r"boulder_kernels\.design\.boulder_mass", "boulder_kernels.rock.boulder_mass", "there is no function"),
        (r"RigidWall\.response", "RigidWall.answer", "there is no function"),
        (r"test_constants\.py::test_boulder", "test_constants.py::test_rock", "there is no test"),
        (r"tests/kernels/test_vehicle\.py::", "tests/kernels/test_truck.py::", "there is no test"),
        (r"^(15\t[^\t]*\t[^\t]*\t)[^\t]*", r"\1", "15: no function"),
        (r"^(15\t[^\t]*\t[^\t]*\t[^\t]*\t)[^\t]*", r"\1", "15: no test"),
        (r"^(15\t[^\t]*\t)implemented", r"\1somehow", "15: 'somehow' is none of"),
        (r"^(29\t.*\t).*$", r"\1so.", "29: explained, but without"),
        (r"`inertia`", "`inertness`", "unknown reading"),
        (
            r"^(49\t[^\t]*\t[^\t]*\t)[^\t]*",
            r"\1boulder_kernels.numerics.sine_versine",
            "49: boulder_kernels.numerics.sine_versine do not mention it",
        ),
    ],
)
def test_what_is_lost_is_seen(pattern: str, replacement: str, problem: str) -> None:
    assert any(problem in found for found in problems(changed(pattern, replacement), ROOT))


def test_a_test_that_is_nightly_is_seen(tmp_path: Path) -> None:
    (tmp_path / "test_rare.py").write_text("import pytest\n\n@pytest.mark.nightly\ndef test_mass():\n    pass\n")
    text = changed(r"^(15\t[^\t]*\t[^\t]*\t[^\t]*\t)[^\t]*", r"\1test_rare.py::test_mass")
    assert "15: test test_rare.py::test_mass is nightly" in problems(text, tmp_path)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("see Eq 16.", {16}),
        ("(Eqs 5, 6, 48)", {5, 6, 48}),
        ("Eqs 24-28", {24, 25, 26, 27, 28}),
        ("Eqs 53 to 55 and 12", {53, 54, 55, 12}),
        ("Eqs 1-3, 7", {1, 2, 3, 7}),
        ("16 equations", set()),
    ],
)
def test_numbers_in_words(text: str, numbers: set[int]) -> None:
    assert mentioned(text) == numbers
