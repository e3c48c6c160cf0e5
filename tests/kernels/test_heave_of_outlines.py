"""Second opinions of boulders that are no boxes: their foot, their width, and faces that are inclined (Eq 150)."""

from __future__ import annotations

from dataclasses import replace
from math import isinf, nan, radians

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import Status
from boulder_kernels.design import body_of_outline
from boulder_kernels.heave import FACES, FALL, FINEST, GROUP, RISE, ROW, SETS, SIDE, STRIP, Base, HeaveOptions, forces
from boulder_kernels.heave import accelerations as found_accelerations
from boulder_kernels.pieces import PiecewiseTable, table_in_layers, uniform_layers
from boulder_kernels.second_opinion import (
    CAUTION,
    HeaveControl,
    HeaveRecord,
    kinetic_energy,
    least_energy,
    potential_energy,
    second_opinions,
    simulate_heave,
)
from boulder_kernels.table import simulate_table
from tests.oracle.heave import Base as OracleBase
from tests.oracle.heave import Body, box_outline, loads
from tests.oracle.heave import accelerations as known_accelerations
from tests.oracle.heave import energy as known_energy
from tests.oracle.heave import simulate_heave as known_impact

from .samples import control, inputs_of, random_designs, table_of
from .test_heave import FORMS, NAMES, random_motion, random_sets
from .test_heave_in_layers import in_ground, prepared, random_ground

BOTH, NEITHER = FORMS[0], FORMS[3]
EVEN = Base(varies=False)
KINDS = ("narrower upwards", "narrower downwards", "barrel", "profile")


def outline_of(rng: np.random.Generator, design: bk.Design, kind: str) -> np.ndarray:
    """Draw an outline, shape (P, 4), within the sides of a design."""
    t = rng.uniform(0.55, 0.95)
    shares = {KINDS[0]: [1.0, t], KINDS[1]: [t, 1.0], KINDS[2]: [t, 1.0, t]}.get(kind, rng.uniform(0.6, 1.0, 5))
    sides = np.array(shares)
    z = np.linspace(0.0, design.H, len(sides))
    reach = 0.5 * design.L * sides
    lean = rng.uniform(-0.08, 0.08, len(sides)) * design.L * (kind == "profile")
    return np.column_stack((z, design.W * sides, reach - lean, reach + lean))


def some_outlines(count: int, seed: int) -> list[tuple[bk.Design, np.ndarray]]:
    """Draw designs, each of the kinds in turn."""
    rng = np.random.default_rng(seed)
    return [(one, outline_of(rng, one, KINDS[n % 4])) for n, one in enumerate(random_designs(count, seed))]


def table_with(design: bk.Design, outline: np.ndarray) -> PiecewiseTable:
    """Return a design with an outline in its uniform soil, a table of one row."""
    return table_in_layers(table_of([design]), uniform_layers(design)[None])._replace(outlines=outline[None])


@pytest.mark.parametrize("fineness", [1, 2])
@pytest.mark.parametrize("form", FORMS[:2], ids=NAMES[:2])
def test_forces_accelerations_and_energies_are_those_of_the_oracle(form: HeaveOptions, fineness: int) -> None:
    """In uniform soil and in layers."""
    rng = np.random.default_rng(551)
    for number, (design, outline) in enumerate(some_outlines(8, seed=552)):
        inputs, table, base = inputs_of(design), table_with(design, outline), EVEN
        if number >= 4:
            ground = random_ground(rng, design)
            inputs, table = replace(inputs, ground=ground), in_ground(design, ground)._replace(outlines=outline[None])
            base = Base(water=ground.water, slope=ground.slope)
        f, work, _ = prepared(table, form, base, fineness)
        body = Body(inputs, *form, OracleBase(), fineness, outline=outline)
        assert work[SETS : SETS + f.pieces] == pytest.approx(body.sets_at_rest, abs=1e-12)
        for turn in range(6):
            sets, (y, rise, rate) = random_sets(rng, f.pieces), random_motion(rng, form)
            work[SETS : SETS + f.pieces] = sets
            touching = turn % 3 > 0
            Q = forces(y.x_b, y.v_b, y.theta_b, y.omega_b, rise, rate, y.x_v, y.v_v, touching, work, f)
            found = np.array([Q.Q_x, Q.Q_theta, Q.Q_y])
            q, rates = np.array([y.x_b, y.theta_b, rise]), np.array([y.v_b, y.omega_b, rate])
            known = loads(body, q, rates, -f.c.k_m * Q.u, touching, sets)
            assert found == pytest.approx(known, rel=1e-7, abs=1e-8 * np.abs(known).max())
            moved = found_accelerations(y.theta_b, y.omega_b, Q, touching, f)[:3]
            expected = known_accelerations(body, q, rates, known)
            assert moved == pytest.approx(expected, rel=1e-7, abs=1e-8 * np.abs(expected).max())
            held = potential_energy(y.x_b, y.theta_b, rise, work, f).u
            still = known_energy(body, q, np.zeros(3), sets)
            assert held == pytest.approx(still, rel=1e-8)
            moving = kinetic_energy(y.v_b, y.theta_b, y.omega_b, rate, f)
            assert moving == pytest.approx(known_energy(body, q, rates, sets) - still, rel=1e-8, abs=1e-9 * abs(still))


