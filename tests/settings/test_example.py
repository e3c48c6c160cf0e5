"""The file as users are shown it, and the files of the package: they load as written and mean what they say."""

import json
import re
from pathlib import Path

import pytest

from boulder_sweep.columns import BY_NAME, COLUMNS, INPUT_COLUMNS, OPTIONAL_INPUTS, OUTCOME_COLUMNS, TO_BUILD
from boulder_sweep.settings import load
from boulder_sweep.store.provenance import settings_sha256
from tests.report.conftest import SITE


def test_axes_in_the_order_of_the_file(load_it, example):
    sweep = load_it(example)
    assert sweep.name == "m30-sizing"
    assert [axis.name for axis in sweep.axes] == [
        "boulder_height_m",
        "embedment_ratio",
        "friction_angle_deg",
        "subgrade_reaction_MN_m3",
    ]
    assert [len(axis) for axis in sweep.axes] == [19, 16, 3, 3]
    assert sweep.n_designs == 19 * 16 * 3 * 3
    assert isinstance(sweep.n_designs, int)
    assert sweep.axes[2].values.tolist() == [36.0, 40.0, 43.2]
    assert sweep.axes[3].values.tolist() == [25.0, 60.0, 95.0]


def test_the_order_of_axes_follows_the_order_of_blocks_and_keys(load_it, example):
    lines = example.splitlines()
    swapped = "\n".join([lines[0], lines[3], lines[2], lines[1], *lines[4:]])
    assert [axis.name for axis in load_it(swapped).axes] == [
        "friction_angle_deg",
        "subgrade_reaction_MN_m3",
        "embedment_ratio",
        "boulder_height_m",
    ]


def test_defaults(load_it, minimal):
    sweep = load_it(minimal)
    assert sweep.name == "grid"
    assert sweep.n_designs == 1
    assert sweep.axes == ()
    assert sweep.constants["strain_rate_factor"] == 1.0
    assert sweep.constants["bumper_height_m"] == 0.5
    assert sweep.constants["hood_height_m"] == 1.4
    assert sweep.constants["bed_offset_m"] == 2.9
    assert (sweep.criterion.max_rotation_deg, sweep.criterion.rating) == (20.0, "P1")
    assert sweep.model.preset == "corrected"
    assert sweep.model.soil_elements == 0
    assert (sweep.solver.accuracy, sweep.solver.step_s, sweep.solver.horizon_s) == ("balanced", None, 1.0)


@pytest.mark.parametrize(
    "key",
    [
        *("boulder.length", "boulder.width", "boulder.height", "boulder.density", "vehicle.mass", "vehicle.speed"),
        *("vehicle.spring", "vehicle.damper", "soil.density", "soil.friction_angle", "soil.subgrade_reaction"),
    ],
)
def test_required_keys(problems_of, minimal, key):
    section, name = key.split(".")
    without = re.sub(rf"({section}:\n(?:  .*\n)*?)  {name}: .*\n", r"\1", minimal)
    (problem,) = problems_of(without)
    assert problem.key == key
    assert "required and missing" in problem.message
    assert problem.line == 1 + without.splitlines().index(f"{section}:")


def test_resolved_says_the_same_for_other_units_and_layout(load_it, load_with, minimal):
    plain = load_it(minimal)
    other = load_with(
        "boulder.length=165 cm",
        "boulder.height=3440 mm",
        "vehicle.spring=3103.3 kN/m",
        "soil.density=1.8599 t/m^3",
        "vehicle.speed=52.2 km/h",
        "solver.horizon=1000 ms",
    )
    assert plain.resolved() == other.resolved()
    assert load_with("vehicle.speed=13").resolved() != plain.resolved()


def test_resolved_is_plain_data_with_units_in_its_names(load_it, example):
    resolved = load_it(example).resolved()
    assert json.loads(json.dumps(resolved)) == resolved
    assert resolved["n_designs"] == 2736
    assert resolved["inputs"]["embedment_ratio"] == [round(0.40 + 0.02 * i, 2) for i in range(16)]
    assert resolved["inputs"]["impact_height_m"].startswith("Eq 9")
    assert resolved["criterion"] == {"max_rotation_deg": 20.0, "rating": "P1", "min_overlap_m": 0.25}
    assert resolved["model"]["calibrated_crush_m"] == 1.0
    assert resolved["model"]["readings"]["inertia"] == "box"
    assert resolved["model"]["soil"] == "closed_form"
    assert resolved["solver"] == {"accuracy": "balanced", "step_s": None, "horizon_s": 1.0}


def test_resolved_stands_for_long_axes_by_their_hash(load_with):
    one, same, other = (
        load_with(f"boulder.width={{from: 1, to: {end}, count: 5000}}").resolved()["inputs"]["boulder_width_m"]
        for end in ("2", "2.0", "2.1")
    )
    assert one == same
    assert one["count"] == 5000
    assert one["sha256"] != other["sha256"]


@pytest.mark.parametrize(
    ("text", "preset", "corrected"),
    [
        ("as_printed", "as_printed", (False,) * 5),
        ("corrected", "corrected", (True,) * 5),
        ("{preset: corrected, inertia: printed}", "mixed", (False, True, True, True, True)),
        ("{preset: as_printed, impact_arm: geometric}", "mixed", (False, True, False, False, False)),
        ("{contact: printed}", "mixed", (True, True, False, True, True)),
        ("{preset: as_printed, restoring: corrected}", "mixed", (False, False, False, True, False)),
        ("{preset: corrected, separation: released}", "corrected", (True,) * 5),
    ],
)
def test_readings(load_with, text, preset, corrected):
    model = load_with(f"model.readings={text}").model
    assert model.preset == preset
    assert model.readings.corrected == corrected


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("solver.accuracy=fine", ("fine", None, 1.0)),
        ("solver.step=4 ms", (None, 0.004, 1.0)),
        ("solver.horizon=250 ms", ("balanced", None, 0.25)),
    ],
)
def test_solver(load_with, override, expected):
    solver = load_with(override).solver
    assert (solver.accuracy, solver.step_s, solver.horizon_s) == expected


