"""A file in feet is answered in feet, by every command that shows numbers; one in metres in metres."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pandas as pd
import pytest

from boulder_sweep.settings import SettingsError, load, load_text
from boulder_sweep.store.provenance import settings_sha256

FEET = """\
name: feet
boulder: {length: 5.5 ft, width: 6 ft, height: [10 ft, 11 ft], density: 162 pcf}
site: {embedment_depth: 7 ft}
soil: {density: 120 pcf, friction_angle: 36, subgrade_reaction: 200 pci, water_table: 6 ft}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 17720 lb/in, damper: 793.2 lb*s/in, bumper_height: 20 in}
"""
COMMANDS = {
    "check": ("check", "feet.yaml"),
    "dry run": ("run", "feet.yaml", "--dry-run", "-q"),
    "simulate": ("simulate", "feet.yaml"),
    "simulate a result": ("simulate", "feet.sweep", "--all"),
    "need": ("need", "feet.yaml", "-q"),
    "capacity": ("capacity", "feet.yaml", "-q"),
    "compare": ("compare", "feet.sweep", "lower.sweep"),
}
METRES = re.compile(r"(?:\d |\[|_|^ +)(?:m|kg)\b|\bkg_m3|MN/m", re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two results of a file in feet, and answers."""
    from boulder_sweep.cli.main import execute

    folder = tmp_path_factory.mktemp("feet")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        Path("feet.yaml").write_text(FEET)
        assert execute(["run", "feet.yaml", "-q"]) == 0
        assert execute(["run", "feet.yaml", "-q", "--set", "vehicle.speed=25 mph", "-o", "lower.sweep"]) == 0
        assert execute(["need", "feet.yaml", "-q", "-o", "depths.parquet"]) == 0
    return folder


@pytest.fixture(autouse=True)
def inside(folder, monkeypatch):
    monkeypatch.chdir(folder)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_in_feet_is_answered_in_feet(sweep, name):
    code, out, err = sweep(*COMMANDS[name])
    assert code == 0, err
    shown = out + err
    assert METRES.search(shown) is None, shown
    assert re.search(r"\bft\b|_ft\b", shown), shown


@pytest.mark.parametrize("name", ["simulate", "need", "capacity"])
def test_other_units_are_shown_where_they_are_asked_for(sweep, name):
    _, out, _ = sweep(*COMMANDS[name], "--units", "si")
    assert METRES.search(out)
    assert re.search(r"\bft\b", out) is None


@pytest.mark.parametrize("result", ["feet.sweep", "depths.parquet"])
def test_pages_and_tables_of_a_result_are_in_feet(sweep, result):
    assert sweep("report", result, "-o", "page.html")[0] == 0
    assert '"units":"us"' in Path("page.html").read_text(encoding="utf-8").replace('": "', '":"')
    assert sweep("export", result, "-o", "table.csv")[0] == 0
    table = pd.read_csv("table.csv")
    assert table.boulder_height_ft.tolist() == [10.0, 11.0]
    assert [name for name in table.columns if name.endswith(("_m", "_kg", "_m3"))] == []
    assert sweep("export", result, "-o", "table.csv", "--units", "si")[0] == 0
    assert "boulder_height_m" in pd.read_csv("table.csv").columns


def test_json_stays_in_the_units_of_the_table(sweep):
    assert json.loads(sweep("simulate", "feet.yaml", "--json")[1])["height_above_ground_m"] == pytest.approx(0.9144)
    assert json.loads(sweep("need", "feet.yaml", "-q", "--json")[1])["unit"] == "m"


@pytest.mark.parametrize(
    ("height", "more", "units"),
    [
        ("[10 ft, 11 ft]", "", "us"),
        ("120 in", "", "us"),
        ("{from: 8 ft, to: 9 ft, count: 3}", "", "us"),
        ("3.4 m", "", "si"),
        ("340 cm", "", "si"),
        ("3.4", "", "si"),
        ("3.4 m", "units: us", "us"),
        ("10 ft", "units: si", "si"),
    ],
)
def test_the_height_decides_where_the_file_names_no_units(height, more, units):
    text = FEET.replace("36,", "36 deg,").replace("[10 ft, 11 ft]", height) + more
    assert load_text(text, Path("some.yaml")).units == units


def test_a_list_of_designs_is_shown_in_the_units_of_its_heights():
    Path("list.csv").write_text("boulder_height_ft\n10\n11\n")
    Path("metric.csv").write_text("boulder_height_m\n3\n3.3\n")
    text = FEET.replace("height: [10 ft, 11 ft], ", "")
    for name, units in (("list.csv", "us"), ("metric.csv", "si")):
        Path("listed.yaml").write_text(f"{text}table: {name}\n")
        assert load("listed.yaml").units == units


@pytest.mark.parametrize(
    ("before", "after", "what"),
    [
        ("mass: 15000 lb", "mass: 15000", "'15000' has no unit; this file is in US units: write 15000 lb or 15000 kg"),
        ("width: 6 ft", "width: 6", "'6' has no unit; this file is in US units: write 6 ft or 6 m"),
        ("[10 ft, 11 ft]", "[10, 11]", "'10' has no unit"),
        ("[10 ft, 11 ft]", "{from: 10, to: 11, count: 2}", "'10' has no unit"),
        ("mass: 15000 lb", "mass: {mean: 15000, cov: 5 %}", "write 15000 lb or 15000 kg"),
        ("water_table: 6 ft", "water_table: 6", "write 6 ft or 6 m"),
    ],
)
def test_in_us_units_or_in_feet_a_bare_number_with_a_dimension_is_refused(before, after, what):
    text = FEET.replace(before, after)
    assert load_text(f"{text}units: si\n", Path("some.yaml")).n_designs > 0
    for units in ("units: us\n", *([""] if "10 ft" in text else [])):
        with pytest.raises(SettingsError) as refused:
            load_text(text + units, Path("some.yaml"))
        assert what in refused.value.problems[0].message
        assert refused.value.problems[0].line == text[: text.index(after)].count("\n") + 1


def test_a_height_in_feet_behind_an_option_says_nothing_of_the_file():
    text = FEET.replace("[10 ft, 11 ft]", "3.4").replace("width: 6 ft", "width: 1.8")
    assert load_text(text, Path("some.yaml"), ["boulder.height=11 ft"]).n_designs == 1


def test_angles_and_ratios_need_no_unit():
    assert load_text(f"{FEET}units: us\n", Path("some.yaml")).units == "us"


def test_units_that_are_neither_are_refused():
    with pytest.raises(SettingsError, match="units: must be si or us"):
        load_text(f"{FEET}units: imperial\n", Path("some.yaml"))


def test_no_row_depends_on_the_units(sweep):
    """Designs written in other units are the same run."""
    shown, plain = (load("feet.yaml", [f"units={units}"]).resolved() for units in ("us", "si"))
    assert shown != plain
    assert settings_sha256(shown) == settings_sha256(plain)
    assert sweep("run", "feet.yaml", "-q", "--resume", "-o", "feet.sweep", "--set", "units=si")[0] == 0
