"""Values, lists and ranges: exact, in the order given, and with a reason where they make no sense."""

from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boulder_sweep.settings.values import MAX_AXIS, spread


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
    problems = problems_of(minimal.replace("height: 3.44", "height: {from: -1, to: 100, count: 2}"))
    assert [(problem.line, problem.column) for problem in problems] == [(4, 18), (4, 26)]
    assert all("admitted range of 0.01 to 20 m" in problem.message for problem in problems)


def test_every_bad_value_of_a_list_is_reported_at_its_place(problems_of, minimal):
    problems = problems_of(minimal.replace("height: 3.44", "height: [3, x, -1, 4, 200]"))
    assert [problem.message[:4] for problem in problems] == ["'x' "]
    problems = problems_of(minimal.replace("height: 3.44", "height: [3, -1, 4, 200]"))
    assert [problem.column for problem in problems] == [15, 22]


@pytest.mark.parametrize("key", ["criterion.max_rotation", "solver.horizon", "solver.step", "solver.accuracy"])
@pytest.mark.parametrize("value", ["[1, 2]", "{from: 1, to: 2, count: 2}"])
def test_settings_that_are_no_axes_take_one_value(the_problem, key, value):
    assert "one value" in the_problem(f"{key}={value}").message
