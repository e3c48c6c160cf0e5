"""A block's stamp changes with every source that its text depends on, and with no other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from docs.studies import contents, stamps
from docs.studies.contents import CONTENTS

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
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
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


def fresh_stamp(root: Path, compute: Callable[[], str] = str) -> str:
    """Return the stamp as a new process would."""
    for remembered in (stamps.reached, stamps._imports, stamps._content_hash):
        remembered.cache_clear()
    return stamps.stamp(root, compute)


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
def test_a_stamp_changes_with_what_counts(root: Path, file: str, counts: bool) -> None:
    before = fresh_stamp(root)
    (root / file).write_text((root / file).read_text() + "# edited\n")
    assert (fresh_stamp(root) != before) == counts


def test_a_stamp_changes_with_the_function_of_the_block(root: Path) -> None:
    assert fresh_stamp(root, lambda: "one") != fresh_stamp(root, lambda: "another")


def test_the_text_and_constants_of_the_function_count() -> None:
    _, text = stamps.used_by(contents.CONTENTS["readings-grid"])
    assert "def readings_of_grid" in text
    assert f"EVERY = {contents.EVERY}" in text


def test_only_what_was_checked_is_recorded(root: Path) -> None:
    blocks = {"one": lambda: "1", "two": lambda: "2"}
    stamps.write(root, blocks, ["one"])
    assert stamps.read(root) == {"one": stamps.stamp(root, blocks["one"])}
    stamps.write(root, blocks, ["two"])
    assert set(stamps.read(root)) == {"one", "two"}
