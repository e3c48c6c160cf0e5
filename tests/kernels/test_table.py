"""Tables of designs: every kind of run, the estimate of errors, statuses and their columns."""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import Status
from tests import oracle

from .samples import control, design_of, random_designs, record_at, table_of

LIMIT = np.radians(20.0)
REPORTED = ("theta_max", "x_b_max", "x_v_max", "F_v_max", "crush_max")


def test_statuses() -> None:
    """One design for each way a simulation may end."""
    rwg, abg = design_of(oracle.RWG), design_of(oracle.ABG)
    table = table_of([rwg, abg, rwg._replace(e_bumper=1.5), rwg._replace(k_v=-1.0)])
    found = bk.simulate_table(table, bk.corrected(), control(2e-3, 0.2, LIMIT, stop_at_limit=True))
    assert list(found.status) == [Status.OUTWARD, Status.LIMIT, Status.NO_CONTACT, Status.INVALID]
    assert found.theta_max[1] == LIMIT
    assert found.t_limit[1] == found.t_end[1] == pytest.approx(0.0769, abs=6e-5)
    assert np.isnan(found.t_limit[0])
    assert found.t_end[0] == 0.2
    later = bk.simulate_table(table, bk.corrected(), control(2e-3, 1.0, LIMIT, stop_at_limit=True))
    assert later.status[0] in (Status.SETTLED, Status.BELOW_LIMIT)
    assert np.degrees(later.theta_max[0]) == pytest.approx(13.7612, abs=1e-3)


def test_stopped_at_the_limit_maxima_are_those_up_to_then() -> None:
    abg = design_of(oracle.ABG)
    stopped = bk.simulate_table(table_of([abg]), bk.corrected(), control(1e-3, 1.0, LIMIT, stop_at_limit=True))
    whole = bk.simulate_table(table_of([abg]), bk.corrected(), control(1e-3, stopped.t_end[0], 9.0))
    for name in REPORTED:
        assert getattr(stopped, name)[0] == pytest.approx(getattr(whole, name)[0], rel=1e-6)
    going_on = bk.simulate_table(table_of([abg]), bk.corrected(), control(1e-3, 0.5, LIMIT))
    assert going_on.t_limit[0] == pytest.approx(stopped.t_limit[0], abs=1e-12)
    assert going_on.theta_max[0] > 2.0


def test_turned_back_beyond_the_limit() -> None:
    """The limit counts backwards, too."""
    rwg = design_of(oracle.RWG)
    back = rwg._replace(e=np.float64(-1.0), e_bumper=np.float64(-9.0), v_0=np.float64(30.0))
    record = record_at(np.linspace(0.0, 0.5, 201))
    found = bk.simulate_design(back, bk.corrected(), control(1e-3, 0.5, 1e-3, stop_at_limit=True), record)
    assert found.status == Status.LIMIT
    assert found.maxima.theta == 1e-3
    assert np.nanmin(record.states[:, 2]) < -5e-4
    assert np.nanmax(record.states[:, 2]) < 5e-4


def test_element_sums_in_a_table() -> None:
    """Rows by element sums are single impacts by element sums, and near the closed form."""
    designs = random_designs(3, seed=131)
    how = control(2e-3, 0.3, LIMIT, 40, stop_at_limit=True)
    found = bk.simulate_table(table_of(designs), bk.corrected(), how)
    closed = bk.simulate_table(table_of(designs), bk.corrected(), how._replace(elements=0))
    for row, design in enumerate(designs):
        single = bk.simulate_design(design, bk.corrected(), how, bk.no_record())
        assert (found.status[row], found.theta_max[row]) == (single.status, single.maxima.theta)
    assert found.x_v_max == pytest.approx(closed.x_v_max, rel=1e-2)


@pytest.mark.parametrize("h", [1e-3, 0.2, 5.0])
def test_a_horizon_of_one_step(h: float) -> None:
    """A step as long as the horizon or longer ends at the horizon."""
    found = bk.simulate_table(
        table_of([design_of(oracle.RWG)]), bk.corrected(), control(h, 1e-3, LIMIT, stop_at_limit=True)
    )
    assert found.status[0] == Status.OUTWARD
    assert found.t_end[0] == 1e-3
    assert found.x_v_max[0] == pytest.approx(0.0145, rel=1e-3)


@pytest.mark.parametrize("readings", [bk.as_printed(), bk.corrected()], ids=["as_printed", "corrected"])
def test_estimated_errors(readings: bk.Readings) -> None:
    """Of every design that is computed, confirmed or not."""
    designs = random_designs(30, seed=132)
    designs[3] = designs[3]._replace(e_bumper=9.0)
    how = control(8e-3, 1.0, LIMIT, stop_at_limit=True, error_estimate=True)
    found = bk.simulate_table(table_of(designs), readings, how)
    assert np.isnan(found.theta_error[3])
    assert np.isnan(found.x_error[3])
    once = bk.simulate_table(table_of(designs), readings, how._replace(error_estimate=False))
    for out in (found, once):
        computed = ~np.isnan(out.theta_max)
        assert np.all(out.theta_error[computed] >= 0.0)
        assert np.all(out.x_error[computed] > 0.0)


@pytest.mark.compiled
@pytest.mark.parametrize("h", [4e-3, 8e-3, 1.6e-2])
def test_estimated_errors_cover_the_true_ones(h: float) -> None:
    """On 99 % of random designs and more, against a step thirty times shorter."""
    table = table_of(random_designs(3000, seed=133))
    how = control(h, 1.0, LIMIT, stop_at_limit=True, error_estimate=True)
    found = bk.simulate_table(table, bk.corrected(), how)
    fine = bk.simulate_table(table, bk.corrected(), how._replace(h=h / 32, error_estimate=False))
    theta = np.abs(found.theta_max - fine.theta_max)
    x = np.maximum(np.abs(found.x_b_max - fine.x_b_max), np.abs(found.x_v_max - fine.x_v_max))
    covered = (theta <= found.theta_error + 1e-10) & (x <= found.x_error + 1e-10)
    assert np.mean(covered) >= 0.99


def test_an_error_that_cannot_be_estimated_is_infinite() -> None:
    """Where only one of two solutions reaches the limit."""
    design = design_of(oracle.RWG)
    exact = bk.simulate_design(design, bk.corrected(), control(1e-4, 1.0), bk.no_record()).maxima.theta
    coarse_steps = [
        bk.simulate_design(design, bk.corrected(), control(h, 1.0), bk.no_record()).maxima.theta for h in (1.6e-2, 8e-3)
    ]
    between = 0.5 * (coarse_steps[0] + coarse_steps[1])
    assert abs(between - exact) > 0.0
    how = control(1.6e-2, 1.0, between, stop_at_limit=True, error_estimate=True)._replace(paired=True)
    found = bk.simulate_table(table_of([design]), bk.corrected(), how)
    assert found.theta_error[0] == np.inf
    assert found.x_error[0] == np.inf
