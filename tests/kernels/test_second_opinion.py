"""Second opinions: whole impacts against the oracle and against what is known of them, and the proof of a verdict."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import Status
from boulder_kernels.design import G, constants_of
from boulder_kernels.dormand_prince import Track
from boulder_kernels.dynamics import contact_displacement, spring_compression
from boulder_kernels.heave import (
    FINEST,
    GROUP,
    SETS,
    STRIP,
    Base,
    HeaveConstants,
    HeaveOptions,
    heave_constants,
    prepare,
)
from boulder_kernels.runge_kutta import START, WORKSPACE, Tracks
from boulder_kernels.second_opinion import (
    CAUTION,
    PLACED,
    Equilibrium,
    HeaveControl,
    HeaveOutcome,
    HeaveRecord,
    energy_at,
    foot_rises,
    least_energy,
    move_to_least_energy,
    no_heave_record,
    potential_energy,
    press_in,
    second_opinions,
    simulate_heave,
)
from boulder_kernels.table import some_rows
from tests import oracle
from tests.oracle.heave import Base as OracleBase
from tests.oracle.heave import Body
from tests.oracle.heave import simulate_heave as known_impact
from tests.oracle.soil import lateral_coefficient

from .rolling import rolling
from .samples import control, design_of, inputs_of, random_designs, same_bits, table_of

RWG, ABG = design_of(oracle.RWG), design_of(oracle.ABG)
BASE = Base()
BOTH, RISE, NEITHER = HeaveOptions(True, True), HeaveOptions(True, False), HeaveOptions(False, False)
LIMIT = np.radians(60.0)
LAWS = ("broms", "width_capped")
DEGREE = np.degrees(1.0)


def under(design: bk.Design, law: str) -> bk.Design:
    """Put a design under another law of the resistance, which is a factor on K_epsilon."""
    inputs = inputs_of(design)
    factor = lateral_coefficient(replace(inputs, resistance=law)) / lateral_coefficient(inputs)
    return design._replace(K_epsilon=design.K_epsilon * factor)


def some_designs(count: int, seed: int) -> list[bk.Design]:
    """Draw designs, one half under either law."""
    return [under(design, LAWS[n % 2]) for n, design in enumerate(random_designs(count, seed))]


class Motion(NamedTuple):
    """One impact: its outcome, its constants and the workspace as it was left."""

    outcome: HeaveOutcome
    f: HeaveConstants
    work: np.ndarray


def simulate(
    design: bk.Design,
    form: HeaveOptions,
    how: HeaveControl,
    base: Base = BASE,
    record: HeaveRecord | None = None,
    *,
    planar: dict[str, float] | None = None,
    **changes: float,
) -> Motion:
    """Simulate one impact, with some constants of the planar motion or of the other changed."""
    c = constants_of(design, bk.corrected(), 0)._replace(**(planar or {}))
    f = heave_constants(design, c, form, base, how.fineness)._replace(**changes)
    work = np.full(WORKSPACE, np.nan)
    prepare(work, f)
    return Motion(simulate_heave(f, design.m_v, how, work, record or no_heave_record()), f, work)


def empty_record(end: float, count: int) -> HeaveRecord:
    return HeaveRecord(np.linspace(0.0, end, count), np.full((count, 8), np.nan), np.full(count, np.nan))


def assert_as_the_oracle(
    design: bk.Design, law: str, form: HeaveOptions, horizon: float, tolerance: float = 1e-12
) -> None:
    """Hold an impact against the oracle: 1e-3 degrees, 1e-5 m and s."""
    inputs = replace(inputs_of(design), resistance=law)
    known = known_impact(inputs, heave=form.heave, friction=form.friction, horizon=horizon, limit=LIMIT)
    found, _, work = simulate(under(design, law), form, HeaveControl(LIMIT, horizon, tolerance, stop=False))
    stopped, *_ = simulate(under(design, law), form, HeaveControl(LIMIT, horizon, tolerance, stop=True))
    if np.isinf(known.t_limit):
        assert found.status == Status.HORIZON
        assert np.isnan(found.t_limit)
        assert found.theta_max * DEGREE == pytest.approx(known.theta_max * DEGREE, abs=1e-3)
        compared, sets = found, work[SETS : SETS + GROUP]
        assert sets == pytest.approx(known.sets, abs=1e-5)
    else:
        assert stopped.status == Status.LIMIT
        assert stopped.theta_max == LIMIT
        assert stopped.t_limit == found.t_limit == pytest.approx(known.t_limit, abs=1e-5)
        assert stopped.t_end == stopped.t_limit
        compared = stopped
    assert compared.x_b_max == pytest.approx(known.x_b_max, abs=1e-5)
    assert compared.y_b_max == pytest.approx(known.y_b_max, abs=1e-5)
    assert compared.x_v_max == pytest.approx(known.x_v_max, abs=1e-5)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("design", [RWG, ABG], ids=["RWG", "ABG"])
@pytest.mark.compiled
def test_crash_tests_are_those_of_the_oracle(design: bk.Design, law: str) -> None:
    assert_as_the_oracle(design, law, BOTH, 0.22)


@pytest.mark.compiled
@pytest.mark.parametrize("form", [RISE, HeaveOptions(False, True), NEITHER], ids=["heave", "friction", "neither"])
def test_other_forms_are_those_of_the_oracle(form: HeaveOptions) -> None:
    assert_as_the_oracle(RWG, "broms", form, 0.2)


@pytest.mark.compiled
@pytest.mark.parametrize("number", [0, *(pytest.param(one, marks=pytest.mark.nightly) for one in (1, 2))])
def test_random_impacts_are_those_of_the_oracle(number: int) -> None:
    assert_as_the_oracle(random_designs(3, seed=271)[number], LAWS[number % 2], BOTH, 0.2)


@pytest.mark.nightly
@pytest.mark.compiled
@pytest.mark.parametrize("number", range(40))
def test_many_random_impacts_are_those_of_the_oracle(number: int) -> None:
    forms = [BOTH, RISE, BOTH, HeaveOptions(False, True)]
    assert_as_the_oracle(random_designs(40, seed=272)[number], LAWS[number % 2], forms[number % 4], 0.6)


def test_the_beginning_of_an_impact_with_or_without_the_compiler() -> None:
    """Short, so that it can be had from plain Python too."""
    assert_as_the_oracle(RWG, "broms", BOTH, 0.01, tolerance=1e-7)


def energies(design: bk.Design, record: HeaveRecord) -> np.ndarray:
    """Energies that were recorded, as parts of the truck's."""
    written = record.energy[~np.isnan(record.energy)]
    assert written.size > 20
    return written / (0.5 * design.m_v * design.v_0**2)


