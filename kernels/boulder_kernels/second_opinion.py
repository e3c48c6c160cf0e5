"""Second opinions: an impact with friction and vertical motion, from first touch to a proved verdict.

Nothing jumps in this motion, but forces have kinks where the truck comes off, where a strip of the foot touches or
leaves, and where slip changes its direction. The embedded error of the method (`boulder_kernels.runge_kutta`) sets the
length of a step. A step also ends where the truck comes off or touches again, where the rotation reaches its limit, and
where a strip of the foot that is being pressed in comes back.

Once the truck no longer drives forward, the energy of boulder, soil, foot and crush can only fall. The motion ends as
soon as this energy is below the least potential energy at the limit of rotation, forward and back: the boulder then
never reaches the limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import align_stack, by_types, inlined, is_none, kernel, on_lines
from .design import Constants, Design, DesignTable, G, body_with, constants_of, corrected, design_in, is_computable
from .dormand_prince import displacement_at, slope_at, time_of_limit, turning_point
from .dynamics import BOX, empty_soil
from .heave import (
    ALONG_X,
    FAR,
    FINEST,
    LIFTING,
    NEAR,
    STRIP,
    TURNING,
    Base,
    HeaveConstants,
    HeaveOptions,
    bed_of,
    constants_on,
    heave_constants,
    inertia_at,
    lay_soil,
    parts_of_soil,
    prepare,
    reach_of,
    seated_sine,
    soil_element,
    strip_depth,
    summed,
)
from .numerics import ITERATIONS, field, put, sine_versine
from .outcomes import Status
from .pieces import ManyPieces, constants_in_soil, fill_pieces
from .runge_kutta import (
    AXES,
    RATES,
    STAGES,
    START,
    TRIAL,
    WORKSPACE,
    Tracks,
    compression_in,
    contact_change,
    first_rate,
    foot_rises,
    keep,
    press_in,
    step,
    track_of,
)
from .soil import TINY, soil_kinematics

READINGS = corrected()
"""The only readings that there are second opinions of."""
WHOLE, USUAL_BASE = HeaveOptions(heave=True, friction=True), Base()
"""The second opinion itself; other forms and bases are for comparison."""
FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 2e-4, 0.02, 1e-9
"""Lengths of steps [s]."""
MOST_ATTEMPTS = 50_000
CAUTION = 0.01
"""Share of the least energy by which the energy must be below it: the errors of integrator and search, and more."""
PLACED = 1e-4
"""How precisely it is found, as a share of the energy that lifts the boulder by its length."""
ROUGHLY = 1e-2
"""The same for the first turn along either axis."""


class HeaveControl(NamedTuple):
    """How an impact is simulated."""

    theta_limit: float
    """Limit of rotation [rad]."""
    longest: float
    """Longest simulated time [s]; a motion that is not proved to stay below the limit by then is not decided."""
    tolerance: float = 2e-4
    """Error of one step [m]: error of the velocities times its length, the rotation at `error_arm`."""
    fineness: int = 1
    """1 for 16 parts of the soil, strips of the foot and points of the sides, up to 4 for 256."""
    margin: float = 0.0
    """Distance that the motion provably keeps from the limit, unless it comes that near to it [rad]."""
    stop: bool = True
    """Whether the simulation ends at the limit, and where it is proved that it is not reached."""


class HeaveRecord(NamedTuple):
    """Where a simulation writes its time history; empty arrays for none."""

    times: np.ndarray
    """Times asked for [s], ascending, shape (n,)."""
    states: np.ndarray
    """Displacements and velocities of x_b, theta_b, y_b and x_v, shape (n, 8)."""
    energy: np.ndarray
    """Energy of truck, boulder, soil and base [J], shape (n,)."""


class HeaveOutcome(NamedTuple):
    """Result of one simulation; NaN where not computed."""

    status: int
    """LIMIT, BELOW_LIMIT, HORIZON, or why there is no result, see `Status`."""
    theta_max: float
    """Largest |theta_b| up to the end [rad]."""
    x_b_max: float
    """Largest displacement x_b [m]."""
    y_b_max: float
    """Largest rise of the common centre of mass [m]."""
    x_v_max: float
    """Largest displacement of the truck [m]."""
    t_limit: float
    """Time at which the rotation reached its limit [s]."""
    t_end: float
    """Simulated time at the end [s]."""
    attempts: float
    """Number of steps tried."""


def no_heave_record() -> HeaveRecord:
    """Return a record that keeps nothing."""
    return HeaveRecord(np.empty(0), np.empty((0, 2 * AXES)), np.empty(0))


@kernel
def kinetic_energy(v_b: float, theta_b: float, omega_b: float, w_b: float, f: HeaveConstants) -> float:
    """Kinetic energy of boulder and lumped soil [J] (Eq 131)."""
    sin, versin = sine_versine(theta_b)
    i = inertia_at(sin, 1.0 - versin, f)
    rise = f.heave * w_b
    turning = 0.5 * i.A * omega_b * omega_b - f.heave * f.m_b * i.X * omega_b * rise
    return 0.5 * f.c.m_eff * v_b * v_b + 0.5 * f.m_b * rise * rise + turning


class Potential(NamedTuple):
    """Potential energy of soil, base and weight (Eq 136), and how it changes along x_b and along y_b."""

    u: float
    """What is stored, and raised against the weight [J]."""
    Q_x: float
    Q_y: float
    """Minus its slopes [N]."""
    K_x: float
    K_y: float
    """Slopes of the forces of springs, which are most of its curvatures [N/m]."""


@kernel
def potential_energy(x_b: float, theta_b: float, y_b: float, work: np.ndarray, f: HeaveConstants) -> Potential:
    """Return the potential energy of soil, base and weight at a position (Eq 136).

    ``x_b, theta_b, y_b``: displacement and rise of the common centre of mass [m], rotation [rad]; ``work``: the
    workspace; where a strip is pressed beyond what it can bear, the work to press it there is counted.
    """
    sin, versin = sine_versine(theta_b)
    k = soil_kinematics(x_b, 0.0, 0.0, sin, versin, f.c)
    p = parts_of_soil(sin, k, f)
    for n in range(f.pieces):
        e = soil_element(n, y_b, 0.0, 0.0, sin, versin, k, p, work, f)
        depth = max(strip_depth(work, n, y_b, sin, versin, f), 0.0)
        elastic = min(f.k_foot * depth, f.q_foot)
        share = f.heave * field(work, STRIP, n)
        put(work, TURNING, n, e.energy + share * elastic * (depth - elastic * (0.5 / f.k_foot)))
        put(work, ALONG_X, n, e.spring)
        put(work, LIFTING, n, e.lift + share * elastic)
        put(work, FAR, n, e.stiffness)
        put(work, NEAR, n, share * f.k_foot if 0.0 < depth * f.k_foot < f.q_foot else 0.0)
    V, Q_x = summed(work, TURNING, f.pieces), summed(work, ALONG_X, f.pieces)
    Q_y, K_x, K_y = summed(work, LIFTING, f.pieces), summed(work, FAR, f.pieces), summed(work, NEAR, f.pieces)
    weight = f.m_b * G
    if f.heave > 0.0:
        V += weight * (y_b - f.a_b * sin - f.b_b * versin)
    else:
        seated = seated_sine(f)
        over, end = max(abs(sin) - seated, 0.0), 0.5 * f.foot + math.copysign(f.lean, sin)
        V += weight * (end * ((abs(sin) - over) ** 2 / (2.0 * seated) + over) - (f.b_b + f.c.c_y) * versin)
    return Potential(V, Q_x, Q_y - f.heave * weight, K_x, K_y)


@kernel
def energy_at(work: np.ndarray, at: int, f: HeaveConstants) -> float:
    """Energy of boulder, lumped soil, soil and base at a state [J]."""
    x, theta, y = field(work, at, 0), field(work, at, 1), field(work, at, 2)
    v, omega, w = field(work, at, 4), field(work, at, 5), field(work, at, 6)
    return kinetic_energy(v, theta, omega, w, f) + potential_energy(x, theta, y, work, f).u


@kernel
def crush_energy(u: float, c: Constants) -> float:
    """Energy in the vehicle's spring [J]."""
    return 0.5 * c.k_v * max(u, 0.0) ** 2


