"""The proof that nothing reported can still grow: its bounds, and that no design called settled ever exceeds them."""

from math import exp, log, radians

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import boulder_kernels as bk
from boulder_kernels import Design, Status
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import State, soil_potential
from boulder_kernels.numerics import sine_versine
from boulder_kernels.outcomes import Maxima
from boulder_kernels.settling import (
    NO_PROOF,
    barrier_energy,
    boulder_energy,
    energy_to_move,
    energy_to_turn,
    proof_is_possible,
)
from tests import oracle
from tests.oracle.restoring import gravity_energy
from tests.oracle.soil import Motion

from .samples import ALL_READINGS, control, design_of, inputs_of, random_designs, random_state, table_of
from .stepping import with_compression

CORRECTED = bk.corrected()


def weak_design(rng: np.random.Generator) -> Design:
    """Draw a slender boulder in very weak soil before a light truck: one that tips over slowly."""
    H = rng.uniform(1.0, 6.0)
    d = rng.uniform(0.1, 0.9) * H
    return Design(
        L=rng.uniform(0.03, 0.5) * H,
        W=rng.uniform(0.3, 3.0),
        H=H,
        rho_b=rng.uniform(1500.0, 4000.0),
        d=d,
        e=rng.uniform(0.05, 1.0) * (H - d),
        rho_s=rng.uniform(1000.0, 2500.0),
        phi=radians(rng.uniform(1.0, 40.0)),
        beta=exp(rng.uniform(log(0.05), log(30.0))),
        K_epsilon=rng.uniform(0.5, 2.0),
        m_v=exp(rng.uniform(log(100.0), log(10_000.0))),
        v_0=exp(rng.uniform(0.0, log(40.0))),
        k_v=exp(rng.uniform(log(1e5), log(2e7))),
        c_v=exp(rng.uniform(log(1e4), log(1e6))),
        e_bumper=0.0,
    )


def weak_designs(count: int, seed: int) -> list[Design]:
    rng = np.random.default_rng(seed)
    return [weak_design(rng) for _ in range(count)]


def potential(design: Design, problem: oracle.Problem, x_b: float, theta: float) -> float:
    """Potential energy of soil and weight at rest [J], by the oracle."""
    still = Motion(x_b=x_b, theta=theta, v_b=0.0, omega=0.0)
    weight = gravity_energy(problem.inputs, problem.constants, theta)
    return problem.soil.elastic_energy(still) + weight


def test_a_proof_needs_both_corrected_readings() -> None:
    for readings in ALL_READINGS:
        assert proof_is_possible(readings) == (readings.restoring_gravity and readings.separation_released)


