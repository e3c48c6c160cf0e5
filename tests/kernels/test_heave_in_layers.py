"""Second opinions in soil that changes with depth: layers, water, cohesion and slope (Eqs 148, 149)."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import inf, isinf, nan, radians
from typing import Any

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import Status
from boulder_kernels.dynamics import empty_soil
from boulder_kernels.ground import BROMS, KP_SQUARED, WIDTH_CAPPED, put_soil
from boulder_kernels.ground import Ground as KernelGround
from boulder_kernels.heave import (
    FALL,
    FINEST,
    RISE,
    STIFFNESS,
    YIELD,
    Base,
    HeaveConstants,
    HeaveOptions,
    accelerations,
    bearing_capacity_factor,
    forces,
)
from boulder_kernels.pieces import PiecewiseTable, table_in_layers, uniform_layers
from boulder_kernels.runge_kutta import WORKSPACE
from boulder_kernels.second_opinion import (
    CAUTION,
    Equilibrium,
    HeaveControl,
    HeaveOutcome,
    HeaveRecord,
    kinetic_energy,
    least_energy,
    move_to_least_energy,
    potential_energy,
    prepare_in_layers,
    second_opinions,
    simulate_heave,
)
from boulder_kernels.table import simulate_table, some_rows
from tests.oracle.heave import Base as OracleBase
from tests.oracle.heave import Body, loads
from tests.oracle.heave import accelerations as known_accelerations
from tests.oracle.heave import energy as known_energy
from tests.oracle.heave import simulate_heave as known_impact
from tests.oracle.inputs import Ground, Layer

from .samples import control, inputs_of, random_designs, table_of
from .test_heave import FORMS, NAMES, random_motion, random_sets

LAWS = {"kp_squared": KP_SQUARED, "broms": BROMS, "width_capped": WIDTH_CAPPED}
BOTH, NEITHER = FORMS[0], FORMS[3]
NO_OUTLINE = np.empty((1, 0, 4))


def random_ground(rng: np.random.Generator, design: bk.Design) -> Ground:
    """Draw two or three layers, most with a boundary beside the boulder, with cohesion, water and slope at times."""
    tops = sorted(rng.uniform(0.1, 1.2, rng.integers(1, 3)) * design.d)
    first = Layer(0.0, float(design.rho_s), float(design.phi), float(design.beta), rng.choice([0.0, 5e3]))
    deeper = [
        Layer(top, rng.uniform(1700, 2200), radians(rng.uniform(30, 45)), rng.uniform(10, 90), rng.choice([0.0, 8e3]))
        for top in tops
    ]
    water, slope = rng.choice([inf, rng.uniform(0.1, 1.1) * design.d]), rng.choice([0.0, radians(rng.uniform(3, 15))])
    return Ground((first, *deeper), water, slope)


def in_ground(design: bk.Design, ground: Ground, law: str = "kp_squared") -> PiecewiseTable:
    """Return a design in a soil, a table of one row."""
    first, *deeper = ground.layers
    design = design._replace(rho_s=first.rho_s, phi=first.phi, beta=first.beta)
    below = np.array([[*vars(layer).values()] for layer in deeper]).reshape(-1, 5)
    below[:, 4] *= 1e-3
    lies = KernelGround(LAWS[law], ground.slope, ground.water, 1e-3 * first.cohesion, below)
    changes = {layer.top for layer in ground.layers} | ({ground.water} if not isinf(ground.water) else set())
    table, layers = table_of([design]), np.empty((1, len(changes), 6))
    put_soil(table, lies, True, 16, np.empty((0, 4)), layers, NO_OUTLINE)
    return PiecewiseTable(*table, layers, NO_OUTLINE)


def base_in(ground: Ground, **more: float) -> Base:
    return Base(water=ground.water, slope=ground.slope, **more)


def prepared(
    table: PiecewiseTable, form: HeaveOptions, base: Base, fineness: int = 1
) -> tuple[HeaveConstants, np.ndarray, bk.Design]:
    """Constants and workspace of the only design of a table."""
    design, work = bk.Design(*(column[0] for column in table[:15])), np.full(WORKSPACE, np.nan)
    soil = empty_soil(table.layers.shape[1], table.outlines.shape[1], 0)
    outline = table.outlines[0]
    inclined = 1.0 if len(outline) else None
    return prepare_in_layers(design, table.layers[0], outline, inclined, soil, form, base, fineness, work), work, design


def some_grounds(count: int, seed: int) -> list[tuple[bk.Design, Ground]]:
    rng = np.random.default_rng(seed)
    return [(design, random_ground(rng, design)) for design in random_designs(count, seed)]


@pytest.mark.parametrize("fineness", [1, 2])
@pytest.mark.parametrize("form", FORMS, ids=NAMES)
def test_forces_accelerations_and_energies_are_those_of_the_oracle(form: HeaveOptions, fineness: int) -> None:
    rng = np.random.default_rng(451)
    for number, (design, ground) in enumerate(some_grounds(6, seed=452)):
        law = list(LAWS)[number % 3]
        f, work, _ = prepared(in_ground(design, ground, law), form, base_in(ground), fineness)
        body = Body(replace(inputs_of(design), ground=ground, resistance=law), *form, OracleBase(), fineness)
        for turn in range(6):
            sets, (y, rise, rate) = random_sets(rng, f.pieces), random_motion(rng, form)
            work[: f.pieces] = sets
            touching = turn % 3 > 0
            Q = forces(y.x_b, y.v_b, y.theta_b, y.omega_b, rise, rate, y.x_v, y.v_v, touching, work, f)
            found = np.array([Q.Q_x, Q.Q_theta, Q.Q_y * form.heave])
            q, rates = np.array([y.x_b, y.theta_b, rise]), np.array([y.v_b, y.omega_b, rate])
            known = loads(body, q, rates, -f.c.k_m * Q.u, touching, sets) * [1.0, 1.0, form.heave]
            assert found == pytest.approx(known, rel=1e-8, abs=1e-9 * np.abs(known).max())
            moved = accelerations(y.theta_b, y.omega_b, Q, touching, f)[:3]
            expected = known_accelerations(body, q, rates, known)
            assert moved == pytest.approx(expected, rel=1e-8, abs=1e-9 * np.abs(expected).max())
            if form.heave or not form.friction:
                held = potential_energy(y.x_b, y.theta_b, rise, work, f).u
                still = known_energy(body, q, np.zeros(3), sets)
                assert held == pytest.approx(still, rel=1e-8)
                moving = kinetic_energy(y.v_b, y.theta_b, y.omega_b, rate, f)
                assert moving == pytest.approx(
                    known_energy(body, q, rates, sets) - still, rel=1e-8, abs=1e-9 * abs(still)
                )


@pytest.mark.parametrize("form", FORMS[1::2], ids=NAMES[1::2])
def test_forces_at_rest_are_the_slopes_of_the_energy(form: HeaveOptions) -> None:
    rng = np.random.default_rng(453)
    for design, ground in some_grounds(4, seed=454):
        f, work, _ = prepared(in_ground(design, ground), form, base_in(ground))
        for _ in range(8):
            y, rise, _ = random_motion(rng, form)
            Q = forces(y.x_b, 0.0, y.theta_b, 0.0, rise, 0.0, 0.0, 0.0, False, work, f)
            found, q, slopes = np.array([Q.Q_x, Q.Q_theta, Q.Q_y * form.heave]), [y.x_b, y.theta_b, rise], np.zeros(3)
            for axis in range(3 if form.heave else 2):
                ends = [potential_energy(*(q + side * 1e-7 * np.eye(3)[axis]), work, f).u for side in (-1.0, 1.0)]
                slopes[axis] = (ends[1] - ends[0]) / 2e-7
            assert found == pytest.approx(-slopes, abs=2e-5 * (np.abs(found).max() + f.m_b * bk.design.G))


@pytest.mark.compiled
def test_layers_of_one_soil_are_the_uniform_soil() -> None:
    """Whole impacts to 1e-9, if the soil is cut where parts end; elsewhere by the error of the parts."""
    designs, how = random_designs(12, seed=455), HeaveControl(radians(30.0), 0.6, 1e-6)
    known = second_opinions(table_of(designs), how)
    for cuts in ([], [0.25, 0.8125]):
        layers = np.stack([np.concatenate([uniform_layers(design)] * (len(cuts) + 1)) for design in designs])
        layers[:, :-1, 0] = np.array(cuts) * np.array([[design.d] for design in designs])
        found = second_opinions(table_in_layers(table_of(designs), layers), how)
        assert np.array_equal(found.status, known.status)
        assert found.theta_max == pytest.approx(known.theta_max, rel=1e-9)
        assert found.x_v_max == pytest.approx(known.x_v_max, rel=1e-9)


def one(design: bk.Design, ground: Ground, how: HeaveControl, law: str = "width_capped", **more: Any) -> HeaveOutcome:
    return HeaveOutcome(*(value[0] for value in second_opinions(in_ground(design, ground, law), how, **more)))


@pytest.mark.compiled
def test_whole_impacts_are_those_of_the_oracle() -> None:
    """Verdict, rotation and displacement, by another integrator."""
    limit = radians(60.0)
    for number, (design, ground) in enumerate(some_grounds(4, seed=456)):
        law = list(LAWS)[number % 3]
        inputs = replace(inputs_of(design), ground=ground, resistance=law)
        known = known_impact(inputs, horizon=0.25, limit=limit)
        found = one(design, ground, HeaveControl(limit, 0.25, 1e-10, stop=False), law, base=base_in(ground))
        assert np.isnan(found.t_limit) == isinf(known.t_limit)
        if isinf(known.t_limit):
            assert np.degrees(found.theta_max) == pytest.approx(np.degrees(known.theta_max), abs=1e-3)
            assert found.x_v_max == pytest.approx(known.x_v_max, abs=1e-4)
        else:
            assert found.t_limit == pytest.approx(known.t_limit, abs=1e-5)


@pytest.mark.compiled
def test_without_rise_and_friction_on_a_stiff_base_it_is_the_planar_motion_in_layers() -> None:
    """Whose soil is integrated exactly: what is left is less than 0.005 degrees and 0.5 mm."""
    for design, ground in some_grounds(8, seed=457):
        table, exact = in_ground(design, ground, "broms"), control(2.5e-4, 0.35, radians(60.0), 0)
        known = simulate_table(table, bk.corrected(), exact._replace(stop_at_limit=False, locate_yield=True))
        how = HeaveControl(radians(60.0), 0.35, 1e-9, FINEST, stop=False)
        found = second_opinions(table, how, NEITHER, base_in(ground, stiffness=1e13))
        assert np.degrees(found.theta_max[0]) == pytest.approx(np.degrees(known.theta_max[0]), abs=5e-3)
        assert found.x_v_max[0] == pytest.approx(known.x_v_max[0], abs=5e-4)


@pytest.mark.compiled
def test_energy_never_rises() -> None:
    for design, ground in some_grounds(10, seed=458):
        f, work, _ = prepared(in_ground(design, ground, "width_capped"), BOTH, base_in(ground))
        record = HeaveRecord(np.linspace(0.0, 0.3, 301), np.full((301, 8), nan), np.full(301, nan))
        simulate_heave(f, design.m_v, HeaveControl(1.2, 0.3, 1e-8, stop=False), work, record)
        assert np.diff(record.energy).max() < 1e-6 * record.energy[0]


@pytest.mark.compiled
def test_what_is_proved_to_stay_below_the_limit_does() -> None:
    proved = 0
    for design, ground in some_grounds(120, seed=459):
        table, base = in_ground(design, ground, "width_capped"), base_in(ground)
        if second_opinions(table, HeaveControl(radians(20.0), 3.0), base=base).status[0] == Status.BELOW_LIMIT:
            later = second_opinions(table, HeaveControl(radians(20.0), 5.0, stop=False), base=base)
            assert later.theta_max[0] < radians(20.0)
            proved += 1
    assert proved >= 10


def test_no_place_costs_less_than_the_least_energy() -> None:
    rng = np.random.default_rng(460)
    for design, ground in some_grounds(6, seed=461):
        f, work, _ = prepared(in_ground(design, ground), BOTH, base_in(ground))
        for theta in (radians(-20.0), radians(20.0)):
            least = least_energy(theta, work, f)
            cloud = np.column_stack((rng.uniform(-1.5, 1.5, 150), rng.uniform(-1.2, 3.0, 150)))
            values = np.array([potential_energy(x, theta, y, work, f).u for x, y in cloud])
            nearby = cloud[np.argmin(values)] + rng.normal(size=(100, 2)) * [0.1, 0.02]
            values = np.append(values, [potential_energy(x, theta, y, work, f).u for x, y in nearby])
            assert least - CAUTION * abs(least) <= values.min()


@pytest.mark.compiled
@pytest.mark.parametrize("theta", [radians(-20.0), radians(20.0)])
def test_the_search_for_the_least_energy_goes_on_until_it_gains_nothing(theta: float) -> None:
    """Turns along x_b and y_b come near it slowly beside this boulder: after three, 1.7 % are left."""
    design, ground = list(some_grounds(25, seed=1009))[24]
    f, work, _ = prepared(in_ground(design, ground), BOTH, base_in(ground))
    found = []
    for x, y in product((-0.5, 0.0, 0.2, 0.4, 0.8), (-0.2, 0.5)):
        place = Equilibrium(x, y, inf)
        for _ in range(60):
            place = move_to_least_energy(place, False, -3.0, 8.0, 1e-6, theta, work, f)
            place = move_to_least_energy(place, True, -6.0, 6.0, 1e-6, theta, work, f)
        found.append(place.energy)
    assert least_energy(theta, work, f) <= min(found) + 0.005 * abs(min(found))


@pytest.mark.compiled
def test_what_weakens_the_soil_never_lets_a_boulder_turn_less() -> None:
    """A layer or water below the foot changes nothing; weaker soil above it, water, slope and less cohesion do.

    Of boulders embedded by half that turn by less than 35 degrees: shallow ones may slide in weak soil, and turn less.
    """
    how = HeaveControl(radians(60.0), 0.4, 1e-6, stop=False)
    turned = {name: [] for name in ("layer", "water", "slope", "cohesion")}
    for design in random_designs(25, seed=462):
        top = Layer(0.0, float(design.rho_s), float(design.phi), float(design.beta))
        weak, alone = replace(top, top=0.6 * design.d, phi=top.phi - 0.09, beta=0.7 * top.beta), Ground((top,))
        stiff = replace(top, cohesion=5e3)
        usual, below = (
            one(design, ground, how, base=base_in(ground))
            for ground in (alone, Ground((top, replace(weak, top=1.001 * design.d)), 1.01 * design.d))
        )
        assert below.theta_max == usual.theta_max
        if usual.theta_max > radians(35.0) or design.d < 0.5 * design.H:
            continue
        for name, ground in (
            ("layer", Ground((top, weak))),
            ("water", Ground((top,), 0.5 * design.d)),
            ("slope", Ground((top,), slope=radians(8.0))),
            ("cohesion", Ground((stiff,))),
        ):
            found = one(design, ground, how, base=base_in(ground)).theta_max - usual.theta_max
            turned[name].append(-found if name == "cohesion" else found)
    for name, more in turned.items():
        assert len(more) >= 6
        assert min(more) > -5e-4, name
        assert np.median(more) > radians(0.05), name


def test_the_foot_stands_on_the_soil_under_it() -> None:
    """By the weight of all soil above it less its water, and beside ground that falls (Eq 148)."""
    design = random_designs(1, seed=463)[0]
    layers = (Layer(0.0, 1800.0, 0.7, 60.0, 3e3), Layer(0.5 * design.d, 2100.0, 0.6, 40.0, 9e3))
    ground = Ground(layers, 0.75 * design.d, radians(10.0))
    f, _, _ = prepared(in_ground(design, ground), BOTH, base_in(ground))
    stress = bk.design.G * design.d * (0.5 * 1800.0 + 0.5 * 2100.0 - 0.25 * 1000.0)
    area, beside_falling_ground = design.L * design.W, (1.0 - np.tan(radians(10.0))) ** 2
    assert f.q_foot == pytest.approx(stress * bearing_capacity_factor(0.6) * beside_falling_ground * area, rel=1e-12)
    assert f.c_foot == pytest.approx(2100.0 * Base().wave_speed * area, rel=1e-12)
    assert f.friction == pytest.approx(np.tan(0.4), rel=1e-12)


def test_parts_have_the_weakest_and_softest_soil_that_a_face_may_meet() -> None:
    """For their depth, from 0.25 of the length below them to 0.45 above: of layers, and of cohesion (Eq 149)."""
    design = random_designs(1, seed=464)[0]._replace(L=1.0, d=2.0)
    low, to = np.arange(16) / 8, np.arange(1, 17) / 8

    def laid(*layers: Layer) -> np.ndarray:
        _, work, _ = prepared(in_ground(design, Ground(layers)), BOTH, Base())
        stiffness = work[STIFFNESS : STIFFNESS + 16]
        return np.array([stiffness, stiffness * work[YIELD : YIELD + 16]])

    weak, strong = Layer(0.0, 1900.0, 0.55, 30.0), Layer(0.0, 1900.0, 0.7, 60.0)
    under, over = replace(strong, top=1.0), replace(weak, top=1.0)
    assert laid(weak, under) == pytest.approx(np.where(low < 1.45, laid(weak), laid(strong)), rel=1e-9)
    assert laid(strong, over) == pytest.approx(np.where(to <= 0.75, laid(strong), laid(weak)), rel=1e-9)
    K_p, (stiffness, strength) = np.tan(np.pi / 4 + 0.35) ** 2, laid(strong)
    held = laid(replace(strong, cohesion=1e4))
    deepest = np.minimum(to + 0.25, 2.0)
    assert held[0] == pytest.approx(stiffness, rel=1e-9)
    weight = 1900.0 * bk.design.G
    assert held[1] == pytest.approx(strength * (1.0 + 2e4 / (np.sqrt(K_p) * weight * deepest)), rel=1e-9)


@pytest.mark.compiled
def test_faces_rise_and_fall_no_further_than_parts_allow_for() -> None:
    """While they press on the soil and turn by no more than 20 degrees."""
    furthest = []
    for design, ground in some_grounds(60, seed=467):
        f, work, _ = prepared(in_ground(design, ground, "width_capped"), BOTH, base_in(ground))
        record = HeaveRecord(np.linspace(0.0, 0.5, 251), np.full((251, 8), nan), np.full(251, nan))
        simulate_heave(f, design.m_v, HeaveControl(radians(20.0), 0.5), work, record)
        x, theta, y = record.states[np.isfinite(record.states[:, 0]), :3].T
        d_n = np.linspace(0.0, design.d, 21)[:, None] - f.c.z_0
        sideways = x + f.c.l_n * (np.cos(theta) - 1.0) - d_n * np.sin(theta)
        for a, side in ((f.c.l_n, 1.0), (f.c.l_n - design.L, -1.0)):
            risen = (y + d_n * (1.0 - np.cos(theta)) - a * np.sin(theta))[side * sideways > 0.0] / design.L
            furthest.append([risen.max(initial=0.0), -risen.min(initial=0.0)])
    rise, fall = np.max(furthest, axis=0)
    assert 0.5 * RISE < rise < RISE
    assert 0.5 * FALL < fall < FALL


def test_a_row_is_the_same_alone_and_in_company() -> None:
    rows = [
        in_ground(design, Ground((*ground.layers[:1], replace(ground.layers[1], top=0.5))))
        for design, ground in some_grounds(6, seed=465)
    ]
    table = PiecewiseTable(*(np.concatenate(column) for column in zip(*rows, strict=True)))
    how = HeaveControl(radians(20.0), 0.5)
    whole = np.array(second_opinions(table, how))
    for row in (0, 3, 5):
        alone = np.array(second_opinions(some_rows(table, np.array([row])), how))
        assert np.array_equal(alone[:, 0], whole[:, row], equal_nan=True)
