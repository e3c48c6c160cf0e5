"""Vehicles whose front stiffens: against the oracle, which goes on by another jerk and knows no offset."""

from dataclasses import replace

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import SecondSpring, SecondSprings, Status
from boulder_kernels.after_step import Kept
from boulder_kernels.control import rates_of, stable_step
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import TURNING_FORWARD, Modes, State, switches_of
from boulder_kernels.outcomes import compression_at, no_maxima
from boulder_kernels.second_spring import (
    is_second_spring,
    offset_of,
    on_second_spring,
    provable_so_far,
    spent_energy,
    stiffest,
)
from boulder_kernels.settling import barrier_energy
from boulder_kernels.time_history import stored_energies
from tests import oracle
from tests.oracle.records import recorded_impact
from tests.oracle.summary import Summary

from .samples import control, design_of, inputs_of, oracle_readings, random_designs, same_bits, table_of
from .test_whole_impacts import LIMIT, H, differences

RWG = design_of(oracle.RWG)
CORRECTED = bk.corrected()
FINE = control(H, 0.5, LIMIT, stop_at_limit=True)._replace(locate_yield=True)
READINGS = {"corrected": bk.corrected(), "as_printed": bk.as_printed()}


def by_kernels(design: bk.Design, second: SecondSpring, readings: bk.Readings = CORRECTED) -> bk.Outcome:
    return bk.simulate(bk.Problem(design, None, second), readings, FINE, bk.no_record())


def by_oracle(design: bk.Design, second: SecondSpring, readings: bk.Readings = CORRECTED) -> Summary:
    inputs = replace(inputs_of(design), k_2=second.k_2, s_2=second.s_2)
    return recorded_impact(inputs, oracle_readings(readings), rotation_limit=LIMIT)


@pytest.mark.compiled
@pytest.mark.parametrize("preset", READINGS)
@pytest.mark.parametrize(("factor", "s_2"), [(3.0, 0.5), (1.3, 0.65), (10.0, 0.05), (1.0, 0.5), (3.0, 5.0)])
def test_whole_impact_is_that_of_the_oracle(preset: str, factor: float, s_2: float) -> None:
    second = SecondSpring(factor * RWG.k_v, s_2)
    known = by_oracle(RWG, second, READINGS[preset])
    assert (known.second_spring_from < known.t_end) == (s_2 < 1.0)
    assert differences(by_kernels(RWG, second, READINGS[preset]), known) == {}


@pytest.mark.compiled
def test_random_impacts_are_those_of_the_oracle() -> None:
    rng = np.random.default_rng(161)
    designs = random_designs(6, seed=162)
    seconds = [SecondSpring(rng.uniform(1.0, 6.0) * design.k_v, rng.uniform(0.1, 1.0)) for design in designs]
    all_known = [by_oracle(design, second) for design, second in zip(designs, seconds, strict=True)]
    for design, second, known in zip(designs, seconds, all_known, strict=True):
        assert differences(by_kernels(design, second), known) == {}
    assert sum(known.second_spring_from < known.t_end for known in all_known) >= 4


@pytest.mark.compiled
def test_a_second_spring_like_the_first_or_never_reached_changes_nothing() -> None:
    alone = bk.simulate_design(RWG, CORRECTED, FINE, bk.no_record())
    unreached = by_kernels(RWG, SecondSpring(3.0 * RWG.k_v, 5.0))
    assert np.array(unreached.maxima).tobytes() == np.array(alone.maxima).tobytes()
    same = by_kernels(RWG, SecondSpring(RWG.k_v, 0.5))  # a step more, cut at the kink
    assert np.array(same.maxima) == pytest.approx(np.array(alone.maxima), rel=1e-8)


def test_force_is_continuous_and_its_slope_is_not() -> None:
    """F_v = k_2 (u - u_0) goes on from k_v u* (Eq 111)."""
    c = constants_of(RWG, CORRECTED, 0)
    k_2, u = 3.0 * c.k_v, 0.2
    after = on_second_spring(c, k_2, offset_of(u, c.k_v, k_2))
    x_v = u + c.tau_v * 3.0
    y = State(0.0, 0.0, 0.0, 0.0, x_v, c.v_0 - 3.0)
    further = y._replace(x_v=x_v + 1e-3)

    def force(y: State, c: bk.Constants) -> float:
        s = switches_of(Modes(TURNING_FORWARD, True, 1.0, 1.0, 0, 0), CORRECTED, c)
        return s.k_contact * compression_at(y, s, c).u

    assert force(y, after) == pytest.approx(force(y, c), rel=1e-12)
    assert force(further, c) - force(y, c) == pytest.approx(1e-3 * c.k_v, rel=1e-9)
    assert force(further, after) - force(y, after) == pytest.approx(1e-3 * k_2, rel=1e-9)
    assert after.k_m == pytest.approx(k_2 / RWG.m_v, rel=1e-15)


def test_energy_spent_at_the_kink() -> None:
    """Stored before less stored after, F^2/2 (1/k_v - 1/k_2) (Eq 112); nothing where the springs are alike."""
    c = constants_of(RWG, CORRECTED, 0)
    k_2, u = 3.0 * c.k_v, 0.2
    u_0 = offset_of(u, c.k_v, k_2)
    y = State(0.0, 0.0, 0.0, 0.0, u + c.tau_v * 3.0, c.v_0 - 3.0)
    before = stored_energies(y, RWG.m_v, True, True, c).crush_elastic
    after = stored_energies(y, RWG.m_v, True, True, on_second_spring(c, k_2, u_0)).crush_elastic
    assert spent_energy(u_0, c.k_v, k_2) == pytest.approx(before - after, rel=1e-12)
    assert spent_energy(0.0, c.k_v, c.k_v) == 0.0


