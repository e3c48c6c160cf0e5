"""Numbers and units as engineers write them, and the traps between YAML, Excel and the Imperial system."""

import math
from fractions import Fraction

import pytest

from boulder_sweep.settings.units import EXPECTED, UnitError, factor
from boulder_sweep.settings.values import split_number


@pytest.mark.parametrize(
    ("override", "column", "expected"),
    [
        ("vehicle.mass=6800 kg", "vehicle_mass_kg", 6800),
        ("vehicle.mass=6800kg", "vehicle_mass_kg", 6800),
        ("vehicle.mass=6.8 t", "vehicle_mass_kg", 6800),
        ("vehicle.mass=6.8 tonnes", "vehicle_mass_kg", 6800),
        ("vehicle.mass=15000 lb", "vehicle_mass_kg", 15000 * 0.45359237),
        ("vehicle.mass=7.5 short_ton", "vehicle_mass_kg", 15000 * 0.45359237),
        ("vehicle.mass=15 kip", "vehicle_mass_kg", 15000 * 0.45359237),
        ("vehicle.speed=30 mph", "impact_speed_m_s", 13.4112),
        ("vehicle.speed=48 km/h", "impact_speed_m_s", 48 / 3.6),
        ("vehicle.speed=44 ft/s", "impact_speed_m_s", 44 * 0.3048),
        ("vehicle.speed=1.4e1", "impact_speed_m_s", 14),
        ("vehicle.speed=+14.", "impact_speed_m_s", 14),
        ("vehicle.spring=3103.3 kN/m", "vehicle_spring_N_m", 3103300),
        ("vehicle.spring=3.1033 MN/m", "vehicle_spring_N_m", 3103300),
        ("vehicle.spring=17720 lb/in", "vehicle_spring_N_m", 17720 * 4.4482216152605 / 0.0254),
        ("vehicle.spring=17720 lbf/in", "vehicle_spring_N_m", 17720 * 4.4482216152605 / 0.0254),
        ("vehicle.damper=138.91 kN*s/m", "vehicle_damper_N_s_m", 138910),
        ("vehicle.damper=138.91 kN·s/m", "vehicle_damper_N_s_m", 138910),
        ("vehicle.damper=138.91 kN-s/m", "vehicle_damper_N_s_m", 138910),
        ("vehicle.damper=138.91 kN s/m", "vehicle_damper_N_s_m", 138910),
        ("vehicle.damper=138.91 kN/(m/s)", "vehicle_damper_N_s_m", 138910),
        ("vehicle.damper=138910 kg/s", "vehicle_damper_N_s_m", 138910),
        ("vehicle.damper=138.91 kNs/m", "vehicle_damper_N_s_m", 138910),
        ("vehicle.damper=138910 Ns/m", "vehicle_damper_N_s_m", 138910),
        ("soil.subgrade_reaction=95 MN/m^3", "subgrade_reaction_MN_m3", 95),
        ("soil.subgrade_reaction=95 MN/m3", "subgrade_reaction_MN_m3", 95),
        ("soil.subgrade_reaction=95 MN/m**3", "subgrade_reaction_MN_m3", 95),
        ("soil.subgrade_reaction=95 MN/m³", "subgrade_reaction_MN_m3", 95),
        ("soil.subgrade_reaction=95 MN m^-3", "subgrade_reaction_MN_m3", 95),
        ("soil.subgrade_reaction=95000 kPa/m", "subgrade_reaction_MN_m3", 95),
        ("soil.subgrade_reaction=350 pci", "subgrade_reaction_MN_m3", 350 * 4.4482216152605 / 0.0254**3 / 1e6),
        ("soil.subgrade_reaction=350 lb/in^3", "subgrade_reaction_MN_m3", 350 * 4.4482216152605 / 0.0254**3 / 1e6),
        ("soil.density=116 pcf", "soil_density_kg_m3", 116 * 0.45359237 / 0.3048**3),
        ("soil.density=116 lb/ft^3", "soil_density_kg_m3", 116 * 0.45359237 / 0.3048**3),
        ("soil.density=18.2 kN/m^3", "soil_density_kg_m3", 18200 / 9.80665),
        ("soil.density=1.86 g/cm^3", "soil_density_kg_m3", 1860),
        ("soil.friction_angle=43.2 deg", "friction_angle_deg", 43.2),
        ("soil.friction_angle=43.2°", "friction_angle_deg", 43.2),
        ("soil.friction_angle=0.75 rad", "friction_angle_deg", math.degrees(0.75)),
        ("site.embedment_ratio=55 %", "embedment_depth_m", 0.55 * 3.44),
        ("boulder.length=5.4 ft", "boulder_length_m", 5.4 * 0.3048),
        ("boulder.length=65 in.", "boulder_length_m", 65 * 0.0254),
        ("boulder.length=5 ft 6 in", "boulder_length_m", 66 * 0.0254),
        ("boulder.length=5ft6in", "boulder_length_m", 66 * 0.0254),
        ("boulder.length=5 feet 6 1/2 inches", "boulder_length_m", 66.5 * 0.0254),
        ("boulder.length=5' 6\"", "boulder_length_m", 66 * 0.0254),
        ("boulder.length=5'-6 1/2\"", "boulder_length_m", 66.5 * 0.0254),
        ("boulder.length=5'", "boulder_length_m", 60 * 0.0254),
        ("boulder.length='66\"'", "boulder_length_m", 66 * 0.0254),
        ("boulder.length=[5 ft 6 in, 6 ft]", "boulder_length_m", 66 * 0.0254),
        ("boulder.length='65 in'", "boulder_length_m", 65 * 0.0254),
        ("boulder.length=.5", "boulder_length_m", 0.5),
    ],
)
def test_units_in_any_common_form(load_with, override, column, expected):
    value = load_with(override).block(0, 1).columns[column].to_numpy()[0]
    assert value == pytest.approx(expected, rel=4e-16)


