"""Remarks on values that are unusual, and the refusal of what is far from usual."""

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.cli.main import execute
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.settings.checks import wall_crush
from boulder_sweep.settings.fields import ALLOW_UNUSUAL, BY_PATH, EVERYTHING, FAR, HELD


def _notes(sweep):
    return [str(note) for note in sweep.notes]


def test_usual_values_have_no_remarks(load_with, load_it, minimal):
    assert _notes(load_it(minimal)) == []


@pytest.mark.parametrize(
    ("override", "words"),
    [
        (
            "vehicle.speed=30",
            "30 m/s is outside the usual range of 4 to 25 m/s (15 to 90 km/h; a bare number is in m/s, not in mph",
        ),
        ("vehicle.speed=70 mph", "70 mph is outside the usual range of 8.948 to 55.92 mph (15 to 90 km/h); "),
        (
            "boulder.height={from: 4 ft, to: 20 ft, count: 3}",
            "4 to 20 ft is outside the usual range of 4.921 to 13.12 ft",
        ),
        ("soil.density=[60, 70] pcf", "60 to 70 pcf is outside"),
        ("vehicle.mass={mean: 200 kip, sd: 9 kip}", "200 kip is outside"),
        ("vehicle.mass=150000", "not in lb"),
        ("vehicle.spring=1e5", "a bare number is in N/m, not in kN/m"),
        ("vehicle.damper=5000", "not in kN*s/m"),
        ("soil.friction_angle=1.5", "a bare number is in degrees"),
        ("soil.friction_angle=[20, 30]", "20 to 30 deg is outside"),
        ("soil.subgrade_reaction=350", "a bare number is in MN/m^3"),
        ("soil.density=1000", "sand and gravel"),
        ("boulder.height={from: 1, to: 5, count: 3}", "1 to 5 m is outside"),
        ("boulder.density=1800", "rock"),
        ("boulder.density=162", "a bare number is in kg/m^3, not in t/m^3 or pcf"),
        ("vehicle.bed_offset=1", "leading edge of the cargo bed; penetration is counted from that edge"),
        ("vehicle.hood_height=1.7", "medium-duty trucks"),
        ("criterion.max_rotation=45", "the model no longer holds"),
        ("site.embedment_ratio=0.9", "usual embedments"),
        ("site.embedment_depth=3.2 m", "depth over height: 0.930233 is outside the usual range of 0.35 to 0.75"),
        ("site.embedment_depth=[1, 2] m", "depth over height: 0.290698 is outside"),
        ("site.embedment_depth=4 m", "depth over height: 1.16279 is outside the usual range of 0.35 to 0.75"),
        ("site.embedment_depth=4 m", "(usual embedments); cannot be computed, since the depth must be less than the"),
        ("site.embedment_depth=3.44 m", "depth over height: 1 is outside"),
        ("site.embedment_depth=[3.2, 4] m", "0.930233 to 1.16279 is outside the usual range of 0.35 to 0.75"),
        ("site.embedment_depth=[3.2, 4] m", "designs of 1 or more cannot be computed, since the depth must be less"),
        ("site.embedment_depth=3.2 m", "(usual embedments); computed as given"),
        ("site.embedment_ratio=1", "cannot be computed, since the depth must be less than the boulder's height"),
        ("boulder.width=[1, 1.5, 1]", "a value more than once"),
    ],
)
def test_unusual_values(load_with, override, words):
    notes = _notes(load_with(override))
    assert any(words in note for note in notes)


YARD = """stone_id,boulder_length_m,boulder_width_m,boulder_height_m,boulder_mass_t
1,1.5,1.6,2.5,12.7
2,1.5,1.6,2.5,16.1
3,3.1,1.6,2.5,20
3,1.5,1.6,2.5,161
4,2.5,1.6,2.5,16
"""
ROCK = "boulder.rock=granite"