@kernel
def least_energy(theta: float, work: np.ndarray, f: HeaveConstants) -> float:
    """Least potential energy at a rotation, wherever the boulder stands [J] (Eq 137).

    Along x_b alone, and along y_b alone, the energy is convex: its least is where its slope is zero. The search goes
    along either in turn until a turn gains nothing. (As a face that widens upwards rises, depth and pressure of the
    soil both fall, and so their product is convex. As one that narrows rises, the pressure grows: it counts as sunk by
    as much as it can be, which is no more than the energy.) Along x_b the least is between the positions where the
    uppermost and the lowest soil are as they were, and further by what an inclined face moves the soil; along y_b
    between those where all strips carry what they can, which is more than the weight, and where the boulder is out of
    the soil. There may be several, of large rotations: the search starts from the middle, and from where the uppermost
    soil is as it was.
    """
    sin, versin = sine_versine(theta)
    upper = f.c.l_n * versin - f.c.z_0 * sin
    left, right = min(upper, upper + f.c.d * sin), max(upper, upper + f.c.d * sin)
    inclined, most = f.steepest * (f.L + f.c.d), f.q_foot / f.k_foot
    ends = left - inclined, right + inclined
    bottom, touch, top = 0.0, -np.inf, f.L + 3.0 * f.c.d + f.s_0
    f = HeaveConstants(*f[:-1], f.L * abs(sin) + most)
    for n in range(f.pieces):
        depth = strip_depth(work, n, 0.0, sin, versin, f)
        bottom, touch = min(bottom, depth - most), max(touch, depth)
    # Begin where the end of the foot, pressed in along a wedge, carries the weight.
    y = touch - min(most, math.sqrt(2.0 * f.m_b * G * f.foot * abs(sin) / f.k_foot))
    least = np.inf
    for x in (0.5 * (left + right), upper):
        position = Equilibrium(x, f.heave * y, np.inf)
        for turn in range(ITERATIONS):
            before, precision = position.energy, PLACED if turn > 0 else ROUGHLY
            if f.heave > 0.0:
                position = move_to_least_energy(position, False, bottom, top, precision, theta, work, f)
            position = move_to_least_energy(position, True, *ends, precision, theta, work, f)
            if before - position.energy <= PLACED * f.m_b * G * f.L:
                break
        y, least = position.y, min(least, position.energy)
    return least


