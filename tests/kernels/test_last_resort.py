"""Designs that need more steps than are allowed: against limits known in closed form, and an implicit integrator."""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import Control, Design, Status
from boulder_kernels.design import design_at
from docs.studies.extremes import box_designs
from tests import oracle
from tests.oracle.records import recorded_impact

from .samples import design_of, inputs_of, same_bits, table_of

CORRECTED = bk.corrected()
LIMIT = float(np.radians(20.0))
LAST_RESORT = Control(5e-4, 1.0, LIMIT, 0, True, locate_yield=True, last_resort=True)
WALL = design_of(oracle.RWG)._replace(rho_b=1e10)


def simulated(design: Design, control: Control = LAST_RESORT) -> bk.OutcomeTable:
    return bk.simulate_table(table_of([design]), CORRECTED, control)


@pytest.mark.parametrize("k_v", [1e11, 1e13])
def test_a_spring_that_relaxes_at_once_leaves_the_damper(k_v: float) -> None:
    """Against a boulder that does not move: m_v x_v'' = -c_v x_v'."""
    design = WALL._replace(k_v=k_v, c_v=2e4)
    assert simulated(design, LAST_RESORT._replace(last_resort=False)).status[0] == Status.WEAK_DAMPER
    found = simulated(design)
    tau = design.m_v / design.c_v
    assert found.x_v_max[0] == pytest.approx(design.v_0 * tau * (1.0 - exp(-1.0 / tau)), rel=2e-3)
    assert found.F_v_max[0] == pytest.approx(design.c_v * design.v_0, rel=0.02)
    assert found.x_error[0] < 0.01


def test_a_stiff_spring_throws_a_light_truck_back() -> None:
    """A blow of microseconds, half an oscillation; then the truck coasts."""
    design = WALL._replace(m_v=1e-3, k_v=1e10, c_v=1e12)
    found = simulated(design)
    assert simulated(design, LAST_RESORT._replace(last_resort=False)).status[0] == Status.STIFF_VEHICLE
    assert found.x_v_max[0] == pytest.approx(design.v_0 * sqrt(design.m_v / design.k_v), rel=1e-4)
    assert found.F_v_max[0] == pytest.approx(design.v_0 * sqrt(design.k_v * design.m_v), rel=1e-4)
    assert pi * sqrt(design.m_v / design.k_v) < 1e-6


def test_what_the_steps_do_not_suffice_for_keeps_its_refusal() -> None:
    hard = design_of(oracle.RWG)._replace(beta=1e9, rho_b=1e-3, rho_s=1e-3, L=0.1)
    for last_resort in (False, True):
        found = simulated(hard, LAST_RESORT._replace(last_resort=last_resort, error_estimate=False))
        assert found.status[0] == Status.STIFF_SOIL
        assert np.isnan(found.theta_max[0])


def test_a_design_that_is_not_refused_is_simulated_as_ever() -> None:
    table = table_of([design_of(oracle.RWG), design_of(oracle.ABG)])
    once = bk.simulate_table(table, CORRECTED, LAST_RESORT._replace(last_resort=False))
    for again, plain in zip(bk.simulate_table(table, CORRECTED, LAST_RESORT), once, strict=True):
        assert same_bits(again, plain) or np.allclose(again, plain, rtol=1e-12, equal_nan=True)


IMPLICIT = (422, 312, 571, 1344, 1719, 2093, 2646, 3275, 3575, 75, 2141, 2751, 3480)
"""Rows of the box that the usual steps refuse, of each cause; the implicit integrator needs seconds for each."""


@pytest.fixture(scope="module")
def box() -> bk.DesignTable:
    return box_designs(4000, 1).table


@pytest.mark.compiled
@pytest.mark.parametrize("row", IMPLICIT)
def test_the_same_as_an_implicit_integrator(box: bk.DesignTable, row: int) -> None:
    design = design_at(box, row)
    found = simulated(design)
    assert simulated(design, LAST_RESORT._replace(last_resort=False)).status[0] > Status.INVALID
    known = recorded_impact(
        inputs_of(design),
        oracle.CORRECTED,
        may_be_new=True,
        horizon=round(float(found.t_end[0]), 9),
        rotation_limit=LIMIT,
        rtol=1e-7,
        land_on_kinks=False,
        stiff=True,
    )
    turned = abs(found.theta_max[0] - known.max_rotation.value)
    assert turned <= found.theta_error[0] + 1e-4 * LIMIT
    driven = abs(found.x_v_max[0] - known.max_vehicle_displacement.value)
    assert driven <= found.x_error[0] + 1e-3 * found.x_v_max[0]