def test_forces_at_rest_are_the_slopes_of_the_energy() -> None:
    rng = np.random.default_rng(553)
    for design, outline in some_outlines(8, seed=554):
        f, work, _ = prepared(table_with(design, outline), FORMS[1], EVEN)
        for _ in range(8):
            y, rise, _ = random_motion(rng, BOTH)
            Q = forces(y.x_b, 0.0, y.theta_b, 0.0, rise, 0.0, 0.0, 0.0, False, work, f)
            found, q, slopes = np.array([Q.Q_x, Q.Q_theta, Q.Q_y]), [y.x_b, y.theta_b, rise], np.zeros(3)
            for axis in range(3):
                ends = [potential_energy(*(q + side * 1e-7 * np.eye(3)[axis]), work, f).u for side in (-1.0, 1.0)]
                slopes[axis] = (ends[1] - ends[0]) / 2e-7
            assert found == pytest.approx(-slopes, abs=2e-5 * (np.abs(found).max() + f.m_b * bk.design.G))


def test_an_inclined_face_is_lifted_or_held_down_by_what_it_presses_with() -> None:
    """By its force times its inclination; a near face that narrows upwards is not held down by it."""
    design = random_designs(1, seed=555)[0]
    for foot, top in ((0.7, 1.0), (1.0, 0.7)):
        outline = box_outline(inputs_of(design)) * np.array([[1.0, foot, foot, foot], [1.0, top, top, top]])
        f, work, _ = prepared(table_with(design, outline), FORMS[1], EVEN)
        slope = 0.5 * design.L * (top - foot) / design.H
        for x, side in ((0.2, 1.0), (-0.2, -1.0 if slope > 0.0 else 0.0)):
            inclined = potential_energy(x, 0.0, 0.0, work, f)
            upright = work.copy()
            upright[FACES + 2 * ROW : FACES + 4 * ROW] = 0.0
            lifted = inclined.Q_y - potential_energy(x, 0.0, 0.0, upright, f).Q_y
            assert lifted == pytest.approx(-side * slope * inclined.Q_x, rel=1e-9, abs=1e-6)


def test_sides_that_widen_upwards_do_not_rub() -> None:
    for design, outline in some_outlines(3, seed=556):
        f, work, _ = prepared(table_with(design, outline), BOTH, EVEN)
        rubs = work[SIDE : SIDE + GROUP] > 0.0
        depths = (f.c.d * np.array([0.0694, 0.33, 0.67, 0.9306])).repeat(4)
        widens = np.interp(f.c.d - depths + 1e-6, *outline.T[:2]) > np.interp(f.c.d - depths - 1e-6, *outline.T[:2])
        assert np.array_equal(rubs, ~widens)


@pytest.mark.compiled
def test_a_box_given_by_its_outline_is_the_box() -> None:
    designs = random_designs(60, seed=557)
    boxes = np.stack([box_outline(inputs_of(design)) for design in designs])
    how = HeaveControl(radians(20.0), 3.0)
    known = second_opinions(table_of(designs), how)
    layers = np.stack([uniform_layers(design) for design in designs])
    found = second_opinions(PiecewiseTable(*table_of(designs), layers, boxes), how)
    assert np.array_equal(found.status, known.status)
    assert {Status.LIMIT.value, Status.BELOW_LIMIT.value} <= set(known.status.tolist())
    assert found.theta_max == pytest.approx(known.theta_max, abs=radians(0.01))
    assert found.x_v_max == pytest.approx(known.x_v_max, abs=1e-4)


@pytest.mark.compiled
def test_whole_impacts_are_those_of_the_oracle() -> None:
    limit = radians(60.0)
    for design, outline in some_outlines(4, seed=558):
        known = known_impact(inputs_of(design), outline=outline, horizon=0.25, limit=limit)
        how = HeaveControl(limit, 0.25, 1e-10, stop=False)
        found = second_opinions(table_with(design, outline), how, base=EVEN)
        assert np.isnan(found.t_limit[0]) == isinf(known.t_limit)
        if isinf(known.t_limit):
            assert np.degrees(found.theta_max[0]) == pytest.approx(np.degrees(known.theta_max), abs=1e-3)
            assert found.x_v_max[0] == pytest.approx(known.x_v_max, abs=1e-4)
        else:
            assert found.t_limit[0] == pytest.approx(known.t_limit, abs=1e-5)


