"""Numbers in the documentation: what counts as drift, and when a block is computed again."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.studies.documents import DocumentError, blocks, differences, drift, write


@pytest.mark.parametrize(
    ("written", "computed"),
    [
        ("| 7.694 | 0.1505 |", "| 7.695 | 0.1504 |"),
        ("1,234 designs", "1,235 designs"),
        ("33.6%", "33.5%"),
        ("3e-07", "4e-07"),
        ("9e-08", "1e-07"),
        ("9.9  m", "10.0 m"),
        ("| a | b |\n| --- | --- |", "| a    | b |\n| ----- | --- |"),
        ("-7.12", "-7.13"),
    ],
)
def test_rounding_is_no_drift(written: str, computed: str) -> None:
    assert drift(written, computed) == []


@pytest.mark.parametrize(
    ("written", "computed"),
    [
        ("| 7.694 |", "| 7.696 |"),
        ("33.6%", "33.4%"),
        ("3e-07", "3e-06"),
        ("3e-07", "5e-07"),
        ("pass", "fail"),
        ("+7.1", "-7.1"),
        ("one\ntwo", "one"),
        ("1,234", "1,334"),
        ("7.6", "7.65e3"),
        ("12 of 13", "12"),
    ],
)
def test_drift_is_found(written: str, computed: str) -> None:
    assert drift(written, computed)
    assert drift(computed, written)


PAGE = """# Title
<!-- one -->
value 1.0
<!-- end -->
prose
<!-- two -->
<!-- end -->
"""


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "docs" / "deeper").mkdir(parents=True)
    (tmp_path / "docs" / "page.md").write_text(PAGE)
    (tmp_path / "docs" / "deeper" / "empty.md").write_text("nothing\n")
    return tmp_path


def test_blocks_are_found(root: Path) -> None:
    assert [(block.page.name, block.name, block.text) for block in blocks(root)] == [
        ("page.md", "one", "value 1.0"),
        ("page.md", "two", ""),
    ]


def test_blocks_are_written_once(root: Path) -> None:
    computed = {"one": "value 3.0", "two": "| a |"}
    assert differences(root, computed) != []
    assert write(root, computed) == [root / "docs" / "page.md"]
    assert differences(root, computed) == []
    assert write(root, computed) == []
    text = (root / "docs" / "page.md").read_text()
    assert text == PAGE.replace("value 1.0", "value 3.0").replace("<!-- two -->\n", "<!-- two -->\n| a |\n")


def test_rounding_changes_no_page(root: Path) -> None:
    write(root, {"one": "value 1.1", "two": ""})
    assert (root / "docs" / "page.md").read_text() == PAGE


def test_blocks_without_a_function_and_functions_without_a_block(root: Path) -> None:
    found = differences(root, {"one": "value 1.0", "three": ""})
    assert any("two: nothing computes" in line for line in found)
    assert any("three: stands on no page" in line for line in found)
    with pytest.raises(DocumentError, match="two"):
        write(root, {"one": "value 1.0"})
