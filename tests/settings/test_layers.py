"""Layers, water, cohesion and slope; named sets of soils and vehicles: what is read, what is refused, and where."""

import numpy as np
import pytest

from boulder_sweep.cli.console import grid_lines
from boulder_sweep.settings.model import Ground, Layer

FILE = """\
boulder: {length: 1.65 m, width: 1.98 m, height: 3.05 m, density: 2596}
site: {embedment_depth: 1.9 m}
soil:
  density: 1860
  friction_angle: [38 deg, 43 deg]
  subgrade_reaction: 60
WHAT
vehicle: {mass: 6800 kg, speed: 50 km/h, spring: 3103 kN/m, damper: 138.9 kN*s/m}
"""
DEEPER = "{from: 0.5 m, density: 2 t/m^3, friction_angle: 36 deg, subgrade_reaction: 40000 kN/m^3, cohesion: 2 kPa}"


def ground_of(*lines: str) -> str:
    return FILE.replace("WHAT", "\n".join(f"  {line}" for line in lines))


def test_what_is_read(load_it) -> None:
    sweep = load_it(ground_of(f"layers: [{DEEPER}]", "cohesion: 4000 Pa", "water_table: 80 cm", "slope: 0.1 rad"))
    ground = sweep.model.ground
    assert ground.layers == (Layer(0.5, 2000.0, 36.0, 40.0, 2.0),)
    assert (ground.cohesion_kPa, ground.water_table_m) == (4.0, 0.8)
    assert ground.slope_deg == pytest.approx(5.7296, abs=1e-4)
    assert sweep.n_designs == 2
    words = (
        "2 layers of soil, cohesion 4 / 2 kPa, water table 0.8 m down, ground falling by 5.72958° behind the boulder"
    )
    assert grid_lines(sweep)[-1] == f"  {words}"
    assert Ground.of_dict(sweep.resolved()["model"]["ground"]) == ground


@pytest.mark.parametrize(
    ("line", "where", "message"),
    [
        ("layers: []", "7:11", "must be a list of 1 to 100 layers"),
        ("layers: loose", "7:11", "must be a list of 1 to 100 layers"),
        ("layers: [5]", "7:12", "a layer must be a block of keys"),
        (f"layers: [{DEEPER}, {DEEPER}]", "7:119", "begins at 0.5 m, not below the layer before it (0.5 m)"),
        (f"layers: [{DEEPER.replace('density: 2 t/m^3, ', '')}]", "7:12", "the layer lacks density"),
        (f"layers: [{DEEPER.replace('cohesion', 'cohesoin')}]", "7:101", "is not a key of a layer"),
        (f"layers: [{DEEPER.replace('2 kPa', '2 kg')}]", "7:111", "'kg' is a mass; a pressure is needed"),
        (f"layers: [{DEEPER.replace('36 deg', '{mean: 36, cov: 0.1}')}]", "7:60", "takes one value here"),
        (f"layers: [{DEEPER.replace('0.5 m', '0 m')}]", "7:19", "outside the admitted range"),
        ("cohesion: [2, 4]", "7:13", "takes one value here, not a list or a range"),
        ("water_table: -1 m", "7:16", "outside the admitted range"),
        ("slope: 38 deg", "7:3", "must be less than every friction angle (the least is 38 deg)"),
    ],
)
def test_what_is_refused(problems_of, line: str, where: str, message: str) -> None:
    (problem,) = problems_of(ground_of(line))
    assert message in problem.message
    assert f"{problem.line}:{problem.column}" == where


def test_the_slope_is_held_against_design_values_and_layers(load_it, problems_of) -> None:
    """36 deg in the layer; a factor of 1.25 leaves 30.2 deg."""
    text = ground_of(f"layers: [{DEEPER}]", "slope: 33 deg")
    assert load_it(text).model.slope_deg == 33.0
    (problem,) = problems_of(text, "partial_factor.friction_angle=1.25")
    assert "the least is 30.17 deg" in problem.message


def test_soil_that_floats(load_it, problems_of) -> None:
    """Only soil below the water table must be heavier than water."""
    wet, dry = (
        ground_of(f"layers: [{DEEPER}]", f"water_table: {at}").replace("1860", "960") for at in ("0.2 m", "0.6 m")
    )
    (problem,) = problems_of(wet)
    assert "soil of 960 kg/m^3 would float" in problem.message
    assert load_it(dry).model.water_table_m == 0.6


SETS = """\
soil:
  - {name: loose, density: 1700, friction_angle: 32 deg, subgrade_reaction: 10}
  - {name: dense sand, density: 1900, friction_angle: 42 deg, subgrade_reaction: 80}
"""


@pytest.fixture
def soils(minimal):
    start, stop = minimal.index("soil:"), minimal.index("vehicle:")
    return minimal[:start] + SETS + minimal[stop:]


def _rows(sweep, *names):
    columns = sweep.block(0, sweep.n_designs).columns
    return list(zip(*(columns[name].to_numpy().tolist() for name in names), strict=True))


def _labels(block, name):
    label = block.labels[name]
    return [label.words[code] for code in label.codes]