def test_conversions_are_exact():
    assert factor("mph", "m/s") == Fraction("0.44704")
    assert factor("lb", "kg") == Fraction("0.45359237")
    assert factor("ft", "m") == Fraction("0.3048")
    assert float(350 * factor("pci", "MN/m^3")) == pytest.approx(95.0, abs=0.01)


@pytest.mark.parametrize("unit", EXPECTED)
def test_every_unit_of_the_table_is_its_own(unit):
    assert factor(unit, unit) == 1


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("vehicle.mass=7 ton", "use short_ton, long_ton or tonne"),
        ("vehicle.mass=7 tons", "use short_ton, long_ton or tonne"),
        ("vehicle.mass=7 m", "'m' is a length; a mass is needed (kg, t, lb or short_ton)"),
        ("boulder.length=3 kg", "a length is needed (m, cm, ft or in)"),
        ("boulder.length=3 %", "a length is needed"),
        ("soil.friction_angle=30 %", "an angle is needed"),
        ("soil.subgrade_reaction=95 MN/m^2", "'MN/m^2' is a pressure; a subgrade reaction"),
        ("vehicle.damper=138 kN/m", "'kN/m' is a stiffness; a damping constant is needed"),
        ("vehicle.spring=3103 KN/m", "'KN' is not a known unit; did you mean kN?"),
        ("vehicle.spring=3 mN/m", "'mN' is not a known unit; did you mean MN (meganewton)?"),
        ("vehicle.speed=30 mhp", "did you mean mph?"),
        ("boulder.length=3 metrs", "did you mean metres?"),
        ("vehicle.speed=30 m/", "'m/' is not a unit"),
        ("boulder.length=3 m^9^9^9", "is not a unit"),
        ("boulder.length=3 ((((((m9)9)9)9)9)9)", "is not a unit"),
        ("boulder.length=3 " + "m*" * 100 + "m", "too long for a unit"),
        ("boulder.length=no", "yes/no value"),
        ("boulder.length=true", "yes/no value"),
        ("boulder.length=1:30", "not one number"),
        ("boulder.length=1/2", "not one number"),
        ("boulder.length=1 to 2", "not one number"),
        ("boulder.length=010", "begins with a zero"),
        ("boulder.length=0x10", "not a decimal number"),
        ("boulder.length=.nan", "not a finite number"),
        ("boulder.length=nan", "not a finite number"),
        ("boulder.length=.inf", "not a finite number"),
        ("boulder.length=-.Inf", "not a finite number"),
        ("boulder.length=-inf m", "not a finite number"),
        ("boulder.length=1e999", "exponent"),
        ("boulder.length=1e999999999999", "exponent"),
        ("boulder.length=1e" + "9" * 5000, "exponent"),
        ("boulder.length=" + "1" * 1000, "too many digits"),
        ("boulder.length=", "is empty"),
        ("boulder.length=~", "is empty"),
        ("boulder.length=null", "is empty"),
        ("boulder.length=-1.65 m", "-1.65 m is outside the admitted range of 0.01 to 20 m"),
        ("boulder.length=80 ft", "80 ft is outside the admitted range of 0.0328084 to 65.6168 ft"),
        ("boulder.length='80  ft'", "80 ft is outside"),
        ("boulder.length=[5, 80] ft", "80 ft is outside"),
        ("site.embedment_ratio=110 %", "110 % is outside the admitted range of 0.0001 to 100 %"),
        ("boulder.length={from: 1 ft, to: 6 ft, step: 2 ft}", "steps of 2 ft from 1 ft do not end at 6 ft but at 5 ft"),
        ("boulder.length=large", "'large' is not a number; a length is needed, such as 1.65 m"),
        ("boulder.length=5'6", "lacks the unit of the inches; write it as in 5 ft 6 in"),
        ("boulder.length=5 ft 6", "lacks the unit of the inches"),
        ("boulder.length=5.5 ft 6 in", "write whole feet and less than 12 inches"),
        ("boulder.length=5 ft 14 in", "write whole feet and less than 12 inches"),
        ("vehicle.mass=5 ft 6 in", "'ft' is a length; a mass is needed"),
        ("soil.friction_angle=34, 38 deg", "write a list in brackets, such as [34, 38] deg"),
        ("soil.friction_angle=34; 38", "write a list in brackets"),
        ("vehicle.mass=-6800", "outside the admitted range"),
        ("soil.friction_angle=0", "outside the admitted range of 1 to 60 deg"),
        ("site.embedment_ratio=55", "0.55 or 55 %"),
        ("model.soil={elements: 0}", "whole number from 1 to 1000000"),
        ("model.soil={elements: 1000001}", "whole number from 1 to 1000000"),
        ("model.soil={element: 5}", "{elements: 5000}"),
        ("model.soil=closed", "closed_form, or {elements: 5000}"),
        ("model.readings=printed", "did you mean as_printed?"),
        ("model.readings={preset: corect}", "did you mean corrected?"),
        ("model.readings={inertia: geometric}", "is not a value of inertia: printed, box, corrected"),
        ("model.readings={inertai: box}", "did you mean inertia?"),
        ("criterion.rating=P4", "P1, P2, P3"),
        ("criterion.max_rotation=0", "outside the admitted range"),
        ("criterion.max_rotation=20 m", "an angle is needed"),
        ("solver.accuracy=blanced", "did you mean balanced?"),
        ("solver.accuracy=0 deg", "outside the admitted range"),
        ("solver.accuracy=1 mm", "an angle is needed"),
        ("solver.horizon=-1", "outside the admitted range"),
        ("solver.horizon=1 m", "a time is needed (s or ms)"),
        ("solver.step=2 s", "admitted range"),
        ("name=a/b", "letters, digits"),
        ("name=../../x", "letters, digits"),
        ("name=[a]", "letters, digits"),
    ],
)
def test_traps(the_problem, override, words):
    problem = the_problem(override)
    assert words in problem.message
    assert problem.file == "--set"
    assert "\n" not in str(problem)


