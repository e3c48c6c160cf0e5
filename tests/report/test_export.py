"""Tables for colleagues: the same rows, in units that names of columns end in, and harmless in a spreadsheet."""

import csv
import dataclasses
import errno
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.answers.advice import advice
from boulder_sweep.answers.printing import need_screen, screen_lines
from boulder_sweep.answers.reserves import capacity
from boulder_sweep.cli.main import execute
from boulder_sweep.columns import COLUMNS, OUTCOME_COLUMNS
from boulder_sweep.errors import OlderRulesWarning, ReportError
from boulder_sweep.judge.quantities import QUANTITIES
from boulder_sweep.report import export as module
from boulder_sweep.report import write_explorer, write_report, writing
from boulder_sweep.report.answers import answer_of
from boulder_sweep.report.export import export
from boulder_sweep.report.page import ASSETS, SCRIPTS
from boulder_sweep.report.rows import read_rows
from boulder_sweep.settings import load_text
from boulder_sweep.settings.sweep import Heading
from boulder_sweep.settings.units import ShownColumn, factor, shown_column, shown_settings, shown_unit
from boulder_sweep.text import NO_BREAK_SPACE
from tests.answers.designs import bare_need, site
from tests.store.folders import rewrite

US = {
    "boulder_length_m": "boulder_length_ft",
    "boulder_density_kg_m3": "boulder_density_pcf",
    "subgrade_reaction_MN_m3": "subgrade_reaction_pci",
    "vehicle_mass_kg": "vehicle_mass_lb",
    "impact_speed_m_s": "impact_speed_mph",
    "vehicle_spring_N_m": "vehicle_spring_lb_in",
    "vehicle_damper_N_s_m": "vehicle_damper_lb_s_in",
    "peak_force_kN": "peak_force_kip",
    "friction_angle_deg": "friction_angle_deg",
    "verdict": "verdict",
}


@pytest.fixture(scope="module")
def table(result):
    return boulder_sweep.read(result)


def test_names_end_in_their_units():
    assert {name: shown_column(name, "us").name for name in US} == US
    assert [shown_column(spec.name, "si").name for spec in COLUMNS] == [spec.name for spec in COLUMNS]
    for spec in COLUMNS:
        column = shown_column(spec.name, "us")
        if column.size != 1.0 and column.unit != "kip":
            assert column.size == float(factor(column.unit, spec.unit))
    assert shown_column("peak_force_kN", "us").size == 4.4482216152605


SAME = (
    *("boulder_length_ft", "boulder_density_pcf", "soil_density_pcf", "subgrade_reaction_pci", "strain_rate_factor"),
    *("vehicle_mass_lb", "impact_speed_mph", "vehicle_spring_lb_in", "vehicle_damper_lb_s_in", "bumper_height_ft"),
    *("hood_height_ft", "bed_offset_ft", "solidity", "shape"),
)
"""Columns with one value in all rows of the result."""


def place_in_a_sheet(name):
    """The answer comes first, and what is the same in every row last."""
    first = ["design_id", "verdict", "reason", "margin", "robustness"]
    return first.index(name) if name in first else 5 + (name in SAME)


@pytest.mark.parametrize("kind", ["csv", "parquet", "xlsx"])
def test_every_row_is_there_in_the_units_asked_for(result, table, tmp_path, kind):
    target = tmp_path / f"designs.{kind}"
    assert export(result, target, units="us") == len(table)
    read = {"csv": pd.read_csv, "parquet": pd.read_parquet, "xlsx": lambda file: pd.read_excel(file, "designs")}[kind]
    found = read(target)
    assert len(found) == len(table)
    added = ["boulder_mass_lb", "height_above_ground_ft", "excavated_yd3", "backfill_yd3"]
    names = [*(shown_column(name, "us").name for name in table.columns), *added]
    assert list(found.columns) == (sorted(names, key=place_in_a_sheet) if kind == "xlsx" else names)
    buried = table.eval("boulder_length_m * boulder_width_m * embedment_depth_m") / 0.9144**3
    np.testing.assert_allclose(found.excavated_yd3 - found.backfill_yd3, buried, rtol=1e-9)
    for name in table.columns:
        column = shown_column(name, "us")
        if table[name].dtype == float:
            np.testing.assert_allclose(found[column.name], table[name] / column.size, rtol=1e-13)  # fourteen digits
        else:
            texts = [column.astype(object).where(column.notna(), "") for column in (found[column.name], table[name])]
            assert texts[0].astype(str).tolist() == texts[1].astype(str).tolist()
    assert list(tmp_path.iterdir()) == [target]


