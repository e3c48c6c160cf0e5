"""Readings in place of soil constants: what the file says, what is taken, what wins, and what is refused."""

from __future__ import annotations

import math

import pytest

from boulder_sweep import at_values
from boulder_sweep import investigation as sand
from boulder_sweep.investigation import api_curve
from boulder_sweep.settings import load
from boulder_sweep.settings.distributions import SetDistributions
from boulder_sweep.settings.soil_readings import CORRELATION
from boulder_sweep.settings.sweep import derived_words

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


def test_tables_that_kept_one_angle_of_a_reading_are_still_put_in_words(soil):
    (data,) = soil(RAW).resolved()["derived"]["soil"]
    for reading in data["readings"]:
        del reading["friction_angles_deg"]
    assert "rods 0.75 (Wolff 1989); density" in derived_words({"soil": [data]})[0]


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


def test_blows_at_an_energy_ratio_of_60_percent(load_it, minimal):
    """N60 is N corrected for the energy alone, so it is not (N1)60, which is that at 100 kPa."""
    readings = ("n60: 13", "n: 13, energy_ratio: 60 %", "n: 10, energy_ratio: 78 %")
    by_n60, by_n, by_ratio = (
        load_it(minimal.replace(CONSTANTS, f"  spt: {{{one}, depth: 1.5 m}}\n")) for one in readings
    )
    assert by_n60.derived == by_n.derived
    angles = [sweep.constants[ANGLE] for sweep in (by_n60, by_ratio)]
    assert angles[0] == pytest.approx(angles[1], rel=1e-12)
    corrected = load_it(minimal.replace(CONSTANTS, "  spt: {n1_60: 13}\n"))
    assert corrected.constants[ANGLE] != pytest.approx(angles[0], abs=1.0)


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
def test_mistakes(problems_of, minimal, entry, position, words):
    (problem,) = problems_of(minimal.replace(CONSTANTS, f"  {entry}\n"))
    assert problem.key == "soil"
    assert words in problem.message
    assert f"{problem.line}:{problem.column}" == position
