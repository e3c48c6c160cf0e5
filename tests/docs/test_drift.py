"""Numbers in the documentation: what counts as drift, and when a block is computed again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from docs.studies import contents, stamps
from docs.studies.contents import CONTENTS
from docs.studies.documents import DocumentError, blocks, differences, write
from docs.studies.drift import drift


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


ROOT = Path(__file__).parents[2]


def files_of(name: str) -> set[str]:
    """Files that a block of the documentation depends on."""
    modules, _ = stamps.used_by(CONTENTS[name])
    return {file.relative_to(ROOT).as_posix() for module in modules for file in stamps.reached(ROOT, module)}


def test_what_is_simulated_depends_on_kernels_and_on_the_way_to_them() -> None:
    for name in ("need-site", "coverage", "soil-grid", "moves", "validation-table"):
        files = files_of(name)
        assert "kernels/boulder_kernels/lanes.py" in files, name
        assert "kernels/boulder_kernels/settling.py" in files, name
        assert "boulder_sweep/judge/inputs.py" in files, name
        # The study of coverage calls the kernels itself.
        assert ("boulder_sweep/judge/evaluation.py" in files) == (name != "coverage"), name


def test_imports_inside_functions_and_public_names_count() -> None:
    files = files_of("need-probability")
    assert "boulder_sweep/answers/need.py" in files
    assert "boulder_sweep/answers/search.py" in files
    assert "docs/studies/answers.py" in files


def test_what_a_block_does_not_need_does_not_count() -> None:
    assert not any(file.startswith("kernels/") for file in files_of("settings-entries"))
    assert not any(file.startswith(("boulder_sweep/cli/", "boulder_sweep/report/")) for file in files_of("coverage"))
    assert "docs/studies/soil.py" not in files_of("coverage")
    assert "docs/studies/contents.py" not in files_of("coverage")


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small repository: a study that imports one module at its head, one inside a function, one for types only."""
    sources = {
        "docs/study.py": "from typing import TYPE_CHECKING\nimport boulder_sweep.head\n"
        "if TYPE_CHECKING:\n    import boulder_sweep.types_only\n"
        "def text():\n    from boulder_sweep import late\n",
        "boulder_sweep/__init__.py": "",
        "boulder_sweep/head.py": "from . import deep\n",
        "boulder_sweep/deep.py": "",
        "boulder_sweep/late.py": "",
        "boulder_sweep/types_only.py": "",
        "boulder_sweep/other.py": "",
        "configs/site.yaml": "name: site\n",
        "README.md": "",
    }
    for name, text in sources.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(stamps, "_home_of", lambda base, name: f"{base}.{name}")
    monkeypatch.setattr(stamps, "used_by", lambda compute: ({"docs.study"}, compute()))
    (tmp_path / stamps.RECORD).parent.mkdir()
    return tmp_path


def fresh_stamp(repository: Path, compute: Callable[[], str] = str) -> str:
    """Return the stamp as a new process would."""
    for remembered in (stamps.reached, stamps._imports, stamps._content_hash):
        remembered.cache_clear()
    return stamps.stamp(repository, compute)


@pytest.mark.parametrize(
    ("file", "counts"),
    [
        ("docs/study.py", True),
        ("boulder_sweep/head.py", True),
        ("boulder_sweep/deep.py", True),
        ("boulder_sweep/late.py", True),
        ("configs/site.yaml", True),
        ("boulder_sweep/types_only.py", False),
        ("boulder_sweep/other.py", False),
        ("README.md", False),
    ],
)
def test_a_stamp_changes_with_what_counts(repository: Path, file: str, counts: bool) -> None:
    before = fresh_stamp(repository)
    (repository / file).write_text((repository / file).read_text() + "# edited\n")
    assert (fresh_stamp(repository) != before) == counts


def test_a_stamp_changes_with_the_function_of_the_block(repository: Path) -> None:
    assert fresh_stamp(repository, lambda: "one") != fresh_stamp(repository, lambda: "another")


def test_the_text_and_constants_of_the_function_count() -> None:
    _, text = stamps.used_by(contents.CONTENTS["readings-grid"])
    assert "def readings_of_grid" in text
    assert f"EVERY = {contents.EVERY}" in text


def test_only_what_was_checked_is_recorded(repository: Path) -> None:
    blocks = {"one": lambda: "1", "two": lambda: "2"}
    stamps.write(repository, blocks, ["one"])
    assert stamps.read(repository) == {"one": stamps.stamp(repository, blocks["one"])}
    stamps.write(repository, blocks, ["two"])
    assert set(stamps.read(repository)) == {"one", "two"}
