"""Names and places that commands write to or read from: URLs, links, hostile names, no home."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import click
import openpyxl
import pytest

import boulder_sweep
from boulder_sweep.cli.main import COMMANDS
from boulder_sweep.cli.options import OutputPath
from boulder_sweep.locations import location_of

CASE = Path(__file__).parents[2] / "configs" / "rwg.yaml"
NAMES = ("output", "plot", "trajectory", "energy", "animate")
OUTPUTS = [
    (command, option)
    for command in COMMANDS
    for option in command.params
    if isinstance(option, click.Option) and {f"--{name}" for name in NAMES} & set(option.opts)
]
REST = {"compare": ("x",), "fit-vehicle": ("--mass", "6800 kg")}


@pytest.mark.parametrize(("command", "option"), OUTPUTS)
def test_an_empty_name_is_refused(sweep, tmp_path, monkeypatch, command, option):
    monkeypatch.chdir(tmp_path)
    assert isinstance(option.type, OutputPath)
    source = () if command.name == "validate" else (CASE,)
    code, out, err = sweep(command.name, *source, *REST.get(command.name, ()), option.opts[0], "")
    assert (code, out) == (2, "")
    assert "the name is empty" in err
    assert not list(tmp_path.iterdir())


@pytest.fixture
def out(sweep, possible_grid):
    url = "memory://results/possible.sweep"
    code, *_ = sweep("run", possible_grid, "-q", "-o", url, "--overwrite")
    assert code == 0
    return url


def test_commands_take_the_url_of_a_result(sweep, possible_grid, out, tmp_path):
    code, told, _ = sweep("run", possible_grid, "-q", "-o", out, "--resume", "--dry-run", "--json")
    found = json.loads(told)
    assert (code, found["out"], found["estimate"]["rows_to_compute"], found["estimate"]["damaged"]) == (0, out, 0, {})
    assert sweep("plot", out)[0] == 0
    assert sweep("report", out)[0] == 0
    assert sweep("simulate", out, "--design", "3")[0] == 0
    assert sweep("export", out, "-o", "table.csv")[0] == 0
    assert {path.name for path in tmp_path.iterdir()} >= {"possible.png", "possible.html", "table.csv"}


def test_a_url_with_credentials_is_refused_before_anything_is_done(sweep, possible_grid):
    code, out, err = sweep("run", possible_grid, "-o", "s3://KEY:SECRET@bucket/out")
    assert (code, out) == (2, "")
    assert err.startswith("error: s3://bucket/out: the URL was given with a user name or password")
    assert "SECRET" not in err


def test_answers_are_written_to_a_url(sweep, possible_grid):
    need = ("need", possible_grid, "-q", "-o")
    assert sweep(*need, "memory://answers/least.parquet")[0] == 0
    assert sweep(*need, "least.parquet")[0] == 0
    assert location_of("memory://answers/least.parquet").read_bytes() == Path("least.parquet").read_bytes()


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
    code, _, err = sweep("new", "new.yaml")
    assert code == 4
    assert "new.yaml exists already" in err
    assert not Path("nowhere").exists()


DRIVER = """
import pwd, sys

def unknown(user):
    raise KeyError("getpwuid(): uid not found")

pwd.getpwuid = unknown
from boulder_sweep.cli.main import main
main(sys.argv[1:])
"""
SETTINGS = """\
name: stones
boulder: {length: 1.65 m, width: 1.68 m, height: [3 m, 3.2 m], density: 2596 kg/m^3}
site: {embedment_depth: 2 m}
soil: {density: 1859.9 kg/m^3, friction_angle: "{mean: 40 deg, cov: 5 %}", subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
solver: {accuracy: fast}
""".replace('"', "")
COMMANDS = {
    "check": ("check", "s.yaml"),
    "run": ("run", "s.yaml", "-o", "again.sweep"),
    "simulate": ("simulate", "s.yaml", "--plot", "motion.png"),
    "need": ("need", "s.yaml"),
    "capacity": ("capacity", "s.yaml"),
    "uncertainty": ("uncertainty", "s.yaml", "--half-width", "20 %"),
    "tradeoff": ("tradeoff", "s.yaml"),
    "report": ("report", "stones.sweep"),
    "explore": ("explore", "s.yaml", "-o", "page.html"),
    "plot": ("plot", "stones.sweep", "-o", "map.png"),
    "export": ("export", "stones.sweep", "-o", "table.xlsx"),
    "compare": ("compare", "stones.sweep", "stones.sweep"),
    "new": ("new", "n.yaml"),
    "examples": ("examples",),
    "doctor": ("doctor",),
}


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME")}
    command = [sys.executable, "-c", DRIVER, *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("no-home")
    (folder / "s.yaml").write_text(SETTINGS)
    assert run(folder, "run", "s.yaml").returncode == 0
    return folder


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_a_user_without_a_home_is_served(folder: Path, words: tuple[str, ...]) -> None:
    done = run(folder, *words)
    assert done.returncode == 0, done.stderr
    assert "rror" not in done.stderr


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