@pytest.mark.parametrize("count", [1, 50, 1_000_000])
def test_soil_elements(load_with, count):
    assert load_with(f"model.soil={{elements: {count}}}").model.soil_elements == count


def test_a_given_impact_height_takes_the_place_of_equation_9(load_with):
    sweep = load_with("site.impact_height=0.938 m")
    assert sweep.block(0, 1).columns["impact_height_m"].to_numpy().tolist() == [0.938]


def test_register_of_columns():
    assert [spec.name for spec in COLUMNS] == ["design_id", *INPUT_COLUMNS, *OUTCOME_COLUMNS]
    assert len(COLUMNS) == 1 + 17 + 22
    assert list(BY_NAME) == [spec.name for spec in (*COLUMNS, *OPTIONAL_INPUTS, *TO_BUILD)]
    assert all(spec.meaning for spec in COLUMNS)
    endings = {"m": "_m", "kg": "_kg", "deg": "_deg", "s": "_s", "kN": "_kN", "m/s": "_m_s"}
    for spec in COLUMNS:
        if spec.unit in endings:
            assert spec.name.endswith(endings[spec.unit])


CONFIGS = Path(__file__).parents[2] / "configs"

# Tables 1 to 3 of the paper.
SHARED = {
    "soil_density_kg_m3": 1859.9,
    "friction_angle_deg": 43.2,
    "subgrade_reaction_MN_m3": 95.0,
    "strain_rate_factor": 1.0,
    "vehicle_spring_N_m": 3103300.0,
    "vehicle_damper_N_s_m": 138910.0,
    "hood_height_m": 1.4,
    "bed_offset_m": 2.9,
}
ABG = {
    "boulder_length_m": 0.762,
    "boulder_width_m": 1.016,
    "boulder_height_m": 2.2,
    "boulder_density_kg_m3": 3074.0,
    "embedment_depth_m": 1.2,
    "impact_height_m": 0.754,
    "vehicle_mass_kg": 6795.0,
    "impact_speed_m_s": 13.36,
    "bumper_height_m": 0.508,
}
RWG = {
    "boulder_length_m": 1.65,
    "boulder_width_m": 1.68,
    "boulder_height_m": 3.44,
    "boulder_density_kg_m3": 2596.0,
    "embedment_depth_m": 2.03,
    "impact_height_m": 0.938,
    "vehicle_mass_kg": 6722.0,
    "impact_speed_m_s": 14.5,
    "bumper_height_m": 0.5,
}


def _row(file, design=0):
    block = load(CONFIGS / file).block(design, design + 1)
    assert block.reasons[0] == ""
    return {name: column.to_numpy()[0] for name, column in block.columns.items()}


@pytest.mark.parametrize(
    ("file", "design", "expected"),
    [("crash_tests.yaml", 0, ABG), ("crash_tests.yaml", 1, RWG), ("abg.yaml", 0, ABG), ("rwg.yaml", 0, RWG)],
)
def test_crash_tests_hold_the_tables_of_the_paper(file, design, expected):
    assert _row(file, design) == SHARED | expected


def test_the_sizing_grid():
    sweep = load(CONFIGS / "m30_sizing.yaml")
    assert sweep.n_designs == 107_008
    assert {axis.name for axis in sweep.axes} == {
        "boulder_height_m",
        "boulder_width_m",
        "embedment_ratio",
        "friction_angle_deg",
        "subgrade_reaction_MN_m3",
    }
    assert not sweep.block(0, sweep.n_designs).reasons.any


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.yaml")), ids=lambda path: path.name)
def test_every_file_is_valid_without_remarks(path):
    assert load(path).notes == ()


def test_it_is_in_the_resolved_settings_and_in_no_hash(load_it):
    plain, headed = load_it(SITE), load_it(f"{SITE}report: {{client: City, date: 2026-11-25}}\n")
    assert "report" not in plain.resolved()
    assert headed.resolved()["report"] == {"client": "City", "date": "2026-11-25"}
    assert settings_sha256(plain.resolved()) == settings_sha256(headed.resolved())
    assert [axis.name for axis in headed.axes] == [axis.name for axis in plain.axes]
    assert load_it(f"{SITE}report:\n").resolved() == plain.resolved()


def test_an_override_replaces_an_entry(load_it):
    sweep = load_it(f"{SITE}report: {{client: City}}\n", "report.client=County", "report.author=C. Day")
    assert sweep.heading.given() == {"client": "County", "author": "C. Day"}


@pytest.mark.parametrize(
    ("block", "column", "words"),
    [
        (
            "report: City",
            9,
            "report: must be a block of keys: project, client, site, date, revision, author, checked_by",
        ),
        ("report: {cleint: City}", 10, "report.cleint: is not a key of report"),
        ("report: {client: [a, b]}", 18, "report.client: must be one line of text, not a list or a block"),
        ("report: {client: ''}", 18, "report.client: is empty; write one line of text, or leave it out"),
        (f"report: {{client: {'x' * 201}}}", 18, "report.client: has 201 characters; at most 200 fit into a heading"),
    ],
)
def test_a_wrong_entry_is_refused_where_it_stands(problems_of, block, column, words):
    problem, *_ = problems_of(f"{SITE}{block}\n")
    assert str(problem).startswith(f"grid.yaml:{len(SITE.splitlines()) + 1}:{column}: {words}")