def test_a_step_longer_than_the_horizon(problems_of, minimal):
    (problem,) = problems_of(minimal, "solver.step=0.5", "solver.horizon=0.1")
    assert problem.key == "solver.step"
    assert "longer than the horizon" in problem.message


@pytest.mark.parametrize(
    "text", ["ton", "m/", "*", "", " ", "m m^", "(m", "m)", "m^x", "\x00", "m" * 61, "°°°^", "1", "2"]
)
def test_malformed_units_are_refused_with_a_reason(text):
    with pytest.raises(UnitError, match=r"unit|needed|ambiguous"):
        factor(text, "m")


@pytest.mark.parametrize(
    ("text", "target", "expected"),
    [
        ("msec", "s", "0.001"),
        ("usec", "s", "0.000001"),
        ("m/(s*s)", "m/s^2", "1"),
        ("g's", "m/s^2", "9.80665"),
        ("g", "m/s^2", "9.80665"),
        ("g", "kg", "0.001"),
        ("mps", "m/s", "1"),
    ],
)
def test_usual_spellings(text, target, expected):
    assert factor(text, target) == Fraction(expected)


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("tcf", "kg/m^3"),  # not tsf, a pressure, nor pcf, of pounds
        ("kn", "m/s"),  # a knot, not a kilonewton
        ("nsec", "s"),
        ("kps", "m/s"),
        ("dm", "m"),
        ("mb", "kg"),
        ("decimetre", "m"),
        ("kgm", "kg/m^3"),
    ],
)
def test_what_is_no_slip_of_a_unit_is_told_which_units_there_are(text, target):
    with pytest.raises(UnitError, match=r"is not a known unit; .* is needed") as refused:
        factor(text, target)
    assert "did you mean" not in str(refused.value)


