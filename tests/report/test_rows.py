"""What a page takes from a table: every verdict, the designs worth naming, and what is left out of large ones."""

import json

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.report.answers import Quantity, answer_of
from boulder_sweep.report.contents import table_data
from boulder_sweep.report.rows import NOT_YET, read_rows, thinned
from tests.report.conftest import SETS


@pytest.fixture(scope="module")
def rows(result):
    return read_rows(result)


@pytest.fixture(scope="module")
def table(result):
    return boulder_sweep.read(result)


def test_every_row_has_its_verdict(rows, table):
    names = np.where(table.reason == "", table.verdict, table.verdict.astype(str) + ": " + table.reason.astype(str))
    assert [rows.names[code] for code in rows.codes] == list(names)
    assert rows.having("pass").ravel().tolist() == (table.verdict == "pass").tolist()
    assert rows.counts() == {name: int((names == name).sum()) for name in set(names)}


def test_passes_outside_of_what_was_tested_are_counted(rows, table):
    passing = table[table.verdict == "pass"].validity.astype(object)
    assert rows.flags.get("", 0) == (passing == "").sum()
    for name in set(rows.flags) - {""}:
        assert rows.flags[name] == sum(name in word.split(";") for word in passing)
    flagged = len(passing) - rows.flags.get("", 0)
    found = [sentence[0] for sentence in answer_of(rows).sentences if "lie outside" in str(sentence[0])]
    assert [text.split(" ")[0] for text in found] == ([str(flagged)] if flagged else [])


def test_mass_and_depth_follow_from_the_axes(rows, table):
    mass = table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
    np.testing.assert_allclose(np.broadcast_to(rows.mass(), rows.shape).ravel(), mass)
    np.testing.assert_allclose(np.broadcast_to(rows.depth(), rows.shape).ravel(), table.embedment_depth_m)


def test_the_answer_names_the_least_boulder_that_passes_in_every_soil(rows, table):
    table = table.assign(
        mass=table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
    )
    boulder = ["boulder_width_m", "boulder_height_m", "embedment_depth_m"]
    everywhere = table.groupby(boulder).verdict.transform(lambda verdicts: (verdicts == "pass").all())
    lightest = table[everywhere].sort_values(["mass", "embedment_depth_m", "margin"]).iloc[0]
    answer = answer_of(rows)
    assert answer.named[0].number == lightest.design_id
    sentence = next(sentence for sentence in answer.sentences if "lightest" in str(sentence[0]))
    quantities = [part for part in sentence if isinstance(part, Quantity)]
    assert [part.value for part in quantities] == pytest.approx([lightest.mass, lightest.embedment_depth_m])
    assert f"margin {lightest.margin:.1%}" in sentence[-1]
    shallowest = table[everywhere].embedment_depth_m.min()
    assert table.embedment_depth_m[answer.named[1].number] == pytest.approx(shallowest)


def test_the_numbers_of_the_answer_add_up(rows, table):
    first = answer_of(rows).sentences[0][0]
    assert (
        first
        == f"{(table.verdict == 'pass').sum()} of {len(table)} designs pass ({(table.verdict == 'pass').mean():.1%})."
    )


def test_of_a_large_grid_the_longest_axes_are_thinned_and_it_says_so(rows):
    whole = thinned(rows)
    assert whole.words == ""
    assert [len(places) for places in whole.places] == [2, 9, 7, 2]
    part = thinned(rows, most_cells=100)
    assert [len(places) for places in part.places] == [2, 5, 4, 2]
    assert part.words == "5 of 9 values of boulder_height_m, 4 of 7 values of embedment_ratio, spread evenly"
    for places, length in zip(part.places, rows.shape, strict=True):
        assert (places[0], places[-1]) == (0, length - 1)
        assert (np.diff(places) > 0).all()


def test_a_list_of_designs_keeps_its_inputs(tmp_path, result):
    table = boulder_sweep.read(result)
    inputs = table[["boulder_height_m", "embedment_depth_m", "friction_angle_deg"]]
    inputs.iloc[::7].to_csv(tmp_path / "designs.csv", index=False)
    (tmp_path / "list.yaml").write_text(
        "name: list\ntable: designs.csv\nboulder: {length: 1.65 m, width: 1.5 m, density: 2600 kg/m^3}\n"
        "soil: {density: 1860 kg/m^3, subgrade_reaction: 60 MN/m^3}\n"
        "vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}\n"
    )
    boulder_sweep.run(boulder_sweep.load(tmp_path / "list.yaml"), tmp_path / "list.sweep")
    rows = read_rows(tmp_path / "list.sweep")
    assert rows.axes == {}
    np.testing.assert_array_equal(rows.inputs["friction_angle_deg"], inputs.iloc[::7].friction_angle_deg)
    answer = answer_of(rows)
    assert rows.row(answer.named[0].number)["verdict"] == "pass"
    part = thinned(rows, most_points=10)
    assert part.words == "10 of the 36 designs of the list, spread evenly"
    assert part.places[0].tolist()[:2] == [0, 4]


def test_rows_that_are_not_there_yet_are_neither_pass_nor_fail(result, tmp_path):
    """As after an interruption: the manifest knows fewer rows than the sweep has."""
    rows = read_rows(result)
    codes = rows.codes.copy()
    codes[100:] = len(rows.names) - 1
    unfinished = type(rows)(
        rows.folder, rows.finished, rows.names, codes, rows.flags, rows.axes, rows.sets, rows.inputs
    )
    assert unfinished.counts()[NOT_YET] == 152
    assert any("152 designs are not computed yet" in str(sentence[0]) for sentence in answer_of(unfinished).sentences)


def test_named_soils_are_one_axis_that_gives_all_their_inputs(tmp_path):
    (tmp_path / "sites.yaml").write_text(SETS)
    boulder_sweep.run(boulder_sweep.load(tmp_path / "sites.yaml"), tmp_path / "out")
    rows, table = read_rows(tmp_path / "out"), boulder_sweep.read(tmp_path / "out")
    assert rows.shape == (2, 3, 2)
    assert rows.sets["soil"].names == ("loose", "dense sand")
    for name in ("soil_density_kg_m3", "friction_angle_deg", "subgrade_reaction_MN_m3", "embedment_ratio"):
        column = table.embedment_depth_m / table.boulder_height_m if name == "embedment_ratio" else table[name]
        np.testing.assert_allclose(np.broadcast_to(rows.inputs[name], rows.shape).ravel(), column)
    assert "all 2 soils" in str(answer_of(rows).sentences) or "every soil" in str(answer_of(rows).sentences)


def test_the_largest_map_takes_little_of_a_page(rows):
    """Random verdicts, which no packing makes small, on a grid of as many designs as a map may show."""
    axes = {
        "boulder_height_m": np.linspace(1.5, 4.0, 150),
        "embedment_ratio": np.linspace(0.35, 0.75, 100),
        "friction_angle_deg": np.linspace(27.0, 49.0, 100),
    }
    codes = np.random.default_rng(3).integers(0, 4, 1_500_000).astype(np.uint8)
    names = ("pass", "fail: overturns", "fail: penetration", "undecided: error", NOT_YET)
    large = type(rows)(rows.folder, rows.finished, names, codes, {}, axes, {}, {})
    kept = thinned(large)
    assert kept.words == ""
    assert len(json.dumps(table_data(large, kept))) < 1_000_000
    assert thinned(large, most_cells=1_400_000).words == "75 of 150 values of boulder_height_m, spread evenly"