@pytest.mark.compiled
def test_energy_stays_where_nothing_dissipates() -> None:
    """No drag, dashpot, friction or bearing capacity, and a truck that is a spring: to 1e-6 of the truck's energy."""
    for design in [RWG, ABG, *some_designs(8, seed=261)]:
        record = empty_record(0.3, 101)
        how = HeaveControl(1.2, 0.3, 1e-13)
        simulate(
            design,
            RISE,
            how,
            Base(wave_speed=0.0),
            record,
            planar={"R_soil": 1e-9, "tau_v": 0.0},
            q_foot=1e15,
        )
        found = energies(design, record)
        assert np.abs(found - found[0]).max() < 1e-6


@pytest.mark.compiled
@pytest.mark.parametrize("form", [BOTH, RISE, HeaveOptions(False, True)], ids=["both", "heave", "friction"])
def test_energy_only_falls_with_all_that_dissipates(form: HeaveOptions) -> None:
    for design in [RWG, ABG, *some_designs(8, seed=262)]:
        record = empty_record(0.6, 301)
        simulate(design, form, HeaveControl(1.2, 0.6, 1e-12), BASE, record)
        found = energies(design, record)
        assert np.diff(found).max() < 1e-6
        assert found[0] - found[-1] > 0.1


@pytest.mark.compiled
def test_what_is_pressed_in_stays() -> None:
    """The set of the base only grows, on the side that the boulder turns to; none where the base can carry anything."""
    found = 0
    for design in some_designs(12, seed=262):
        ends = [HeaveControl(1.2, end, 1e-12, stop=False) for end in np.linspace(0.03, 0.3, 10)]
        sets = np.array([simulate(design, RISE, how).work[SETS : SETS + GROUP] for how in ends])
        assert np.diff(sets, axis=0).min() > -1e-6  # the last steps of two ends are not the same
        assert sets[:, 0].max() == 0.0
        firm = simulate(design, RISE, ends[-1], q_foot=1e15)
        assert firm.work[SETS : SETS + GROUP].max() == 0.0
        found += sets.max() > 1e-3
    assert found >= 3


