"""Distributions against those of SciPy, far out in their tails, too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

import boulder_sweep
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import uncertain_rows
from boulder_sweep.designs import block_of
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantiles import values_of
from boulder_sweep.settings import SettingsError, load_text
from boulder_sweep.settings.distributions import Distribution
from tests.answers.designs import site

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
    alone = [
        boulder_sweep.uncertainty(load_text(one, Path("one.yaml")), half_width=0.05).frame.p_pass.to_numpy()
        for one in (ALONE.format("{mean: 40 deg, sd: 1 deg}"), ALONE.format("{mean: 40 deg, cov: 10 %}"))
    ]
    chances = found.p_pass.to_numpy().reshape(2, 3)
    assert set(chances[:, 0]) <= {0.0, 1.0}
    assert np.array_equal(chances[:, 1:].T, np.stack(alone))
    assert sweep.resolved()["distributions"]["friction_angle_deg"]["sets"][0] is None


ALONE = """
name: one
boulder: {{length: 1.65 m, width: 1.68 m, height: [3.0, 3.4] m, density: 2600 kg/m^3}}
site: {{embedment_depth: 2.1 m}}
soil: {{density: 1860 kg/m^3, friction_angle: {}, subgrade_reaction: 60 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""


def test_a_probability_is_asked_for_in_every_named_soil() -> None:
    sweep = load_text(NAMED, Path("named.yaml"))
    frame = boulder_sweep.need(sweep, probability=0.9).frame
    depth = frame.least_embedment_depth_m.to_numpy().reshape(2, 3)
    assert (np.diff(depth[1]) > 0.0).all(), "the less is known, the deeper"


def test_a_list_inside_a_named_soil_is_refused() -> None:
    with pytest.raises(SettingsError, match="must have one mean in a named set"):
        load_text(NAMED.replace("mean: 40 deg, sd", "mean: [38, 40] deg, sd"), Path("named.yaml"))
