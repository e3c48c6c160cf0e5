"""Links that somebody has put where a command writes: refused in words, and what they point at is left alone."""

from __future__ import annotations

from pathlib import Path

import pytest

CASE = Path(__file__).parents[2] / "configs" / "rwg.yaml"
WRITING = [
    ("export", "out.sweep", "-o", "table.csv"),
    ("export", "out.sweep", "-o", "table.xlsx"),
    ("export", "out.sweep", "-o", "table.parquet"),
    ("plot", "out.sweep", "-o", "map.png"),
    ("report", "out.sweep", "-o", "page.html"),
    ("need", "grid.yaml", "--least", "embedment_depth", "-o", "answers.parquet"),
    ("simulate", CASE, "--plot", "impact.svg"),
    ("simulate", CASE, "--energy", "energy.png"),
    ("simulate", CASE, "--trajectory", "history.parquet"),
    ("simulate", CASE, "--animate", "film.gif"),
]


@pytest.fixture
def result(sweep, possible_grid):
    """Work beside a result and a file that nobody may touch."""
    assert sweep("run", possible_grid, "-o", "out.sweep")[0] == 0
    outside = Path("outside")
    outside.write_text("precious")
    yield outside
    assert outside.read_text() == "precious"


def test_no_command_writes_through_a_link(sweep, result):
    for words in WRITING:
        name = Path(words[-1])
        name.symlink_to(result)
        code, _, err = sweep(*words)
        assert code == 2, (words, err)
        assert err.splitlines()[-1].startswith(f"error: {name} is a link")
        assert name.is_symlink()
        name.unlink()


def test_a_new_file_is_not_made_where_a_link_points(sweep, result):
    Path("new.yaml").symlink_to("nowhere")
    code, _, err = sweep("new", "new.yaml", "--yes")
    assert code == 4
    assert "new.yaml exists already" in err
    assert not Path("nowhere").exists()
