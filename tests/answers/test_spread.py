"""Distributions against those of SciPy, far out in their tails, too."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

from boulder_sweep.answers.spread import Spread, values_of
from boulder_sweep.errors import QuestionError
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
