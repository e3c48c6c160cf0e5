"""Remarks on what is valid and unusual."""

import numpy as np
import pytest

from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.settings.checks import wall_crush


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
        ("vehicle.speed=70 mph", "70 mph is outside the usual range of 8.94775 to 55.9234 mph"),
        (
            "boulder.height={from: 4 ft, to: 20 ft, count: 3}",
            "4 to 20 ft is outside the usual range of 4.92126 to 13.1234 ft",
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


def test_a_remark_has_its_place(load_it, minimal):
    note, _ = _notes(load_it(minimal.replace("speed: 14.5", "speed: 30")))
    assert note.startswith("grid.yaml:14:3: vehicle.speed: 30 m/s")


@pytest.mark.parametrize(
    ("angle", "reaction", "mixed"),
    [
        ("43.2", "95", False),
        ("[36, 40]", "[45, 90]", False),
        ("[30, 35, 40]", "[2.2, 4]", False),
        ("[36, 40, 43.2]", "[25, 60, 95]", True),
        ("40", "[17.6, 64]", True),
    ],
)
def test_soil_data_of_two_families(load_with, angle, reaction, mixed):
    notes = _notes(load_with(f"soil.friction_angle={angle}", f"soil.subgrade_reaction={reaction}"))
    assert any("two families of data" in note for note in notes) == mixed


@pytest.mark.parametrize(
    ("angle", "reaction", "words"),
    [
        ("28", "110", "110 MN/m^3 does not go with 28 deg"),
        ("42", "3", "3 MN/m^3 does not go with 42 deg"),
        ("[28, 43]", "110", "110 MN/m^3 does not go with 28 deg"),
        ("[36, 42]", "[45, 108]", ""),
        ("43.2", "95", ""),
    ],
)
def test_soil_constants_off_both_families(load_with, angle, reaction, words):
    notes = _notes(load_with(f"soil.friction_angle={angle}", f"soil.subgrade_reaction={reaction}"))
    found = [note for note in notes if "does not go with" in note]
    assert (words in found[0]) if words else not found


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