def test_energy_is_that_of_the_oracle() -> None:
    """What boulder, soil, weight and the spring of the truck hold; a spring that is off holds nothing."""
    rng = np.random.default_rng(111)
    for design in random_designs(6, seed=112):
        c = constants_of(design, CORRECTED, 0)
        problem = oracle.problem(inputs_of(design), oracle.CORRECTED)
        for u in (-0.1, 0.0, 0.2):
            y = with_compression(random_state(rng, (-1.2, 1.2)), u, c)
            known = potential(design, problem, y.x_b, y.theta_b)
            known += 0.5 * (c.m_eff * y.v_b**2 + c.J_eff * y.omega_b**2) + 0.5 * c.k_v * max(u, 0.0) ** 2
            assert boulder_energy(y, c) == pytest.approx(known, rel=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_no_place_beyond_a_maximum_costs_less(seed: int) -> None:
    """The bounds against a search: on theta = +-theta_max over x_b, and on x_b = x_max over theta."""
    rng = np.random.default_rng([113, seed])
    for design in [*random_designs(4, seed=114 + seed), *weak_designs(4, seed=115 + seed)]:
        c = constants_of(design, CORRECTED, 0)
        problem = oracle.problem(inputs_of(design), oracle.CORRECTED)
        theta_max, x_max = rng.uniform(0.01, 0.6), rng.uniform(0.01, 0.5)
        to_turn = [
            potential(design, problem, x_b, side * theta_max)
            for side in (-1.0, 1.0)
            for x_b in np.linspace(-0.8, 0.8, 161)
        ]
        size = max(abs(value) for value in to_turn)
        assert energy_to_turn(theta_max, c) <= min(to_turn) + 1e-9 * size
        to_move = [potential(design, problem, x_max, a) for a in np.linspace(-theta_max, theta_max, 161)]
        assert energy_to_move(x_max, theta_max, c) <= min(to_move) + 1e-9 * size
        assert energy_to_move(x_max, 0.0, c) <= potential(design, problem, x_max, 0.0) + 1e-9 * size


def test_the_bounds_are_not_idle() -> None:
    """Of both bounds more than nine tenths are left where the soil is firm."""
    design = design_of(oracle.RWG)
    c = constants_of(design, CORRECTED, 0)
    problem = oracle.problem(inputs_of(design), oracle.CORRECTED)
    turned = min(potential(design, problem, x_b, 0.2) for x_b in np.linspace(-0.5, 0.5, 501))
    assert energy_to_turn(0.2, c) > 0.9 * turned
    moved = min(potential(design, problem, 0.2, a) for a in np.linspace(-0.2, 0.2, 501))
    assert energy_to_move(0.2, 0.2, c) > 0.8 * moved


def test_the_bound_on_turning_is_tight() -> None:
    """Elastic or yielding, as a whole or by one element: the least energy to six digits."""
    for design in [design_of(oracle.RWG), *random_designs(4, seed=117)]:
        for elements in (0, 1, 50):
            c = constants_of(design, CORRECTED, elements)
            for theta in (1e-4, 0.02, 0.3):
                sin, versin = sine_versine(theta)
                slope = c.d * sin
                found = minimize_scalar(
                    lambda A, slope=slope, c=c: soil_potential(A, slope, c).V,
                    bounds=(0.0, slope),
                    method="bounded",
                    options={"xatol": 1e-10 * slope},
                )
                known = c.C_cos * sin + c.C_sin * versin + found.fun
                assert energy_to_turn(theta, c) == pytest.approx(known, rel=2e-6)
                assert energy_to_turn(theta, c) <= known * (1.0 + 1e-12)


def test_no_proof_without_a_barrier() -> None:
    """A boulder that never turned, or that has been past its tipping angle in soft soil, has none."""
    c = constants_of(design_of(oracle.RWG), CORRECTED, 0)
    assert barrier_energy(Maxima(0.0, 0.0, 0.1, 0.0, 0.1, 0.0, 1e6, 0.0, 0.5, 0.0), c) == NO_PROOF
    soft = constants_of(design_of(oracle.ABG)._replace(beta=np.float64(1e-3)), CORRECTED, 0)
    assert barrier_energy(Maxima(1.2, 0.0, 0.1, 0.0, 0.1, 0.0, 1e6, 0.0, 0.5, 0.0), soft) == NO_PROOF
    tipped = State(0.0, 0.0, 1.5, 0.0, -9.0, 0.0)
    assert not boulder_energy(tipped, soft) < NO_PROOF


def check_settled(designs: list[Design], limit: float) -> int:
    """Follow every design that is called settled for three seconds more; return how many there were."""
    table = table_of(designs)
    found = bk.simulate_table(table, CORRECTED, control(2e-3, 1.0, limit, stop_at_limit=True))
    settled = np.flatnonzero(found.status == Status.SETTLED)
    rest = bk.DesignTable(*(column[settled] for column in table))
    later = bk.simulate_table(rest, CORRECTED, control(2e-3, 4.0, limit))
    for name in ("theta_max", "x_b_max", "x_v_max", "F_v_max", "crush_max"):
        grown = getattr(later, name) / getattr(found, name)[settled] - 1.0
        assert np.max(grown, initial=0.0) <= 1e-9, designs[settled[int(np.argmax(grown))]]
    assert np.all(found.t_end[settled] < 1.0)
    return settled.size


@pytest.mark.compiled
@pytest.mark.parametrize("degrees", [20.0, 60.0, 90.0])
def test_nothing_grows_once_settled(degrees: float) -> None:
    settled = check_settled(random_designs(2000, seed=116), radians(degrees))
    settled += check_settled(weak_designs(20_000, seed=117), radians(degrees))
    assert settled > 400


def test_nothing_grows_once_settled_here_either() -> None:
    assert check_settled(random_designs(25, seed=118), radians(60.0)) >= 1


TIPS_OVER = [
    # called settled by a barrier that they had long passed, when that was not looked at
    Design(0.1289, 2.7746, 3.1138, 3923.8, 1.3041, 1.7897, 2279.7, 0.08227, 0.05174, 1.872, 141.65, 2.9394, 4.0122e6,
           9.6647e4, 0.0),
    Design(0.21271, 2.9576, 1.7506, 2431.67, 0.27737, 0.11927, 1100.66, 0.20859, 24.0249, 0.89564, 138.63, 8.611,
           3.15862e6, 22895.2, 0.0),
    Design(0.18894, 2.94648, 4.7374, 3052.78, 2.85353, 1.37067, 1663.44, 0.04416, 0.19343, 1.68466, 1806.6, 2.19839,
           1.2023e6, 422594.0, 0.0),
    Design(0.30147, 2.69791, 3.43958, 1896.55, 2.69524, 0.53944, 2435.17, 0.03961, 0.06231, 0.77045, 848.1, 7.1844,
           376567.9, 193858.2, 0.0),
]  # fmt: skip


@pytest.mark.parametrize("design", TIPS_OVER)
@pytest.mark.parametrize("degrees", [20.0, 60.0, 90.0])
def test_a_boulder_that_tips_over_slowly_is_not_settled(design: Design, degrees: float) -> None:
    found = bk.simulate_design(
        design, CORRECTED, control(2e-3, 1.0, radians(degrees), stop_at_limit=True), bk.no_record()
    )
    assert found.status in (Status.LIMIT, Status.OUTWARD)