@pytest.mark.parametrize(
    ("overrides", "note"),
    [
        (
            (ROCK,),
            "yard.csv:4: boulder.length: stone_id 3: 3.1 m is outside the usual range of 0.6 to 2 m (usual boulders)"
            "; computed as given (1 more like it)",
        ),
        ((ROCK,), "yard.csv: boulder.mass: by its mass a boulder fills 60% to 101% (stone_id 2) of the box"),
        ((ROCK,), "yard.csv:5: boulder.mass: stone_id 3 fills 1013% of the box of its sizes by its mass: above 115%"),
        ((ROCK,), "yard.csv:5: stone_id: 3 stands twice"),
        (("table=named.csv", ROCK), "named.csv:5: Boulder: G03 stands twice"),
        (
            ("table=rates.csv", ROCK),
            "rates.csv:2: soil.strain_rate_factor: row 1: 5 is outside the usual range of 1 to",
        ),
        (("table=tape.csv", ROCK), "boulder.mass: no mass: each boulder is a solid box of its sizes"),
    ],
)
def test_remarks_on_a_list_stand_at_its_rows(tmp_path, monkeypatch, overrides, note):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "yard.csv").write_text(YARD)
    sides = "boulder_length_m,boulder_width_m,boulder_height_m"
    (tmp_path / "rates.csv").write_text(f"{sides},strain_rate_factor\n1.5,1.5,3,5\n")
    (tmp_path / "named.csv").write_text(YARD.replace("stone_id", "Boulder").replace("\n3,", "\nG03,"))
    (tmp_path / "tape.csv").write_text("".join(f"{line.rpartition(',')[0]}\n" for line in YARD.splitlines()))
    (tmp_path / "yard.yaml").write_text(
        f"table: yard.csv\nboulder: {{}}\n{LIST.partition('density: 2596 kg/m^3}')[2]}".replace(
            "table: trucks.csv", ""
        ).replace("vehicle: {", "vehicle: {mass: 15000 lb, ")
    )
    notes = _notes(boulder_sweep.load("yard.yaml", overrides))
    assert sum(note in one for one in notes) == 1


def test_a_remark_has_its_place(load_it, minimal):
    note, _ = _notes(load_it(minimal.replace("speed: 14.5", "speed: 30")))
    assert note.startswith("grid.yaml:14:3: vehicle.speed: 30 m/s")


@pytest.mark.parametrize(
    ("angle", "reaction", "words"),
    [
        ("43.2", "95", ""),
        ("[36, 40]", "[45, 90]", ""),
        ("[36, 42]", "[45, 108]", ""),
        ("[30, 35, 40]", "[2.2, 4]", "2.2 MN/m^3 does not go with 40 deg"),
        ("[36, 40, 43.2]", "[25, 60, 95]", "two families of data are mixed"),
        ("40", "[17.6, 64]", "two families of data are mixed"),
        ("28", "110", "110 MN/m^3 does not go with 28 deg"),
        ("42", "3", "3 MN/m^3 does not go with 42 deg"),
        ("[28, 43]", "110", "110 MN/m^3 does not go with 28 deg"),
    ],
)
def test_soil_constants_of_no_family_or_of_two(load_with, angle, reaction, words):
    notes = _notes(load_with(f"soil.friction_angle={angle}", f"soil.subgrade_reaction={reaction}"))
    found = [note for note in notes if "does not go with" in note or "two families" in note]
    assert len(found) == bool(words)
    assert not words or words in found[0]


@pytest.mark.parametrize("override", ["site.embedment_depth=4 m", "site.embedment_ratio=1"])
def test_what_cannot_be_computed_is_not_called_computed(load_with, override):
    assert not any("computed as given" in note for note in _notes(load_with(override)))


FITTED = ("vehicle.spring=3103.3 kN/m", "vehicle.damper=138.91 kN*s/m", "vehicle.mass=15000 lb")


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (("vehicle.speed=30 mph",), ""),
        (("vehicle.speed=[20, 30, 40] mph",), ""),
        (
            ("vehicle.mass=65000 lb", "vehicle.speed=30 mph"),
            "crushed by 2.85 m; its spring and damper are calibrated up",
        ),
        (("vehicle.mass=2430 lb", "vehicle.speed=30 mph"), "crushed by only 0.279 m; its spring"),
        (("vehicle.speed=50 mph",), "crushed by 1.38 m;"),
        (("vehicle.speed=[30, 40, 50] mph",), "crushed by up to 1.38 m;"),
        (("vehicle.speed=50 mph", "vehicle.calibrated_crush=1.5 m"), ""),
        (("vehicle.speed=10 mph",), "crushed by only 0.276 m;"),
    ],
)
def test_a_vehicle_far_from_what_its_spring_was_fitted_to(load_with, overrides, words):
    found = [note for note in _notes(load_with(*FITTED, *overrides)) if "against a rigid wall" in note]
    assert len(found) == (words != "")
    assert not words or words in found[0]


