"""Remarks on what is valid and unusual."""

import pytest


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
        ("vehicle.mass=150000", "not in lb"),
        ("vehicle.spring=3103.3", "a bare number is in N/m, not in kN/m"),
        ("vehicle.damper=138.91", "not in kN*s/m"),
        ("soil.friction_angle=1.5", "a bare number is in degrees"),
        ("soil.friction_angle=[20, 30]", "20 to 30 deg is outside"),
        ("soil.subgrade_reaction=350", "a bare number is in MN/m^3"),
        ("soil.density=1000", "sand and gravel"),
        ("boulder.height={from: 1, to: 5, count: 3}", "1 to 5 m is outside"),
        ("boulder.density=1800", "rock"),
        ("boulder.density=2.6", "a bare number is in kg/m^3, not in t/m^3 or pcf"),
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
    (note,) = _notes(load_it(minimal.replace("speed: 14.5", "speed: 30")))
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
