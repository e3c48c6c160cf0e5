"""Plastic soil: single elements by hand, sums and whole impacts against the oracle."""

import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import boulder_kernels as bk
from boulder_kernels import unloading
from boulder_kernels.dynamics import State
from boulder_kernels.layered import SoilElements
from boulder_kernels.plastic import (
    LAST,
    Memory,
    potential_of_plastic_elements,
    push,
    reaction_of_plastic_elements,
    slider_energy,
)
from boulder_kernels.soil import Kinematics, Reaction, soil_kinematics
from boulder_kernels.unloading import rest_of
from tests import oracle
from tests.kernels.samples import simulate_plastic
from tests.oracle.records import recorded_impact
from tests.oracle.restoring import gravity_energy
from tests.oracle.soil import Motion, Soil

from .samples import design_of, random_design, random_designs, random_state

LAWS = {"plastic": bk.PLASTIC, "plastic_with_gap": bk.PLASTIC_WITH_GAP}
N = 8


def plain(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel as it is written, which takes no time to compile."""
    return getattr(kernel, "py_func", kernel)


def memory_of(elements: int, gap: bool) -> Memory:
    return Memory(np.zeros(elements), np.zeros(elements), gap, np.zeros(LAST + 6), np.zeros((0, 2 * elements + 1)))


def one_element() -> SoilElements:
    """An element of 1 N/m that yields at 1 N: displacements and forces are the same numbers."""
    return SoilElements(np.array([0.5]), np.array([1.0]), np.array([1.0]), np.array([0.0]))


def forces_along(path: list[float], gap: bool) -> list[float]:
    """Push one element along a path and return its force at each point."""
    soil, memory = one_element(), memory_of(1, gap)
    found = []
    for u in path:
        plain(push)(0, u, 1.0, memory)
        k = Kinematics(A=u, slope_x=0.0, B=0.0, slope_v=0.0, q=1.0, lever_d=0.0)
        found.append(-plain(reaction_of_plastic_elements)(k, soil, memory).F)
    return found


def control(h: float, law: int, horizon: float = 0.6, elements: int = N, **changes: object) -> bk.Control:
    how = bk.Control(h, horizon, math.radians(20.0), elements, False, stop_at_limit=False, unloading=law)
    return how._replace(**changes)


def slow_trucks(count: int, seed: int) -> list[bk.Design]:
    """Random designs that most trucks do not overturn."""
    return [design._replace(v_0=0.6 * design.v_0) for design in random_designs(count, seed)]


def test_an_element_without_a_gap_unloads_by_its_spring_and_yields_the_other_way() -> None:
    path = [0.5, 3.0, 2.5, 2.0, 1.0, 0.0, 1.0, 2.0]
    assert forces_along(path, gap=False) == pytest.approx([0.5, 1.0, 0.5, 0.0, -1.0, -1.0, 0.0, 1.0])


def test_an_element_with_a_gap_bears_again_where_it_was_left() -> None:
    path = [0.5, 3.0, 2.5, 2.0, 1.0, 0.0, -0.5, -2.0, -1.5, -1.0, 0.0, 2.0, 2.5, 4.0]
    expected = [0.5, 1.0, 0.5, 0.0, 0.0, 0.0, -0.5, -1.0, -0.5, 0.0, 0.0, 0.0, 0.5, 1.0]
    assert forces_along(path, gap=True) == pytest.approx(expected)


@pytest.mark.parametrize("gap", [False, True])
def test_sums_are_those_of_the_oracle_whatever_was_remembered(gap: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        design = random_design(rng)
        y = random_state(rng)
        inputs = oracle.Inputs(**{name: float(v) for name, v in design._asdict().items() if name != "e_bumper"})
        constants = oracle.constants(inputs, oracle.CORRECTED, N)
        soil = Soil(inputs, constants)
        motion = Motion(y.x_b, y.theta_b, y.v_b, y.omega_b)
        alpha, height, R, gamma = soil.nodes(motion)
        back = rng.normal(0.0, soil.dx_yield, N)
        front = back + rng.exponential(soil.dx_yield, N) * gap
        known = soil.totals(replace(motion, bearing=np.concatenate((front, back))))
        elements = SoilElements(
            alpha / inputs.d,
            oracle.soil.spring_constants(inputs, alpha, height),
            oracle.soil.ultimate_forces(inputs, alpha, height),
            inputs.rho_s * inputs.W * height,
        )
        lever = -R * np.cos(gamma + y.theta_b)
        dx, v = oracle.soil.stretch(R, gamma, motion), oracle.soil.velocity(R, gamma, motion)
        # Lines through the first and the last element.
        per = elements.ratio[-1] - elements.ratio[0]
        slopes = [(line[-1] - line[0]) / per for line in (dx, v, lever)]
        starts = [line[0] - s * elements.ratio[0] for line, s in zip((dx, v, lever), slopes, strict=True)]
        k = Kinematics(starts[0], -slopes[0], starts[1], -slopes[1], starts[2], slopes[2])
        found = plain(reaction_of_plastic_elements)(k, elements, memory_of(N, gap)._replace(front=front, back=back))
        assert pytest.approx(known.F, rel=1e-9, abs=1e-6 * elements.ultimate.sum()) == found.F
        assert pytest.approx(known.M, rel=1e-9, abs=1e-6 * elements.ultimate.sum()) == found.M


@pytest.mark.parametrize("gap", [False, True])
def test_no_way_takes_less_work_than_the_straight_one(gap: bool) -> None:
    """What the proofs of verdict and rest rely on: the potential about what is remembered is the least work."""
    rng, soil = np.random.default_rng(5), one_element()
    for _ in range(200):
        memory = memory_of(1, gap)
        for u in rng.normal(0.0, 2.0, 3):
            plain(push)(0, u, 1.0, memory)
        at, end = float(u), float(rng.normal())
        needed = [plain(potential_of_plastic_elements)(place, 0.0, soil, memory).V for place in (at, end)]
        work = 0.0
        for target in (*rng.normal(0.0, 2.0, rng.integers(0, 4)), end):
            fine = np.linspace(at, target, 101)
            forces = []
            for u in fine:
                plain(push)(0, u, 1.0, memory)
                k = Kinematics(u, 0.0, 0.0, 0.0, 1.0, 0.0)
                forces.append(-plain(reaction_of_plastic_elements)(k, soil, memory).F)
            work += sum(
                0.5 * (a + b) * (v - u) for (a, b), (u, v) in zip(pairwise(forces), pairwise(fine), strict=True)
            )
            at = target
        assert work >= needed[1] - needed[0] - 1e-3


@pytest.mark.parametrize("gap", [False, True])
def test_work_is_stored_or_taken_by_the_sliders(gap: bool) -> None:
    rng, soil = np.random.default_rng(7), one_element()
    memory, at, force, work, taken = memory_of(1, gap), 0.0, 0.0, 0.0, 0.0
    for target in rng.normal(0.0, 2.0, 20):
        for u in np.linspace(at, target, 401)[1:]:
            taken += plain(push)(0, u, 1.0, memory)  # times 1 N
            k = Kinematics(u, 0.0, 0.0, 0.0, 1.0, 0.0)
            now = -plain(reaction_of_plastic_elements)(k, soil, memory).F
            work, at, force = work + 0.5 * (force + now) * (u - at), u, now
        stored = plain(potential_of_plastic_elements)(at, 0.0, soil, memory)
        assert stored.V + taken == pytest.approx(work, abs=2e-3)
        assert pytest.approx(force, abs=1e-12) == stored.V_A
        assert plain(slider_energy)(k, soil, memory) == pytest.approx(0.0, abs=1e-12)
        pushed = memory.front[0] + 3.0  # 1 m by the spring, 2 m by the slider
        assert plain(slider_energy)(Kinematics(pushed, 0.0, 0.0, 0.0, 1.0, 0.0), soil, memory) == pytest.approx(2.0)
        stored = plain(potential_of_plastic_elements)(pushed, 0.0, soil, memory)
        assert pytest.approx(2.5) == stored.V


@pytest.mark.compiled
@pytest.mark.parametrize("unloading", LAWS)
@pytest.mark.parametrize("inputs", [oracle.RWG, replace(oracle.RWG, beta=25.0, d=1.7)], ids=["rwg", "softer"])
def test_whole_impacts_and_what_is_left_are_those_of_the_oracle(unloading: str, inputs: oracle.Inputs) -> None:
    """The oracle carries the sliders as states of the motion, each moving with its element while it yields."""
    known = recorded_impact(
        inputs, oracle.CORRECTED, elements=N, horizon=0.6, rtol=1e-8, land_on_kinks=False, unloading=unloading
    )
    found = simulate_plastic(design_of(inputs), bk.corrected(), control(0.0005, LAWS[unloading]), bk.no_record())
    assert found.outcome.maxima.theta == pytest.approx(known.max_rotation.value, abs=1e-7)
    assert found.outcome.maxima.x_b == pytest.approx(known.max_displacement.value, abs=1e-6)
    memory = found.constants.memory
    assert np.concatenate((memory.front, memory.back)) == pytest.approx(np.array(known.left), abs=2e-6)
    assert found.swing_back == pytest.approx(known.swing_back, abs=1e-6)


@pytest.mark.compiled
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_soil_that_never_yields_is_the_elastic_one(law: int) -> None:
    design = design_of(replace(oracle.RWG, K_epsilon=1e6))
    found = simulate_plastic(design, bk.corrected(), control(0.004, law), bk.no_record())
    elastic = control(0.004, law)._replace(unloading=bk.ELASTIC)
    known = bk.simulate_design(design, bk.corrected(), elastic, bk.no_record())
    if law == bk.PLASTIC:
        assert found.outcome.maxima == pytest.approx(known.maxima, rel=1e-9)
    else:  # nothing is pressed for good, so no gap opens
        assert found.outcome.maxima == pytest.approx(known.maxima, rel=1e-9)


@pytest.mark.compiled
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_steps_converge_faster_than_by_the_second_order(law: int) -> None:
    designs = [design_of(oracle.RWG), *slow_trucks(24, 3)]
    swings = [
        [simulate_plastic(d, bk.corrected(), control(h, law), bk.no_record()).swing_back for d in designs]
        for h in (0.004, 0.0005, 0.0000625)
    ]
    coarse, fine = (np.abs(np.subtract(found, swings[-1])).mean() for found in swings[:2])
    assert 2.0 < math.log(coarse / fine) / math.log(8.0) < 3.5


@pytest.mark.compiled
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_estimated_errors_cover_the_true_ones(law: int) -> None:
    designs = slow_trucks(60, 11)
    table = bk.DesignTable(*map(np.array, zip(*designs, strict=True)))
    how = control(0.008, law, 1.0, elements=50, stop_at_limit=True, longest_horizon=2.0)
    found = bk.simulate_table(table, bk.corrected(), how._replace(error_estimate=True))
    known = bk.simulate_table(table, bk.corrected(), how._replace(h=0.0005))
    standing = np.isfinite(known.theta_rest)
    covered = found.theta_error >= np.abs(found.theta_max - known.theta_max)
    assert standing.sum() >= 20
    assert covered[standing].mean() >= 0.98
    rest = found.rest_error + known.rest_error >= np.abs(found.theta_rest - known.theta_rest)
    assert rest[standing].all()


def test_the_weight_is_lifted_to_where_the_boulder_rests(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unloading, "least_plastic_energy", lambda slope_x, c: 1000.0 * slope_x)
    lumped = oracle.constants(oracle.RWG, oracle.CORRECTED, N)
    c = bk.constants_of(design_of(oracle.RWG), bk.corrected(), N)
    for theta in (-0.3, 0.0, 0.1, 0.5):
        known = gravity_energy(oracle.RWG, lumped, theta) + 1000.0 * oracle.RWG.d * math.sin(theta)
        assert plain(unloading.resting_energy)(theta, c) == pytest.approx(known, abs=1e-6)


@pytest.mark.compiled
def test_the_place_of_rest_is_where_forces_balance() -> None:
    """Held without motion where the sliders were left, the boulder has neither net force nor net moment."""
    found = simulate_plastic(design_of(oracle.RWG), bk.corrected(), control(0.004, bk.PLASTIC), bk.no_record())
    c = found.constants
    sin, versin = math.sin(found.theta_rest), 1.0 - math.cos(found.theta_rest)

    def reaction(x_b: float) -> Reaction:
        return reaction_of_plastic_elements(soil_kinematics(x_b, 0.0, 0.0, sin, versin, c), c.soil, c.memory)

    x_b = brentq(lambda x: reaction(x).F, -1.0, 1.0, xtol=1e-14)
    weight = c.C_cos * math.cos(found.theta_rest) + c.C_sin * sin  # the couple that turns it back
    assert found.theta_rest > math.radians(5.0)
    assert pytest.approx(weight, rel=1e-4) == reaction(x_b).M


@pytest.mark.compiled
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_what_is_proved_holds_for_ten_times_as_long(law: int) -> None:
    """A design that is decided below its limit never reaches it, and stays within the doubt of its rest."""
    for design in slow_trucks(40, 13):
        how = control(0.004, law, 1.0, elements=30, stop_at_limit=True, longest_horizon=1.0)
        early = simulate_plastic(design, bk.corrected(), how, bk.no_record())
        if early.outcome.status != bk.Status.BELOW_LIMIT or math.isnan(early.theta_rest):
            continue
        later = simulate_plastic(
            design, bk.corrected(), how._replace(horizon=10.0, longest_horizon=10.0), bk.no_record()
        )
        assert later.outcome.status != bk.Status.LIMIT
        assert abs(later.theta_rest - early.theta_rest) <= early.doubt
        assert later.doubt <= early.doubt + abs(later.theta_rest - early.theta_rest) + 1e-6
        y = State(*later.constants.memory.so_far[LAST:])
        assert abs(y.theta_b - early.theta_rest) <= early.doubt + 1e-6
        again = rest_of(y, math.radians(20.0), later.constants)
        assert again.theta == later.theta_rest


@pytest.mark.compiled
def test_without_the_compiler_it_is_the_same() -> None:
    code = (
        "import numpy as np; from math import radians; import boulder_kernels as bk\n"
        "from tests import oracle; from tests.kernels.samples import design_of\n"
        "from tests.kernels.samples import simulate_plastic\n"
        "how = bk.Control(0.01, 0.5, radians(20.0), 6, False, unloading=2)\n"
        "found = simulate_plastic(design_of(oracle.RWG), bk.corrected(), how, bk.no_record())\n"
        "print(found.outcome.maxima.theta, found.theta_rest, found.doubt, found.swing_back)\n"
    )
    lines = [
        subprocess.run(
            [sys.executable, "-c", code], env=os.environ | off, capture_output=True, text=True, check=True
        ).stdout.split()
        for off in ({}, {"NUMBA_DISABLE_JIT": "1"})
    ]
    assert [float(number) for number in lines[0]] == pytest.approx([float(number) for number in lines[1]], rel=1e-6)
