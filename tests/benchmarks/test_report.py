"""Tables get into the README without touching its prose."""

from pathlib import Path

import pytest

from benchmarks.report import README, Table, significant, write_between_markers

TABLE = Table("speed", "Speed", "on a machine", ["what", "figure"], [["lanes", "1 us"]], ["a note"])
TABLES = ("kernel", "named", "rates", "peers")


def test_prose_stays_as_it_is(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("before\n<!-- begin speed -->\nold\n<!-- end speed -->\nafter\n")
    write_between_markers([TABLE], readme)
    text = readme.read_text()
    assert text.startswith("before\n")
    assert text.endswith("\nafter\n")
    assert "old" not in text
    assert "| lanes | 1 us |" in text
    write_between_markers([TABLE], readme)
    assert readme.read_text() == text


def test_a_table_without_a_place_is_refused(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("no place\n")
    with pytest.raises(ValueError, match="speed"):
        write_between_markers([TABLE], readme)
    assert readme.read_text() == "no place\n"


def test_readme_has_a_place_for_every_table() -> None:
    text = README.read_text()
    for name in TABLES:
        assert text.index(f"<!-- begin {name} -->") < text.index(f"<!-- end {name} -->")


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (0.0123, "0.012"), (1.5e-7, "1.5e-07"), (123.4, "123"), (25000.0, "2.5e+04")]
)
def test_numbers_are_short(value: float, text: str) -> None:
    assert significant(value) == text
