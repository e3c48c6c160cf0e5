"""A hostile grid, table and file name, from the file to every place that shows them: they stay text."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import openpyxl
import pytest

import boulder_sweep

BAD = "<script>alert(1)</script>\"'&\x1b[31m=cmd|' /C calc'!A0\n-->"
FORMULAS = ("=cmd|' /C calc'!A0", "+1+1", "@SUM(A1)", "-2+3")
FOLDER, TABLE = "a <b>\x1b]0;x\x07 '\n", "=t<script>.csv"
GRID = """\
name: {name}
table: {table}
boulder: {{length: 1.65 m, width: 1.68 m, density: 2600 kg/m^3}}
site: {{embedment_ratio: 0.6}}
soil: {{density: 1860 kg/m^3, friction_angle: 40 deg}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""


@pytest.fixture
def hostile(tmp_path, monkeypatch):
    """Enter a folder with a hostile name that holds a grid and a table of the same kind."""
    folder = tmp_path / FOLDER
    folder.mkdir()
    monkeypatch.chdir(folder)
    with Path(TABLE).open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["site_name", "boulder_height_m", "subgrade_reaction_MN_m3"])
        names = [BAD, *FORMULAS, "plain"]
        table.writerows([name, 2.6 + 0.2 * (k // 2), 40 + 40 * (k % 2)] for k, name in enumerate(names))
    Path("grid.yaml").write_text(GRID.format(name="hostile", table=json.dumps(TABLE)))
    return folder


def harmless(*texts: str) -> None:
    for text in texts:
        assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f]", text), "nothing that a terminal acts on"


def test_from_the_file_to_every_place_that_shows_it(sweep, hostile):
    folder = str(hostile)
    for words in (
        ["check", f"{folder}/grid.yaml"],
        ["run", f"{folder}/grid.yaml", "-o", f"{folder}/out.sweep"],
        ["run", f"{folder}/grid.yaml", "-o", f"{folder}/out.sweep", "--resume", "--dry-run"],
        ["simulate", f"{folder}/out.sweep", "--all"],
        ["capacity", f"{folder}/grid.yaml"],
        ["need", f"{folder}/grid.yaml"],
        ["plot", f"{folder}/out.sweep", "-o", f"{folder}/map.svg"],
        ["simulate", f"{folder}/grid.yaml", "--plot", f"{folder}/one.svg"],
        ["report", f"{folder}/out.sweep", "-o", f"{folder}/page.html"],
        ["export", f"{folder}/out.sweep", "-o", f"{folder}/rows.csv"],
        ["export", f"{folder}/out.sweep", "-o", f"{folder}/rows.xlsx"],
    ):
        code, out, err = sweep(*words)
        assert code == 0, (words, err)
        harmless(out, err)
    for picture in ("map.svg", "one.svg"):
        drawn = ElementTree.parse(picture)
        tags = {element.tag.rpartition("}")[2] for element in drawn.iter()}
        assert "script" not in tags
    page = Path("page.html").read_text()
    assert not re.search(r"<script>alert|<b>\x1b", page)
    assert "\x1b" not in page
    with Path("rows.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    assert not any(value.startswith(("=", "+", "@")) for row in rows for value in row.values())
    assert not any("\x1b" in value for row in rows for value in row.values())
    book = openpyxl.load_workbook("rows.xlsx")
    assert not any(cell.data_type == "f" for sheet in book for line in sheet.iter_rows() for cell in line)
    shown = boulder_sweep.read("out.sweep")._repr_html_()
    assert "&lt;script&gt;alert(1)" in shown
    assert "<script>" not in shown


def test_a_hostile_name_of_a_grid_is_refused_and_shown_harmlessly(sweep, hostile):
    text = Path("grid.yaml").read_text().replace("name: hostile", f"name: {json.dumps(BAD)}")
    Path("grid.yaml").write_text(text)
    code, out, err = sweep("check", f"{hostile}/grid.yaml")
    assert code == 2
    assert "name: must be at most 80 letters" in err
    harmless(out, err)


def test_a_table_that_is_refused_is_named_harmlessly(sweep, hostile):
    Path(TABLE).write_text(f'"{BAD}",boulder_height_m\nx,1e999\n')
    code, out, err = sweep("check", f"{hostile}/grid.yaml")
    assert code == 2
    harmless(out, err)