class Barrier(NamedTuple):
    """Energy below which the boulder never turns as far as some angle."""

    energy: float
    """By what is known; infinite at first [J]."""
    ways: int
    """1 where it was looked for forwards, 2 also backwards; 0 where strips were pressed in since."""


@kernel
def barrier_at(theta: float, held: float, barrier: Barrier, work: np.ndarray, f: HeaveConstants) -> Barrier:
    """Return the barrier of an angle [rad], known as far as it takes to compare it with the energy that is held [J]."""
    energy, ways = barrier
    while held < energy and ways < 2:
        least = least_energy(theta if ways == 0 else -theta, work, f)
        least -= CAUTION * abs(least)
        energy, ways = least if ways == 0 else min(energy, least), ways + 1
    return Barrier(energy, ways)


class Equilibrium(NamedTuple):
    """Where the boulder stands at some rotation."""

    x: float
    """Displacement along X [m]."""
    y: float
    """Rise of the boulder [m]."""
    energy: float
    """Potential energy there [J]."""


@kernel
def move_to_least_energy(
    position: Equilibrium,
    sideways: bool,
    low: float,
    high: float,
    precision: float,
    theta: float,
    work: np.ndarray,
    f: HeaveConstants,
) -> Equilibrium:
    """Move along x_b, or else along y_b, between two ends that push inwards, to where the energy is least.

    Newton's steps, halved brackets where they lead out of the bracket; the precision is a share, see `PLACED`.
    """
    x, y, energy = position
    for _ in range(ITERATIONS):
        p = potential_energy(x, theta, y, work, f)
        push, stiffness, at = (p.Q_x, p.K_x, x) if sideways else (p.Q_y, p.K_y, y)
        energy = p.u
        # No position between the ends costs less by more than this, as the energy is convex.
        if abs(push) * (high - low) <= precision * f.m_b * G * f.L:
            break
        low, high = (at, high) if push > 0.0 else (low, at)
        at += push / max(stiffness, TINY)
        at = at if low < at < high else 0.5 * (low + high)
        x, y = (at, y) if sideways else (x, at)
    return Equilibrium(x, y, energy)


@inlined
def growth(tolerance: float, error: float) -> float:
    """Return the factor for the next step: the error of a step grows with the fourth power of its length."""
    return 0.9 * math.sqrt(math.sqrt(tolerance / error))


