"""``soil:`` and ``vehicle:`` as lists of named sets: an axis of values that belong together."""

import numpy as np
import pytest

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
        ("name: loose", "name: loose, correlation: 0.5", "soil.correlation", "is not a key of soil"),
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
