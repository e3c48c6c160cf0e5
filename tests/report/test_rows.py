"""What a page takes from a table: every verdict, the designs worth naming, and what is left out of large ones."""

import dataclasses
import json

import numpy as np
import pandas as pd
import pytest

import boulder_sweep
from boulder_sweep.answers.advice import advice
from boulder_sweep.judge.quantities import quantities
from boulder_sweep.report import write_report
from boulder_sweep.report.answers import answer_of
from boulder_sweep.report.page import table_data, thinned
from boulder_sweep.report.rows import NOT_YET, read_rows
from boulder_sweep.settings.model import Ground, Shape
from boulder_sweep.store import folder
from tests.report.conftest import GRID, LIST, SETS


@pytest.fixture(scope="module")
def rows(result):
    return read_rows(result)


@pytest.fixture(scope="module")
def table(result):
    return boulder_sweep.read(result)


def test_every_row_has_its_verdict(rows, table):
    told = np.where(table.verdict == "pass", table.robustness.astype(str), table.reason.astype(str))
    names = np.where(told == "", table.verdict, table.verdict.astype(str) + ": " + told)
    assert [rows.names[code] for code in rows.codes] == list(names)
    assert rows.having("pass").ravel().tolist() == (table.verdict == "pass").tolist()
    assert rows.counts() == {name: int((names == name).sum()) for name in set(names)}


def test_every_row_has_its_grade_whether_it_was_asked_for_or_not(rows, table):
    graded = table.robustness.astype(object).where(table.verdict == "pass", "")
    assert [rows.robustness[code] for code in rows.codes] == list(graded)
    assert len(set(graded)) > 1


def test_mass_and_depth_follow_from_the_axes(rows, table):
    mass = table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
    np.testing.assert_allclose(np.broadcast_to(rows.mass(), rows.shape).ravel(), mass)
    np.testing.assert_allclose(np.broadcast_to(rows.depth(), rows.shape).ravel(), table.embedment_depth_m)


def test_the_numbers_of_the_answer_add_up(rows, table):
    first = answer_of(rows).sentences[0][0]
    assert (
        first
        == f"{(table.verdict == 'pass').sum()} of {len(table)} designs pass ({(table.verdict == 'pass').mean():.1%})."
    )


def test_of_a_large_grid_the_longest_axes_are_thinned_and_it_says_so(rows):
    whole = thinned(rows)
    assert whole.words == ""
    assert [len(indices) for indices in whole.indices] == [2, 9, 7, 2]
    part = thinned(rows, most_cells=100)
    assert [len(indices) for indices in part.indices] == [2, 5, 4, 2]
    assert part.words == "5 of 9 values of boulder_height_m, 4 of 7 values of embedment_ratio, spread evenly"
    for indices, length in zip(part.indices, rows.shape, strict=True):
        assert (indices[0], indices[-1]) == (0, length - 1)
        assert (np.diff(indices) > 0).all()


def test_a_list_of_designs_keeps_its_inputs(tmp_path, result):
    table = boulder_sweep.read(result)
    inputs = table[["boulder_height_m", "embedment_depth_m", "friction_angle_deg"]]
    inputs.iloc[::7].to_csv(tmp_path / "designs.csv", index=False)
    (tmp_path / "list.yaml").write_text(LIST)
    boulder_sweep.run(boulder_sweep.load(tmp_path / "list.yaml"), tmp_path / "list.sweep")
    rows = read_rows(tmp_path / "list.sweep")
    assert rows.axes == {}
    np.testing.assert_array_equal(rows.inputs["friction_angle_deg"], inputs.iloc[::7].friction_angle_deg)
    answer = answer_of(rows)
    assert answer.row == {**answer.row, **rows.row(answer.named.number), "robustness": "robust"}
    part = thinned(rows, most_points=10)
    assert part.words == "10 of the 36 designs of the list, spread evenly"
    assert part.indices[0].tolist()[:2] == [0, 4]