def test_named_vehicles_are_held_against_their_own_springs(load_with):
    """Each of these is within its range; crossed, the heavy one on the soft spring would not be."""
    light = "{name: light, mass: 1100 kg, speed: 30 mph, spring: 900 kN/m, damper: 25 kN*s/m}"
    heavy = "{name: heavy, mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}"
    assert not any("rigid wall" in note for note in _notes(load_with(f"vehicle=[{light}, {heavy}]")))
    swapped = f"[{light.replace('1100 kg', '15000 lb')}, {heavy}]"
    assert any("rigid wall" in note for note in _notes(load_with(f"vehicle={swapped}")))


def test_the_crush_at_a_rigid_wall_is_that_of_the_analytic_solution():
    chance = np.random.default_rng(5)
    vehicles = np.exp(chance.uniform(np.log([1e3, 1.0, 2e5, 1e4]), np.log([3e4, 40.0, 5e7, 2e6]), (200, 4)))
    walls = [RigidWall(*map(float, one)) for one in vehicles]
    assert len({wall.over_damped for wall in walls}) == 2
    np.testing.assert_allclose(wall_crush(*vehicles.T), [wall.max_displacement_m for wall in walls], rtol=1e-9)


LIST = """\
name: listed
boulder: {length: 1.65 m, width: 1.68 m, density: 2596 kg/m^3}
site: {embedment_ratio: 0.55}
soil: {density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}
vehicle: {speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
table: trucks.csv
"""
TRUCKS = "boulder_height_m,vehicle_mass_lb\n2.4,15000\n2.4,15\n2.4,20000\n"


def test_what_is_held_has_a_usual_range_within_the_admitted_one():
    assert {path.split(".")[1] for path in HELD} >= {"mass", "density", "speed", "spring", "damper"}
    for path in HELD:
        usual, admitted = BY_PATH[path].usual, BY_PATH[path].admitted
        assert admitted.low < usual.low / FAR
        assert usual.low < usual.high < admitted.high


def _entry(path, value):
    if path == "boulder.mass":
        return (f"{path}={value!r}", "boulder.length=20", "boulder.width=20", "boulder.height=20")
    return (f"{path}={value!r}",)


@pytest.mark.parametrize(
    ("path", "side"),
    [
        (path, side)
        for path in HELD
        for side in ("low", "high")
        if (path, side) != ("vehicle.speed", "high")  # 750 m/s is not admitted
    ],
)
def test_a_factor_of_thirty_outside(load_with, problems_of, minimal, path, side):
    usual = BY_PATH[path].usual
    last = usual.low / FAR if side == "low" else usual.high * FAR
    beyond = last * (0.999 if side == "low" else 1.001)
    load_with(*_entry(path, last))
    (problem,) = problems_of(minimal, *_entry(path, beyond))
    assert problem.key == path
    assert f"allow_unusual: [{path}]" in problem.message
    for allowed in (f"[{path}]", path, EVERYTHING, f"[{path}, vehicle.speed]"):
        sweep = load_with(*_entry(path, beyond), f"{ALLOW_UNUSUAL}={allowed}")
        assert sweep.constants[BY_PATH[path].name] == beyond


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("vehicle.mass=15 lb", "15 lb is less than 1/30 of the usual 2205 to 66140 lb (car to heavy truck"),
        ("vehicle.mass=15.000 lb", "15 lb is less than 1/30"),
        ("vehicle.mass=6.8e6", "6.8e+06 kg is more than 30 times the usual 1000 to 30000 kg"),
        ("vehicle.mass=[6800, 12, 15]", "12 to 15 kg is less than"),
        ("vehicle.mass=[12, 1e6]", "12 to 1e+06 kg is more than 30 times outside the usual"),
        ("vehicle.mass={from: 1 kg, to: 7000 kg, count: 3}", "1 kg is less than"),
        ("vehicle.mass={mean: [6800 kg, 15 kg], sd: 1 kg}", "15 kg is less than"),
        ("vehicle.mass={distribution: uniform, low: 1 kg, high: 9 t}", "1 kg is less than"),
        ("vehicle.mass={distribution: triangular, low: 1 kg, mode: 7 t, high: 9 t}", "1 kg is less than"),
        ("vehicle.spring=3103.3", "a bare number is in N/m, not in kN/m"),
        ("vehicle.damper=138.91", "not in kN*s/m"),
        ("vehicle.speed=0.05", "0.05 m/s is less than"),
        ("boulder.density=2.6", "not in t/m^3 or pcf"),
        ("soil.density=1.86", "not in t/m^3 or pcf"),
        (
            "soil.layers=[{from: 1 m, density: 1.9, friction_angle: 36, subgrade_reaction: 60}]",
            "1.9 kg/m^3 is less than 1/30 of the usual 1520 to 2240 kg/m^3",
        ),
        (
            "vehicle.approach={length: 0.001 m, from: 0 m/s, acceleration: 1 m/s^2}",
            "0.0447214 m/s is less than 1/30 of the usual 4 to 25 m/s",
        ),
    ],
)
def test_what_is_refused(the_problem, entry, words):
    assert words in the_problem(entry).message


