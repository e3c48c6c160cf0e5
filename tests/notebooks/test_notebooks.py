"""Every notebook runs from top to bottom and gives the output it is shipped with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest

from docs.studies.documents import drift
from docs.studies.notebooks import FOLDER, executed

NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
TIMING = "timing"
"""Tag of cells whose output tells how long something took."""


def code_cells(notebook: Any) -> list[Any]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def text_of(cell: Any) -> str:
    """Text that a cell shows; pictures are left out."""
    return "\n".join(
        str(output.get("text") or output.get("data", {}).get("text/plain", "")) for output in cell.outputs
    ).strip()


def test_there_are_notebooks() -> None:
    assert len(NOTEBOOKS) >= 4


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_shipped_with_its_output(path: Path) -> None:
    """``python -m docs.studies.notebooks`` renews it."""
    cells = code_cells(nbformat.read(path, as_version=4))
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert "/tmp" not in "".join(text_of(cell) for cell in cells)
    assert path.stat().st_size < 500_000


@pytest.mark.nightly
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_says_the_same(path: Path) -> None:
    shipped = code_cells(nbformat.read(path, as_version=4))
    for before, now in zip(shipped, code_cells(executed(path)), strict=True):
        if TIMING not in before.metadata.get("tags", ()):
            assert drift(text_of(before), text_of(now)) == [], before.source
