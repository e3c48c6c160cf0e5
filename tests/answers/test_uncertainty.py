"""The chance of passing: against cases of which it is known, and what decides it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from scipy import stats
from scipy.special import ndtr, ndtri

import boulder_sweep
from boulder_sweep.answers.chance import FIRST, SCRAMBLINGS, Points, chance, interval
from boulder_sweep.answers.draws import WORST, Draws, _distance_of
from boulder_sweep.answers.need import need
from boulder_sweep.answers.printing import uncertainty_lines
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import judges_of, uncertain_rows
from boulder_sweep.answers.uncertainty import drivers, uncertainty
from boulder_sweep.designs import block_of
from boulder_sweep.errors import PictureError, QuestionError
from boulder_sweep.judge.judged import ERROR, FAIL, OVERRIDE, PASS, UNDECIDED, not_computed
from boulder_sweep.judge.quantiles import values_of
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings import load, load_text
from boulder_sweep.settings.model import Distribution
from tests.answers.designs import bare_need, site

UNCERTAIN = {"height": "3.2 m", "site": "embedment_depth: 2.2 m", "friction": "{mean: 38 deg, sd: 3 deg}"}


def test_chance_follows_from_the_least_friction_angle() -> None:
    """With one uncertain input the design passes from its least friction angle on, and the chance is known."""
    found = uncertainty(site(**UNCERTAIN), half_width=0.002, confidence=0.99).frame.iloc[0]
    for name, robust in (("p_pass", False), ("p_robust", True)):
        sweep = site(**UNCERTAIN | {"friction": "38 deg"})
        exact = ndtr((38.0 - bare_need(sweep, "friction_angle", robust=robust).frame.passes_at[0]) / 3.0)
        low, estimate, high = found[[f"{name}_low", name, f"{name}_high"]]
        assert low - 5e-4 <= exact <= high + 5e-4  # 0.01 deg of the lattice is 0.1 %
        assert low <= estimate <= high
    assert found.p_robust < found.p_pass - 0.1
    assert found.verdict == "pass"
    assert found.p_pass_driver == "soil.friction_angle"


def test_every_row_has_its_chance() -> None:
    sweep = site(**UNCERTAIN | {"height": "[3.1, 3.3, 3.5] m", "friction": "{mean: [34, 38, 42] deg, sd: 3 deg}"})
    frame = uncertainty(sweep).frame
    assert len(frame) == 9
    assert (frame.p_pass_high - frame.p_pass_low <= 0.02).all()
    assert frame.p_pass.between(frame.p_pass_low, frame.p_pass_high).all()
    by_angle = frame.p_pass.to_numpy().reshape(3, 3)
    assert (np.diff(by_angle, axis=1) > 0.0).all(), "the last axis of the file is the friction angle"


def test_does_not_depend_on_threads() -> None:
    one, two = (uncertainty(site(**UNCERTAIN), jobs=jobs) for jobs in (1, 2))
    assert one.arrow.equals(two.arrow)
    assert one.samples.equals(two.samples)
    assert not uncertainty(site(**UNCERTAIN), seed=1).arrow.equals(one.arrow)


def test_margin_lowers_the_chance() -> None:
    plain, more = (uncertainty(site(**UNCERTAIN), margin=margin).frame.p_pass[0] for margin in (0.0, "25 %"))
    assert more < plain - 0.1


def test_a_varying_input_is_named_that_decides() -> None:
    sweep = site(**UNCERTAIN | {"subgrade": "{distribution: lognormal, mean: 60 MN/m^3, cov: 40 %}"})
    found = uncertainty(sweep)
    assert found.frame.p_pass_driver[0] == "soil.friction_angle"
    assert any("soil.friction_angle" in line for line in uncertainty_lines(found))
    assert all(len(line) <= 80 for line in uncertainty_lines(found))


def test_driver_is_the_input_that_decides() -> None:
    z = Points(3, 0).upto(FIRST).reshape(-1, 3)
    outputs = np.stack([z[:, 0] + 0.3 * z[:, 1], z[:, 2] ** 3 - z[:, 0], (z[:, 1] > 0.5).astype(float)])
    assert drivers(z, outputs).tolist() == [0, 2, 1]


def test_what_does_not_vary_has_no_driver() -> None:
    assert drivers(np.random.default_rng(1).standard_normal((512, 2)), np.ones((1, 512))).tolist() == [-1]


def test_depth_for_a_probability() -> None:
    sweep = site(**UNCERTAIN)
    row = bare_need(sweep, "embedment_depth", probability="95 %").frame.iloc[0]
    assert row.found == "found"
    assert row.p_pass >= 0.95 > row.p_pass_low
    depth = f"embedment_depth: {row.passes_at} m"
    there = uncertainty(site(**UNCERTAIN | {"site": depth}), half_width=0.003, seed=7).frame.iloc[0]
    assert there.p_pass == pytest.approx(0.95, abs=0.006)
    certain = bare_need(site(**UNCERTAIN | {"friction": "38 deg"})).frame.passes_at[0]
    assert row.passes_at > certain


@pytest.mark.parametrize("probability", [0.6, 0.95])
def test_no_answer_has_less_than_the_probability_that_is_asked_for(probability: float) -> None:
    heights = "boulder.height=[3.2, 3.4, 3.6] m"
    uncertain = [f"vehicle.{key}={{mean: {mean}, cov: 10 %}}" for key, mean in (("speed", "30 mph"), ("mass", "7 t"))]
    found = need(load("configs/uncertain_site.yaml", [heights, *uncertain]), probability=probability).frame
    answered = found[found.passes_at.notna()]
    assert len(answered) > 1
    assert (answered.p_pass >= probability).all()


def test_files(tmp_path: Path) -> None:
    found = uncertainty(site(**UNCERTAIN))
    files = found.write(tmp_path / "chance.parquet")
    assert [file.name for file in files] == ["chance.parquet", "chance.samples.parquet"]
    frame = pd.read_parquet(files[0])
    assert frame.attrs["meanings"]["p_pass"].startswith("chance")
    assert json.loads(pq.read_schema(files[0]).metadata[b"boulder_sweep.question"])["seed"] == 0
    samples = pd.read_parquet(files[1])
    assert (samples.distance > 0).mean() == pytest.approx(frame.p_pass[0], abs=0.02)


def test_picture(tmp_path: Path) -> None:
    found = uncertainty(site(**UNCERTAIN))
    found.plot(tmp_path / "chance.png")
    assert (tmp_path / "chance.png").stat().st_size > 10_000
    with pytest.raises(PictureError, match="no samples of design 3"):
        found.plot(tmp_path / "none.png", 3)


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ({"half_width": "0"}, "must be between"),
        ({"confidence": "101 %"}, "less than 100 %"),
        ({"margin": "a"}, "is not a number"),
        ({"seed": -1}, "--seed -1: must not be negative"),
    ],
)
def test_wrong_numbers_are_refused(question: dict[str, str | int], message: str) -> None:
    with pytest.raises(QuestionError, match=message):
        uncertainty(site(**UNCERTAIN), **question)


def linear(z: np.ndarray) -> np.ndarray:
    return z.sum(axis=1) / np.sqrt(z.shape[1])


@pytest.mark.parametrize("beta", [-3.0, -0.5, 0.0, 1.0, 2.5])
def test_chance_of_a_linear_limit_state(beta: float) -> None:
    found = chance(lambda _, z: linear(z) <= beta, 1, Points(3, 1), half_width=2e-3, confidence=0.999, most=1 << 18)
    assert found.low[0] <= ndtr(beta) <= found.high[0]
    assert found.high[0] - found.low[0] <= 4e-3
    assert abs(found.estimate[0] - ndtr(beta)) < 2e-3


def test_rows_stop_when_they_are_sure_enough() -> None:
    edges = np.array([-9.0, 0.3, 9.0])
    found = chance(lambda index, z: linear(z) <= edges[index], 3, Points(2, 1), half_width=5e-3)
    assert found.points.tolist()[::2] == [FIRST * SCRAMBLINGS] * 2
    assert found.points[1] > FIRST * SCRAMBLINGS
    assert (found.estimate[0], found.low[0], found.estimate[2], found.high[2]) == (0.0, 0.0, 1.0, 1.0)
    assert 0.0 < found.high[0] < 0.01
    assert 0.99 < found.low[2] < 1.0


def test_no_more_points_than_allowed() -> None:
    found = chance(lambda _, z: linear(z) <= 0.3, 1, Points(2, 1), half_width=1e-6, most=2048)
    assert found.points[0] == 2048
    assert found.high[0] - found.low[0] > 2e-6


def test_what_is_not_known_widens_the_interval_and_has_its_commonest_cause() -> None:
    """Of one row half passes and a sixth is not known for two causes; of the other nothing is known."""

    def event(row: np.ndarray, z: np.ndarray) -> np.ndarray:
        share = ndtr(linear(z))
        some = np.where(share < 0.5, 1, np.where(share < 0.6, -3, np.where(share < 2.0 / 3.0, -5, 0)))
        return np.where(row == 0, some, -9)

    found = chance(event, 2, Points(2, 1), half_width=0.01)
    assert found.estimate == pytest.approx([0.5, 0.0], abs=5e-3)
    assert found.unknown == pytest.approx([1.0 / 6.0, 1.0], abs=5e-3)
    assert found.cause.tolist() == [3, 9]
    assert found.low == pytest.approx([0.5, 0.0], abs=0.011)
    assert found.high == pytest.approx([2.0 / 3.0, 1.0], abs=0.011)
    assert found.low[0] < 0.5 < 2.0 / 3.0 < found.high[0]
    assert chance(lambda _, z: linear(z) < 0.3, 1, Points(2, 1), half_width=0.01).unknown[0] == 0.0


def test_the_same_seed_gives_the_same() -> None:
    one, two, other = (chance(lambda _, z: linear(z) <= 0.3, 1, Points(2, seed), half_width=0.01) for seed in (1, 1, 2))
    assert one.estimate[0] == two.estimate[0] != other.estimate[0]


@pytest.mark.parametrize("edge", [0.4, 2.0])
def test_stated_intervals_hold_at_their_rate(edge: float) -> None:
    held = 0
    for seed in range(200):
        found = chance(lambda _, z: linear(z) <= edge, 1, Points(3, seed), half_width=0.01)
        held += int(found.low[0] <= ndtr(edge) <= found.high[0])
    assert held >= 182, "95 % of 200 are 190, less three standard deviations"


@pytest.mark.parametrize("weights", [(1.0,), (0.95, 0.3122), (1.0, 1.0, 1.0)])
def test_stated_intervals_hold_for_whatever_number_of_inputs_decides(weights: tuple[float, ...]) -> None:
    """If one input decides, all scramblings often count the same; their spread alone held 85 % of the time."""
    direction = np.array(weights) / np.linalg.norm(weights)
    exact = np.random.default_rng(0).uniform(0.02, 0.98, 200)
    edges, held, widths = ndtri(exact), [], []
    for seed in range(10):
        points = Points(len(weights), seed)
        found = chance(lambda row, z: z @ direction <= edges[row], len(exact), points, half_width=0.01)
        held.append((found.low <= exact) & (exact <= found.high))
        widths.append(found.high - found.low)
    assert np.mean(held) >= 0.95
    assert np.min(widths) > 0.0
    assert np.max(widths) <= 0.02 + 1e-12


def test_scramblings_that_agree_are_not_certain() -> None:
    low, high = interval(np.full((1, SCRAMBLINGS), 16.0), 32, 0.95)
    assert (high - low)[0] == pytest.approx(2.0 * (1.0 - 0.05 ** (1 / 16)) / 32)
    wider = interval(np.array([[15.0, 17.0] * 8]), 32, 0.95)
    of_the_mean = 2.13145 * math.sqrt(16 / 15) / 32 / 4  # Student's t of 15 degrees of freedom
    assert (wider[1] - wider[0] - (high - low))[0] == pytest.approx(2.0 * of_the_mean, rel=1e-5)


def test_an_undecided_design_without_a_margin_is_as_good_as_at_its_limit():
    rows = not_computed(("why",), np.zeros(4, dtype=int))
    rows.columns["verdict"] = np.array([PASS, FAIL, UNDECIDED, ERROR], dtype=np.int32)
    rows.columns["margin"] = np.array([0.25, -0.5, np.nan, np.nan])
    found = _distance_of(rows, rows.verdict == PASS, 0.0)
    assert found[0] == 0.25
    assert found[1] == -0.5
    assert -1e-300 < found[2] < 0.0
    assert found[3] == WORST


def test_what_is_known_of_a_design_is_its_verdict_and_the_reason_of_an_undecided_one():
    uncertain = {"site": "embedment_depth: {mean: 2.5 m, sd: 0.5 m}", "height": "3.2 m", "friction": "44 deg"}
    sweep = site(**uncertain)
    draws = Draws(sweep.plan.given_rows(0, 1), Spread(sweep), judges_of(sweep), Pool(1))
    depths = np.array([1.5, 2.3, 2.6, 3.1])  # overturns, passes, hardly reaches the bumper, is passed over
    distance, known = draws.drawn(np.zeros(4, dtype=int), ((depths - 2.5) / 0.5)[:, None])
    assert known.tolist() == [0, 1, -OVERRIDE, 0]
    assert (distance > 0.0).tolist() == [False, True, False, False]
    assert distance[3] == WORST


Z = np.concatenate([np.linspace(-8.0, 8.0, 65), [-1e-9, 0.0, 1e-9]])
LOGNORMAL = stats.lognorm(s=np.sqrt(np.log1p(0.16)), scale=60.0 / np.sqrt(1.16))


@pytest.mark.parametrize(
    ("spread", "mean", "reference"),
    [
        (Distribution("normal", -1e9, 1e9, sd=3.0), 38.0, stats.norm(38.0, 3.0)),
        (Distribution("normal", 30.0, 41.0, sd=3.0), 38.0, stats.truncnorm(-8 / 3, 1.0, 38.0, 3.0)),
        (Distribution("lognormal", 0.0, 1e30, cov=0.4), 60.0, LOGNORMAL),
        (Distribution("uniform", 12.0, 14.0), 13.0, stats.uniform(12.0, 2.0)),
        (Distribution("triangular", 12.0, 15.0, mode=13.0), 13.0, stats.triang(1 / 3, 12.0, 3.0)),
        (Distribution("beta", 30.0, 50.0, sd=3.0), 38.0, None),
    ],
)
def test_fractiles(spread: Distribution, mean: float, reference) -> None:
    if reference is None:
        at, var = 0.4, (3.0 / 20.0) ** 2
        total = at * (1.0 - at) / var - 1.0
        reference = stats.beta(at * total, (1.0 - at) * total, 30.0, 20.0)
    found = values_of(spread, np.full(len(Z), mean), Z)
    assert np.allclose(found[Z < 0.5], reference.ppf(ndtr(Z[Z < 0.5])), rtol=1e-9)
    assert np.allclose(found[Z > -0.5], reference.isf(ndtr(-Z[Z > -0.5])), rtol=1e-9)
    assert (np.diff(np.sort(found[:65])) >= 0.0).all()


def test_correlation_of_friction_and_stiffness() -> None:
    sweep = site(
        friction="{mean: 38 deg, sd: 3 deg}",
        subgrade="{distribution: lognormal, mean: 60 MN/m^3, cov: 40 %}, correlation: 0.6",
    )
    spread = Spread(sweep)
    assert spread.names == ["friction_angle_deg", "subgrade_reaction_MN_m3"]
    z = np.random.default_rng(1).standard_normal((200_000, 2))
    given = {name: np.broadcast_to(values[:1], len(z)) for name, values in sweep.plan.given_rows(0, 1).items()}
    drawn = spread.filled(given, z)
    logs = np.log(drawn["subgrade_reaction_MN_m3"])
    assert np.corrcoef(drawn["friction_angle_deg"], logs)[0, 1] == pytest.approx(0.6, abs=0.01)
    assert drawn["subgrade_reaction_MN_m3"].mean() == pytest.approx(60.0, rel=0.01)


def test_certain_inputs_have_no_spread() -> None:
    with pytest.raises(QuestionError, match="no input has a distribution"):
        Spread(site())


NAMED = """
name: named
boulder: {length: 1.65 m, width: 1.68 m, height: [3.0, 3.4] m, density: 2600 kg/m^3}
site: {embedment_depth: 2.1 m}
soil:
  - {name: certain, density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}
  - {name: known,   density: 1860 kg/m^3, friction_angle: {mean: 40 deg, sd: 1 deg}, subgrade_reaction: 60 MN/m^3}
  - {name: unknown, density: 1860 kg/m^3, friction_angle: {mean: 40 deg, cov: 10 %}, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


def test_every_named_soil_may_have_its_own_distribution() -> None:
    sweep = load_text(NAMED, Path("named.yaml"))
    spread = Spread(sweep)
    rows = uncertain_rows(sweep, sweep.plan.given_rows(0, 6), 0, 6)
    z = np.full((6, 1), 1.0)
    drawn = spread.filled(rows, z)["friction_angle_deg"]
    assert drawn == pytest.approx([40.0, 41.0, 44.0] * 2, abs=1e-3)
    block_of(spread.filled(rows, z))
    found = boulder_sweep.uncertainty(sweep, half_width=0.05).frame
    usual = {"height": "[3.0, 3.4] m", "site": "embedment_depth: 2.1 m"}
    alone = [
        boulder_sweep.uncertainty(site(**usual, friction=one), half_width=0.05).frame.p_pass.to_numpy()
        for one in ("{mean: 40 deg, sd: 1 deg}", "{mean: 40 deg, cov: 10 %}")
    ]
    chances = found.p_pass.to_numpy().reshape(2, 3)
    assert set(chances[:, 0]) <= {0.0, 1.0}
    assert np.array_equal(chances[:, 1:].T, np.stack(alone))
    assert sweep.resolved()["distributions"]["friction_angle_deg"]["sets"][0] is None


def test_a_probability_is_asked_for_in_every_named_soil() -> None:
    sweep = load_text(NAMED, Path("named.yaml"))
    frame = boulder_sweep.need(sweep, probability=0.9).frame
    depth = frame.least_embedment_depth_m.to_numpy().reshape(2, 3)
    assert (np.diff(depth[1]) > 0.0).all(), "the less is known, the deeper"


ONE = {"height": "3.2 m", "site": "embedment_depth: 2.2 m", "friction": "40 deg"}


@pytest.mark.parametrize(
    ("changes", "asked", "entry"),
    [
        ({"friction": "{mean: 38 deg, sd: 1 deg}"}, {"least": "friction_angle"}, "soil.friction_angle"),
        ({"site": "embedment_depth: {mean: 2.2 m, sd: 0.1 m}"}, {"least": "embedment_ratio"}, "site.embedment_depth"),
        ({"site": "embedment_ratio: {mean: 0.6, sd: 0.1}"}, {}, "site.embedment_ratio"),
    ],
)
def test_what_is_searched_has_no_distribution(changes: dict[str, str], asked: dict[str, str], entry: str) -> None:
    """Without a probability it is searched as in any file: what it had is overwritten."""
    sweep = site(**ONE | {"subgrade": "{mean: 60 MN/m^3, cov: 10 %}"} | changes)
    with pytest.raises(QuestionError, match=rf"and {entry} has a distribution: give it one value \(--set {entry}="):
        need(sweep, probability=0.95, **asked)
    assert bare_need(sweep, **asked).frame.found[0] == "found"


def test_a_friction_angle_for_a_probability_in_uncertain_ground() -> None:
    """One value is overwritten; the other distributions stay."""
    sweep = site(**ONE | {"subgrade": "{mean: 60 MN/m^3, cov: 10 %}"})
    row, certain = (
        need(one, "friction_angle", **more).frame.iloc[0]
        for one, more in (
            (sweep, {"probability": 0.95}),
            (site(**ONE), {"margin": 0.0, "robust": False}),
        )
    )
    assert row.found == "found"
    assert row.passes_at > certain.passes_at
    assert row.p_pass == pytest.approx(0.95, abs=0.01)
