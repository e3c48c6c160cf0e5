"""Files that -o of `need`, `capacity` and `uncertainty` wrote, read back, reported, drawn and compared."""

from __future__ import annotations

import json
import random
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.answers.need import Need
from boulder_sweep.answers.outputs import AnswerFile
from boulder_sweep.answers.printing import volume_lines
from boulder_sweep.answers.reserves import capacity
from boulder_sweep.errors import ReportError
from boulder_sweep.report import write_report
from boulder_sweep.report.answers import SCREENS, Measure, answer_of, screens
from boulder_sweep.report.comparison import compare
from boulder_sweep.report.rows import read_rows
from boulder_sweep.settings import load_text
from boulder_sweep.store.provenance import settings_sha256
from tests.answers.designs import bare_need, site
from tests.conftest import Command
from tests.report.conftest import OTHER_VALUES, SETS, places, put

RATIOS = "embedment_ratio: {from: 0.5, to: 0.8, count: 4}"
UNCERTAIN = {"friction": "{mean: [36, 40] deg, cov: 5 %}", "site": "embedment_depth: 2.2 m"}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One file of each question."""
    folder = tmp_path_factory.mktemp("answers")
    found: dict[str, Any] = {
        "depth": bare_need(site(), margin="10 %"),
        "depth of a ratio": bare_need(site(site=RATIOS), robust=True),
        "height": bare_need(site(height="[2.6, 3.6] m", friction="[38, 40] deg"), "height"),
        "speed": bare_need(site(height="[3.0, 3.4] m"), most="speed"),
        "chance": bare_need(site(**UNCERTAIN, height="3.4 m"), probability=0.9),
        "sets": bare_need(load_text(SETS, folder / "sets.yaml"), margin=0.1),
        "capacity": capacity(site(height="[3.0, 3.4] m")),
        "uncertainty": boulder_sweep.uncertainty(site(**UNCERTAIN, height="[3.0, 3.4] m"), half_width=0.2),
        "one": bare_need(site(height="3.4 m", friction="40 deg")),
        "nothing": bare_need(site(height="2.0 m", friction="36 deg")),
    }
    for name, answers in found.items():
        answers.write(folder / f"{name}.parquet")
    return {name: folder / f"{name}.parquet" for name in found}


NEEDS = ("depth", "depth of a ratio", "height", "speed", "chance", "sets", "one", "nothing")


@pytest.mark.parametrize("name", NEEDS)
def test_a_need_is_read_back_as_it_was(files: dict[str, Path], name: str) -> None:
    file = AnswerFile(files[name], ReportError)
    found = file.answers()
    assert isinstance(found, Need)
    assert file.asked == len(found) == file.rows
    asked = json.loads(found.arrow.schema.metadata[b"boulder_sweep.question"])
    assert (found.key.answer, found.least_margin) == (asked["asked"], asked["margin"])
    assert found.probability == (0.9 if name == "chance" else None)
    assert file.question.get("robust", False) == (name == "depth of a ratio")
    settings = file.identity["settings"]
    given = found.sweep.resolved()
    assert {key: given[key] for key in ("name", "order", "inputs", "criterion", "model")} == {
        key: settings[key] for key in ("name", "order", "inputs", "criterion", "model")
    }


def test_axes_too_long_for_the_settings_are_read_from_the_table(tmp_path: Path) -> None:
    many = ", ".join(f"{30 + place / 100:g}" for place in range(1001))
    found = bare_need(site(height="3.4 m", friction=f"[{many}] deg"))
    found.write(tmp_path / "many.parquet")
    rows = read_rows(tmp_path / "many.parquet")
    assert rows.shape == (1001,)
    np.testing.assert_array_equal(rows.inputs["friction_angle_deg"], found.sweep.axes[0].values)


def test_of_a_question_without_a_recommendation_the_governing_answer_is_named(files: dict[str, Path]) -> None:
    answers = AnswerFile(files["speed"], ReportError).answers()
    assert isinstance(answers, Need)
    assert answers.recommendation is None
    frame = answers.frame.reset_index(drop=True)
    speeds = frame["most_impact_speed_m_s"]
    answer = answer_of(read_rows(files["speed"]))
    assert answer.named.number == speeds.idxmin()
    governing = answer.sentences[0]
    assert governing[1] == Measure(speeds.min(), "m/s")
    assert str(governing[2]).startswith(f" (design {speeds.idxmin()}, margin ")


def test_what_has_no_answer_says_why(files: dict[str, Path], tmp_path: Path) -> None:
    bare_need(site(height="2.0 m"), most="speed").write(tmp_path / "speed.parquet")
    assert answer_of(read_rows(tmp_path / "speed.parquet")).sentences == (("Nothing that was tried passes.",),)
    nothing = read_rows(files["nothing"])
    assert screens(nothing, answer_of(nothing))["si"].signs == [
        "blocked: does not pass by what was asked, up to where the truck would pass or ride over the boulder (1 row)",
        "dig, fill: soil to excavate and to put back (docs/model.md)",
    ]
    rows = read_rows(files["depth"])
    table = pq.read_table(files["depth"]).to_pylist()
    assert rows.counts() == {
        name: sum(_name(row) == name for row in table) for name in dict.fromkeys(map(_name, table))
    }


def _name(row: dict[str, Any]) -> str:
    return f"fail: {row['found']}" if row["passes_at"] is None else f"pass: {row['robustness']}"


RARELY_OPENED = ("sets", "height", "speed", "chance", "uncertainty", "nothing")


@pytest.mark.parametrize(
    "name", ["depth", "capacity", *(pytest.param(one, marks=pytest.mark.nightly) for one in RARELY_OPENED)]
)
def test_the_page_opens_without_a_complaint(files: dict[str, Path], name: str, tmp_path: Path, opened: Any) -> None:
    page = opened(write_report(files[name], tmp_path / "page.html"))
    table = pq.read_table(files[name]).to_pylist()
    assert page.complaints == []
    assert not page.is_visible("#failure")
    answers = AnswerFile(files[name], ReportError)
    for units in ("us", "si"):
        page.select_option("#units", units)
        screen = SCREENS[answers.kind](answers.answers(), units)
        lines = [[word for head, _ in screen.columns for word in head]]
        lines += [[cell(row) for _, cell in screen.columns] for row in screen.rows]
        shown = page.locator(".answers:visible tr").all_inner_texts()
        assert [line.split() for line in shown] == [" ".join(line).split() for line in lines]
        signs = page.locator("[data-in]:visible > .wide:has(.answers) ~ .signs").all_inner_texts()
        assert signs == [*screen.signs, *volume_lines("  ".join(head[0] for head, _ in screen.columns))]
    if len(table) > 1:
        assert re.match(rf"\d+ of the {len(table)} designs shown pass", page.inner_text("#sweep-words"))
    chosen = page.evaluate("page.data.chosen[0]")
    row = table[chosen["number"]]
    for column in ("embedment_depth_m", "boulder_height_m", "friction_angle_deg", "impact_speed_m_s"):
        assert chosen["inputs"][column] == row[column]
    assert page.inner_text("#chosen0-verdict")[2:].startswith(row["verdict"])
    assert page.complaints == []


def test_the_map_of_a_need_says_the_answers(files: dict[str, Path], tmp_path: Path, opened: Any) -> None:
    page = opened(write_report(files["depth"], tmp_path / "page.html"))
    table = pq.read_table(files["depth"]).to_pylist()
    assert [page.input_value(f"#{one}") for one in ("across", "up")] == ["boulder_height_m", "friction_angle_deg"]
    cells = page.evaluate("page.maps.sweep.cells.map((cell) => ({ x: cell.x, y: cell.y, words: wordsOf(cell) }))")
    for row in table:
        (cell,) = [one for one in cells if (one["x"], one["y"]) == (row["boulder_height_m"], row["friction_angle_deg"])]
        if row["passes_at"] is None:
            assert cell["words"] == f"fail: {row['found'].replace('_', ' ')}"
        else:
            depth = float(re.search(r"embedment depth ([\d.]+)", cell["words"])[1])
            assert depth == pytest.approx(row["least_embedment_depth_m"], rel=1e-3)


@pytest.mark.parametrize("name", ["depth", "sets", "speed", "chance", "capacity", "uncertainty"])
def test_a_chart_is_drawn(files: dict[str, Path], name: str, tmp_path: Path, sweep: Command) -> None:
    code, out, err = sweep("plot", files[name], "-o", tmp_path / "chart.png", "--units", "us")
    assert (code, err) == (0, "")
    rows = len(pq.read_table(files[name]))
    assert out == f"{tmp_path / 'chart.png'}: {rows} answers\n"
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")
    code, _, err = sweep("plot", files[name], "--across", "width")
    assert code == 2
    assert "a chart of answers takes none" in err


def test_one_design_of_uncertainty_is_drawn_with_its_samples(tmp_path: Path, sweep: Command) -> None:
    one = site(height="3.2 m", friction="{mean: 40 deg, cov: 5 %}")
    boulder_sweep.uncertainty(one, half_width=0.1).write(tmp_path / "one.parquet")
    assert sweep("plot", tmp_path / "one.parquet") == (0, f"{tmp_path / 'one.png'}: 1 answer\n", "")
    (tmp_path / "one.samples.parquet").unlink()
    code, _, err = sweep("plot", tmp_path / "one.parquet")
    assert code == 2
    assert "no samples of design 0 are kept" in err


def test_two_needs_are_paired_by_their_inputs(files: dict[str, Path], tmp_path: Path) -> None:
    weaker = bare_need(site(friction="[34, 38] deg"), margin="10 %")
    weaker.write(tmp_path / "weaker.parquet")
    found = compare(files["depth"], tmp_path / "weaker.parquet")
    before, after = (pq.read_table(file).to_pandas() for file in (files["depth"], tmp_path / "weaker.parquet"))
    assert (len(found.matched), found.differ, found.kind) == (len(before), ("friction_angle_deg",), "need")
    assert found.answers == {"least_embedment_depth_m": "m"}
    change = (after.least_embedment_depth_m - before.least_embedment_depth_m).dropna()
    moves = found.to_dict()["answers"]["least_embedment_depth_m"]
    assert (moves["larger"], moves["smaller"]) == ((change > 0).sum(), (change < 0).sum())
    assert moves["largest_change"] == change.max() > 0
    lost = int((before.passes_at.notna() & after.passes_at.isna()).sum())
    assert found.turned()["passes_lost"] == lost
    assert any("friction_angle_deg" in line for line in found.changed)


def test_an_answer_file_does_not_differ_from_itself(files: dict[str, Path]) -> None:
    for name, file in files.items():
        found = compare(file, file)
        assert len(found.matched) == len(pq.read_table(file)), name
        assert found.changed == ()
        for moves in found.to_dict()["answers"].values():
            assert (moves["larger"], moves["smaller"]) == (0, 0)


def test_the_command_says_what_changed(files: dict[str, Path], tmp_path: Path, sweep: Command) -> None:
    capacity(site(height="[3.0, 3.4] m").__class__(**_slower())).write(tmp_path / "slower.parquet")
    code, out, _ = sweep("compare", files["capacity"], tmp_path / "slower.parquet", "--units", "us", "--show", "1")
    assert code == 0
    assert "differs  impact speed: 30 -> 25 mph" in out
    assert "withstands_mass_lb: 4 larger, 0 smaller, 0 equal after (by +" in out
    code, out, _ = sweep("compare", files["depth"], files["depth"])
    assert code == 0
    assert "least_embedment_depth_m: 0 larger, 0 smaller, " in out


def _slower() -> dict[str, Any]:
    """Return the parts of the same sweep at a lower speed."""
    own = vars(site(height="[3.0, 3.4] m")).copy()
    own.pop("plan", None)
    return own | {"constants": own["constants"] | {"impact_speed_m_s": 11.176}}


@pytest.mark.parametrize("other", ["height", "capacity", "uncertainty"])
def test_answers_to_two_questions_are_not_compared(files: dict[str, Path], other: str) -> None:
    with pytest.raises(ReportError, match="compare two results of one command and question"):
        compare(files["depth"], files[other])


def test_a_file_with_other_columns_or_rows_is_refused(files: dict[str, Path], tmp_path: Path) -> None:
    table, other = pq.read_table(files["depth"]), tmp_path / "other.parquet"
    pq.write_table(table.slice(1), other)
    with pytest.raises(ReportError, match="does not hold the rows of its 6 designs in their order"):
        write_report(other, tmp_path / "page.html")
    pq.write_table(table.drop_columns(["margin"]), other)
    with pytest.raises(ReportError, match="is damaged; write it again with `sweep need`"):
        write_report(other, tmp_path / "page.html")
    pq.write_table(pa.table({"a": [1]}), other)
    with pytest.raises(ReportError, match="neither the folder of a run nor a file that `sweep` wrote"):
        write_report(other, tmp_path / "page.html")


def test_more_rows_than_designs_are_refused(files: dict[str, Path], tmp_path: Path) -> None:
    table = pq.read_table(files["capacity"])
    pq.write_table(pa.concat_tables([table] * 2), tmp_path / "twice.parquet")
    with pytest.raises(ReportError, match="is damaged: it has 8 rows for 4 designs"):
        AnswerFile(tmp_path / "twice.parquet", ReportError)


PARSED = ("settings", "control", "readings", "versions", "accuracy", "question")


def changed(table: pa.Table, chance: random.Random) -> tuple[pa.Table, str]:
    """Return answers with one place of their settings changed, and their hash made right again; and which place."""
    keys = [name for name in PARSED if f"boulder_sweep.{name}".encode() in table.schema.metadata]
    parts = {name: json.loads(table.schema.metadata[f"boulder_sweep.{name}".encode()]) for name in keys}
    place = chance.choice([place for place in places(parts) if len(place) > 1])
    value = chance.choice(OTHER_VALUES)
    put(parts, place, value)
    metadata = dict(table.schema.metadata)
    metadata |= {f"boulder_sweep.{name}".encode(): json.dumps(part).encode() for name, part in parts.items()}
    metadata[b"boulder_sweep.settings_sha256"] = settings_sha256(parts["settings"]).encode()
    return table.replace_schema_metadata(metadata), f"{place}: {value!r}"


@pytest.mark.parametrize("many", [pytest.param(6, id="some"), pytest.param(120, id="many", marks=pytest.mark.nightly)])
@pytest.mark.parametrize("name", ["depth", "sets", "chance", "capacity", "uncertainty"])
def test_one_changed_place_in_the_settings_ends_in_words(
    files: dict[str, Path], tmp_path: Path, sweep: Command, name: str, many: int
) -> None:
    """Or in the answer, where the place holds what a settings file may say."""
    table, chance, refused = pq.read_table(files[name]), random.Random(name), 0
    file = tmp_path / "changed.parquet"
    for _ in range(many):
        other, place = changed(table, chance)
        pq.write_table(other, file)
        for words in (
            ("report", file, "-o", tmp_path / "page.html"),
            ("export", file, "-o", tmp_path / "table.csv"),
            ("compare", file, files[name]),
            ("plot", file, "-o", tmp_path / "plot.png"),
        ):
            code, _, err = sweep(*words)
            assert code in (0, 2), (place, err)
            assert not re.search(r"\b[A-Z]\w+(Error|Exception)\b", err), (place, err)
            refused += code
    assert refused > many


@pytest.mark.parametrize("entry", ["max_rotation_deg", "rating", "min_overlap_m"])
def test_a_criterion_without_an_entry_is_refused(files: dict[str, Path], tmp_path: Path, entry: str) -> None:
    """A settings file may leave it to its default, which is in every result."""
    table = pq.read_table(files["one"])
    settings = json.loads(table.schema.metadata[b"boulder_sweep.settings"])
    del settings["criterion"][entry]
    hashed = {b"boulder_sweep.settings_sha256": settings_sha256(settings).encode()}
    metadata = table.schema.metadata | {b"boulder_sweep.settings": json.dumps(settings).encode()} | hashed
    pq.write_table(table.replace_schema_metadata(metadata), tmp_path / "one.parquet")
    with pytest.raises(ReportError, match=f"damaged .settings.criterion.{entry} is missing.; write it again"):
        AnswerFile(tmp_path / "one.parquet", ReportError)


def test_files_beside_answers_belong_to_them(files: dict[str, Path], tmp_path: Path, sweep: Command) -> None:
    """Samples of other answers, and of none."""
    for name in ("uncertainty.parquet", "uncertainty.samples.parquet"):
        shutil.copy(files["uncertainty"].with_name(name), tmp_path / name)
    assert sweep("plot", tmp_path / "uncertainty.parquet", "-o", tmp_path / "chance.png")[0] == 0
    samples = tmp_path / "uncertainty.samples.parquet"
    table = pq.read_table(samples)
    for metadata in (None, {**table.schema.metadata, b"boulder_sweep.settings_sha256": b"0" * 64}):
        pq.write_table(table.replace_schema_metadata(metadata), samples)
        code, _, err = sweep("plot", tmp_path / "uncertainty.parquet", "-o", tmp_path / "chance.png")
        assert code == 2
        assert "uncertainty.samples.parquet belongs to other answers than" in err
