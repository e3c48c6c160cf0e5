"""The integration of whole impacts: energy, events, the limit of a rigid wall, and its own accuracy."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from tests.oracle import (
    ABG,
    AS_PRINTED,
    CORRECTED,
    RWG,
    Inputs,
    Modes,
    Readings,
    loads,
    problem,
    rate,
    simulate,
    state_modes,
)
from tests.oracle.inputs import CORRECTED_NAMES
from tests.oracle.restoring import gravity_hold
from tests.oracle.vehicle import WallImpact

SEEDS = [*range(3), *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(3, 8))]


def random_inputs(rng: np.random.Generator) -> Inputs:
    """A design from the range boulders and soils realistically have."""
    H = rng.uniform(1.8, 4.0)
    d = rng.uniform(0.35, 0.65) * H
    return Inputs(
        L=rng.uniform(0.6, 2.0),
        W=rng.uniform(0.8, 2.5),
        H=H,
        rho_b=rng.uniform(2400, 3074),
        d=d,
        e=(min(H - d, 1.4) + 0.5) / 2,
        rho_s=rng.uniform(1520, 2240),
        phi=radians(rng.uniform(27, 49)),
        beta=float(np.exp(rng.uniform(np.log(2), np.log(110)))),
        m_v=rng.uniform(5000, 9000),
        v_0=rng.uniform(8, 25),
        k_v=rng.uniform(2e6, 5e6),
        c_v=rng.uniform(0.7e5, 2.5e5),
        K_epsilon=rng.uniform(1.0, 1.2),
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_energy_is_conserved_corrected(seed: int) -> None:
    found = simulate(random_inputs(np.random.default_rng(seed)), CORRECTED)
    ledger = found.energy(np.linspace(0.0, found.t_end, 101))
    assert ledger.total == pytest.approx(ledger.total[0], rel=1e-8)
    assert np.all(ledger.clipped == 0.0)
    assert np.all(np.diff(ledger.soil_drag) >= 0)
    assert np.all(np.diff(ledger.crush_damper) >= 0)


@pytest.mark.parametrize("seed", SEEDS)
def test_energy_is_accounted_for_in_any_mix_of_readings(seed: int) -> None:
    """The printed restoring moment's work and the force clipped away, counted in, close the ledger too."""
    rng = np.random.default_rng(100 + seed)
    mix = {name: rng.choice(["printed", other]) for name, other in CORRECTED_NAMES.items()}
    found = simulate(random_inputs(rng), Readings(**mix))
    total = found.energy(np.linspace(0.0, found.t_end, 101)).total
    assert total == pytest.approx(total[0], rel=1e-7)


@pytest.mark.parametrize("readings", [AS_PRINTED, CORRECTED], ids=["printed", "corrected"])
@pytest.mark.parametrize("inputs", [ABG, RWG], ids=["ABG", "RWG"])
def test_tolerance_and_kinks_do_not_matter(inputs: Inputs, readings: Readings) -> None:
    usual = simulate(inputs, readings)
    other = simulate(inputs, readings, rtol=1e-12, land_on_kinks=False)
    assert usual.max_rotation.value == pytest.approx(other.max_rotation.value, abs=1e-8)
    assert usual.max_displacement.value == pytest.approx(other.max_displacement.value, abs=1e-8)
    assert usual.peak_force.value == pytest.approx(other.peak_force.value, rel=1e-8)


@pytest.mark.parametrize("readings", [AS_PRINTED, CORRECTED], ids=["printed", "corrected"])
def test_trajectory_obeys_the_equations(readings: Readings) -> None:
    """Central differences of the dense output equal the rates of the mode that holds there."""
    found = simulate(RWG, readings)
    edges = [event.time for event in found.events] + [found.t_end]
    for event, until in zip(found.events, edges[1:], strict=True):
        t = event.time + np.array([0.3, 0.5, 0.7]) * (until - event.time)
        step = 1e-6
        slopes = (found.states(t + step) - found.states(t - step)) / (2 * step)
        for slope, y in zip(slopes.T, found.states(t).T, strict=True):
            expected = rate(found.problem, y, event.modes)
            assert slope == pytest.approx(expected, rel=1e-5, abs=1e-4)


def test_trajectory_is_continuous_and_starts_at_rest() -> None:
    found = simulate(RWG, CORRECTED)
    assert found.states(0.0)[:, 0].tolist() == [0, 0, 0, 0, 0, RWG.v_0, 0]
    for t in found.steps[1:-1]:
        before, after = found.states(t - 1e-12).T, found.states(t + 1e-12).T
        assert after == pytest.approx(before, rel=1e-7, abs=1e-8)