def test_the_values_of_a_set_stay_together(load_it, soils):
    sweep = load_it(soils, "boulder.height=[3, 3.4]")
    assert sweep.n_designs == 4
    pairs = _rows(sweep, "boulder_height_m", "friction_angle_deg", "subgrade_reaction_MN_m3", "soil_density_kg_m3")
    assert pairs == [(h, *soil) for h in (3.0, 3.4) for soil in ((32.0, 10.0, 1700.0), (42.0, 80.0, 1900.0))]
    assert _labels(sweep.block(0, 4), "soil") == ["loose", "dense sand"] * 2
    assert _labels(sweep.block(1, 2), "soil") == ["dense sand"]
    assert sweep.block(1, 2).labels["soil"].words == ("dense sand",)


def test_soils_and_vehicles_are_crossed(load_it, soils):
    start = soils.index("vehicle:")
    vehicles = (
        "vehicle:\n"
        "  - {name: M30, mass: 6800, speed: 30 mph, spring: 3103.3e3, damper: 138.91e3}\n"
        "  - {name: M50, mass: 6800, speed: 50 mph, spring: 3103.3e3, damper: 138.91e3}\n"
    )
    sweep = load_it(soils[:start] + vehicles)
    block = sweep.block(0, 4)
    assert _labels(block, "soil") == ["loose", "loose", "dense sand", "dense sand"]
    assert _labels(block, "vehicle") == ["M30", "M50"] * 2
    assert block.columns["impact_speed_m_s"].to_numpy() == pytest.approx([13.4112, 22.352] * 2)
    assert sweep.resolved()["order"] == ["soil", "vehicle"]
    assert sweep.resolved()["labels"] == {"soil": ["loose", "dense sand"], "vehicle": ["M30", "M50"]}
    assert sweep.resolved()["inputs"]["friction_angle_deg"] == [32.0, 42.0]


def test_an_option_sets_an_entry_of_every_set(load_it, soils):
    sweep = load_it(soils, "soil.friction_angle=36 deg")
    assert _rows(sweep, "friction_angle_deg", "subgrade_reaction_MN_m3") == [(36.0, 10.0), (36.0, 80.0)]


def test_notes_look_at_the_pairs_that_occur(load_it, soils):
    assert load_it(soils).notes == ()
    swapped = soils.replace("42 deg", "30 deg")
    assert any("does not go with 30 deg" in note.message for note in load_it(swapped).notes)


def test_a_partial_factor_reaches_named_sets(load_it, soils):
    angles = np.radians(
        [row[0] for row in _rows(load_it(soils, "partial_factor.friction_angle=1.25"), "friction_angle_deg")]
    )
    assert np.tan(np.radians([32.0, 42.0])) / np.tan(angles) == pytest.approx(1.25)


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("name: loose, ", "", "soil.name", "every named set needs a name"),
        ("name: loose", "name: a/b", "soil.name", "every named set needs a name"),
        ("name: loose", "name: dense sand", "soil.name", "'dense sand' is given twice"),
        ("friction_angle: 32 deg, ", "", "soil.friction_angle", "in every named set, or in none"),
        ("32 deg", "[32, 34] deg", "soil.friction_angle", "takes one value"),
        ("32 deg", "{mean: [30, 32], sd: 3}", "soil.friction_angle", "must have one mean"),
        ("density: 1700", "densty: 1700", "soil.densty", "did you mean density?"),
        ("density: 1700, ", "", "soil.density", "in every named set, or in none"),
        ("name: loose", "name: loose, correlation: 0.5", "soil.correlation", "is not a key of soil in a named set"),
        ("name: loose", "name: loose, slope: 5 deg", "soil.slope", "it is one for all designs of a file"),
        (
            "  - {name: loose, density: 1700, friction_angle: 32 deg, subgrade_reaction: 10}",
            "  - loose",
            "soil",
            "list of blocks",
        ),
        ("32 deg", "320 deg", "soil.friction_angle", "outside the admitted range"),
    ],
)
def test_mistakes(problems_of, soils, old, new, key, words):
    assert any(problem.key == key and words in problem.message for problem in problems_of(soils.replace(old, new)))


def test_an_empty_list_and_a_list_where_none_is_taken(problems_of, minimal):
    start, stop = minimal.index("soil:"), minimal.index("vehicle:")
    empty = problems_of(minimal[:start] + "soil: []\n" + minimal[stop:])
    assert any(problem.key == "soil" and "list of blocks" in problem.message for problem in empty)
    start, stop = minimal.index("boulder:"), minimal.index("site:")
    listed = problems_of("boulder:\n  - {name: a, length: 1}\n" + minimal[stop:])
    assert any(problem.key == "boulder" and "must be a block of keys" in problem.message for problem in listed)


def test_beside_a_table_they_are_refused(tmp_path, problems_of, soils):
    (tmp_path / "designs.csv").write_text("boulder_length_m\n1.5\n")
    text = soils.replace("  length: 1.65\n", "") + f"table: {tmp_path / 'designs.csv'}\n"
    assert any("must be one value beside a table" in problem.message for problem in problems_of(text))