def test_a_spreadsheet_tells_units_settings_and_that_it_is_no_test(result, tmp_path):
    export(result, tmp_path / "designs.xlsx")
    book = openpyxl.load_workbook(tmp_path / "designs.xlsx")
    assert book.sheetnames == ["answer", "designs", "about"]
    lines = [[cell or "" for cell in row] for row in book["about"].iter_rows(values_only=True)]
    assert "not a rating by test" in lines[0][0]
    assert ["boulder_length_m", "m", "length L of the boulder along the direction of travel"] in lines
    assert ["name: sizing", "", ""] in lines
    assert any(line[0] == "hash of the kernels" for line in lines)


def test_a_spreadsheet_is_ready_to_be_read(result, tmp_path):
    rows = export(result, tmp_path / "designs.xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "designs.xlsx")["designs"]
    assert openpyxl.load_workbook(tmp_path / "designs.xlsx", read_only=True)["designs"].max_row == rows + 1
    assert sheet.freeze_panes == "B2"
    assert sheet.auto_filter.ref == f"A1:{openpyxl.utils.get_column_letter(sheet.max_column)}{rows + 1}"
    ranges = [(column.min, column.max, column.width) for column in sheet.column_dimensions.values()]
    for cell in sheet[1]:
        (width,) = [width for first, last, width in ranges if first <= cell.column <= last]
        assert width >= len(cell.value) + 2, "and an arrow of the filter"


def answer_sheet(file, target, units="si"):
    """Sentences as lines, heads and rows of the table of the first sheet."""
    export(file, target, units=units)
    sheet = openpyxl.load_workbook(target)["answer"]
    lines = [list(row) for row in sheet.iter_rows()]
    blank = next((k for k, line in enumerate(lines) if not any(cell.value for cell in line)), -1)
    above, below, *rows = lines[blank + 1 :]
    heads = [f"{one.value or ''} {other.value or ''}".strip() for one, other in zip(above, below, strict=True)]
    count = max(k for k, head in enumerate(heads) if head) + 1  # sentences may be wider
    return [line[0].value for line in lines[: max(blank, 0)]], heads[:count], [row[:count] for row in rows]


@pytest.mark.parametrize("units", ["si", "us"])
def test_the_first_sheet_is_what_the_terminal_says(tmp_path, units):
    sweep = dataclasses.replace(site(height="[2.8, 3.4, 3.6] m"), heading=Heading(project="Gate"))
    found = boulder_sweep.need(sweep)
    found.write(tmp_path / "depth.parquet")
    said, heads, rows = answer_sheet(tmp_path / "depth.parquet", tmp_path / "depth.xlsx", units)
    assert said == ["project: Gate", *(line.replace(NO_BREAK_SPACE, " ") for line in advice(found, units))]
    assert heads == [" ".join(head).strip() for head, _ in need_screen(found, units).columns]
    texts = [line.split() for line in screen_lines(found, units)[3:]]
    assert [row[0].value for row in rows] == [None, "→", None]
    assert [{cell.font.bold for cell in row} for row in rows] == [{False}, {True}, {False}]
    for row, line in zip(rows, texts, strict=True):
        for cell, text in zip(row[1:], line[line[0] == "→" :], strict=False):
            if text[0].isdigit():
                assert cell.value == float(text)
                assert cell.number_format == f"0.{'0' * len(text.partition('.')[2])}".rstrip(".")
            else:
                assert cell.value == {"-": "–"}.get(text, text)


@pytest.mark.parametrize(
    ("text", "value", "kind"),
    [
        *(("2.340", 2.34, "0.000"), ("12,500", 12500.0, "#,##0"), ("49.7%", 0.497, "0.0%"), ("-3", -3.0, "0")),
        *(("-", "–", "General"), ("", None, "General"), ("≤1.2", "≤1.2", "General"), ("=1", "'=1", "General")),
    ],
)
def test_texts_of_the_first_sheet_are_numbers_where_they_can_be(text, value, kind):
    assert module._number(text) == (value, kind)


def test_of_a_long_table_the_first_sheet_says_where_the_rest_is(tmp_path):
    found = boulder_sweep.need(site(height="{from: 2.6 m, to: 3.6 m, count: 21}"))
    found.write(tmp_path / "depth.parquet")
    _, _, rows = answer_sheet(tmp_path / "depth.parquet", tmp_path / "depth.xlsx")
    part = "16 of 21, the best of the 9 with an answer first; those left out have none"
    assert rows[-1][0].value == f"({part}; all are on the sheet designs)"
    assert len(rows) == 17


def test_the_first_sheet_of_a_run_is_the_recommendation_of_its_page(result, tmp_path):
    said, heads, (best, other) = answer_sheet(result, tmp_path / "run.xlsx")
    need = answer_of(read_rows(result)).need
    design, named = need.recommendation.design, [line.replace(NO_BREAK_SPACE, " ") for line in advice(need)]
    assert said[: len(named)] == named
    assert said[len(named)] == "57 of 252 designs pass (22.6%)."
    shown = {head: cell.value for head, cell in zip(heads, best, strict=True)}
    assert [best[0].value, other[0].value] == ["→", None]
    assert shown["depth m"] == pytest.approx(design.sizes["embedment_depth_m"], abs=5e-4)
    assert shown["dig m³"] == pytest.approx(design.excavated_m3, abs=0.05)
    margins = [shown["φ′ 36°"], shown["φ′ 40°"]]
    assert margins == pytest.approx([row["margin"] for row in design.rows], abs=5e-4)
    assert shown["least margin"] == min(margins)


@pytest.mark.parametrize("units", ["si", "us"])
def test_the_first_sheet_of_a_run_without_a_design_that_qualifies_has_the_nearest(tmp_path, units):
    boulder_sweep.run(site(site="embedment_ratio: 0.5", height="[2.0, 2.6] m"), tmp_path / "low.sweep")
    said, heads, (nearest,) = answer_sheet(tmp_path / "low.sweep", tmp_path / "low.xlsx", units)
    assert any(line.startswith("Nearest: ") for line in said)
    assert nearest[0].value is None
    assert nearest[heads.index("H m" if units == "si" else "H ft")].value == (2.0 if units == "si" else 6.562)


def test_the_first_sheet_of_other_answers_is_their_table(answers, tmp_path):
    for name, head in (("uncertainty", "P(pass)"), ("capacity", "class, simulated")):
        said, heads, rows = answer_sheet(answers[name][0], tmp_path / f"{name}.xlsx")
        without = "What each design just withstands, without a margin"
        assert said == ([without] if name == "capacity" else [])
        assert head in heads
        assert len(rows) == answers[name][1].num_rows
    export(answers["simulate"][0], tmp_path / "history.xlsx")
    assert openpyxl.load_workbook(tmp_path / "history.xlsx").sheetnames == ["designs", "about"]


def test_one_table_gives_the_same_spreadsheet(result, tmp_path):
    for name in ("one.xlsx", "two.xlsx"):
        export(result, tmp_path / name)
    assert (tmp_path / "one.xlsx").read_bytes() == (tmp_path / "two.xlsx").read_bytes()
    with zipfile.ZipFile(tmp_path / "one.xlsx") as book:
        assert {entry.date_time[0] for entry in book.infolist()} == {1980}
        assert {*re.findall(rb"\d{4}-\d\d-\d\dT", book.read("docProps/core.xml"))} == {b"1980-01-01T"}


@pytest.mark.parametrize("where", ["rows", "file"])
def test_a_disk_that_fills_up_under_a_spreadsheet_is_named(result, tmp_path, monkeypatch, where):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(*((module, "_rows", full) if where == "rows" else (zipfile.ZipFile, "write", full)))
    with pytest.raises(ReportError, match=r"designs\.xlsx cannot be written: No space left on device"):
        export(result, tmp_path / "designs.xlsx")
    assert list(tmp_path.iterdir()) == []


def test_cells_without_a_number_are_blank(answers, tmp_path, monkeypatch):
    table = pa.table({"design_id": [0, 1, 2, 3], "x": [1.5, None, math.nan, math.inf], "word": ["a", "", None, "b"]})
    columns = [ShownColumn(name, "", 1.0, "") for name in table.column_names]
    monkeypatch.setattr(module, "_tables", lambda *_: iter([(columns, table.slice(0, 3)), (columns, table.slice(3))]))
    export(answers["simulate"][0], tmp_path / "blank.xlsx")
    rows = openpyxl.load_workbook(tmp_path / "blank.xlsx")["designs"].iter_rows(min_row=2, values_only=True)
    assert list(rows) == [(0, 1.5, "a"), (1, None, None), (2, None, None), (3, None, "b")]


def test_settings_are_in_the_units_asked_for(result, tmp_path):
    export(result, tmp_path / "us.xlsx", units="us")
    texts = [row[0] for row in openpyxl.load_workbook(tmp_path / "us.xlsx")["about"].iter_rows(values_only=True)]
    assert f"  boulder_length_ft: {1.65 / 0.3048:.12g}" in texts
    assert f"  boulder_width_ft: {1.5 / 0.3048:.12g}, {1.9 / 0.3048:.12g}" in texts
    assert "  vehicle_mass_lb: 15000" in texts
    assert "  impact_speed_mph: 30" in texts
    assert f"  min_overlap_ft: {0.25 / 0.3048:.12g}" in texts
    assert "  horizon_s: 1" in texts
    assert not [text for text in texts if text and text.split(":")[0].endswith(("_m", "_kg", "_m_s", "_kN"))]


def test_distributions_layers_and_long_axes_are_in_the_units_asked_for():
    spread = {"kind": "normal", "sd": 60.0, "cov": 0.05, "low": 0.0}
    settings = {
        "distributions": {"soil_density_kg_m3": spread, "friction_angle_deg": {"sd": 3.0}},
        "model": {"ground": {"layers": [{"from_m": 1.2, "cohesion_kPa": 5.0}], "water_table_m": None}},
        "inputs": {"boulder_height_m": {"count": 20, "first": 1.0, "last": 2.0, "sha256": "ab"}},
    }
    assert shown_settings(settings, "si") == settings
    found = shown_settings(settings, "us")
    pcf = float(factor("pcf", "kg/m^3"))
    assert found["distributions"]["soil_density_pcf"] == {**spread, "sd": pytest.approx(60.0 / pcf, rel=1e-13)}
    assert found["distributions"]["friction_angle_deg"] == {"sd": 3.0}
    (layer,) = found["model"]["ground"]["layers"]
    assert layer == {
        "from_ft": pytest.approx(1.2 / 0.3048, rel=1e-13),
        "cohesion_psf": pytest.approx(104.427, abs=1e-3),
    }
    assert found["model"]["ground"]["water_table_ft"] is None
    assert found["inputs"]["boulder_height_ft"] == {
        "count": 20,
        "first": pytest.approx(1 / 0.3048, rel=1e-13),
        "last": pytest.approx(2 / 0.3048, rel=1e-13),
        "sha256": "ab",
    }


def test_a_table_judged_by_other_rules_says_so_in_every_row_and_beside_the_other(result, tmp_path, capsys):
    out = tmp_path / "other.sweep"
    shutil.copytree(result, out)
    rewrite(out, lambda said: said.update(rules_sha256="abcdef0123456789"))
    judged = f"judged by the rules of version {boulder_sweep.__version__} (rules abcdef01, kernels "
    with pytest.warns(OlderRulesWarning, match="abcdef01"):
        export(out, tmp_path / "other.parquet", units="us")
    table = pq.read_table(tmp_path / "other.parquet")
    (said,) = set(table["judged_by"].to_pylist())
    assert said.startswith(judged)
    assert f"verdicts\t{said}\t".encode() in table.schema.metadata[b"about"]
    assert execute(["compare", str(result), str(out)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"rules    {result}: judged by the rules of this version\nrules    {out}: {judged}")


def test_parquet_keeps_units_and_meanings(result, tmp_path):
    export(result, tmp_path / "designs.parquet", units="us")
    schema = pq.read_schema(tmp_path / "designs.parquet")
    assert schema.field("peak_force_kip").metadata[b"unit"] == b"kip"
    assert b"not a rating by test" in schema.metadata[b"about"]


def test_a_text_that_looks_like_a_formula_stays_a_text(tmp_path):
    signs = [*"=+-@", *"＝＋－＠", *"﹦﹢﹣﹫⁼₌⁺₊"]
    formulas = [*(f"{sign}HYPERLINK(1)" for sign in signs), "{=1}", "<r><f>1</f></r>"]
    others = ["plain", "a=b", "±3", "</v>&amp;", "https://a.b", "mailto:a", "12"]
    rows = [f"{text},3" for text in (*formulas, *others)]
    (tmp_path / "designs.csv").write_text("\n".join(("boulder_id,boulder_height_m", *rows)), encoding="utf-8")
    (tmp_path / "list.yaml").write_text(
        "name: list\ntable: designs.csv\nboulder: {length: 1.65 m, width: 1.5 m, density: 2600 kg/m^3}\n"
        "site: {embedment_ratio: 0.6}\n"
        "soil: {density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}\n"
        "vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}\n"
    )
    boulder_sweep.run(boulder_sweep.load(tmp_path / "list.yaml"), tmp_path / "out")
    export(tmp_path / "out", tmp_path / "out.csv")
    with (tmp_path / "out.csv").open(newline="", encoding="utf-8") as file:
        shown = [row["boulder_id"] for row in csv.DictReader(file)]
    assert [text.lstrip("'") for text in shown] == [*formulas, *others]
    assert [text.startswith("'") for text in shown] == [True] * len(formulas) + [False] * len(others)
    export(tmp_path / "out", tmp_path / "out.xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "out.xlsx")["designs"]
    assert {cell.data_type for row in sheet.iter_rows() for cell in row} <= {"s", "inlineStr", "n"}
    (ids,) = [column for column in sheet.iter_cols(values_only=True) if column[0] == "boulder_id"]
    assert list(ids[1:]) == shown


@pytest.mark.parametrize("sign", [*module.FORMULA_SIGNS, "\x00", "\x1b[31m"])
def test_a_text_about_the_table_is_no_formula_either(result, tmp_path, monkeypatch, sign):
    """Settings, versions and names come from a file that anybody may have made."""
    monkeypatch.setattr(module, "about", lambda finished, columns, units: iter([(f"{sign}cmd", "x", f"{sign}cmd")]))
    export(result, tmp_path / "out.xlsx")
    (cells,) = openpyxl.load_workbook(tmp_path / "out.xlsx")["about"].iter_rows()
    assert [cell.data_type for cell in cells] == ["s", "s", "s"]
    assert cells[0].value.isprintable()
    assert not cells[0].value.startswith(module.FORMULA_SIGNS)


def test_a_result_is_never_written_into(result):
    (part,) = result.glob("rows-*.parquet")
    before = {path.name: path.read_bytes() for path in result.iterdir()}
    for name in ("all.parquet", "all.csv", "all.xlsx", part.name):
        with pytest.raises(ReportError, match="holds the result of a run; name a file outside it"):
            export(result, result / name)
    assert {path.name: path.read_bytes() for path in result.iterdir()} == before


def test_a_table_that_has_no_place_is_refused_by_the_name_given(result, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ReportError, match=rf"^none/base\.csv: the folder {tmp_path}/none does not exist$"):
        export(result, "none/base.csv")
    (tmp_path / "base.csv").mkdir()
    with pytest.raises(ReportError, match=r"^base\.csv cannot be written: Is a directory$"):
        export(result, "base.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["base.csv"]


def test_what_cannot_be_written_is_refused(result, tmp_path, monkeypatch):
    with pytest.raises(ReportError, match=r"must end in \.xlsx, \.csv or \.parquet"):
        export(result, tmp_path / "designs.ods")
    monkeypatch.setattr(module, "MOST_SHEET_ROWS", 100)
    with pytest.raises(ReportError, match="a sheet holds 100 rows, not 252"):
        export(result, tmp_path / "designs.xlsx")
    assert list(tmp_path.iterdir()) == []


def test_what_the_system_refuses_is_an_error_of_the_report(result, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(module.Path, "replace", refuse)
    with pytest.raises(ReportError, match=r"designs\.csv cannot be written: Permission denied"):
        export(result, tmp_path / "designs.csv")
    assert list(tmp_path.iterdir()) == []


def test_units_are_si_or_us(result, tmp_path):
    with pytest.raises(ValueError, match="units must be si or us, not 'metric'"):
        export(result, tmp_path / "designs.csv", units="metric")
    with pytest.raises(ValueError, match="units must be si or us, not 'metric'"):
        write_report(result, tmp_path / "page.html", units="metric")
    with pytest.raises(ValueError, match="units must be si or us, not 'metric'"):
        write_explorer(writing.example(), 0, tmp_path / "page.html", units="metric")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [-1, 1, 5])
def test_a_page_needs_a_design_that_exists(tmp_path, number):
    with pytest.raises(ReportError, match=f"holds 1 design, numbered from 0; there is no {number}"):
        write_explorer(writing.example(), number, tmp_path / "page.html")


def test_a_page_that_the_system_refuses_is_an_error_of_the_report(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(writing, "replacing", refuse)
    with pytest.raises(ReportError, match=r"page\.html cannot be written: Read-only file system"):
        write_explorer(writing.example(), 0, tmp_path / "page.html")


def test_a_page_holds_its_scripts_whatever_the_locale(tmp_path):
    code = "from boulder_sweep.report import writing as w; w.write_explorer(w.example(), 0, 'page.html')"
    plain = os.environ | {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=plain, check=True)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    for script in SCRIPTS:
        assert (ASSETS / f"{script}.js").read_text(encoding="utf-8").strip() in page


ONE_SITE = """\
name: one site
boulder: {length: 1.65 m, width: 1.68 m, height: [2.6, 3.2, 3.4] m, density: 2600 kg/m^3}
site: {embedment_depth: 2 m}
soil: {density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: SPEED, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """Files of answers: name to file and table."""
    folder = tmp_path_factory.mktemp("answers")
    plain = load_text(ONE_SITE.replace("SPEED", "30 mph"), Path("one.yaml"))
    uncertain = load_text(ONE_SITE.replace("SPEED", "{mean: 13.4 m/s, cov: 5 %}"), Path("one.yaml"))
    found = {
        "need": bare_need(plain),
        "capacity": capacity(plain),
        "uncertainty": boulder_sweep.uncertainty(uncertain, half_width=0.1),
    }
    for name, one in found.items():
        one.write(folder / f"{name}.parquet")
    history = boulder_sweep.simulate(plain, 2)
    history.to_parquet(folder / "simulate.parquet")
    return {name: (folder / f"{name}.parquet", one.arrow) for name, one in found.items()} | {
        "simulate": (folder / "simulate.parquet", history.to_arrow())
    }


def place_of_tried(name, column):
    """Whether a column holds what was tried last in rows that have no answer, or its outcome."""
    built = ("height_above_ground_m", "excavated_m3", "backfill_m3")
    return name == "need" and column in {"embedment_depth_m", "impact_height_m", *built, *OUTCOME_COLUMNS}


def test_boulders_of_a_list_keep_their_names_where_none_passes(tmp_path):
    (tmp_path / "yard.csv").write_text("boulder_id,boulder_height_m\nlow,2.6\nhigh,3.4\n")
    listed = ONE_SITE.replace("SPEED", "30 mph").replace("height: [2.6, 3.2, 3.4] m, ", "")
    answers = bare_need(load_text(f"table: yard.csv\n{listed}", tmp_path / "yard.yaml"))
    answers.write(tmp_path / "yard.parquet")
    export(tmp_path / "yard.parquet", tmp_path / "out.csv")
    found = pd.read_csv(tmp_path / "out.csv")
    assert list(found["found"]) == ["blocked_by_overlap", "found"]
    assert list(found["boulder_id"]) == ["low", "high"]


@pytest.mark.parametrize("name", ["need", "capacity", "uncertainty", "simulate"])
@pytest.mark.parametrize("kind", ["csv", "xlsx", "parquet"])
def test_files_of_answers_are_exported_like_results(answers, tmp_path, name, kind):
    file, table = answers[name]
    target = tmp_path / f"out.{kind}"
    assert export(file, target, units="us") == len(table)
    read = {"csv": pd.read_csv, "parquet": pd.read_parquet, "xlsx": lambda file: pd.read_excel(file, "designs")}[kind]
    found = read(target)
    has_answer = table["passes_at"].is_valid().to_pylist() if name == "need" else [True] * len(table)
    assert all(has_answer) == (name != "need")
    added = QUANTITIES if name == "uncertainty" else ()  # tables of other answers have them
    assert len(found.columns) == len(table.column_names) + len(added)
    export(file, tmp_path / "names.parquet", units="us")
    names = pq.read_schema(tmp_path / "names.parquet").names
    assert set(found.columns) == {*names}
    assert (list(found.columns) == names) == (kind != "xlsx" or name == "simulate"), "a sheet has an order of its own"
    for place, field in enumerate(table.schema):
        shown, own = names[place], table.column(place).to_pylist()
        unit = field.metadata[b"unit"].decode() if field.metadata else ""
        size = shown_unit(unit, "us").size if unit and not field.name.endswith("passes_within") else 1.0
        there = [None if pd.isna(value) or value == "" else value for value in found[shown]]
        for one, other, answered in zip(there, own, has_answer, strict=True):
            if place_of_tried(name, field.name) and not answered:
                assert one is None, shown
            elif isinstance(other, float):
                assert one == pytest.approx(other / size, rel=1e-12)
            else:
                assert (one or "") == (other or ""), shown
        assert (shown == field.name) == (size == 1.0)


def test_answers_keep_their_meanings_and_units(answers, tmp_path):
    export(answers["need"][0], tmp_path / "need.xlsx", units="us")
    lines = list(openpyxl.load_workbook(tmp_path / "need.xlsx")["about"].iter_rows(values_only=True))
    meaning = next(line for line in lines if line[0] == "least_embedment_depth_ft")
    assert meaning[1:] == ("ft", "smallest value of site.embedment_depth that passes; null where none does")
    assert any(line[0] == "fails_at_ft" for line in lines)


def test_a_parquet_file_of_somebody_else_is_refused(tmp_path):
    pd.DataFrame({"x": [1.0]}).to_parquet(tmp_path / "other.parquet")
    with pytest.raises(ReportError, match="is neither the folder of a run nor a file that `sweep` wrote"):
        export(tmp_path / "other.parquet", tmp_path / "out.csv")
