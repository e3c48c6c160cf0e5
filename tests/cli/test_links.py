"""Links that somebody has put where a command writes: refused in words, and what they point at is left alone."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from boulder_sweep.store import files

TOKEN = "0123456789abcdef"
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


def test_no_command_writes_through_a_link(sweep, result, monkeypatch):
    monkeypatch.setattr(files, "secrets", SimpleNamespace(token_hex=lambda _: TOKEN))
    for words in WRITING:
        name = Path(words[-1])
        passing = Path(f"_{name}.writing" if words[0] == "report" else f".{name}.{TOKEN}.part")
        name.write_text("an earlier one")
        for planted in (passing, name):
            planted.unlink(missing_ok=True)
            planted.symlink_to(result)
            code, _, err = sweep(*words)
            assert code == 2, (words, err)
            assert err.splitlines()[-1].startswith(f"error: {planted} is a link")
            assert planted.is_symlink()
            assert planted is name or name.read_text() == "an earlier one"
            planted.unlink()


def test_a_new_file_is_not_made_where_a_link_points(sweep, result):
    Path("new.yaml").symlink_to("nowhere")
    code, _, err = sweep("new", "new.yaml", "--yes")
    assert code == 4
    assert "new.yaml exists already" in err
    assert not Path("nowhere").exists()


def test_a_run_through_a_link_is_refused(sweep, result):
    for name in ("_lock", "__manifest.parquet.writing"):
        (Path("out.sweep") / name).symlink_to(result.resolve())
        code, out, err = sweep("run", "grid.yaml", "-o", "out.sweep", "--resume")
        assert (code, out) == (2, "")
        assert f"out.sweep/{name} is a link" in err
        (Path("out.sweep") / name).unlink()
    assert sweep("run", "grid.yaml", "-o", "out.sweep", "--resume")[0] == 0