@pytest.mark.parametrize("target", EXPECTED)
def test_a_suggested_unit_keeps_the_kind_of_quantity(target):
    """Whatever a letter that lacks or is another makes of a unit: what is suggested fits, and has the same letters."""
    letters = "aceknmpstx"
    for unit in ("ms", "sec", "mm", "ft", "kN/m", "kN*s/m", "MN/m^3", "mph", "km/h", "pcf", "lb", "MPa", "deg"):
        for place in range(len(unit)):
            rest = unit[place + 1 :]
            for typed in (unit[:place] + rest, *(unit[:place] + letter + rest for letter in letters)):
                try:
                    factor(typed, target)
                except UnitError as error:
                    _, _, meant = str(error).partition("did you mean ")
                    word = str(error).split("'")[1]
                    assert not meant or factor(typed.replace(word, meant.rstrip("?").split(" (")[0]), target), typed
                    assert not meant or sorted(word.lower()) == sorted(meant.rstrip("?").split(" (")[0].lower()), typed


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        ("15,000 lb", "15000 lb"),
        ("12,345,678", "12345678"),
        ("1,500.5 kg", "1500.5 kg"),
        ("15.000,5 kg", "15000.5 kg"),
        ("1.234.567", "1234567"),
        ("15'000 kg", "15000 kg"),
        ("15’000 kg", "15000 kg"),
        ("15 000 kg", "15000 kg"),
        ("15_000", "15000"),
        ("-15,000", "-15000"),
        ("15,000e3 kg", "15000e3 kg"),
        ("1,5 t", "1.5 t"),
        ("6,80 t", "6.80 t"),
        ("1,5e3 kg", "1.5e3 kg"),
        ("0,125 t", "0.125 t"),
        ("1,2345 t", "1.2345 t"),
        ("1500,500", ""),
        ("12,34,567", ""),
        ("15,000,5", ""),
        ("1.5.2", ""),
    ],
)
@pytest.mark.parametrize("form", ["{}", "'{}'"])
def test_separators_in_a_number(the_problem, written, plain, form):
    """Before three digits no decimal point is suggested: it would make the number too small by a factor of 1000."""
    quoted = form.format(written.replace("'", "''") if form[0] == "'" else written)
    message = the_problem(f"vehicle.mass={quoted}").message
    remedy = f"; write {plain}" if plain else "; write digits and one decimal point only, as in 6800.5"
    assert message == f"'{written}' is not a plain number{remedy}"
    assert not plain or split_number(plain, "kg")


@pytest.mark.parametrize("entry", ["{}", "{{mean: {}, sd: 500 kg}}", "{{from: {}, to: 20 t, count: 3}}"])
def test_a_number_that_a_comma_cuts_in_two(problems_of, minimal, entry):
    """Within braces a comma ends a value, so YAML has a key ``000 lb`` there."""
    vehicle = f"vehicle: {{mass: {entry.format('15,000 lb')}, speed: 14.5, spring: 3103.3e3, damper: 138.91e3}}\n"
    text = minimal[: minimal.index("vehicle:")] + vehicle
    (problem,) = problems_of(text)
    assert (problem.key, problem.message) == ("vehicle.mass", "'15,000 lb' is not a plain number; write 15000 lb")
    assert (problem.line, problem.column) == (12, vehicle.index("15,000") + 1)


def test_the_rest_of_a_number_in_a_list(the_problem):
    assert "write that without a comma, as in 15000" in the_problem("vehicle.mass=[15,000, 20,000] lb").message
