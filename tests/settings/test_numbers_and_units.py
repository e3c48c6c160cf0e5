"""Numbers, units, ranges and distributions as engineers write them, and the traps between YAML, Excel and feet."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from boulder_sweep.settings.units import EXPECTED, UnitError, factor
from boulder_sweep.settings.values import MAX_AXIS, split_number, spread


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
        ("vehicle.mass=-15000 lb", "outside the admitted range"),
        ("vehicle.speed=-30 mph", "outside the admitted range"),
        ("vehicle.speed=300 mph", "300 mph is outside the admitted range of 0 to 223.694 mph (up to 360 km/h)"),
        ("site.embedment_ratio=55", "0.55 or 55 %); write 55 %"),
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
        ("solver.accuracy=0.01 deg", "is not an accuracy: fast, balanced, fine"),
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
        *((unit, unit, "1") for unit in EXPECTED),
        ("mph", "m/s", "0.44704"),
        ("lb", "kg", "0.45359237"),
        ("ft", "m", "0.3048"),
        ("msec", "s", "0.001"),
        ("usec", "s", "0.000001"),
        ("m/(s*s)", "m/s^2", "1"),
        ("g's", "m/s^2", "9.80665"),
        ("g", "m/s^2", "9.80665"),
        ("g", "kg", "0.001"),
        ("mps", "m/s", "1"),
    ],
)
def test_conversions_are_exact(text, target, expected):
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


def _height(sweep):
    (axis,) = sweep.axes
    assert axis.name == "boulder_height_m"
    return axis.values.tolist()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[3, 3.5, 4]", [3.0, 3.5, 4.0]),
        ("[4, 3]", [4.0, 3.0]),
        ("[3]", [3.0]),
        ("[3, 3.5] m", [3.0, 3.5]),
        ("[3 m, 350 cm]", [3.0, 3.5]),
        ("[10, 12] ft", [3.048, 3.6576]),
        ("'[3, 3.5] m'", [3.0, 3.5]),
        ('"[3, 3.5]"', [3.0, 3.5]),
        ("{from: 3, to: 4, count: 3}", [3.0, 3.5, 4.0]),
        ("{from: 3 m, to: 4 m, step: 0.5 m}", [3.0, 3.5, 4.0]),
        ("{from: 3, to: 4, step: 0.5} m", [3.0, 3.5, 4.0]),
        ("{from: 10 ft, to: 11 ft, step: 6 in}", [3.048, 3.2004, 3.3528]),
        ("{from: 4, to: 3, step: -0.5}", [4.0, 3.5, 3.0]),
        ("{from: 4, to: 3, count: 3}", [4.0, 3.5, 3.0]),
        ("{from: 3, to: 3, count: 1}", [3.0]),
        ("{from: 3, to: 3, step: 0.1}", [3.0]),
        ("{from: 3, to: 3.2, count: 3}", [3.0, 3.1, 3.2]),
        ("{count: 3, to: 4, from: 3}", [3.0, 3.5, 4.0]),
    ],
)
def test_values_as_written(load_with, text, expected):
    assert _height(load_with(f"boulder.height={text}")) == expected


def test_steps_do_not_drift(load_with):
    sweep = load_with("site.embedment_ratio={from: 0.40, to: 0.70, step: 0.02}")
    values = sweep.axes[0].values.tolist()
    assert len(values) == 16
    assert values == [float(Decimal("0.40") + i * Decimal("0.02")) for i in range(16)]


@given(first=st.decimals("0.01", "20", places=3), step=st.decimals("0.001", "0.5", places=3), count=st.integers(1, 40))
def test_every_value_of_a_step_range_is_the_float_nearest_to_its_decimal(first, step, count):
    last = first + (count - 1) * step
    values = spread(Fraction(first), Fraction(last), count)
    assert values == [float(first + i * step) for i in range(count)]


@given(a=st.fractions(-1000, 1000), b=st.fractions(-1000, 1000), count=st.integers(2, 50))
def test_every_value_of_a_count_range_is_the_float_nearest_to_the_exact_one(a, b, count):
    assert spread(a, b, count) == [float(a + (b - a) * i / (count - 1)) for i in range(count)]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[]", "empty"),
        ("'[]'", "empty"),
        ("{from: 3.4, to: 1.6, step: 0.1}", "goes downwards and the step does not"),
        ("{from: 1.6, to: 3.4, step: -0.1}", "goes upwards and the step does not"),
        ("{from: 1.6, to: 3.4, step: 0}", "step must not be 0"),
        ("{from: 1.6, to: 3.45, step: 0.1}", "but at 3.4 m or 3.5 m"),
        ("{from: 1.6, to: 3.4, count: 1}", "a count of 1 cannot hold both ends"),
        ("{from: 1.6, to: 3.4, count: 0}", "whole number"),
        ("{from: 1.6, to: 3.4, count: -3}", "whole number"),
        ("{from: 1.6, to: 3.4, count: 2.5}", "whole number"),
        ("{from: 1.6, to: 3.4, count: yes}", "whole number"),
        ("{from: 1.6, to: 3.4, count: [3]}", "whole number"),
        (f"{{from: 1.6, to: 3.4, count: {MAX_AXIS + 1}}}", "whole number"),
        ("{from: 1.6, to: 3.4, count: 9999999999999999999999}", "whole number"),
        ("{from: 1.6, to: 3.4, step: 1e-9}", "more than 1000000 values"),
        ("{from: 1.6, to: 3.4, step: 1e-290}", "more than 1000000 values"),
        ("{from: 1.6, to: 3.4}", "lacks count or step"),
        ("{from: 1.6, count: 3}", "lacks to"),
        ("{count: 3}", "lacks from and to"),
        ("{}", "lacks from and to"),
        ("{from: 1.6, to: 3.4, count: 3, step: 0.1}", "not both"),
        ("{from: 1.6, to: 3.4, steps: 3}", "did you mean step"),
        ("{from: 1.6 m, to: 3.4, count: 3}", "has no unit while the others have one"),
        ("[6 ft, 7]", "'7' has no unit"),
        ("[6 ft, 7] ft", "has a unit and so has the list"),
        ("[[3], 4]", "one number is needed here, not a list"),
        ("{from: [3], to: 4, count: 2}", "one number is needed here, not a list"),
        ("[{from: 3, to: 4, count: 2}]", "one number is needed here, not a block"),
    ],
)
def test_what_makes_no_sense_is_refused(the_problem, text, words):
    problem = the_problem(f"boulder.height={text}")
    assert problem.key == "boulder.height"
    assert words in problem.message


def test_both_ends_of_a_range_are_reported(problems_of, minimal):
    problems = problems_of(minimal.replace("height: 3.44", "height: {from: 0, to: 100, count: 2}"))
    assert [(problem.line, problem.column) for problem in problems] == [(4, 18), (4, 25)]
    assert all("admitted range of 0.01 to 20 m" in problem.message for problem in problems)


def test_every_bad_value_of_a_list_is_reported_at_its_place(problems_of, minimal):
    problems = problems_of(minimal.replace("height: 3.44", "height: [3, x, -1, 4, 200]"))
    assert [problem.message[:4] for problem in problems] == ["'x' "]
    problems = problems_of(minimal.replace("height: 3.44", "height: [3, -1, 4, 200]"))
    assert [problem.column for problem in problems] == [15, 22]


@pytest.mark.parametrize("key", ["criterion.max_rotation", "solver.horizon", "solver.step"])
@pytest.mark.parametrize("value", ["[1, 2]", "{from: 1, to: 2, count: 2}"])
def test_settings_that_are_no_axes_take_one_value(the_problem, key, value):
    assert "one value" in the_problem(f"{key}={value}").message


PHI = "friction_angle_deg"


@pytest.mark.parametrize(
    ("text", "mean", "sd", "kind"),
    [
        ("{mean: 38 deg, sd: 3 deg}", 38.0, 3.0, "normal"),
        ("{mean: 38, cov: 5 %}", 38.0, 1.9, "normal"),
        ("{distribution: lognormal, mean: 38 deg, cov: 0.05}", 38.0, 1.9, "lognormal"),
        ("{distribution: uniform, low: 36 deg, high: 42 deg}", 39.0, 6 / math.sqrt(12), "uniform"),
        ("{distribution: beta, low: 30, high: 45, mean: 38, sd: 2}", 38.0, 2.0, "beta"),
        ("{mean: 0.66322512 rad, sd: 0.05235988 rad}", 38.0, 3.0, "normal"),
    ],
)
def test_mean_and_standard_deviation(load_with, text, mean, sd, kind):
    sweep = load_with(f"soil.friction_angle={text}")
    distribution = sweep.distributions[PHI]
    assert distribution.kind == kind
    assert sweep.constants[PHI] == pytest.approx(mean, rel=1e-6)
    assert distribution.deviation(np.array([mean]))[0] == pytest.approx(sd, rel=1e-6)


def test_a_triangle_has_the_moments_of_its_corners(load_with):
    sweep = load_with("soil.friction_angle={distribution: triangular, low: 34, mode: 39, high: 42}")
    triangle = stats.triang((39 - 34) / (42 - 34), 34, 42 - 34)
    assert sweep.constants[PHI] == pytest.approx(triangle.mean())
    assert sweep.distributions[PHI].deviation(np.zeros(1))[0] == pytest.approx(triangle.std())


@pytest.mark.parametrize(
    ("kind", "spread"), [("normal", "cov: 8 %"), ("normal", "sd: 3 deg"), ("lognormal", "cov: 8 %")]
)
def test_a_characteristic_value_is_the_five_percent_fractile(load_with, kind, spread):
    sweep = load_with(f"soil.friction_angle={{distribution: {kind}, characteristic: 36 deg, {spread}}}")
    mean = sweep.constants[PHI]
    sd = sweep.distributions[PHI].deviation(np.array([mean]))[0]
    if kind == "normal":
        parent = stats.norm(mean, sd)
    else:
        spread_of_log = math.sqrt(math.log(1 + (sd / mean) ** 2))
        parent = stats.lognorm(spread_of_log, scale=mean * math.exp(-0.5 * spread_of_log**2))
    assert parent.ppf(0.05) == pytest.approx(36.0)


def test_ends_truncate_and_are_the_admitted_range_by_default(load_with):
    given = load_with("soil.friction_angle={mean: 38, sd: 3, low: 32 deg, high: 44 deg}").distributions[PHI]
    assert (given.low, given.high) == (32.0, 44.0)
    default = load_with("soil.friction_angle={mean: 38, sd: 3}").distributions[PHI]
    assert (default.low, default.high) == (1.0, 60.0)


def test_means_may_be_an_axis(load_with):
    sweep = load_with("soil.friction_angle={mean: [36, 40] deg, cov: 5 %}")
    assert sweep.n_designs == 2
    assert sweep.axes[0].values.tolist() == [36.0, 40.0]
    assert sweep.distributions[PHI].deviation(sweep.axes[0].values).tolist() == pytest.approx([1.8, 2.0])


def test_correlation(load_with, the_problem):
    both = ("soil.friction_angle={mean: 38, sd: 3}", "soil.subgrade_reaction={mean: 60, cov: 30 %}")
    assert load_with(*both, "soil.correlation=0.5").correlation == 0.5
    assert load_with(*both).correlation == 0.0
    assert "needs a distribution of soil.friction_angle" in the_problem("soil.correlation=0.5").message


def test_what_is_doubtful_decides_the_results_and_is_in_the_record(load_with):
    record = load_with("soil.friction_angle={mean: 38, sd: 3}").resolved()
    assert record["distributions"] == {PHI: {"kind": "normal", "sd": 3.0, "low": 1.0, "high": 60.0}}
    assert "distributions" not in load_with().resolved()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{mean: 38 deg}", "a normal distribution needs sd or cov"),
        ("{sd: 3 deg}", "needs mean or characteristic"),
        ("{mean: 38, sd: 3, cov: 8 %}", "give sd or cov, not both"),
        ("{mean: 38, characteristic: 36, sd: 3}", "give mean or characteristic, not both"),
        ("{mean: 38, sd: 0}", "must be more than 0"),
        ("{mean: 38, sd: -3}", "must be more than 0"),
        ("{mean: 38, sd: 3 m}", "'m' is a length; an angle is needed"),
        ("{mean: 38, cov: 3 deg}", "'deg' is an angle; a plain number is needed"),
        ("{mean: 380, sd: 3}", "outside the admitted range"),
        ("{mean: 38, sd: 3, low: 39}", "the mean must be between low and high (39 to 60 deg)"),
        ("{mean: 38, sd: 3, low: 50, high: 40}", "low (50 deg) must be less than high (40 deg)"),
        ("{mean: 38, sd: 3, mode: 38}", "'mode' is not a key of a normal distribution"),
        ("{mean: 38, sdd: 3}", "did you mean sd?"),
        ("{mean: 38, sd: 3} deg", "behind each number"),
        ("{normal: {mean: 38, sd: 3}}", "{distribution: normal, mean: ..., sd: ...}"),
        ("{distribution: nromal, mean: 38, sd: 3}", "did you mean normal?"),
        ("{distribution: uniform, low: 36}", "a uniform distribution needs high"),
        ("{distribution: triangular, low: 36, high: 40, mode: 45}", "the mode must be between low and high"),
        ("{distribution: beta, low: 36, high: 40, mean: 37, sd: 2}", "must be less than 1.732 deg"),
        ("{distribution: lognormal, characteristic: 36, sd: 3}", "needs cov"),
        ("{characteristic: 36, cov: 70 %}", "use lognormal"),
        ("{characteristic: 58, sd: 3}", "outside the admitted range"),
    ],
)
def test_mistakes(problems_of, minimal, text, words):
    problems = problems_of(minimal, f"soil.friction_angle={text}")
    assert any(words in problem.message for problem in problems)
    assert {problem.key for problem in problems} == {"soil.friction_angle"}


@pytest.mark.parametrize("text", ["43.2", "[36, 40]"])
def test_a_partial_factor_divides_the_tangent(load_with, text):
    plain = load_with(f"soil.friction_angle={text}")
    factored = load_with(f"soil.friction_angle={text}", "partial_factor.friction_angle=1.25")
    angles = plain.block(0, plain.n_designs).columns[PHI].to_numpy()
    design = factored.block(0, factored.n_designs).columns[PHI].to_numpy()
    assert np.tan(np.radians(angles)) / np.tan(np.radians(design)) == pytest.approx(1.25)
    assert factored.resolved()["partial_factor"] == {"friction_angle": 1.25}
    assert any("simulated and listed as" in note.message for note in factored.notes)
    assert "partial_factor" not in plain.resolved()


def test_a_partial_factor_beside_a_distribution_is_refused(problems_of, minimal):
    overrides = ("soil.friction_angle={mean: 38, sd: 3}", "partial_factor.friction_angle=1.25")
    (problem,) = problems_of(minimal, *overrides)
    assert problem.key == "partial_factor.friction_angle"
    (problem,) = problems_of(minimal, "partial_factor.friction_angle=0.8")
    assert "outside the admitted range of 1 to 5" in problem.message
