"""What locating the events of second opinions gives and costs: ``python -m benchmarks.located``; takes two minutes.

The kernel cuts its steps where the truck comes off or touches again, where the limit is reached, and where a strip of
the foot that is being pressed in comes back. Here other events are located in the same way: where the foot lifts its
first strip or its last, where each strip touches or leaves, where each reaches its bearing capacity, and where the slip
of either face or of the foot turns. Each is compared, at the tolerance of the kernel, with the kernel's solution at a
tolerance of 1e-12: passes of M30 and random passes (`docs.studies.forms`), under `width_capped`, for 0.6 s.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boulder_kernels import DesignTable
from boulder_kernels._jit import inlined, kernel
from boulder_kernels.design import constants_of, design_in
from boulder_kernels.dormand_prince import STAGES, displacement_at, slope_at, turning_point
from boulder_kernels.heave import FOOT, PIECES, HeaveConstants, heave_constants, prepare, strip_depth
from boulder_kernels.heave_steps import (
    AXES,
    RATES,
    START,
    WORKSPACE,
    Tracks,
    attempt,
    contact_change,
    keep,
    press_in,
    track_of,
    write_rate,
)
from boulder_kernels.numerics import ITERATIONS, Bracket, field, narrowed, next_guess, put, sine_versine
from boulder_kernels.second_opinion import (
    FIRST_STEP,
    LONGEST_STEP,
    MOST_ATTEMPTS,
    READINGS,
    SHORTEST_STEP,
    USUAL_BASE,
    WHOLE,
    HeaveControl,
    second_opinions,
)
from boulder_kernels.table import some_rows
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.judged import PASS
from boulder_sweep.soils import with_law
from docs.studies.forms import SPEEDS, drawn_of_grid, grid_evaluation, random_designs

GRID = Path("configs/m30_sizing.yaml")
COUNT = 500
"""Passes simulated of either kind."""
DRAWN = 5000
"""Random designs of which these are passes."""
WATCHED_S, LIMIT_DEG, FALLEN_DEG = 0.6, 57.0, 45.0
"""How long an impact is watched, the limit of rotation, and the rotation from which a design has fallen and counts no
more: small differences grow there."""
TOLERANCE, EXACT = HeaveControl(1.0, 1.0).tolerance, 1e-12
SEATED, TOUCHES, CAPACITIES, TURNS_BACK, SLIPS = 0, 2, 2 + PIECES, 2 + 2 * PIECES, 2 + 3 * PIECES
"""First events of each kind, see `KINDS`."""
EVENTS = SLIPS + 3
RANGES = ((SEATED, TOUCHES), (TOUCHES, CAPACITIES), (CAPACITIES, TURNS_BACK), (TURNS_BACK, SLIPS), (SLIPS, EVENTS))
"""Events of each kind."""
KINDS = (
    "the foot lifts its first or last strip",
    "each strip touches or leaves",
    "each strip reaches its capacity",
    "a strip that is pressed in comes back",
    "the slip of a face or of the foot turns",
)


class Moment(NamedTuple):
    """What the events of foot and slip depend on."""

    y: float
    """Rise [m]."""
    sin: float
    versin: float
    v: float
    omega: float
    w: float
    """Velocities of x_b, theta_b and y_b, per s."""


@inlined
def moment_in(q: Tracks, tau: float, h: float) -> Moment:
    """Rise, rotation and velocities at the fraction tau of a step."""
    sin, versin = sine_versine(displacement_at(q.theta_b, tau))
    v, omega, w = slope_at(q.x_b, tau) / h, slope_at(q.theta_b, tau) / h, slope_at(q.y_b, tau) / h
    return Moment(displacement_at(q.y_b, tau), sin, versin, v, omega, w)


@kernel
def event_value(n: int, m: Moment, work: np.ndarray, f: HeaveConstants) -> float:
    """Value of event n, which changes its sign where the event happens [m or m/s]."""
    cos = 1.0 - m.versin
    if n < TOUCHES:
        low, high = np.inf, -np.inf
        for j in range(PIECES):
            depth = strip_depth(work, j, m.y, m.sin, m.versin, f)
            low, high = min(low, depth), max(high, depth)
        return low if n == SEATED else high
    if n < CAPACITIES:
        return strip_depth(work, n - TOUCHES, m.y, m.sin, m.versin, f)
    if n < TURNS_BACK:
        return strip_depth(work, n - CAPACITIES, m.y, m.sin, m.versin, f) - f.q_strip / f.k_strip
    if n < SLIPS:
        a = field(work, FOOT, n - TURNS_BACK)
        return m.omega * (a * cos - f.c.c_y * m.sin) - m.w
    if n == SLIPS + 2:
        return m.v - m.omega * f.c.c_y * cos
    edge = f.c.l_n if n == SLIPS else f.c.l_n - f.L
    return m.v * m.sin + m.w * cos - m.omega * edge


@kernel
def first_event(
    work: np.ndarray, flags: np.ndarray, q: Tracks, tau_end: float, h: float, located: int, f: HeaveConstants
) -> float:
    """Return the fraction of a step at which the first located event happens; tau_end if none does.

    An event happens once per change of its flag, and a flag changes with or without a cut: nothing is located twice.
    """
    tau, first = tau_end, -1
    end, start = moment_in(q, tau_end, h), moment_in(q, 0.0, h)
    for kind in range(len(RANGES)):
        if (located >> kind) & 1:
            for n in range(RANGES[kind][0], RANGES[kind][1]):
                above = event_value(n, end, work, f)
                flag = 1.0 if above > 0.0 else 0.0
                if flag == flags[n]:
                    continue
                b = Bracket(0.0, event_value(n, start, work, f), tau_end, above, 0.0)
                at = 0.0
                if b.f_low * above < 0.0:
                    for _ in range(ITERATIONS):
                        at = next_guess(b)
                        there = event_value(n, moment_in(q, at, h), work, f)
                        if abs(there) < 1e-12 or b.high - b.low < 1e-12:
                            break
                        b = narrowed(b, at, there)
                    if TURNS_BACK <= n < SLIPS:
                        m = moment_in(q, at, h)
                        over = strip_depth(work, n - TURNS_BACK, m.y, m.sin, m.versin, f) - f.q_strip / f.k_strip
                        at = at if over > 0.0 else 0.0
                if at <= 0.0:
                    flags[n] = flag
                elif at < tau:
                    tau, first = at, n
    if first >= 0:
        flags[first] = 1.0 - flags[first]
    return tau


@kernel
def simulate_located(
    f: HeaveConstants, control: HeaveControl, located: int, work: np.ndarray, flags: np.ndarray
) -> tuple[float, float, float]:
    """Simulate one impact to the end of its time as `boulder_kernels.second_opinion` does, with other events located.

    Parameters
    ----------
    f, control, work
        As of `boulder_kernels.second_opinion.simulate_heave`.
    located
        One bit for each of `KINDS`.
    flags
        Room for one number per event: whether its value was above zero, shape (EVENTS,).

    Returns
    -------
    tuple of float
        Largest rotation [rad], largest rise [m], and steps tried.
    """
    prepare(work, f)
    for axis in range(2 * AXES):
        put(work, START, axis, 0.0)
    put(work, START, 7, f.c.v_0)
    for n in range(EVENTS):
        flags[n] = 1.0 if n < CAPACITIES else 0.0
    t, h, touching = 0.0, FIRST_STEP, True
    u = write_rate(work, START, 0, touching, f)
    theta_max = y_max = 0.0
    attempts = 0
    while attempts < MOST_ATTEMPTS and t < control.longest:
        attempts += 1
        h = min(h, control.longest - t)
        error, u_end = attempt(work, h, touching, f)
        if not error <= control.tolerance:
            if not h > SHORTEST_STEP:
                break
            h *= max(0.9 * (control.tolerance / error) ** 0.2, 0.2) if error < np.inf else 0.2
            continue
        q = Tracks(track_of(work, 0, h), track_of(work, 1, h), track_of(work, 2, h), track_of(work, 3, h))
        tau, changes = 1.0, False
        if u_end < 0.0 < u if touching else u_end > 0.0 >= u:
            tau, changes = contact_change(q, u, u_end, h, f.c), True
        until = first_event(work, flags, q, tau, h, located, f)
        tau, changes = until, changes and until == tau
        theta_max = max(theta_max, abs(displacement_at(q.theta_b, turning_point(q.theta_b, tau))))
        theta_max = max(theta_max, abs(displacement_at(q.theta_b, tau)))
        y_max = max(y_max, displacement_at(q.y_b, turning_point(q.y_b, tau)))
        keep(work, q, tau, h)
        t += tau * h
        press_in(work, f)
        touching = touching != changes
        u = u_end
        if tau < 1.0:
            u = write_rate(work, START, 0, touching, f)
            u = 0.0 if changes else u
        else:
            for axis in range(AXES):
                put(work, RATES, axis, field(work, RATES + AXES * (STAGES - 1), axis))
        h = min(h * min(0.9 * (control.tolerance / max(error, 1e-30)) ** 0.2, 4.0), LONGEST_STEP)
    return theta_max, y_max, float(attempts)


class Found(NamedTuple):
    """Largest rotations [deg] and rises [mm] of n designs, and steps tried."""

    rotation: np.ndarray
    rise: np.ndarray
    attempts: np.ndarray


def located(table: DesignTable, kinds: int, tolerance: float = TOLERANCE) -> Found:
    """Simulate n designs with events located, one bit of `kinds` for each of `KINDS`."""
    control = HeaveControl(np.radians(LIMIT_DEG), WATCHED_S, tolerance, False)
    work, flags, designs = np.empty(WORKSPACE), np.empty(EVENTS), np.stack(table)
    rows: list[Any] = []
    for row in range(designs.shape[1]):
        design = design_in(designs, row)
        f = heave_constants(design, constants_of(design, READINGS, 0), WHOLE, USUAL_BASE)
        rows.append(simulate_located(f, control, kinds, work, flags))
    rotation, rise, attempts = np.array(rows).T
    return Found(np.degrees(rotation), 1e3 * rise, attempts)


def of_the_kernel(table: DesignTable, tolerance: float) -> Found:
    """Simulate n designs by the kernel."""
    outcome = second_opinions(table, HeaveControl(np.radians(LIMIT_DEG), WATCHED_S, tolerance, False))
    rotation, rise, attempts = map(np.asarray, (outcome.theta_max, outcome.y_b_max, outcome.attempts))
    return Found(np.degrees(rotation), 1e3 * rise, attempts)


def passes(count: int = COUNT) -> dict[str, DesignTable]:
    """Return passes of M30 and random passes, under `width_capped`."""
    grid = drawn_of_grid(GRID, SPEEDS["M30"])[0]
    drawn = random_designs(DRAWN)
    usual = drawn.rows(np.flatnonzero(grid_evaluation(GRID).judged(drawn).verdict == PASS))
    some = np.arange(count)
    return {
        name: with_law(some_rows(designs.table, some), "width_capped")
        for name, designs in (("M30", grid), ("usual boulders and soils", usual))
    }


def table_of(designs: DesignTable) -> Table:
    """Return attempts and errors by what is located, and by the tolerance without any of it."""
    exact = of_the_kernel(designs, EXACT)
    there = exact.rotation < FALLEN_DEG
    table = Table(
        (
            "located",
            "tolerance [m]",
            "steps tried",
            *("rotation: mean error [1e-3 °]", "largest"),
            *("rise: mean error [µm]", "largest"),
        )
    )

    def add(words: str, tolerance: float, found: Found) -> None:
        rotation, rise = np.abs(found.rotation - exact.rotation)[there], 1e3 * np.abs(found.rise - exact.rise)[there]
        figures = (1e3 * rotation.mean(), 1e3 * rotation.max(), rise.mean(), rise.max())
        table.add(words, f"{tolerance:g}", f"{found.attempts.mean():.0f}", *(f"{figure:.2g}" for figure in figures))

    add("none of these", TOLERANCE, located(designs, 0))
    for place, words in enumerate(KINDS):
        add(words, TOLERANCE, located(designs, 1 << place))
    add("all", TOLERANCE, located(designs, (1 << len(KINDS)) - 1))
    add("none of these", 0.1 * TOLERANCE, located(designs, 0, 0.1 * TOLERANCE))
    add("the kernel", TOLERANCE, of_the_kernel(designs, TOLERANCE))
    return table


def main() -> None:
    """Print the table of either kind of designs."""
    for name, designs in passes().items():
        print(f"{len(designs.L)} passes: {name}")
        print(table_of(designs).markdown())


if __name__ == "__main__":
    main()
