"""Questions answered on a cluster: the same answers, bit for bit."""

from __future__ import annotations

from pathlib import Path

import pytest

from boulder_sweep.answers.need import need
from boulder_sweep.answers.uncertainty import uncertainty
from boulder_sweep.settings import load

CONFIGS = Path(__file__).parents[2] / "configs"
DASK = {"backend": "dask", "jobs": 2}


def test_need_on_a_cluster():
    sweep = load(CONFIGS / "site.yaml")
    assert need(sweep, **DASK).arrow.equals(need(sweep).arrow)


@pytest.mark.parametrize("asked", [{"least": "mass"}, pytest.param({"probability": 0.95}, marks=pytest.mark.nightly)])
def test_need_of_other_kinds_on_a_cluster(asked):
    sweep = load(CONFIGS / ("uncertain_site.yaml" if "probability" in asked else "site.yaml"))
    assert need(sweep, **asked, **DASK).arrow.equals(need(sweep, **asked).arrow)


def test_uncertainty_on_a_cluster():
    sweep = load(CONFIGS / "uncertain_site.yaml")
    here, there = uncertainty(sweep, half_width=0.05), uncertainty(sweep, half_width=0.05, **DASK)
    assert there.arrow.equals(here.arrow)
