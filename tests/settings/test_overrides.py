"""``--set KEY=VALUE`` and the names of entries: the same rules as in the file, and an error at the option."""

from operator import attrgetter

import pytest

from boulder_sweep.settings.fields import BOULDER_MASS, FIELDS, INPUTS, UnknownNameError, named


@pytest.mark.parametrize(
    ("override", "column", "expected"),
    [
        ("vehicle.speed=20 m/s", "impact_speed_m_s", [20.0]),
        ("vehicle.speed = 20 m/s", "impact_speed_m_s", [20.0]),
        ("vehicle.speed=[30, 40] mph", "impact_speed_m_s", [13.4112, 17.8816]),
        ("vehicle.speed={from: 10, to: 12, step: 1}", "impact_speed_m_s", [10.0, 11.0, 12.0]),
        ("vehicle.bumper_height=0.6", "bumper_height_m", [0.6]),
        ("speed=[30, 40] mph", "impact_speed_m_s", [13.4112, 17.8816]),
        ("impact_speed_m_s=20", "impact_speed_m_s", [20.0]),
        ("friction_angle=38 deg", "friction_angle_deg", [38.0]),
    ],
)
def test_values(load_with, override, column, expected):
    sweep = load_with(override)
    assert sweep.block(0, sweep.n_designs).columns[column].to_numpy().tolist() == expected


@pytest.mark.parametrize(
    ("overrides", "found", "expected"),
    [
        (["max_rotation=15 deg"], "criterion.max_rotation_deg", 15.0),
        (["accuracy=fast"], "solver.accuracy", "fast"),
        (["readings=as_printed"], "model.preset", "as_printed"),
        (["vehicle.speed=10", "vehicle.speed=11"], "constants", {"impact_speed_m_s": 11.0}),  # the last holds
        (["site.embedment_ratio=0.5"], "constants", {"embedment_ratio": 0.5}),
        (["model.readings.contact=printed"], "model.readings.corrected", (True, True, False, True, True)),
        (["model.soil.elements=500"], "model.soil_elements", 500),
        (["criterion.rating=P2"], "criterion.rating", "P2"),  # of a block that the file lacks
        (["name=other"], "name", "other"),
    ],
)
def test_what_it_replaces(load_with, overrides, found, expected):
    value = attrgetter(found)(load_with(*overrides))
    assert value == (value | expected if isinstance(expected, dict) else expected)


def test_a_replaced_axis_keeps_its_place_and_a_new_one_comes_last_in_its_block(load_it, example):
    sweep = load_it(example, "boulder.height=[2, 3]", "vehicle.bumper_height=[0.5, 0.6]", "boulder.length=[1, 2]")
    assert [axis.name for axis in sweep.axes][:3] == ["boulder_length_m", "boulder_height_m", "embedment_ratio"]
    assert sweep.axes[-1].name == "bumper_height_m"


def test_one_way_of_embedment_takes_the_place_of_the_other(load_it, example):
    sweep = load_it(example, "site.embedment_depth=1 m")
    assert sweep.constants["embedment_depth_m"] == 1.0
    assert "embedment_ratio" not in {axis.name for axis in sweep.axes}


def test_step_and_accuracy_take_the_place_of_each_other(load_it, example):
    solver = load_it(example, "solver.step=2 ms").solver
    assert (solver.accuracy, solver.step_s) == (None, 0.002)
    text = example.replace("accuracy: balanced", "step: 2 ms")
    for fast in ("solver.accuracy=fast", "--accuracy=fast"):
        solver = load_it(text, fast).solver
        assert (solver.accuracy, solver.step_s) == ("fast", None)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (("solver.step=2 ms", "solver.accuracy=fast"), "give accuracy or step, not both"),
        (("solver.accuracy=fast", "solver.step=2 ms"), "give accuracy or step, not both"),
        (("solver.step=2 ms", "--accuracy=fast"), "give accuracy or step, not both"),
        (("solver={step: 2 ms}", "--accuracy=fast"), "give accuracy or step, not both"),
        (("site.embedment_ratio=0.5", "site.embedment_depth=1 m"), "give embedment_ratio or embedment_depth, not both"),
    ],
)
def test_two_options_that_contradict_each_other_are_refused(problems_of, minimal, example, overrides, message):
    for text in (minimal, example):
        (problem,) = problems_of(text, *overrides)
        assert (problem.file, problem.message) == ("--set", message)


def test_single_readings_on_top_of_a_preset(load_it, minimal):
    text = minimal + "model: {readings: as_printed}\n"
    readings = load_it(text, "model.readings.impact_arm=geometric", "model.readings.inertia=box").model.readings
    assert readings.corrected == (True, True, False, False, False)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("speed", "is not KEY=VALUE"),
        ("", "is not KEY=VALUE"),
        ("=3", "is not KEY=VALUE"),
        ("vehicle..speed=3", "is not KEY=VALUE"),
        ("vehicle.speed=[1, 2", "a list is not closed"),
        ("vehicle.speed=!!int 3", "the tag !!int is not accepted"),
        ("vehicle.speed=3\n---\n4", "second document"),
        ("vehicle.speed=" + "1" * 30_000, "longer than"),
        ("vehicle.speed=" + "[" * 3000, "nested more than 20 deep"),
        ("vehicle.sped=3", "did you mean speed?"),
        ("boulder=3", "must be a block of keys"),
        ("velocity=3", "is not an entry of the file; did you mean speed?"),
        ("density=3", "is ambiguous; use boulder.density or soil.density"),
        ("mass=3", "is ambiguous; use boulder.mass or vehicle.mass"),
    ],
)
def test_mistakes_point_at_the_option(problems_of, minimal, override, words):
    problems = problems_of(minimal, override)
    assert any(words in problem.message for problem in problems)
    assert all(problem.file == "--set" and problem.line is None for problem in problems if words in problem.message)


def test_a_file_that_an_option_names_wrongly_is_a_mistake_of_the_option(problems_of, minimal):
    (problem,) = problems_of(minimal, "table=designs.doc")
    kinds = ".csv, .xlsx, .parquet"
    assert str(problem) == f"--set: table: 'designs.doc' has an unsupported type; use one of {kinds}"


def test_mistakes_of_file_and_options_come_together(problems_of, minimal):
    problems = problems_of(minimal.replace("1.65", "x"), "vehicle.speed=x", "vehicle.mass=y")
    assert [(problem.file, problem.key) for problem in problems] == [
        ("grid.yaml", "boulder.length"),
        ("--set", "vehicle.mass"),
        ("--set", "vehicle.speed"),
    ]


EVERY = (*FIELDS, BOULDER_MASS)


@pytest.mark.parametrize("field", INPUTS, ids=lambda field: field.path)
def test_every_input_has_three_names(field):
    assert named(field.path) is field
    assert named(field.name) is field
    keys = [one.key for one in (*INPUTS, BOULDER_MASS)]
    if keys.count(field.key) == 1:
        assert named(field.key) is field is named(field.key, EVERY)
    else:
        with pytest.raises(UnknownNameError, match=rf"'{field.key}' is ambiguous; use .*{field.path}"):
            named(field.key)