@kernel
def simulate_heave(
    f: HeaveConstants, m_v: float, control: HeaveControl, work: np.ndarray, record: HeaveRecord
) -> HeaveOutcome:
    """Simulate one impact with heave and friction.

    ``m_v``: mass of the truck [kg], for the energy that is recorded; ``control``: limit, horizon and tolerance;
    ``work``: workspace, shape (WORKSPACE,), of a design at rest: what `boulder_kernels.heave.prepare` has filled;
    ``record``: filled with the time history at the times it names.
    """
    align_stack()
    c = f.c
    for axis in range(2 * AXES):
        put(work, START, axis, 0.0)
    put(work, START, 7, c.v_0)
    t, h, touching = 0.0, FIRST_STEP, True
    u = first_rate(work, touching, f)
    theta_max = x_b_max = y_b_max = x_v_max = 0.0
    t_limit, barrier = np.nan, Barrier(np.inf, 0)
    proved_at = control.theta_limit - control.margin
    written, attempts = 0, 0
    status = Status.STEP_BUDGET.value
    while attempts < MOST_ATTEMPTS:
        attempts += 1
        h = min(h, control.longest - t)
        error, u_end = step(work, h, touching, f)
        if not error <= control.tolerance:
            if not h > SHORTEST_STEP:
                status = Status.UNSTABLE.value
                break
            h *= max(growth(control.tolerance, error), 0.2) if error < np.inf else 0.2
            continue
        q = Tracks(track_of(work, 0, h), track_of(work, 1, h), track_of(work, 2, h), track_of(work, 3, h))
        tau, changes = 1.0, False
        if u_end < 0.0 < u if touching else u_end > 0.0 >= u:
            tau, changes = contact_change(q, u, u_end, h, c), True
        if f.heave > 0.0:
            deepest = foot_rises(work, q, tau, h, f)
            tau, changes = deepest, changes and deepest == tau
        turned = turning_point(q.theta_b, tau)
        theta = abs(displacement_at(q.theta_b, turned))
        theta_end = abs(displacement_at(q.theta_b, tau))
        at_limit = max(theta, theta_end) >= control.theta_limit
        if at_limit and np.isnan(t_limit):
            until = time_of_limit(q.theta_b, control.theta_limit, turned if theta >= control.theta_limit else tau)
            t_limit = t + until * h
            tau = until if control.stop else tau
        theta_max = max(theta_max, max(theta, theta_end))
        x_b_max = max(x_b_max, displacement_at(q.x_b, turning_point(q.x_b, tau)))
        y_b_max = max(y_b_max, displacement_at(q.y_b, turning_point(q.y_b, tau)))
        x_v_max = max(x_v_max, displacement_at(q.x_v, turning_point(q.x_v, tau)))
        keep(work, q, tau, h)
        while written < record.times.size and record.times[written] <= t + tau * h:
            at = (record.times[written] - t) / h
            for axis in range(AXES):
                record.states[written, axis] = displacement_at(q[axis], at)
                record.states[written, AXES + axis] = slope_at(q[axis], at) / h
                put(work, TRIAL, axis, record.states[written, axis])
                put(work, TRIAL, AXES + axis, record.states[written, AXES + axis])
            stored = crush_energy(compression_in(q, at, h, c), c) if touching else 0.0
            record.energy[written] = energy_at(work, TRIAL, f) + stored + 0.5 * m_v * record.states[written, 7] ** 2
            written += 1
        t += tau * h
        if at_limit and control.stop:
            status, theta_max = Status.LIMIT.value, control.theta_limit
            break
        if press_in(work, f):
            # What is pressed in only lowers the least: it is looked for again where that may decide.
            barrier = Barrier(barrier.energy, 0)
        if changes:
            touching = not touching
            u = 0.0
        else:
            u = u_end
        if tau < 1.0:
            cut = first_rate(work, touching, f)
            u = u if changes else cut
        else:
            for axis in range(AXES):
                put(work, RATES, axis, field(work, RATES + AXES * (STAGES - 1), axis))
        h = min(h * min(growth(control.tolerance, max(error, 1e-30)), 4.0), LONGEST_STEP)
        if control.stop and field(work, START, 7) <= 0.0:
            held = energy_at(work, START, f) + (crush_energy(u, c) if touching else 0.0)
            if theta_max >= proved_at and proved_at < control.theta_limit:
                proved_at, barrier = control.theta_limit, Barrier(np.inf, 0)
            barrier = barrier_at(proved_at, held, barrier, work, f)
            if held < barrier.energy:
                status = Status.BELOW_LIMIT.value
                break
        if t >= control.longest:
            status = Status.HORIZON.value
            break
    if status in (Status.STEP_BUDGET.value, Status.UNSTABLE.value):
        return HeaveOutcome(status, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, float(attempts))
    return HeaveOutcome(status, theta_max, x_b_max, y_b_max, x_v_max, t_limit, t, float(attempts))