@pytest.mark.compiled
def test_what_is_pressed_in_does_not_depend_on_where_steps_end() -> None:
    """By the default tolerance to 0.03 mm on average; twenty times as far off where no step ends at the deepest."""
    gaps = []
    for design in some_designs(24, seed=262):
        exact, usual = (
            simulate(design, RISE, HeaveControl(1.2, 0.3, tolerance, stop=False)).work[SETS : SETS + GROUP]
            for tolerance in (1e-11, 1e-6)
        )
        if exact.max() > 1e-4:
            gaps.append(np.abs(usual - exact).max())
    assert len(gaps) >= 12
    assert np.mean(gaps) < 1e-5
    assert np.max(gaps) < 6e-5


def test_a_step_ends_where_a_strip_that_is_pressed_in_comes_back() -> None:
    """The step is cut at the greatest depth of the first strip, and the interpolant gives what is pressed in."""
    f = heave_constants(RWG, constants_of(RWG, bk.corrected(), 0), BOTH, BASE, 1)
    work, h = np.zeros(WORKSPACE), 4e-3
    prepare(work, f)
    still = Track(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    capacity = f.q_foot / f.k_foot
    for beyond, end in ((0.004, 0.4), (-0.004, 1.0)):
        # It sinks to its greatest depth at 0.4 of the step.
        start = f.s_0 - capacity - beyond
        sinking = Track(start, -0.8 * 1e-3, 1e-3, 0.0, 0.0, 0.0)
        q = Tracks(still, still, sinking, still)
        assert foot_rises(work, q, 1.0, h, f) == pytest.approx(end, abs=1e-6)
        assert foot_rises(work, q, 0.3, h, f) == 0.3
    assert foot_rises(work, Tracks(still, still, Track(np.nan, np.nan, 0, 0, 0, 0), still), 1.0, h, f) == 1.0


def test_pressing_in_by_hand() -> None:
    """What a strip is pressed in beyond q/k_b stays, once, and adds up (Eq 133)."""
    f = heave_constants(RWG, constants_of(RWG, bk.corrected(), 0), BOTH, BASE, 1)
    work = np.zeros(WORKSPACE)
    prepare(work, f)
    deepest = RWG.rho_s * G * RWG.d * np.exp(np.pi * np.tan(RWG.phi)) * np.tan(np.pi / 4 + RWG.phi / 2) ** 2 / 100e6
    settlement = f.m_b * G / (100e6 * RWG.L * RWG.W)
    for depth, known, pressed in (
        (0.9 * deepest, 0.0, False),
        (deepest + 0.01, 0.01, True),
        (deepest + 0.005, 0.01, False),
        (deepest + 0.03, 0.03, True),
    ):
        work[START + 2] = settlement - depth
        assert press_in(work, f) == pressed
        assert work[SETS : SETS + GROUP] == pytest.approx(np.full(GROUP, known), abs=1e-12)


@pytest.mark.compiled
def test_a_strip_pressed_beyond_its_capacity_takes_energy() -> None:
    """Nothing else dissipates: what goes is at least the capacity times the sets, and no more than by rounding."""
    found = 0
    for design in [ABG, *some_designs(8, seed=261)]:
        record = empty_record(0.2, 101)
        how = HeaveControl(1.2, 0.2, 1e-12)
        m = simulate(design, RISE, how, Base(wave_speed=0.0), record, planar={"R_soil": 1e-9, "tau_v": 0.0})
        energy = energies(design, record)
        pressed = m.work[SETS : SETS + GROUP] @ m.work[STRIP : STRIP + GROUP]
        taken = m.f.q_foot * pressed / (0.5 * design.m_v * design.v_0**2)
        if taken > 1e-4:
            found += 1
        assert energy[0] - energy[-1] == pytest.approx(taken, rel=0.02, abs=1e-5)
    assert found >= 2


@pytest.mark.compiled
@pytest.mark.parametrize("law", LAWS)
def test_without_rise_and_friction_on_a_stiff_base_it_is_the_planar_motion(law: str) -> None:
    """What is left is the rotation at which the base gives way; it shrinks with its stiffness."""
    how = HeaveControl(LIMIT, 0.35, 1e-9, FINEST, stop=False)
    for design in [RWG, ABG, *random_designs(6, seed=263)]:
        design = under(design, law)
        exact = control(2.5e-4, 0.35, LIMIT, 0)._replace(locate_yield=True)
        known = bk.simulate_design(design, bk.corrected(), exact, bk.no_record()).maxima
        for stiffness, degrees, metres in ((1e11, 0.03, 3e-3), (1e13, 3e-3, 2e-4)):
            found = simulate(design, NEITHER, how, Base(stiffness=stiffness)).outcome
            assert found.theta_max * DEGREE == pytest.approx(known.theta * DEGREE, abs=degrees)
            assert found.x_b_max == pytest.approx(known.x_b, abs=metres)
            assert found.x_v_max == pytest.approx(known.x_v, abs=metres)
            assert found.y_b_max == 0.0


@pytest.mark.compiled
@pytest.mark.parametrize("number", [0, 6, 7])
def test_on_a_stiff_base_it_turns_about_the_far_end_of_its_foot(number: int) -> None:
    """Up to where the truck comes off, for designs that stay on their base: by another integrator, with two axes."""
    design = under([RWG, ABG, *random_designs(6, seed=263)][number], "broms")
    record = empty_record(0.16, 81)
    how = HeaveControl(1.2, 0.16, 1e-9, stop=False)
    simulate(design, RISE, how, Base(stiffness=1e14, wave_speed=0.0), record, q_foot=1e18)
    known = rolling(Body(inputs_of(design), True, False, OracleBase()), record.times)
    assert len(known) > 30
    found = record.states[: len(known)]
    assert known[-1, 1] * DEGREE > 5.0
    assert found[:, 1] * DEGREE == pytest.approx(known[:, 1] * DEGREE, abs=0.01)
    assert found[:, 0] == pytest.approx(known[:, 0], abs=1e-4)
    assert found[:, 2] == pytest.approx(known[:, 2], abs=1e-4)


@pytest.mark.compiled
@pytest.mark.parametrize("degrees", [20.0, 60.0])
@pytest.mark.parametrize("form", [BOTH, RISE], ids=["both", "heave"])
def test_what_is_proved_to_stay_below_the_limit_does(form: HeaveOptions, degrees: float) -> None:
    """Simulated on for five seconds."""
    limit = np.radians(degrees)
    table = table_of(some_designs(600, seed=265))
    found = second_opinions(table, HeaveControl(limit, 3.0), form)
    proved = np.flatnonzero(found.status == Status.BELOW_LIMIT)
    later = second_opinions(some_rows(table, proved), HeaveControl(limit, 5.0, stop=False), form)
    assert proved.size > 40
    assert np.all(later.status == Status.HORIZON)
    assert np.all(later.theta_max < limit)
    assert np.mean(found.t_end[proved]) < 1.0
    assert np.all(later.theta_max >= found.theta_max[proved] - 1e-12)


@pytest.mark.compiled
def test_with_a_margin_what_turns_less_is_proved_to_stay_that_far_below() -> None:
    """And what comes nearer is proved to stay below the limit itself, as without a margin."""
    limit, margin = np.radians(20.0), np.radians(3.0)
    table = table_of(some_designs(600, seed=265))
    without = second_opinions(table, HeaveControl(limit, 3.0))
    found = second_opinions(table, HeaveControl(limit, 3.0, margin=margin))
    assert np.array_equal(found.status, without.status)
    proved = found.status == Status.BELOW_LIMIT
    nearer = proved & (found.theta_max >= limit - margin)
    assert nearer.sum() >= 3
    well_below = np.flatnonzero(proved & ~nearer)
    later = second_opinions(some_rows(table, well_below), HeaveControl(limit, 5.0, stop=False))
    assert well_below.size > 40
    assert np.all(later.theta_max < limit - margin)
    assert np.mean(found.t_end[well_below] > without.t_end[well_below]) > 0.1
    with pytest.raises(ValueError, match="fineness is 1 to 4"):
        second_opinions(table, HeaveControl(limit, 3.0, fineness=FINEST + 1))


def test_no_place_costs_less_than_the_least_energy() -> None:
    """At either limit, wherever it stands, for boulders deep and shallow; with strips that were pressed in (Eq 137)."""
    rng = np.random.default_rng(273)
    for design in [RWG, *some_designs(3, seed=274), *map(shallow, some_designs(4, seed=275))]:
        f = heave_constants(design, constants_of(design, bk.corrected(), 0), BOTH, BASE, 1)
        work = np.full(WORKSPACE, np.nan)
        prepare(work, f)
        work[SETS : SETS + GROUP] = np.where(rng.random(GROUP) < 0.2, rng.uniform(0.0, 0.05, GROUP), 0.0)
        for theta in (-LIMIT, np.radians(20.0)):
            least = least_energy(theta, work, f)
            cloud = np.column_stack((rng.uniform(-1.5, 1.5, 150), rng.uniform(-1.2, 1.2, 150)))
            values = np.array([potential_energy(x, theta, y, work, f).u for x, y in cloud])
            nearby = cloud[np.argmin(values)] + rng.normal(size=(100, 2)) * [0.1, 0.02]
            values = np.append(values, [potential_energy(x, theta, y, work, f).u for x, y in nearby])
            assert least - CAUTION * abs(least) <= values.min()
            assert least > values.min() - 0.5 * np.ptp(values)  # nor is it out of reach


@pytest.mark.compiled
def test_eased_is_where_a_step_either_way_costs_more() -> None:
    """Along either axis, from any place between the ends: to `PLACED` of the weight times the length."""
    rng = np.random.default_rng(279)
    for design in some_designs(6, seed=280):
        f = heave_constants(design, constants_of(design, bk.corrected(), 0), BOTH, BASE, 1)
        work = np.full(WORKSPACE, np.nan)
        prepare(work, f)
        enough = PLACED * f.m_b * G * design.L
        for theta in (np.radians(20.0), -np.radians(20.0)):
            at_top = f.c.l_n * (1.0 - np.cos(theta)) - f.c.z_0 * np.sin(theta)
            across = sorted((at_top, at_top + design.d * np.sin(theta)))
            for sideways, (low, high) in ((True, across), (False, (-1.0, 2.0))):
                start = Equilibrium(rng.uniform(*across), rng.uniform(-0.5, 0.5), np.inf)
                least = move_to_least_energy(start, sideways, low, high, PLACED, theta, work, f)
                assert (least.y == start.y) if sideways else (least.x == start.x)
                ends = np.linspace(low, high, 2001)
                tried = [(s, least.y) if sideways else (least.x, s) for s in ends]
                values = [potential_energy(x, theta, y, work, f).u for x, y in tried]
                assert least.energy == potential_energy(least.x, theta, least.y, work, f).u
                assert least.energy <= min(values) + enough


def test_the_proof_counts_all_energy_and_waits_for_the_truck() -> None:
    """It ends where boulder, soil, base and crush hold less than the least, and the truck no longer drives forward.

    A slow truck with a stiff damper, which gives back much: when it stops, the boulder alone already holds less.
    """
    limit = np.radians(20.0)
    design = under(RWG, "broms")._replace(v_0=8.0, c_v=1e7)
    outcome, f, work = simulate(design, BOTH, HeaveControl(limit, 1.0))
    assert outcome.status == Status.BELOW_LIMIT
    x, theta, _, x_v, *_, v_v = work[START : START + 8]
    assert v_v < 0.0
    sin, versin = np.sin(theta), 1.0 - np.cos(theta)
    u = spring_compression(x_v, v_v, contact_displacement(x, sin, versin, f.c), f.c)
    held, crush = energy_at(work, START, f), 0.5 * f.c.k_v * u**2
    least = min(least_energy(side * limit, work, f) for side in (-1.0, 1.0))
    assert crush > 0.1 * least
    assert held + crush < (1.0 - CAUTION) * least


def shallow(design: bk.Design) -> bk.Design:
    """Return a boulder embedded by a sixth of its height: turned, it sinks by more than its embedment."""
    return design._replace(d=design.H / 6, e=(min(design.H * 5 / 6, 1.4) + design.e_bumper) / 2)


@pytest.mark.compiled
def test_rotation_converges_with_the_tolerance() -> None:
    """By the default tolerance within 0.2 degrees, and no verdict depends on it."""
    table = table_of(some_designs(100, seed=264))
    exact = second_opinions(table, HeaveControl(1.0, 1.0, 1e-11))
    within = {2e-4: 0.2, 1e-5: 0.03, 1e-7: 0.003}
    mean = []
    for tolerance, degrees in within.items():
        found = second_opinions(table, HeaveControl(1.0, 1.0, tolerance))
        assert np.array_equal(found.status, exact.status)
        gaps = np.abs(found.theta_max - exact.theta_max) * DEGREE
        assert gaps.max() < degrees
        mean.append(gaps.mean())
    assert mean[0] > 3 * mean[1] > 9 * mean[2]
    assert HeaveControl(1.0, 1.0).tolerance == 2e-4


@pytest.mark.compiled
def test_a_row_is_the_same_alone_in_any_order_and_any_company() -> None:
    table = table_of(some_designs(60, seed=276))
    how = HeaveControl(LIMIT, 1.0)
    whole = np.array(second_opinions(table, how))
    order = np.random.default_rng(1).permutation(60)
    assert same_bits(np.array(second_opinions(some_rows(table, order), how)), np.ascontiguousarray(whole[:, order]))
    for row in (0, 31, 59):
        alone = np.array(second_opinions(some_rows(table, np.array([row])), how))
        assert same_bits(alone, np.ascontiguousarray(whole[:, [row]]))


@pytest.mark.compiled
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("change", [{"phi": np.nan}, {"rho_b": np.inf}, {"W": 0.0}, {"d": np.nan}, {"k_v": -1.0}])
def test_an_impossible_design_is_refused_and_leaves_the_others_alone(change: dict[str, float]) -> None:
    designs = some_designs(9, seed=277)
    how = HeaveControl(LIMIT, 1.0)
    known = np.array(second_opinions(table_of(designs), how))
    designs[4] = designs[4]._replace(**change)
    found = second_opinions(table_of(designs), how)
    assert found.status[4] == Status.INVALID
    assert np.isnan(np.array(found)[1:7, 4]).all()
    kept = np.arange(9) != 4
    assert same_bits(np.ascontiguousarray(np.array(found)[:, kept]), np.ascontiguousarray(known[:, kept]))


def test_a_boulder_that_the_base_cannot_carry_has_no_second_opinion() -> None:
    """At rest it would sink: there is no rest to begin from, and no least energy to prove anything by."""
    phi = RWG.phi
    N_q = np.exp(np.pi * np.tan(phi)) * np.tan(np.pi / 4 + phi / 2) ** 2
    bearable = RWG.rho_s * RWG.d * N_q / RWG.H  # density at which the weight is the bearing capacity
    how = HeaveControl(LIMIT, 1e-3)
    for factor, status in ((0.999, Status.HORIZON), (1.001, Status.INVALID)):
        table = table_of([RWG._replace(rho_b=factor * bearable)])
        assert second_opinions(table, how).status[0] == status
        assert second_opinions(table, how, HeaveOptions(False, True)).status[0] == Status.HORIZON


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("change", "statuses"),
    [
        ({"c_v": 1e-3}, {Status.STEP_BUDGET}),
        ({"rho_b": 1e-3}, {Status.LIMIT}),
        ({"k_v": 1e18}, {Status.UNSTABLE, Status.STEP_BUDGET}),
        ({"v_0": 0.0}, {Status.BELOW_LIMIT}),
        ({"v_0": 200.0}, {Status.LIMIT}),
        ({"m_v": 1e12}, {Status.LIMIT}),
        ({"L": 100.0}, {Status.BELOW_LIMIT}),
        ({"beta": 1e-6}, {Status.LIMIT}),
    ],
)
def test_extremes_end(change: dict[str, float], statuses: set[Status]) -> None:
    found = second_opinions(table_of([RWG._replace(**change)]), HeaveControl(LIMIT, 2.0))
    assert found.status[0] in statuses
    assert np.isnan(found.theta_max[0]) == (found.status[0] in (Status.STEP_BUDGET, Status.UNSTABLE))


@pytest.mark.compiled
def test_friction_holds_and_rise_loosens() -> None:
    """Either alone does what it is said to: with friction a boulder turns less, free to rise it turns further."""
    table, how = table_of(some_designs(60, seed=278)), HeaveControl(LIMIT, 0.4, stop=False)
    turned_by = {
        form: second_opinions(table, how, form).theta_max for form in (BOTH, RISE, HeaveOptions(False, True), NEITHER)
    }
    assert np.mean(turned_by[HeaveOptions(False, True)] < turned_by[NEITHER]) > 0.9
    assert np.mean(turned_by[BOTH] < turned_by[RISE]) > 0.9
