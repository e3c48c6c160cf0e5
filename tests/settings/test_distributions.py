"""Uncertain inputs and partial factors: what a file may say, and what it then means."""

import math

import numpy as np
import pytest
from scipy import stats

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