@kernel
def prepare_in_layers(
    design: Design,
    layers: np.ndarray,
    outline: np.ndarray,
    inclined: float | None,
    soil: ManyPieces,
    form: HeaveOptions,
    base: Base,
    fineness: int,
    work: np.ndarray,
) -> HeaveConstants:
    """Fill the workspace for a design in layers, shape (M, 6), with an outline, shape (P, 4); return its constants.

    The pieces are filled anew. None tells, by its type, that the boulder is a box, whose faces are upright.
    """
    lumped, body = fill_pieces(design, layers, outline, soil), body_with(design, outline)
    reach = reach_of(design, outline)
    c = constants_in_soil(design, READINGS, body, lumped, inclined)
    bed = bed_of(design, reach.L, lumped.mass, layers, form, base)
    f = constants_on(bed, body, reach, c, form, base, fineness)
    prepare(work, f)
    lay_soil(work, layers, outline, base, soil, f)
    return f


@kernel
def prepare_in_uniform_soil(
    design: Design, form: HeaveOptions, base: Base, fineness: int, work: np.ndarray
) -> HeaveConstants:
    """Fill the workspace for a box in uniform soil, and return its constants."""
    f = heave_constants(design, constants_of(design, READINGS, 0), form, base, fineness)
    prepare(work, f)
    return f


@by_types
def prepare_design(
    design: Any, row: Any, layers: Any, outlines: Any, soil: Any, form: Any, base: Any, fineness: Any, work: Any
) -> Callable[..., HeaveConstants]:
    """Return what fills the workspace for a design of a table; arguments: see `run_second_opinions`."""
    if is_none(layers):
        return lambda design, row, layers, outlines, soil, form, base, fineness, work: prepare_in_uniform_soil(
            design, form, base, fineness, work
        )
    if is_none(outlines):
        return lambda design, row, layers, outlines, soil, form, base, fineness, work: prepare_in_layers(
            design, layers[row], np.empty((0, 4)), None, soil, form, base, fineness, work
        )
    return lambda design, row, layers, outlines, soil, form, base, fineness, work: prepare_in_layers(
        design, layers[row], outlines[row], 1.0, soil, form, base, fineness, work
    )


@kernel
def run_second_opinions(
    designs: np.ndarray,
    layers: np.ndarray | None,
    outlines: np.ndarray | None,
    soil: ManyPieces | None,
    form: HeaveOptions,
    base: Base,
    control: HeaveControl,
    work: np.ndarray,
    record: HeaveRecord,
    out: np.ndarray,
) -> None:
    """Simulate designs one by one; see `second_opinions`.

    Layers, shape (n, M, 6), and the pieces that every design fills anew are None of boxes in uniform soils; outlines,
    shape (n, P, 4), of all boxes.
    """
    for row in range(designs.shape[1]):
        design = design_in(designs, row)
        outcome = HeaveOutcome(Status.INVALID.value, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, 0.0)
        f = prepare_design(design, row, layers, outlines, soil, form, base, control.fineness, work)
        # A boulder that the base cannot carry is not at rest at first, and no depth of it is the least energy.
        if is_computable(f.c) and (not form.heave or f.k_foot * f.s_0 < f.q_foot):
            outcome = simulate_heave(f, design.m_v, control, work, record)
        o = outcome
        out[0, row], out[1, row], out[2, row], out[3, row] = o.status, o.theta_max, o.x_b_max, o.y_b_max
        out[4, row], out[5, row], out[6, row], out[7, row] = o.x_v_max, o.t_limit, o.t_end, o.attempts


def second_opinions(
    table: Any,
    control: HeaveControl,
    form: HeaveOptions = WHOLE,
    base: Base = USUAL_BASE,
    record: HeaveRecord | None = None,
) -> HeaveOutcome:
    """Simulate every design of a table with heave and friction.

    Parameters
    ----------
    table
        `boulder_kernels.DesignTable` of n designs that the truck hits, or a `PiecewiseTable`.
    control
        Limit, horizon and tolerance.
    form
        What is added to the planar motion.
    base
        The ground under the foot.
    record
        Filled with the time history of the last design; none by default.

    Returns
    -------
    HeaveOutcome
        Arrays of shape (n,).
    """
    if not 1 <= control.fineness <= FINEST:
        raise ValueError(f"the fineness is 1 to {FINEST}, not {control.fineness}")
    layers: np.ndarray | None = getattr(table, "layers", None)
    outlines: np.ndarray = getattr(table, "outlines", BOX[None])
    points = outlines.shape[1]
    soil = None if layers is None else empty_soil(layers.shape[1], points, 0)
    designs = np.stack(table[: len(DesignTable._fields)])
    out = np.full((len(HeaveOutcome._fields), designs.shape[1]), np.nan)
    work, kept = on_lines(8 * WORKSPACE).view(np.float64), record or no_heave_record()
    run_second_opinions(designs, layers, outlines if points else None, soil, form, base, control, work, kept, out)
    return HeaveOutcome(out[0].astype(np.int8), *out[1:])