def test_maxima_are_those_of_the_trajectory() -> None:
    found = simulate(RWG, CORRECTED)
    t = np.linspace(0.0, found.t_end, 20_001)
    y = found.states(t)
    for peak, values in [
        (found.max_rotation, np.abs(y[2])),
        (found.max_displacement, y[0]),
        (found.max_vehicle_displacement, y[4]),
        (found.peak_force, found.force(t)),
    ]:
        assert peak.value >= values.max()
        assert peak.value == pytest.approx(values.max(), rel=1e-6)
        assert peak.time == pytest.approx(t[np.argmax(values)], abs=1e-4)


def test_boulder_stands_still_until_the_weight_is_overcome() -> None:
    found = simulate(RWG, CORRECTED)
    first, release = found.events[:2]
    assert (first.modes.rotation, release.name) == ("held", "release")
    held = found.states(np.linspace(0.0, release.time, 20))
    assert np.all(held[2:4] == 0.0)
    assert np.all(held[0, 2:] > 0.0)
    y = found.states(release.time)[:, 0]
    net = loads(found.problem, y, Modes("held", "touching")).net
    assert net == pytest.approx(gravity_hold(found.problem.inputs, found.problem.constants), rel=1e-7)


def test_coasting_vehicle_keeps_its_speed_and_returns_to_the_same_crush() -> None:
    found = simulate(RWG, CORRECTED)
    lost = next(event for event in found.events if event.name == "contact lost")
    regained = next(event for event in found.events if event.name == "contact regained")
    t = np.linspace(lost.time, regained.time, 50)
    y = found.states(t)
    assert y[5] == pytest.approx(y[5, 0], rel=1e-12)
    assert found.force(t[1:-1]) == pytest.approx(0.0, abs=1e-3)
    c = found.problem.constants
    crush = y[4] - (y[0] + c.h * np.sin(y[2]) + c.c_x * (1 - np.cos(y[2])))
    assert crush[-1] == pytest.approx(crush[0], abs=1e-9)
    assert np.all(crush[1:-1] < crush[0])


def test_an_immovable_boulder_is_a_rigid_wall() -> None:
    heavy = replace(RWG, rho_b=RWG.rho_b * 1e9)
    found = simulate(heavy, CORRECTED, horizon=0.3)
    wall = WallImpact(RWG.m_v, RWG.v_0, RWG.k_v, RWG.c_v)
    assert found.peak_force.value == pytest.approx(wall.peak_force()[0], rel=1e-7)
    assert found.max_vehicle_displacement.value == pytest.approx(wall.largest_displacement()[0], rel=1e-7)
    lost = next(event for event in found.events if event.name == "contact lost")
    assert lost.time == pytest.approx(wall.separation()[0], abs=1e-8)
    assert found.states(0.3)[5, 0] == pytest.approx(wall.separation()[1], rel=1e-6)


def test_rotation_limit_is_located() -> None:
    limit = radians(20.0)
    whole, stopped = simulate(ABG, CORRECTED), simulate(ABG, CORRECTED, rotation_limit=limit)
    assert stopped.t_end == pytest.approx(whole.time_of_rotation(limit), abs=1e-10)
    assert stopped.max_rotation.value == pytest.approx(limit, abs=1e-10)
    assert np.isnan(simulate(RWG, CORRECTED).time_of_rotation(limit))


def test_modes_of_the_trajectory_are_those_of_the_literal_formulas() -> None:
    """Between events the modes held are the ones each state by itself asks for."""
    for inputs in (ABG, RWG):
        for readings in (AS_PRINTED, CORRECTED):
            found = simulate(inputs, readings)
            edges = [event.time for event in found.events] + [found.t_end]
            for event, until in zip(found.events, edges[1:], strict=True):
                if event.modes.rotation == "held" and readings == AS_PRINTED:
                    continue  # omega = 0 exactly: held between the two branches, neither by itself
                y = found.states((event.time + until) / 2)[:, 0]
                literal = state_modes(found.problem, y, event.modes.contact)
                assert (literal.rotation, literal.contact) == (event.modes.rotation, event.modes.contact)


def test_literal_switching_at_rest_is_the_weight_in_balance() -> None:
    impact = problem(RWG, CORRECTED)
    y = impact.start
    assert state_modes(impact, y).rotation == "held"
    y[6] = -1e4  # a blow beyond what the weight can hold
    assert state_modes(impact, y).rotation == "clockwise"
    assert rate(impact, y, state_modes(impact, y))[3] > 0
