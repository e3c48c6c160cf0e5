"""A slow push by the laws of the model and by a published curve: against limits known in closed form."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq

from boulder_kernels.design import G, design_at, passive_pressure_coefficient
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.judge.inputs import sampled_designs
from docs.studies.against_tests import api_sand, model_soil, pushed

RWG = design_at(sampled_designs(crash_test("rwg"), 1).table, 0)


def test_far_pushed_the_soil_is_at_its_limit_on_both_sides_of_one_point() -> None:
    """Where K sigma W acts forwards down to z_r and backwards below, moments about the force give z_r."""
    d, e = RWG.d, RWG.e
    share = d**3 / 3.0 + e * d**2 / 2.0
    z_r = brentq(lambda z: 2.0 * (z**3 / 3.0 + e * z**2 / 2.0) - share, 0.0, d)
    per_depth = passive_pressure_coefficient(RWG.phi) ** 2 * RWG.rho_s * G * RWG.W
    limit = per_depth * (z_r**2 - d**2 / 2.0)
    assert pushed(RWG, model_soil(RWG), math.radians(60.0)) == pytest.approx(limit, rel=2e-3)


def test_the_curve_of_api_at_thirty_degrees() -> None:
    """C_1, C_2 and C_3 of the standard's chart: 1.9, 2.65 and 29, as read."""
    design = RWG._replace(phi=math.radians(30.0), beta=1e9)
    soil, gamma = api_sand(design), RWG.rho_s * G
    shallow = soil(1.0, 0.5) / (gamma * 0.5 * (3.0 - 0.8 * 0.5 / RWG.W))
    assert shallow == pytest.approx(1.9 * 0.5 + 2.65 * RWG.W, rel=0.03)
    assert soil(1.0, 100.0) / (0.9 * gamma * 100.0 * RWG.W) == pytest.approx(29.0, rel=0.05)