@pytest.mark.compiled
@pytest.mark.parametrize("s_2", [0.5, 0.8])
def test_a_located_kink_costs_no_order(s_2: float) -> None:
    """Order five across the kink, where soil and weight are smooth: errors against a far finer step."""
    design = RWG._replace(beta=np.float64(20.0), K_epsilon=np.float64(1e4), rho_b=np.float64(1e5))
    second = SecondSpring(4.0 * design.k_v, s_2)
    n = 41

    def end(h: float) -> np.ndarray:
        record = bk.Record(
            np.linspace(0.0, 0.1, n),
            np.full((n, 6), np.nan),
            np.zeros(n, np.int8),
            np.zeros(n, np.bool_),
            np.full((n, 4), np.nan),
            np.zeros(n),
        )
        bk.simulate(bk.Problem(design, None, second), CORRECTED, control(h, 0.1), record)
        assert record.offset[0] == 0.0 < record.offset[-1]
        return record.states[-1]

    known = end(1e-4)
    steps = np.array([8e-3, 6e-3, 4e-3, 3e-3, 2e-3])
    errors = np.array([np.max(np.abs(end(h) - known)) for h in steps])
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 4.5 < order < 6.5


@pytest.mark.compiled
def test_error_estimate_covers_the_kink() -> None:
    designs = random_designs(40, seed=163)
    springs = SecondSprings(np.array([3.0 * design.k_v for design in designs]), np.full(len(designs), 0.5))
    table = table_of(designs)
    how = bk.Control(8e-3, 0.5, LIMIT, 0, True, True, False)
    found = bk.simulate_table(table, CORRECTED, how, springs)
    known = bk.simulate_table(table, CORRECTED, FINE, springs)
    right = (found.status == known.status) & (np.abs(found.theta_max - known.theta_max) <= found.theta_error + 1e-12)
    assert right.all()


@pytest.mark.compiled
def test_rows_are_the_single_impacts() -> None:
    designs = random_designs(5, seed=164)
    seconds = [SecondSpring(2.0 * design.k_v, 0.1 * (row + 1)) for row, design in enumerate(designs)]
    springs = SecondSprings(*(np.array(column) for column in zip(*seconds, strict=True)))
    how = bk.Control(2e-3, 1.0, float(np.radians(20.0)), 0, False)
    out = bk.simulate_table(table_of(designs), CORRECTED, how, springs)
    for row, (design, second) in enumerate(zip(designs, seconds, strict=True)):
        one = bk.simulate(bk.Problem(design, None, second), CORRECTED, how, bk.no_record())
        assert (out.status[row], out.theta_max[row], out.crush_max[row]) == (
            one.status,
            one.maxima.theta,
            one.maxima.crush,
        )


@pytest.mark.parametrize(
    ("factor", "s_2"), [(0.99, 0.5), (np.nan, 0.5), (np.inf, 0.5), (2.0, 0.0), (2.0, -1.0), (2.0, np.nan)]
)
def test_a_second_spring_that_cannot_be_is_refused(factor: float, s_2: float) -> None:
    second = SecondSpring(factor * RWG.k_v, s_2)
    assert not is_second_spring(constants_of(RWG, CORRECTED, 0), second)


def test_such_a_vehicle_is_not_simulated() -> None:
    assert by_kernels(RWG, SecondSpring(0.99 * RWG.k_v, 0.5)).status == Status.INVALID


@pytest.mark.compiled
def test_steps_follow_the_stiffer_spring() -> None:
    c = constants_of(RWG, CORRECTED, 0)
    second = SecondSpring(1e4 * RWG.k_v, 0.5)
    alone = constants_of(RWG._replace(k_v=second.k_2), CORRECTED, 0)
    assert stable_step(rates_of(LIMIT, stiffest(c, second))) == pytest.approx(stable_step(rates_of(LIMIT, alone)))
    how = bk.Control(8e-3, 0.5, LIMIT, 0, False)
    springs = SecondSprings(np.array([second.k_2]), np.array([second.s_2]))
    refused = bk.simulate_table(table_of([RWG]), CORRECTED, how, springs)
    assert refused.status[0] == Status.WEAK_DAMPER
    found = bk.simulate_table(table_of([RWG]), CORRECTED, how._replace(last_resort=True), springs)
    assert found.status[0] in (Status.LIMIT, Status.SETTLED, Status.BELOW_LIMIT, Status.HORIZON)
    # So stiff a spring leaves the damper alone.
    softer = SecondSprings(np.array([100.0 * RWG.k_v]), np.array([0.5]))
    near = bk.simulate_table(table_of([RWG]), CORRECTED, FINE._replace(h=1e-4), softer)
    assert found.theta_max[0] == pytest.approx(near.theta_max[0], rel=0.02)


def test_the_proof_of_rest_counts_on_the_stiffer_spring() -> None:
    """On a spring k_2 a force takes F^2/(2 k_2), so less energy may press as hard again."""
    c = constants_of(RWG, CORRECTED, 0)
    m = no_maxima()._replace(theta=0.3, x_b=0.5, F_v=1e3)
    y = State(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    kept = provable_so_far(Kept(-1.0, 1.0, y, m), c.k_v, 4.0 * c.k_v)
    assert barrier_energy(kept.m, c) == pytest.approx(barrier_energy(m, c) / 4.0, rel=1e-9)
    assert barrier_energy(m, c) == pytest.approx(0.5 * m.F_v**2 / c.k_v, rel=1e-5)
    assert same_bits(np.array(kept.m)[:6], np.array(m)[:6])
