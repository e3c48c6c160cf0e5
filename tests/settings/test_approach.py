"""The street in place of a speed: the arithmetic, what the file says, what is kept of it, and what is refused."""

from __future__ import annotations

import math

import pytest

from boulder_sweep.settings.sweep import derived_words
from boulder_sweep.settings.vehicle import Approach, G, NoApproachError

SPEED = "  speed: 14.5"
WHOLE = "  approach: {length: 80 m, from: 20 mph, acceleration: 1.2 m/s^2}"


def test_speed_by_hand():
    """1 m/s^2 over 80 m from 8 m/s: sqrt(64 + 2 x 1 x 80) = sqrt(224)."""
    assert Approach(80.0, 1.0, 8.0).impact_speed_m_s == pytest.approx(math.sqrt(224.0), rel=1e-15)
    assert Approach(0.0, 1.0, 8.0).impact_speed_m_s == 8.0


def test_the_skidding_speed_of_the_handbook():
    """MIL-HDBK-1013/14, Eq 6, with its 32.2 ft/s^2: f = 0.6 and r = 100 ft give sqrt(0.6 x 32.2 x 100) = 43.95 ft/s."""
    approach = Approach(0.0, 0.0, curve_radius_m=30.48, friction=0.6)
    assert approach.impact_speed_m_s / 0.3048 == pytest.approx(math.sqrt(0.6 * 32.2 * 100.0), rel=1e-3)
    assert Approach(0.0, 0.0, curve_radius_m=30.48).friction == 1.0


def test_energy_on_a_grade():
    """A vehicle that rolls down loses the height it drops: v^2 = 2 g h, whatever the way."""
    length, grade = 100.0, -0.05
    drop = length * math.sin(math.atan(-grade))
    assert Approach(length, 0.0, 0.0, grade=grade).impact_speed_m_s == pytest.approx(math.sqrt(2 * G * drop), rel=1e-12)


def test_a_curve_limits_the_start_only():
    curve = Approach(50.0, 1.5, 20.0, 10.0)
    assert curve.start_speed_m_s == curve.curve_speed_m_s == math.sqrt(10.0 * G)
    assert curve.impact_speed_m_s == Approach(50.0, 1.5, None, 10.0).impact_speed_m_s
    assert Approach(50.0, 1.5, 5.0, 10.0).impact_speed_m_s == Approach(50.0, 1.5, 5.0).impact_speed_m_s


@pytest.mark.parametrize(
    "larger", [{"length_m": 90.0}, {"acceleration_m_s2": 1.6}, {"from_m_s": 6.0}, {"grade": -0.02}, {"friction": 0.9}]
)
def test_every_choice_goes_to_the_safe_side(larger):
    """More of anything but a rise is never slower."""
    usual = {"length_m": 80.0, "acceleration_m_s2": 1.5, "from_m_s": 5.0, "curve_radius_m": 25.0, "friction": 0.8}
    assert Approach(**usual | larger).impact_speed_m_s >= Approach(**usual).impact_speed_m_s


def test_a_vehicle_that_stops_before():
    with pytest.raises(NoApproachError, match=r"after 12\.7 m"):
        Approach(80.0, 0.0, 5.0, grade=0.1005).impact_speed_m_s  # noqa: B018
    with pytest.raises(NoApproachError, match="after 0 m"):
        Approach(80.0, 0.0, 0.0).impact_speed_m_s  # noqa: B018


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
        ("  approach: {length: 80 m, from: 0}", "14:13", "lacks acceleration: that of the vehicle at full throttle"),
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