def test_rows_that_are_not_there_yet_are_neither_pass_nor_fail(result, tmp_path):
    """As after an interruption: there are fewer rows than the sweep has."""
    rows = read_rows(result)
    codes = rows.codes.copy()
    codes[100:] = len(rows.names) - 1
    unfinished = dataclasses.replace(rows, codes=codes)
    assert unfinished.counts()[NOT_YET] == 152
    assert any("152 designs are not computed yet" in str(sentence[0]) for sentence in answer_of(unfinished).sentences)


def test_a_list_that_is_not_finished_has_a_report_of_its_finished_rows(tmp_path, monkeypatch):
    designs = pd.DataFrame({"boulder_height_m": np.linspace(2.0, 3.8, 10).tolist() * 2})
    designs["friction_angle_deg"] = np.repeat([44.0, 30.0], 10)
    designs["embedment_depth_m"] = 0.6 * designs.boulder_height_m
    designs.to_csv(tmp_path / "designs.csv", index=False)
    (tmp_path / "list.yaml").write_text(LIST)
    out = tmp_path / "list.sweep"
    monkeypatch.setattr(folder, "FEWEST_ROWS", 5)
    boulder_sweep.run(boulder_sweep.load(tmp_path / "list.yaml"), out)
    max(out.iterdir()).unlink()
    rows = read_rows(out)
    assert rows.counts()[NOT_YET] == 5
    assert thinned(rows).indices[0].tolist() == list(range(15))
    assert boulder_sweep.read(out).verdict[answer_of(rows).named.number] == "pass"
    assert write_report(out, tmp_path / "list.html").stat().st_size > 100_000


def test_named_soils_are_one_axis_that_gives_all_their_inputs(tmp_path):
    (tmp_path / "sites.yaml").write_text(SETS)
    boulder_sweep.run(boulder_sweep.load(tmp_path / "sites.yaml"), tmp_path / "out")
    rows, table = read_rows(tmp_path / "out"), boulder_sweep.read(tmp_path / "out")
    assert rows.shape == (2, 3, 2)
    assert rows.sets["soil"].names == ("loose", "dense sand")
    for name in ("soil_density_kg_m3", "friction_angle_deg", "subgrade_reaction_MN_m3", "embedment_ratio"):
        column = table.embedment_depth_m / table.boulder_height_m if name == "embedment_ratio" else table[name]
        np.testing.assert_allclose(np.broadcast_to(rows.inputs[name], rows.shape).ravel(), column)
    assert " in both soils" in advice(answer_of(rows).need)[0]


def test_the_largest_map_takes_little_of_a_page(rows):
    """Random verdicts, which no packing makes small, on a grid of as many designs as a map may show."""
    axes = {
        "boulder_height_m": np.linspace(1.5, 4.0, 150),
        "embedment_ratio": np.linspace(0.35, 0.75, 100),
        "friction_angle_deg": np.linspace(27.0, 49.0, 100),
    }
    codes = np.random.default_rng(3).integers(0, 4, 1_500_000).astype(np.uint8)
    names = ("pass", "fail: overturns", "fail: penetration", "undecided: error", NOT_YET)
    large = type(rows)(rows.finished, names, codes, {}, axes, {}, {})
    kept = thinned(large)
    assert kept.words == ""
    assert len(json.dumps(table_data(large, kept))) < 1_000_000
    assert thinned(large, most_cells=1_400_000).words == "75 of 150 values of boulder_height_m, spread evenly"


FAST = GRID.replace("speed: 30 mph", "speed: [30, 40] mph")
BOULDER = ["boulder_width_m", "boulder_height_m", "embedment_depth_m"]


def ran(text, folder, name="grid"):
    """Run a file; return what the page reads of it, and its table with the masses."""
    (folder / f"{name}.yaml").write_text(text)
    out = boulder_sweep.run(boulder_sweep.load(folder / f"{name}.yaml"), folder / f"{name}.sweep").out
    table = boulder_sweep.read(out)
    mass = table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
    return read_rows(out), table.assign(mass=mass)