@pytest.mark.parametrize("entry", ["vehicle.speed=0", "vehicle.speed=[0, 5, 10]", "vehicle.mass={mean: 6800, sd: 500}"])
def test_what_is_admitted(load_with, entry):
    load_with(entry)


def test_each_has_its_place_and_one_entry_allows_all(problems_of, load_it, minimal):
    text = minimal.replace("mass: 6722", "mass: [6722, 15, 16] lb").replace("density: 1859.9", "density: 1.86")
    problems = problems_of(text)
    places = [(9, 12, "soil.density"), *((13, column, "vehicle.mass") for column in (16, 20))]
    assert [(one.line, one.column, one.key) for one in problems] == places
    (remedy,) = {one.message.rpartition(" by ")[2] for one in problems}
    assert load_it(f"{text}{remedy}\n").allowed == ("soil.density", "vehicle.mass")


def test_named_vehicles_have_their_places(problems_of, minimal):
    light = "  - {name: light, mass: 15 lb, speed: 30 mph, spring: 900 kN/m, damper: 25 kN*s/m}\n"
    heavy = "  - {name: heavy, mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91}\n"
    problems = problems_of(minimal[: minimal.index("vehicle:")] + f"vehicle:\n{light}{heavy}")
    assert [(one.line, one.key) for one in problems] == [(13, "vehicle.mass"), (14, "vehicle.damper")]
    assert problems[0].column == light.index("15 lb") + 1


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("[vehicle.mas]", "did you mean vehicle.mass?"),
        ("[vehicle.mass, vehicle.wheels]", "'vehicle.wheels' is not an entry that is held to its usual range"),
        ("criterion.max_rotation", "(boulder.density, boulder.mass, soil.density, vehicle.mass,"),
        ("alll", "did you mean all?"),
        ("{vehicle.mass: yes}", "is not an entry"),
        ("[[vehicle.mass]]", "is not an entry"),
        ("", "'' is not an entry"),
    ],
)
def test_what_may_be_allowed(the_problem, value, words):
    problem = the_problem(f"{ALLOW_UNUSUAL}={value}")
    assert problem.key == ALLOW_UNUSUAL
    assert words in problem.message


@pytest.fixture
def trucks(tmp_path, monkeypatch):
    """Work where a file lists three trucks, the second of 15 lb."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trucks.csv").write_text(TRUCKS)
    (tmp_path / "listed.yaml").write_text(LIST)
    return "listed.yaml"


def test_a_row_of_a_list_is_an_error_and_the_others_are_computed(trucks, capsys):
    assert execute(["run", trucks, "-q"]) == 3
    assert "unusual 1" in capsys.readouterr().out
    table = boulder_sweep.read("listed.sweep")
    assert table.verdict.tolist() == ["fail", "error", "fail"]
    assert table.reason.tolist() == ["overturns", "unusual", "overturns"]
    assert np.isnan(table.max_rotation_deg[1])
    assert boulder_sweep.load(trucks).block(1, 3).reasons[0] == "unusual"
    again = recompute("listed.sweep", 1)
    assert not again.unequal
    (note,) = (one for one in boulder_sweep.load(trucks).notes if one.key == "vehicle.mass")
    assert "1 design not computed (error, unusual), the first is design 1" in note.message


@pytest.mark.parametrize("allowed", [EVERYTHING, "[vehicle.mass]"])
def test_a_file_may_allow_the_rows_of_its_list(trucks, allowed):
    assert execute(["run", trucks, "-q", "--set", f"{ALLOW_UNUSUAL}={allowed}"]) == 0
    table = boulder_sweep.read("listed.sweep")
    assert "error" not in table.verdict.tolist()
    assert not recompute("listed.sweep", 1).unequal
    assert boulder_sweep.load(trucks).resolved() != boulder_sweep.load(trucks, [f"{ALLOW_UNUSUAL}=all"]).resolved()


def test_an_unusual_row_answers_no_question(trucks, capsys):
    assert execute(["need", trucks, "-q", "--most", "speed"]) == 3
    assert execute(["capacity", trucks, "-q"]) == 3


def test_of_a_grid_what_is_allowed_changes_nothing_else(load_with):
    assert load_with().resolved() == load_with(f"{ALLOW_UNUSUAL}=all").resolved()
