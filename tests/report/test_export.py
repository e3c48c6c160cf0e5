"""Tables for colleagues: the same rows, in units that names of columns end in, and harmless in a spreadsheet."""

import csv
import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.answers.reserves import capacity
from boulder_sweep.cli.main import execute
from boulder_sweep.columns import COLUMNS, OUTCOME_COLUMNS
from boulder_sweep.errors import OlderRulesWarning, ReportError
from boulder_sweep.judge.quantities import QUANTITIES
from boulder_sweep.report import export as module
from boulder_sweep.report import write_explorer, write_report, writing
from boulder_sweep.report.export import export
from boulder_sweep.report.page import ASSETS, SCRIPTS
from boulder_sweep.settings import load_text
from boulder_sweep.settings.shown_units import shown_column, shown_settings, shown_unit
from boulder_sweep.settings.units import factor
from tests.answers.designs import bare_need
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


@pytest.mark.parametrize("kind", ["csv", "parquet", "xlsx"])
def test_every_row_is_there_in_the_units_asked_for(result, table, tmp_path, kind):
    target = tmp_path / f"designs.{kind}"
    assert export(result, target, units="us") == len(table)
    read = {"csv": pd.read_csv, "parquet": pd.read_parquet, "xlsx": lambda file: pd.read_excel(file, "designs")}[kind]
    found = read(target)
    assert len(found) == len(table)
    added = ["boulder_mass_lb", "height_above_ground_ft", "excavated_yd3", "backfill_yd3"]
    assert list(found.columns) == [*(shown_column(name, "us").name for name in table.columns), *added]
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
    assert book.sheetnames == ["designs", "about"]
    lines = [[cell or "" for cell in row] for row in book["about"].iter_rows(values_only=True)]
    assert "not a rating by test" in lines[0][0]
    assert ["boulder_length_m", "m", "length L of the boulder along the direction of travel"] in lines
    assert ["name: sizing", "", ""] in lines
    assert any(line[0] == "hash of the kernels" for line in lines)


def test_a_spreadsheet_is_ready_to_be_read(result, tmp_path):
    rows = export(result, tmp_path / "designs.xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "designs.xlsx")["designs"]
    assert sheet.freeze_panes == "B2"
    assert sheet.auto_filter.ref == f"A1:{openpyxl.utils.get_column_letter(sheet.max_column)}{rows + 1}"
    for cell in sheet[1]:
        assert sheet.column_dimensions[cell.column_letter].width >= len(cell.value) + 2, "and an arrow of the filter"


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
    formulas = [f"{sign}HYPERLINK(1)" for sign in signs]
    rows = [f"{text},3" for text in (*formulas, "plain", "a=b", "±3")]
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
    assert [text.lstrip("'") for text in shown] == [*formulas, "plain", "a=b", "±3"]
    assert [text.startswith("'") for text in shown] == [True] * len(formulas) + [False] * 3
    export(tmp_path / "out", tmp_path / "out.xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "out.xlsx")["designs"]
    assert {cell.data_type for row in sheet.iter_rows() for cell in row} <= {"s", "inlineStr", "n"}


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
    outcomes = {*OUTCOME_COLUMNS} - {"verdict", "reason"}
    return name == "need" and column in {"embedment_depth_m", "impact_height_m", *built, *outcomes}


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
    for place, field in enumerate(table.schema):
        shown, own = found.columns[place], table.column(place).to_pylist()
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