def said_of(rows, word):
    """Return the sentence with a word, with its numbers in the units of the table."""
    sentence = next(one for one in answer_of(rows).sentences if word in str(one[0]))
    return "".join(part if isinstance(part, str) else f"{part.value:.6g} {part.unit}" for part in sentence)


def test_passes_of_which_second_opinions_were_asked_have_a_grade(tmp_path):
    rows, table = ran(f"{FAST}\nmodel: {{second_opinion: [broms, width_capped]}}\n", tmp_path)
    passes, counts = table[table.verdict == "pass"], table.robustness.value_counts()
    graded = {name: n for name, n in rows.counts().items() if name.startswith("pass")}
    assert graded == {f"pass: {grade}": counts[grade] for grade in ("robust", "sensitive")}
    assert rows.having("pass").sum() == len(passes)
    said = said_of(rows, "are robust")
    assert said.startswith(f"Of the {len(passes)} that pass, {counts['robust']} are robust (stands with friction")
    assert f"{counts['sensitive']} are sensitive" in said


def test_without_second_opinions_the_page_says_so(tmp_path):
    rows, table = ran(NOT_ASKED, tmp_path)
    left = (table.robustness == "open").sum()
    words = "No second opinion" if left == (table.verdict == "pass").sum() else f"{left} are open"
    assert words in said_of(rows, words)
    assert "pass" in rows.names


def best_of(table, margin=0.25):
    """Return the rows of the design to be recommended: it holds in all its rows, and is robust, then light."""
    built = quantities(table, Shape(), Ground())["excavated_m3"]
    table = table.assign(dug=built, rank=table.robustness.map({"robust": 0, "open": 1, "sensitive": 2}).astype(float))
    own = table.groupby(BOULDER)
    held = own.verdict.transform(lambda words: (words == "pass").all()) & (own.margin.transform("min") >= margin)
    held &= own.margin.transform("count") == own.margin.transform("size")
    worst = table[held].groupby(BOULDER).agg({"rank": "max", "mass": "max", "dug": "max", "margin": "min"})
    best = worst.sort_values(["rank", "mass", "dug"]).iloc[0]
    return table[(table[BOULDER] == list(best.name)).all(axis=1)], worst


NOT_ASKED = f"{FAST}\nmodel: {{second_opinion: none}}\n"
ASKED = f"{FAST}\nmodel: {{second_opinion: [broms, width_capped]}}\n"


@pytest.mark.parametrize("angles", ["[36, 40]", "[40, 43]", "40"])
def test_a_run_recommends_the_lightest_robust_design_that_has_the_margin_everywhere(angles, tmp_path):
    rows, table = ran(ASKED.replace("angle: [36, 40]", f"angle: {angles}"), tmp_path)
    best, all_held = best_of(table)
    answer = answer_of(rows)
    found = answer.need.recommendation
    assert [one["design_id"] for one in found.design.rows] == best.design_id.tolist()
    assert (found.qualified, found.alike) == (len(all_held), int((all_held["rank"] <= best["rank"].max()).sum()))
    assert found.design.grade == "robust"
    assert answer.row["design_id"] == answer.named.number == best.design_id[best.margin.idxmin()]
    passing = table[table.verdict == "pass"]
    assert best.mass.iloc[0] > passing.mass.min()  # which is lighter, but not in every case, or sensitive
    assert f"{100 * best.margin.min():.0f}\u00a0% to spare" in advice(answer.need)[0]


