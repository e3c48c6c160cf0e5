"""What a site gives in place of plain entries: readings of its soil, the street before it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from boulder_sweep import at_values, run
from boulder_sweep import investigation as sand
from boulder_sweep.errors import QuestionError
from boulder_sweep.investigation import api_curve
from boulder_sweep.settings import load
from boulder_sweep.settings.model import SetDistributions
from boulder_sweep.settings.soil_readings import CORRELATION, covered_depth
from boulder_sweep.settings.sweep import derived_words
from boulder_sweep.settings.vehicle import Approach, G, NoApproachError
from boulder_sweep.store.reading import FinishedRows
from tests.answers.designs import bare_need

CONFIGS = Path(__file__).parents[2] / "configs"


def test_it_stands_for_plain_entries(tmp_path):
    """A file with readings and a street, and one with the constants that follow: equal settings and equal rows."""
    deep = ["site.embedment_depth=2.3 m"]
    sweep = load(CONFIGS / "borehole.yaml", deep)
    spread = {name: own.to_dict() for name, own in sweep.distributions.items()}
    angle, density, reaction = (
        spread[name] for name in ("friction_angle_deg", "soil_density_kg_m3", "subgrade_reaction_MN_m3")
    )
    text = (CONFIGS / "borehole.yaml").read_text()
    head, tail = text[: text.index("soil:")], text[text.index("vehicle:") :]
    soil = (
        "soil:\n"
        f"  friction_angle: {{mean: {sweep.constants['friction_angle_deg']!r} deg, sd: {angle['sd']} deg}}\n"
        f"  density: {{distribution: uniform, low: {density['low']!r}, high: {density['high']!r}}}\n"
        f"  subgrade_reaction: {{distribution: lognormal, mean: {sweep.constants['subgrade_reaction_MN_m3']!r}, "
        f"cov: {reaction['cov']!r}}}\n"
        "  correlation: 0.99\n\n"
    )
    way = tail.index("  approach:"), tail.index("\n", tail.index("  approach:"))
    tail = f"{tail[: way[0]]}  speed: {sweep.constants['impact_speed_m_s']!r} m/s{tail[way[1] :]}"
    (tmp_path / "plain.yaml").write_text(head + soil + tail)
    plain = load(tmp_path / "plain.yaml", deep)
    resolved = sweep.resolved()
    derived = resolved.pop("derived")
    assert resolved == plain.resolved()
    assert set(derived) == {"soil", "approach"}
    rows = []
    for one, folder in ((sweep, "a"), (plain, "b")):
        run(one, tmp_path / folder)
        rows.append(FinishedRows(tmp_path / folder).row(0).to_pylist())
    assert rows[0] == rows[1]


SPEED = "  speed: 14.5"
WHOLE = "  approach: {length: 80 m, from: 20 mph, acceleration: 1.2 m/s^2}"


@pytest.mark.parametrize(
    ("approach", "squared"),
    [
        (Approach(80.0, 1.0, 8.0), 64.0 + 2.0 * 1.0 * 80.0),
        (Approach(0.0, 1.0, 8.0), 64.0),
        # A vehicle that rolls down loses the height it drops, whatever the way: v^2 = 2 g h.
        (Approach(100.0, 0.0, 0.0, grade=-0.05), 2.0 * G * 100.0 * math.sin(math.atan(0.05))),
        # MIL-HDBK-1013/14, Eq 6, with its 32.2 ft/s^2: f = 0.6 and r = 100 ft.
        (Approach(0.0, 0.0, curve_radius_m=30.48, friction=0.6), 0.6 * 32.17405 * 100.0 * 0.3048**2),
        (Approach(0.0, 0.0, curve_radius_m=30.48), G * 30.48),
        # A curve limits the start, and only that.
        (Approach(50.0, 1.5, 20.0, 10.0), 10.0 * G + 150.0),
        (Approach(50.0, 1.5, None, 10.0), 10.0 * G + 150.0),
        (Approach(50.0, 1.5, 5.0, 10.0), 25.0 + 150.0),
    ],
)
def test_speed_by_hand(approach, squared):
    """v^2 = v_0^2 + 2 a s, on a grade and behind a curve."""
    assert approach.impact_speed_m_s == pytest.approx(math.sqrt(squared), rel=1e-7)


@pytest.mark.parametrize(
    "larger", [{"length_m": 90.0}, {"acceleration_m_s2": 1.6}, {"from_m_s": 6.0}, {"grade": -0.02}, {"friction": 0.9}]
)
def test_every_choice_goes_to_the_safe_side(larger):
    """More of anything but a rise is never slower."""
    usual = {"length_m": 80.0, "acceleration_m_s2": 1.5, "from_m_s": 5.0, "curve_radius_m": 25.0, "friction": 0.8}
    assert Approach(**usual | larger).impact_speed_m_s >= Approach(**usual).impact_speed_m_s


def test_a_vehicle_that_stops_before():
    with pytest.raises(NoApproachError, match=r"after 12\.7 m"):
        _ = Approach(80.0, 0.0, 5.0, grade=0.1005).impact_speed_m_s
    with pytest.raises(NoApproachError, match="after 0 m"):
        _ = Approach(80.0, 0.0, 0.0).impact_speed_m_s


def test_the_file(load_it, minimal):
    sweep = load_it(minimal.replace(SPEED, WHOLE))
    speed = Approach(80.0, 1.2, 8.9408).impact_speed_m_s
    assert sweep.constants["impact_speed_m_s"] == speed
    (kept,) = sweep.resolved()["derived"]["approach"]
    assert kept["impact_speed_m_s"] == speed
    assert (kept["length_m"], kept["from_m_s"], kept["acceleration_m_s2"], kept["grade"]) == (80.0, 8.9408, 1.2, 0.0)
    assert "friction" not in kept
    (words,) = derived_words(sweep.derived)
    assert words == (
        "vehicle.speed: 16.49 m/s (36.9 mph) is the most that reaches the boulder: from 8.941 m/s (20 mph), over 80 m "
        "with 1.2 m/s^2"
    )
    assert derived_words(sweep.derived, "us")[0] == (
        "vehicle.speed: 36.9 mph is the most that reaches the boulder: from 20 mph, over 262.5 ft with 3.937 ft/s^2"
    )
    us = WHOLE.replace("80 m", "262.46719160104987 ft").replace("1.2 m/s^2", "3.937007874015748 ft/s^2")
    assert load_it(minimal.replace(SPEED, us)).constants["impact_speed_m_s"] == pytest.approx(speed, rel=1e-12)


def test_a_curve_and_a_grade_in_the_file(load_it, minimal):
    whole = "  approach: {length: 60 m, acceleration: 1, curve_radius: 20 m, friction: 0.8, grade: -3 %}"
    sweep = load_it(minimal.replace(SPEED, whole))
    approach = Approach(60.0, 1.0, None, 20.0, 0.8, -0.03)
    assert sweep.constants["impact_speed_m_s"] == approach.impact_speed_m_s
    assert sweep.derived["approach"][0]["curve_speed_m_s"] == approach.curve_speed_m_s
    assert "the most in a curve of 20 m (sqrt(0.8 g r))" in derived_words(sweep.derived)[0]
    assert "grade -3 %" in derived_words(sweep.derived)[0]


def test_without_it_nothing_is_added(load_it, minimal, example):
    for text in (minimal, example):
        assert "derived" not in load_it(text).resolved()


def test_the_speed_is_no_axis_and_keeps_the_order(load_it, minimal):
    text = minimal.replace(SPEED, WHOLE).replace("mass: 6722", "mass: [6000, 7000]").replace("3103.3e3", "[3e6, 4e6]")
    assert [axis.name for axis in load_it(text).axes] == ["vehicle_mass_kg", "vehicle_spring_N_m"]


def test_named_vehicles_have_ways_of_their_own(load_it, minimal):
    head = minimal[: minimal.index("vehicle:")]
    one = "{name: %s, mass: 6722, approach: {length: %s m, from: 0, acceleration: 1}, spring: 3e6, damper: 138e3}"
    sweep = load_it(f"{head}vehicle:\n  - {one % ('north', 50)}\n  - {one % ('south', 72)}\n")
    assert sweep.block(0, 2).columns["impact_speed_m_s"].to_numpy().tolist() == [10.0, 12.0]
    assert [way["name"] for way in sweep.derived["approach"]] == ["north", "south"]
    assert derived_words(sweep.derived)[1].startswith("vehicle.speed (south): 12 m/s")


def test_options_take_its_place(load_it, minimal):
    text = minimal.replace(SPEED, WHOLE)
    sweep = load_it(text, "vehicle.speed=15 m/s")
    assert sweep.constants["impact_speed_m_s"] == 15.0
    assert sweep.derived == {}
    assert load_it(text, "vehicle.approach.length=0 m").constants["impact_speed_m_s"] == 8.9408
    turned = load_it(minimal, "vehicle.approach={length: 50 m, from: 0, acceleration: 1}")
    assert turned.constants["impact_speed_m_s"] == 10.0


@pytest.mark.parametrize(
    ("entry", "position", "words"),
    [
        (f"{SPEED}\n{WHOLE}", "15:3", "give speed or approach, not both"),
        ("  approach: 80 m", "14:13", "an approach must be a block of keys: length, from"),
        ("  approach: {length: 80 m, from: 0}", "14:13", "lacks acceleration: the vehicle's at full throttle"),
        ("  approach: {from: 0, acceleration: 1}", "14:13", "lacks length"),
        ("  approach: {length: 80, acceleration: 1}", "14:13", "lacks from (0 mph for a start from rest)"),
        ("  approach: {length: 80, from: 0, acceleration: 1, mu: 1}", "14:52", "'mu' is not a key of an approach"),
        ("  approach: {length: 80, from: 0, acceleration: 1, friction: 1}", "14:52", "give curve_radius"),
        ("  approach: {length: 80, from: 0, acceleration: 3 mph}", "14:49", "an acceleration is needed"),
        ("  approach: {length: 80, from: 0, acceleration: 1, grade: 20 %}", "14:13", "after 0 m and does not reach"),
        ("  approach: {length: 9e4, from: 0, acceleration: 1}", "14:13", "more than 100 m/s"),
    ],
)
def test_mistakes(problems_of, minimal, entry, position, words):
    (problem,) = problems_of(minimal.replace(SPEED, entry))
    assert problem.key == "vehicle.approach"
    assert words in problem.message
    assert f"{problem.line}:{problem.column}" == position


def test_a_misspelled_key_is_found(problems_of, minimal):
    (problem,) = problems_of(minimal.replace(SPEED, f"{SPEED}\n{WHOLE.replace('approach', 'aproach')}"))
    assert "did you mean approach?" in problem.message


CONSTANTS = "  density: 1859.9\n  friction_angle: 43.2\n  subgrade_reaction: 95\n"
ANGLE, DENSITY, REACTION = "friction_angle_deg", "soil_density_kg_m3", "subgrade_reaction_MN_m3"
RAW = "spt: {n: 24, energy_ratio: 60 %, depth: 1.5 m}"


@pytest.fixture
def soil(load_it, minimal):
    """Load the minimal file with other entries of the soil."""
    return lambda text, *overrides: load_it(minimal.replace(CONSTANTS, f"  {text}\n"), *overrides)


def angle_of(n, depth=1.5, density=None):
    """Return the lowest friction angle by a count, and the highest."""
    angles = sand.angles_by_blow_count(
        sand.normalized_blow_count(n, 0.6, depth, sand.vertical_stress(depth, density))
    ).values()
    return min(angles), max(angles)


def test_a_blow_count_gives_three_uncertain_constants(soil):
    sweep = soil(RAW)
    angle, highest = angle_of(24)
    assert sweep.constants[ANGLE] == angle
    assert sweep.distributions[ANGLE].to_dict() == {"kind": "normal", "sd": 3.61, "low": 1.0, "high": 60.0}
    assert (highest - angle) / 1.6449 == pytest.approx(3.61, abs=0.01)
    spread = sweep.distributions[DENSITY]
    assert (spread.kind, spread.low, spread.high) == ("uniform", *sand.densities(angle))
    assert sweep.constants[REACTION] == pytest.approx(float(api_curve([angle])[0]), rel=1e-12)
    assert sweep.distributions[REACTION].kind == "lognormal"
    assert sweep.correlation == CORRELATION


def test_what_the_angle_may_be_off_by_is_carried_along_the_curve(soil):
    """One standard deviation of the angle is one of the logarithm of the subgrade reaction."""
    spread = soil(RAW).distributions[REACTION]
    curve = api_curve([36.0, 39.61])
    assert math.sqrt(math.log1p(spread.cov**2)) == pytest.approx(math.log(curve[1] / curve[0]), rel=1e-9)


def test_other_commands_take_the_unfavourable_quantile(soil):
    taken = at_values(soil(RAW))
    assert taken.taken_at == dict.fromkeys((ANGLE, DENSITY, REACTION), "p5 low")
    assert taken.constants[ANGLE] == pytest.approx(angle_of(24)[0] - 1.6449 * 3.61, abs=1e-3)
    assert taken.derived["soil"]


@pytest.mark.parametrize("n1_60", [6.6, 10, 15, 20, 30, 39])
def test_the_lowest_correlation_is_the_mean_and_the_highest_lies_within(soil, n1_60):
    """The mean is never stronger than either; the fractiles of 5 and 95 % hold both, with no less than the scatter."""
    low, high = sorted(sand.angles_by_blow_count(n1_60).values())
    sweep = soil(f"spt: {{n1_60: {n1_60}}}\n  subgrade_reaction: 40")
    sd = sweep.distributions[ANGLE].sd
    assert sweep.constants[ANGLE] == low
    assert high <= low + 1.6449 * sd
    assert sd == 3.0 or low + 1.6449 * (sd - 0.01) <= high


def test_cones_and_relative_density(soil):
    cone = soil("cpt: {q_c: 9 MPa, depth: 1.5 m}")
    assert cone.constants[ANGLE] == sand.kulhawy_mayne(9.0, sand.vertical_stress(1.5, None))
    assert cone.distributions[ANGLE].sd == 2.8
    deep = soil("cpt: {q_c: 9 MPa, depth: 10 m}")
    assert deep.constants[ANGLE] == sand.robertson_campanella(9.0, sand.vertical_stress(10.0, None))
    dense = soil("relative_density: 65 %")
    assert dense.constants[ANGLE] == pytest.approx(36.0)
    assert dense.distributions[ANGLE].sd == 2.0


def test_us_units(soil):
    metric, us = soil("cpt: {q_c: 9 MPa, depth: 1.5 m}"), soil("cpt: {q_c: 93.984 tsf, depth: 4.9212598 ft}")
    assert "q_c 93.98 tsf at 4.921 ft, C_N" in derived_words(us.derived, "us")[0]
    assert us.constants[ANGLE] == pytest.approx(metric.constants[ANGLE], abs=1e-4)


def test_corrected_counts_are_taken_as_they_are(soil):
    assert soil("spt: {n1_60: 25}").constants[ANGLE] == sand.wolff(25.0)


def test_what_is_measured_wins(soil):
    sweep = soil(f"{RAW}\n  friction_angle: 35 deg\n  density: 1800 kg/m^3")
    assert (sweep.constants[ANGLE], sweep.constants[DENSITY]) == (35.0, 1800.0)
    assert list(sweep.distributions) == [REACTION]
    assert sweep.correlation == 0.0
    assert soil(RAW, "soil.friction_angle=35 deg").constants[ANGLE] == 35.0
    every = soil(f"{RAW}\n{CONSTANTS}")
    assert every.distributions == {}
    assert "the file gives every constant" in derived_words(every.derived)[0]


def test_a_measured_density_is_that_of_the_stress(soil):
    sweep = soil("spt: {n: 24, energy_ratio: 60 %, depth: 5 m}\n  density: 1700 kg/m^3")
    assert sweep.constants[ANGLE] == angle_of(24, 5.0, 1700.0)[0] > angle_of(24, 5.0)[0]


def test_a_given_correlation_stays(soil):
    assert soil(f"{RAW}\n  correlation: 0.5").correlation == 0.5


def test_what_was_used_is_said_and_kept(soil):
    sweep = soil(RAW)
    (words,) = derived_words(sweep.derived)
    assert words == (
        "soil: friction angle 35.77 deg, sd 3.61 deg, by N 24 (60 %) at 1.5 m, (N1)60 30.6 with C_N 1.7, rods 0.75 "
        "(Wolff 1989, the lowest; by Hatanaka and Uchida 1996 it is 41.71 deg); density 1762 to 2082 kg/m^3, uniform "
        "(EM 1110-2-2504, Table 3-1); subgrade reaction 29.8 MN/m^3, cov 73 %, which follows the angle (API)"
    )
    (us,) = derived_words(sweep.derived, "us")
    assert us == words.replace("1.5 m", "4.921 ft").replace("1762 to 2082 kg/m^3", "110 to 130 pcf").replace(
        "29.8 MN/m^3", "110 pci"
    )
    (data,) = sweep.resolved()["derived"]["soil"]
    assert data["friction_angle_deg"] == sweep.constants[ANGLE]
    assert data["readings"][0]["stress_factor"] == 1.7
    assert data["readings"][0]["friction_angles_deg"] == pytest.approx(sand.angles_by_blow_count(30.6))


def test_named_soils_have_readings_of_their_own(load_it, minimal):
    soils = "soil: [{name: a, spt: {n1_60: 20}}, {name: b, relative_density: 60 %}, {name: c, density: 1800, "
    soils += "friction_angle: 38, subgrade_reaction: 40}]\n"
    sweep = load_it(minimal.replace(f"soil:\n{CONSTANTS}", soils))
    assert sweep.block(0, 3).columns[ANGLE].to_numpy().tolist() == pytest.approx([32.88, 35.0, 38.0], abs=0.01)
    spread = sweep.distributions[ANGLE]
    assert isinstance(spread, SetDistributions)
    assert [own and own.sd for own in spread.each] == [3.0, 2.0, None]
    assert [data["name"] for data in sweep.derived["soil"]] == ["a", "b"]


def test_beside_a_table_its_columns_win(load_it, minimal, tmp_path):
    (tmp_path / "soils.csv").write_text(f"{ANGLE},{REACTION}\n36,40\n38,50\n")
    text = minimal.replace(CONSTANTS, f"  {RAW}\n")
    (tmp_path / "grid.yaml").write_text(f"table: soils.csv\n{text}")
    sweep = load(tmp_path / "grid.yaml")
    assert sweep.block(0, 2).columns[ANGLE].to_numpy().tolist() == [36.0, 38.0]
    assert list(sweep.distributions) == [DENSITY]


@pytest.mark.parametrize(
    ("entry", "position", "words"),
    [
        ("spt: {n: 3, energy_ratio: 60 %, depth: 1.5 m}", "9:8", "holds from 4.55 to 39; give soil.friction_angle"),
        ("spt: [{n1_60: 30}, {n1_60: 4}]", "9:22", "(N1)60 is 4"),
        ("spt: {n: 20, depth: 1.5 m}", "9:8", "or n1_60, which is corrected for the stress, too"),
        ("spt: {n: 20, n1_60: 30}", "9:8", "not both"),
        ("spt: {n: 20, energy: 60 %, depth: 1 m}", "9:16", "'energy' is not a key of a reading"),
        ("spt: 20", "9:8", "a reading must be a block of keys: n, energy_ratio, n60, depth, n1_60"),
        ("spt: {n60: 20, energy_ratio: 70 %, depth: 1.5 m}", "9:8", "n60 is at an energy ratio of 60 %"),
        ("spt: {n60: 20, n1_60: 30}", "9:8", "not both"),
        ("spt: {n60: 20}", "9:8", "n60, the blows at an energy ratio of 60 %, with depth"),
        ("spt: []", "9:8", "the list is empty"),
        ("cpt: {q_c: 14 MPa}", "9:8", "a reading of a cone has q_c and depth"),
        ("cpt: {q_c: 14 m, depth: 1 m}", "9:14", "a pressure is needed (MPa, kPa or tsf)"),
        ("cpt: {q_c: 0.7 MPa, depth: 1 m}", "9:8", "holds from 30 to 46 deg"),
        ("relative_density: 95 %", "9:21", "the correlation holds from 0.15 to 0.85; give soil.friction_angle"),
        ("relative_density: 30 %", "9:21", "the API curve begins at 30 deg"),
        ("relative_density: 60 %\n  spt: {n1_60: 20}", "9:3", "give one of spt, relative_density"),
        (f"{RAW}\n  water_table: 1 m", "9:3", "with a water table give soil.subgrade_reaction"),
    ],
)
def test_mistakes_of_soil_readings(problems_of, minimal, entry, position, words):
    (problem,) = problems_of(minimal.replace(CONSTANTS, f"  {entry}\n"))
    assert problem.key == "soil"
    assert words in problem.message
    assert f"{problem.line}:{problem.column}" == position


SITE = """\
boulder: {length: 1.65 m, width: 1.68 m, height: 3.4 m, density: 2600 kg/m^3}
site: {embedment_depth: 2.2 m}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
soil:
"""
STRONGEST = min(sand.STRONGEST["spt"].values())


def blows(*rows):
    """Return a borehole of counts at 60 % and depths."""
    return f"spt: [{', '.join(f'{{n: {n}, energy_ratio: 60 %, depth: {depth} m}}' for n, depth in rows)}]"


def cone(*rows):
    """Return the log of a cone as a list, a row a line."""
    return "cpt:\n" + "\n".join(f"    - {{q_c: {q} MPa, depth: {depth:.2f} m}}" for q, depth in rows)


def lowest_angle_of(n, depth):
    """Return the friction angle that one count gives [deg]."""
    count = sand.normalized_blow_count(n, 0.6, depth, sand.vertical_stress(depth, None))
    return min(sand.angles_by_blow_count(count).values())


@pytest.fixture
def site(load_it):
    """Load the site with readings, and with other entries in place of its own."""
    return lambda soil, *overrides: load_it(f"{SITE}  {soil}\n", *overrides)


@pytest.fixture
def refusal(problems_of):
    """Return the one problem of the site with readings."""

    def problem(soil, *overrides):
        (only,) = problems_of(f"{SITE}  {soil}\n", *overrides)
        return only

    return problem


def words_of(sweep):
    (words,) = derived_words(sweep.derived)
    return words


@pytest.mark.parametrize(
    ("soil", "angle", "words"),
    [
        (
            blows((19, 0.8), (22, 1.5), (50, 2.3)),
            lowest_angle_of(19, 0.8),
            ["the weakest of 3 readings", "1 reading at 2.3 m above the range of the correlation, taken as its end"],
        ),
        (
            blows((15, 1.5), (22, 3.0), (11, 9.0)),
            lowest_angle_of(15, 1.5),
            [
                "the weakest of 2 readings",
                "1 reading at 9 m left out, below the first one under the deepest foot (2.2 m)",
            ],
        ),
        (
            "spt: [{n60: 13, depth: 1.5 m}]",
            lowest_angle_of(13, 1.5),
            ["by N 13 (60 %) at 1.5 m, (N1)60 16.57"],
        ),
        (blows((60, 1.5)), STRONGEST, ["1 reading at 1.5 m above the range"]),
        (blows((22, 1.5), (15, 2.3)), lowest_angle_of(15, 2.3), ["the weakest of 2 readings"]),
        (
            blows((22, 1.5), (25, 2.2), (14, 2.3), (11, 2.4)),
            lowest_angle_of(14, 2.3),
            ["weakest of 3", "1 reading at 2.4 m left"],
        ),
        (
            blows((22, 2.4), (25, 2.4), (4, 2.5), (3, 30)),
            lowest_angle_of(22, 2.4),
            ["2 readings at 2.5 to 30 m left out"],
        ),
        (blows((22, 0)), min(sand.angles_by_blow_count(22 * 0.75 * 1.7).values()), ["N 22 (60 %) at 0 m"]),
        (
            "topsoil: 0.4 m\n  " + blows((2, 0.3), (22, 0.4), (24, 1.5)),
            lowest_angle_of(22, 0.4),
            ["the weakest of 2 readings", "1 reading at 0.3 m left out, in the topsoil"],
        ),
        (
            "spt: [{n1_60: 20, depth: 1.5 m}, {n1_60: 8, depth: 3 m}, {n1_60: 6, depth: 4 m}, {n1_60: 30}]",
            29.465,
            ["(N1)60 8 at 3 m, the weakest of 3 readings"],
        ),
        (
            "cpt: [{q_c: 40, depth: 1 m}, {q_c: 12, depth: 2 m}, {q_c: 9, depth: 3 m}, {q_c: 0, depth: 35 m}]",
            sand.kulhawy_mayne(9.0, sand.vertical_stress(3.0, None)),
            ["weakest of 3", "1 reading at 1 m above the range", "1 reading at 35 m left out"],
        ),
        ("cpt: {q_c: 40 MPa, depth: 1 m}", 46.0, ["by Robertson and Campanella 1983 it is 46 deg"]),
    ],
)
def test_the_weakest_of_the_readings_that_count_decides(site, soil, angle, words):
    sweep = site(soil + "\n  subgrade_reaction: 40")
    assert sweep.constants[ANGLE] == pytest.approx(angle, abs=1e-3)
    for part in words:
        assert part in words_of(sweep)


@pytest.mark.parametrize(
    ("written", "least"),
    [
        ("50/75mm", 50),
        ('50/3"', 50),
        ("50 / 75 mm", 50),
        ("50 blows for 75 mm", 50),
        ("20/0.5 ft", 20),
        ("20/300mm", 20),
        ("R", 50),
        ("refusal", 50),
        ("'>50'", 50),
        ("'>= 20'", 20),
        ("20+", 20),
    ],
)
@pytest.mark.parametrize("key", ["n: {}, energy_ratio: 60 %", "n60: {}"])
def test_a_test_that_was_given_up_has_at_least_its_blows(site, key, written, least):
    reading = f"spt: {{{key.format(written)}, depth: 8 m}}"
    sweep, plain = (site(f"{text}\n  subgrade_reaction: 40") for text in (reading, blows((least, 8))))
    assert sweep.constants[ANGLE] == plain.constants[ANGLE]
    assert ("N at least" in words_of(sweep)) == ("/300" not in written)


@pytest.mark.parametrize(
    ("reading", "position", "words"),
    [
        ("n: 50/75, energy_ratio: 60 %, depth: 2 m", "5:12", "write it as in 50/75mm"),
        ("n: 50/450mm, energy_ratio: 60 %, depth: 2 m", "5:12", "is no count of the last 300 mm (1 ft)"),
        ("n: 50/75 kg, energy_ratio: 60 %, depth: 2 m", "5:12", "a length is needed"),
        ("n: WOH, energy_ratio: 60 %, depth: 2 m", "5:8", "(N1)60 is 0; the correlation holds from"),
        ("n: 20, energy_ratio: 70, depth: 2 m", "5:30", "energy_ratio: 70 is outside the admitted range of 0.3 to 1"),
        ("n: X, energy_ratio: 60 %, depth: 2 m", "5:12", "'X' is not a number"),
        ("n1_60: R", "5:16", "'R' is not a number"),
        ("n: >50, energy_ratio: 60 %, depth: 2 m", "5:12", "put the text in quotation marks"),
        ("n1_60: 20, energy_ratio: 60 %", "5:8", "not both"),
    ],
)
def test_readings_that_cannot_be_read(refusal, reading, position, words):
    problem = refusal(f"spt: {{{reading}}}")
    assert words in problem.message
    assert f"{problem.line}:{problem.column}" == position


GIVEN = {"friction_angle": "36 deg", "density": "1860 kg/m^3", "subgrade_reaction": "60 MN/m^3"}


@pytest.mark.parametrize("reading", [blows((60, 1.5)), blows((1, 1.5)), cone((0.1, 1.0)), "relative_density: 99 %"])
def test_where_every_constant_is_given_the_readings_are_only_kept(site, reading):
    sweep = site("\n  ".join([*(f"{key}: {value}" for key, value in GIVEN.items()), reading]))
    assert (
        sweep.constants[ANGLE],
        sweep.constants[REACTION],
        sweep.distributions,
    ) == (36.0, 60.0, {})
    assert len(sweep.resolved()["derived"]["soil"][0]["readings"]) == 1
    assert words_of(sweep) == "soil: the readings are kept for the record: the file gives every constant"


@pytest.mark.parametrize("given", [[], ["friction_angle"], ["density", "subgrade_reaction"], ["density"]])
@pytest.mark.parametrize("reading", [blows((1, 1.5)), cone((0.1, 1.0))])
def test_what_a_refusal_asks_for_is_enough(site, refusal, reading, given):
    """A reading below the range stands for nothing; every constant that the message names makes the file valid."""
    entries = [f"{key}: {GIVEN[key]}" for key in given]
    message = refusal("\n  ".join([reading, *entries])).message
    named = [key for key in GIVEN if f"soil.{key}" in message]
    assert sorted(named) == sorted(set(GIVEN) - set(given))
    assert site("\n  ".join([reading, *entries, *(f"{key}: {GIVEN[key]}" for key in named)]))


def test_rows_of_a_log_under_the_range_are_one_line(site, refusal):
    rows = [(0.3 if k < 15 else 9.0, 0.02 * k) for k in range(1, 442)]
    problem = refusal(cone(*rows))
    assert (problem.line, problem.column) == (6, 7)
    assert problem.message == (
        "the friction angle by 0.3 MPa is 24.52 deg; the correlation holds from 30 to 46 deg; 14 of the 111 readings "
        "that count are too weak for it, at 0.02 to 0.28 m; give soil.friction_angle, soil.density and "
        "soil.subgrade_reaction as measured; or, where this is topsoil, soil.topsoil: 0.3 m"
    )
    words = words_of(site(f"topsoil: 0.3 m\n  {cone(*rows)}"))
    assert "14 readings at 0.02 to 0.28 m left out, in the topsoil; 330 readings at 2.24 to 8.82 m left out" in words
    deeper = [(0.3 if k < 30 else 9.0, 0.02 * k) for k in range(1, 442)]
    assert "topsoil" not in refusal(cone(*deeper)).message


@pytest.mark.parametrize("row", ["{q_c: 9 m, depth: 1 m}", "{q_c: 9 MPa}", "{q_c: -1 MPa, depth: 1 m}"])
def test_the_same_mistake_in_every_row_is_one_line(refusal, row):
    assert refusal("cpt:\n" + 441 * f"    - {row}\n").line == 6


@pytest.mark.parametrize(
    ("soil", "words"),
    [
        ("topsoil: 0.6 m\n  " + blows((20, 1.5)), "outside the admitted range of 0 to 0.5 m"),
        ("topsoil: 0.3 m\n  relative_density: 60 %", "give it with spt or cpt"),
        ("topsoil: 0.3 m\n  friction_angle: 36\n  density: 1860\n  subgrade_reaction: 60", "give it with spt or cpt"),
        ("topsoil: 0.3 m\n  " + blows((20, 0.2)), "every reading lies in the topsoil"),
    ],
)
def test_topsoil_is_shallow_and_says_something_of_readings(refusal, soil, words):
    assert words in refusal(soil).message


@pytest.mark.parametrize(
    ("embedment", "foot"),
    [
        ("embedment_depth: 1.2 m", 1.2),
        ("embedment_depth: [1.2, 2.9] m", 2.9),
        ("embedment_depth: {mean: 1.2 m, sd: 0.1 m}", 1.7),
        ("embedment_depth: {distribution: uniform, low: 1 m, high: 1.4 m}", 1.4),
        ("embedment_ratio: 0.5", 1.7),
        ("embedment_ratio: {from: 0.4, to: 0.7, step: 0.1}", 2.38),
    ],
)
def test_the_deepest_foot_of_the_file_is_what_readings_reach_down_to(site, embedment, foot):
    """A reading every 0.5 m: the first under the foot is the last that counts."""
    depths = [0.5 * k for k in range(1, 12)]
    key, _, value = embedment.partition(": ")
    sweep = site(blows(*((40 - 4 * depth, depth) for depth in depths)), f"site.{key}={value}")
    (data,) = sweep.derived["soil"]
    assert data["foot_m"] == pytest.approx(foot)
    last = next(depth for depth in depths if depth > foot)
    assert [reading["depth_m"] for reading in data["readings"] if "left_out" not in reading][-1] == last
    assert covered_depth(sweep.derived) == last


def test_the_foot_of_a_profile_and_of_a_table(load_it, tmp_path):
    log = blows((30, 1.5), (25, 2.0), (20, 2.5), (15, 3.0))
    profile = "profile: [{height: 0, width: 1.5, length: 1.5}, {height: 3 m, width: 1.5, length: 1.5}]"
    text = SITE.replace("length: 1.65 m, width: 1.68 m, height: 3.4 m", profile)
    sweep = load_it(text.replace("embedment_depth: 2.2 m", "embedment_ratio: 60 %") + f"  {log}\n")
    assert sweep.derived["soil"][0]["foot_m"] == pytest.approx(1.8)
    (tmp_path / "designs.csv").write_text("boulder_height_m,embedment_ratio\n2.0,0.7\n4.0,0.4\n")
    text = SITE.replace(", height: 3.4 m", "").replace("site: {embedment_depth: 2.2 m}\n", "")
    sweep = load_it(f"table: {tmp_path / 'designs.csv'}\n{text}  {log}\n")
    assert sweep.derived["soil"][0]["foot_m"] == pytest.approx(1.6)


LOG = blows((25, 1.5), (22, 3.0), (18, 4.5))


@pytest.mark.parametrize(
    ("embedment", "least", "between", "entry"),
    [
        ("embedment_depth=1.2 m", "embedment_depth", None, "site.embedment_depth: [1.19, 2.9] m"),
        ("embedment_ratio=0.4", "embedment_depth", None, "site.embedment_depth: [1.19, 2.9] m"),
        ("embedment_depth=1.2 m", "embedment_ratio", None, "site.embedment_ratio: [0.35, 0.852941]"),
        ("embedment_ratio=0.4", "height", None, "boulder.height: [1.5, 4] m"),
        ("embedment_depth=1.2 m", "embedment_depth", ("1 m", "1.5 m"), "site.embedment_depth: [1, 1.5] m"),
    ],
)
def test_a_search_below_the_readings_that_count_is_refused(site, embedment, least, between, entry):
    with pytest.raises(QuestionError) as caught:
        bare_need(site(LOG, f"site.{embedment}"), least, between=between)
    assert "the readings of the soil below 1.5 m were left out" in str(caught.value)
    assert f"they count where the file gives {entry}" in str(caught.value)
    key, _, values = entry.partition(": ")
    instead = [f"site.{embedment}"] if key == "boulder.height" else []
    assert covered_depth(site(LOG, *instead, f"{key}={values}").derived) > 1.5


def test_beside_a_table_a_deeper_design_makes_more_readings_count(load_it, tmp_path):
    table = tmp_path / "designs.csv"
    text = f"table: {table}\n{SITE.replace('site: {embedment_depth: 2.2 m}', '')}  {LOG}\n"
    table.write_text("embedment_depth_m\n1.2\n")
    with pytest.raises(QuestionError, match=r"or they count where the table has a design with such a foot"):
        bare_need(load_it(text))
    table.write_text("embedment_depth_m\n1.2\n2.9\n")
    assert covered_depth(load_it(text).derived) == 3.0


def test_a_search_within_them_is_answered(site):
    answers = bare_need(site(LOG), "embedment_depth", between=("2.2 m", "2.9 m"))
    assert answers.counts()