@pytest.mark.compiled
def test_without_rise_and_friction_on_a_stiff_base_it_is_the_planar_motion() -> None:
    for design, outline in some_outlines(8, seed=559):
        table, exact = table_with(design, outline), control(2.5e-4, 0.35, radians(60.0), 0)
        known = simulate_table(table, bk.corrected(), exact._replace(stop_at_limit=False, locate_yield=True))
        how = HeaveControl(radians(60.0), 0.35, 1e-9, FINEST, stop=False)
        found = second_opinions(table, how, NEITHER, Base(stiffness=1e13, varies=False))
        assert np.degrees(found.theta_max[0]) == pytest.approx(np.degrees(known.theta_max[0]), abs=0.02)
        assert found.x_v_max[0] == pytest.approx(known.x_v_max[0], abs=5e-4)


@pytest.mark.compiled
def test_energy_never_rises() -> None:
    for design, outline in some_outlines(16, seed=560):
        f, work, _ = prepared(table_with(design, outline), BOTH, EVEN)
        record = HeaveRecord(np.linspace(0.0, 0.3, 301), np.full((301, 8), nan), np.full(301, nan))
        simulate_heave(f, design.m_v, HeaveControl(1.2, 0.3, 1e-10, stop=False), work, record)
        assert np.diff(record.energy).max() < 1e-6 * record.energy[0]


def test_at_rest_it_stands() -> None:
    """Also where its centre does not lie over the middle of its foot."""
    leaning = 0
    for design, outline in some_outlines(12, seed=561):
        f, work, _ = prepared(table_with(design, outline), BOTH, EVEN)
        Q = forces(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False, work, f)
        arm = body_of_outline(design, outline).foot
        tilted = abs(f.lean) > 1e-6
        leaning += tilted
        # The strips are placed by their middles.
        assert abs(Q.Q_theta) < 0.05 * f.m_b * bk.design.G * abs(f.lean) + 1e-6 * f.m_b * bk.design.G * arm
        assert abs(Q.Q_y) < 1e-9 * f.m_b * bk.design.G
        assert work[STRIP : STRIP + GROUP].sum() == pytest.approx(1.0)
    assert leaning >= 3


@pytest.mark.compiled
def test_no_place_costs_less_than_the_least_energy() -> None:
    rng = np.random.default_rng(562)
    for design, outline in some_outlines(24, seed=563):
        f, work, _ = prepared(table_with(design, outline), BOTH, EVEN)
        for theta in (radians(-20.0), radians(20.0)):
            least = least_energy(theta, work, f)
            cloud = np.column_stack((rng.uniform(-1.5, 1.5, 300), rng.uniform(-1.2, 3.0, 300)))
            for width in (0.2, 0.05, 0.02):
                values = np.array([potential_energy(x, theta, y, work, f).u for x, y in cloud])
                nearby = cloud[np.argmin(values)] + rng.normal(size=(200, 2)) * width * [1.0, 0.5]
                cloud = np.concatenate([cloud[[np.argmin(values)]], nearby])
            values = np.array([potential_energy(x, theta, y, work, f).u for x, y in cloud])
            assert least - CAUTION * abs(least) <= values.min()


@pytest.mark.compiled
def test_what_is_proved_to_stay_below_the_limit_does() -> None:
    proved = 0
    for design, outline in some_outlines(120, seed=564):
        table = table_with(design, outline)
        if second_opinions(table, HeaveControl(radians(20.0), 3.0), base=EVEN).status[0] == Status.BELOW_LIMIT:
            later = second_opinions(table, HeaveControl(radians(20.0), 5.0, stop=False), base=EVEN)
            assert later.theta_max[0] < radians(20.0)
            proved += 1
    assert proved >= 10


@pytest.mark.compiled
def test_faces_rise_and_fall_no_further_than_parts_allow_for() -> None:
    """While they press on the soil and turn by no more than 20 degrees."""
    furthest = []
    for design, outline in some_outlines(60, seed=565):
        f, work, _ = prepared(table_with(design, outline), BOTH, EVEN)
        record = HeaveRecord(np.linspace(0.0, 0.5, 251), np.full((251, 8), nan), np.full(251, nan))
        simulate_heave(f, design.m_v, HeaveControl(radians(20.0), 0.5), work, record)
        x, theta, y = record.states[np.isfinite(record.states[:, 0]), :3].T
        d_n = (np.arange(GROUP) + 0.5)[:, None] / GROUP * design.d - f.c.z_0
        sideways = x + f.c.l_n * (np.cos(theta) - 1.0) - d_n * np.sin(theta)
        for row, side in ((0, 1.0), (1, -1.0)):
            a = work[FACES + ROW * row : FACES + ROW * row + GROUP, None]
            risen = (y + d_n * (1.0 - np.cos(theta)) - a * np.sin(theta))[side * sideways > 0.0] / f.L
            furthest.append([risen.max(initial=0.0), -risen.min(initial=0.0)])
    rise, fall = np.max(furthest, axis=0)
    assert rise < RISE
    assert fall < FALL