def test_a_run_without_second_opinions_asks_them_of_what_it_recommends(tmp_path):
    rows, table = ran(NOT_ASKED.replace("angle: [36, 40]", "angle: [40, 43]"), tmp_path)
    _, asked = ran(ASKED.replace("angle: [36, 40]", "angle: [40, 43]"), tmp_path, "asked")
    found = answer_of(rows).need.recommendation.design
    numbers = [one["design_id"] for one in found.rows]
    assert numbers == best_of(asked)[0].design_id.tolist()
    assert "open" in set(table.robustness[numbers])
    assert [one["robustness"] for one in found.rows] == asked.robustness[numbers].tolist()
    assert answer_of(dataclasses.replace(rows, asks=False)).need.recommendation.design.grade == "open"


def test_a_speed_that_no_boulder_withstands_is_said_and_the_nearest_named(tmp_path):
    rows, table = ran(FAST.replace("[30, 40] mph", "[30, 90] mph"), tmp_path)
    assert not (table[table.impact_speed_m_s > 20].verdict == "pass").any()
    answer = answer_of(rows)
    none, nearest = advice(answer.need)
    assert none == "No design of the run passes with 25\u00a0% to spare in all 4 cases of soil and vehicle."
    passes = table.groupby(BOULDER).verdict.apply(lambda words: int((words == "pass").sum()))
    assert f"which fails in {4 - passes.max()} of 4 cases" in nearest
    assert answer.row["verdict"] == "fail"
    assert (table[BOULDER].iloc[answer.named.number] == [answer.row[name] for name in BOULDER]).all()


def test_vehicles_by_name_are_withstood_all(tmp_path):
    vehicle = "mass: 15000 lb, spring: 3103.3 kN/m, damper: 138.91 kN*s/m"
    trucks = f"[{{name: slow, speed: 30 mph, {vehicle}}}, {{name: fast, speed: 31 mph, {vehicle}}}]"
    rows, table = ran(f"{GRID.split('vehicle:')[0]}vehicle: {trucks}\n", tmp_path)
    answer = answer_of(rows)
    assert len(answer.need.recommendation.design.rows) == 4
    assert answer.row["vehicle"] == "fast"
    assert table.margin[answer.named.number] >= 0.25


def test_a_boulder_of_a_list_passes_in_all_of_its_rows(tmp_path):
    angles = {3.2: (30, 42), 3.4: (38, 42), 3.6: (42,)}
    lines = [
        f"{height},{height * 0.65},{angle}" for angle in (30, 38, 42) for height in angles if angle in angles[height]
    ]
    (tmp_path / "designs.csv").write_text("boulder_height_m,embedment_depth_m,friction_angle_deg\n" + "\n".join(lines))
    rows, table = ran(LIST, tmp_path)
    assert table.verdict.tolist() == ["fail", "pass", "pass", "pass", "pass"]
    best, _ = best_of(table, 0.25)
    answer = answer_of(rows)
    # The lightest that passes at all fails in the other soil of the list.
    assert [one["design_id"] for one in answer.need.recommendation.design.rows] == best.design_id.tolist()
    assert " in every row of the list that has it" in advice(answer.need)[0]
    (tmp_path / "designs.csv").write_text(
        "boulder_height_m,embedment_depth_m,friction_angle_deg\n3.2,2.08,30\n3.2,2.08,42\n"
    )
    rows, _ = ran(LIST, tmp_path, "none")
    assert "which fails in 1 of 2 cases" in advice(answer_of(rows).need)[1]


def test_every_row_of_several_parts_has_its_own_margin(tmp_path):
    depths = "site.embedment_depth={from: 2.1 m, to: 2.6 m, count: 256}"
    sweep = boulder_sweep.load("configs/site.yaml", [depths, "boulder.height=3.6 m", "soil.friction_angle=40 deg"])
    boulder_sweep.run(sweep, tmp_path / "out")
    assert len(list((tmp_path / "out").iterdir())) == 4
    margins = boulder_sweep.read(tmp_path / "out")["margin"].to_numpy(float)
    assert len(set(margins)) == 256
    numbers = np.arange(len(margins))[::2]
    assert np.array_equal(read_rows(tmp_path / "out").margins(numbers), margins[::2], equal_nan=True)
