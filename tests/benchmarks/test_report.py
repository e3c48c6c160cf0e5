"""Tables get into the page of the benchmarks without touching its prose."""

from pathlib import Path

import pytest

from benchmarks import report
from benchmarks.report import BLOCKS, README, described, significant
from boulder_sweep.crash_tests.tables import Table


def test_a_table_is_written_below_its_conditions_and_the_rest_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = README.read_text(encoding="utf-8")
    monkeypatch.setattr(report, "README", tmp_path / "README.md")
    report.README.write_text(page, encoding="utf-8")
    report.write({"peers": described("Speed", "on a machine", Table(("what",), [("lanes",)]), "one note", "another")})
    text = report.README.read_text(encoding="utf-8")
    before, after = page.split("<!-- peers -->")
    shown = "**Speed**\n\n*on a machine*\n\n| what |\n| --- |\n| lanes |\n\n- one note\n- another"
    assert text == f"{before}<!-- peers -->\n{shown}\n<!-- end -->{after.split('<!-- end -->')[1]}"


def test_the_page_has_a_place_for_every_table() -> None:
    text = README.read_text(encoding="utf-8")
    assert all(text.count(f"<!-- {name} -->") == 1 for name in BLOCKS)


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (0.0123, "0.012"), (1.5e-7, "1.5e-07"), (123.4, "123"), (25000.0, "2.5e+04")]
)
def test_numbers_are_short(value: float, text: str) -> None:
    assert significant(value) == text
