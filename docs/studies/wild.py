"""Families of designs far from usual ones: true errors of the named accuracies, and how often estimates cover them."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings, Status, corrected, simulate_table
from boulder_kernels.control import EVENT_TOLERANCE
from boulder_kernels.table import some_rows
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.designs import impact_height_of_face
from boulder_sweep.judge.accuracy import LONGEST_HORIZON, STEPS, Steps, accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import Designs, sampled_designs
from boulder_sweep.settings import load
from docs.studies.random_designs import random_table

LIMIT = math.radians(20.0)
HORIZON_S = 1.0
REFERENCE_STEP_S = 5e-5
ROUNDING_RAD, ROUNDING_M = 1e-11, 1e-11
"""Errors below these are rounding, of the reference as well."""
DESIGNS = 20_000
"""Designs of each family."""
SEED = 7
"""Of the random numbers: not one of those by which `boulder_kernels.outcomes` was chosen."""
HOOD_M = 1.45
"""Height of the hood that strikes wide and flat boulders [m]."""
FIRST_STEP_S = 0.004
"""Step that tells which designs are late [s]."""
BED_OFFSETS_M = (0.3, 3.0)
"""Least and largest distance from the bumper to the cargo bed of vehicles that strike late designs [m]."""
SAME_END_S = 0.02
"""Late solutions are compared if their ends differ by less: largest values up to another time are others [s]."""


def wild_families(count: int, seed: int) -> dict[str, DesignTable]:
    """Return twelve families of designs, made of usual ones.

    The truck strikes wide and flat boulders as high as its own height and theirs allow.

    Parameters
    ----------
    count
        Designs of each family.
    seed
        Of the random numbers.
    """
    usual = random_table(count, seed)
    rng = np.random.default_rng(seed)

    def even(low: float, high: float) -> np.ndarray:
        return rng.uniform(low, high, count)

    def by_logarithm(low: float, high: float) -> np.ndarray:
        return np.exp(rng.uniform(math.log(low), math.log(high), count))

    families = {
        "slender boulder": usual._replace(L=even(0.1, 0.5)),
        "light boulder": usual._replace(rho_b=by_logarithm(100.0, 1500.0), v_0=even(3.0, 15.0)),
        "hardly buried": usual._replace(d=even(0.02, 0.3) * usual.d, v_0=even(1.0, 6.0)),
        "soft soil": usual._replace(beta=by_logarithm(0.02, 2.0)),
        "stiff soil": usual._replace(beta=by_logarithm(110.0, 5000.0)),
        "soft vehicle": usual._replace(k_v=even(0.02, 0.2) * usual.k_v, c_v=even(0.2, 1.0) * usual.c_v),
        "stiff vehicle": usual._replace(k_v=even(5.0, 50.0) * usual.k_v, c_v=even(1.0, 20.0) * usual.c_v),
        "light, fast vehicle": usual._replace(m_v=even(300.0, 2000.0), v_0=even(25.0, 60.0)),
        "heavy, slow vehicle": usual._replace(m_v=even(15e3, 60e3), v_0=even(1.0, 8.0)),
    }
    height = even(0.9, 2.5)
    flat = usual._replace(L=even(1.5, 4.0), W=even(1.5, 6.0), H=height, d=even(0.1, 0.6) * height, v_0=even(2.0, 24.0))
    bumper = np.minimum(flat.e_bumper, 0.9 * (flat.H - flat.d))
    struck = impact_height_of_face(flat.H, flat.d, bumper, HOOD_M)
    return families | {
        "wide, flat boulder": flat._replace(e=struck, e_bumper=bumper),
        "heavy, slow, any spring": usual._replace(
            m_v=by_logarithm(1e4, 1e5), v_0=even(0.5, 8.0), k_v=by_logarithm(1e5, 8e6)
        ),
        "softest vehicle": usual._replace(k_v=by_logarithm(2e4, 1e6), c_v=by_logarithm(2e3, 4e5)),
    }


def late_designs(count: int, seed: int) -> Designs:
    """Return those designs of all families whose motion goes on past the horizon.

    Parameters
    ----------
    count
        Designs of all families together, before the others are left out.
    seed
        Of the random numbers.
    """
    families = wild_families(-(-count // 12), seed)
    table = DesignTable(*(np.concatenate(column) for column in zip(*families.values(), strict=True)))
    first = solved(table, Steps(FIRST_STEP_S), estimate=False, late=True)
    late = np.flatnonzero(first.t_end > HORIZON_S)
    offset = np.random.default_rng(seed).uniform(*BED_OFFSETS_M, len(late))
    return Designs(some_rows(table, late), offset)


class FamilyScore(NamedTuple):
    """One accuracy on the designs of a family."""

    standing: int
    """Designs that turn no further than the limit, by either solution."""
    largest_deg: float
    """Largest true error of the rotation of these."""
    largest_m: float
    """Largest true error of the displacements of all that both solutions or neither stopped, and that are decided."""
    rotation: float
    """Share of these whose estimated error of the rotation is no smaller than the true one."""
    displacement: float
    """Share whose estimated error of the displacements is no smaller than the true one, of all designs that both
    solutions or neither stopped at the limit."""
    wrong: int
    """Designs on the wrong side of the limit that are not undecided."""


def solved(
    table: DesignTable,
    steps: Steps,
    readings: Readings | None = None,
    *,
    estimate: bool,
    paired: bool = False,
    late: bool = False,
) -> OutcomeTable:
    """Simulate a family; `late` as a table does it that goes on past the horizon, and locates events as finely."""
    control = Control(steps.step_s, HORIZON_S, LIMIT, 0, estimate, True, steps.locate_yield, paired=paired)
    if late:
        control = control._replace(longest_horizon=LONGEST_HORIZON * HORIZON_S, event_tolerance=EVENT_TOLERANCE)
    return simulate_table(table, readings or corrected(), control)


def reference(table: DesignTable, readings: Readings | None = None) -> OutcomeTable:
    """Return the solution by very short steps, which also locate the yield of the soil; its errors are rounding."""
    known = solved(table, Steps(REFERENCE_STEP_S, locate_yield=True), readings, estimate=False)
    known.theta_error[:], known.x_error[:] = ROUNDING_RAD, ROUNDING_M
    return known


def compared(found: OutcomeTable, known: OutcomeTable) -> FamilyScore:
    """Compare estimated with true errors, which are known to within the errors of `known`."""
    computed = np.isfinite(found.theta_max) & np.isfinite(known.theta_max)
    fell, falls = found.status == Status.LIMIT, known.status == Status.LIMIT
    standing, alike = computed & ~fell & ~falls, computed & (fell == falls)
    turned = np.abs(found.theta_max - known.theta_max)
    moved = np.maximum(np.abs(found.x_b_max - known.x_b_max), np.abs(found.x_v_max - known.x_v_max))
    unsure = ~fell & (LIMIT - found.theta_max < found.theta_error) | np.isinf(found.theta_error)
    return FamilyScore(
        int(standing.sum()),
        math.degrees(float(turned[standing].max(initial=0.0))),
        float(moved[alike & ~unsure].max(initial=0.0)),
        float(np.mean((turned <= found.theta_error + known.theta_error)[standing])),
        float(np.mean((moved <= found.x_error + known.x_error)[alike])),
        int((computed & (fell != falls) & ~unsure).sum()),
    )


def _measured(designs: DesignTable) -> dict[str, FamilyScore]:
    """Compare the named accuracies."""
    known = reference(designs)
    return {name: compared(solved(designs, steps, estimate=name != "fast"), known) for name, steps in STEPS.items()}


def _known_late(designs: Designs) -> OutcomeTable:
    """Solve late designs by two short steps; what they differ by is the error, and where one falls nothing is known."""
    other, known = (
        solved(designs.table, Steps(factor * REFERENCE_STEP_S, locate_yield=True), estimate=False, late=True)
        for factor in (2.0, 1.0)
    )
    known.theta_max[(known.status == Status.LIMIT) != (other.status == Status.LIMIT)] = np.nan
    moved = np.maximum(np.abs(known.x_b_max - other.x_b_max), np.abs(known.x_v_max - other.x_v_max))
    known.theta_error[:] = ROUNDING_RAD + np.abs(known.theta_max - other.theta_max)
    known.x_error[:] = ROUNDING_M + moved
    return known


def _judged_late(designs: Designs, grid: Path, accuracy: str) -> OutcomeTable:
    """Return what a table says of late designs; an error is infinite where it is not known."""
    sweep = load(grid, [f"solver.accuracy={accuracy}"])
    rows = evaluation_of(sweep, accuracy_of(sweep)).judged(designs)
    overturns = rows["reason"] == rows.words["reason"].index("overturns")
    theta = np.radians(rows["rotation_error_deg"])
    return OutcomeTable(
        np.where(overturns, Status.LIMIT, Status.SETTLED).astype(np.int8),
        np.radians(rows["max_rotation_deg"]),
        rows["max_displacement_m"],
        rows["max_vehicle_displacement_m"],
        rows["peak_force_kN"],
        rows["vehicle_crush_m"],
        rows["time_to_limit_s"],
        rows["end_time_s"],
        np.where(np.isnan(theta), np.where(overturns, 0.0, np.inf), theta),
        np.nan_to_num(rows["displacement_error_m"], nan=np.inf),
        rows["step_s"],
    )


def _measured_late(designs: Designs, grid: Path) -> dict[str, FamilyScore]:
    """Compare what tables of the named accuracies say of late designs. Both end by proof, not always at one time."""
    known = _known_late(designs)
    found = {}
    for name in [name for name in STEPS if name != "fast"]:  # which leaves them undecided
        out = _judged_late(designs, grid, name)
        together = np.abs(out.t_end - known.t_end) < SAME_END_S
        found[name] = compared(some_rows(out, together), some_rows(known, together))
    return found


def _worst(families: list[FamilyScore]) -> FamilyScore:
    """Return the worst of each number, and how many designs stand and are wrong in all."""
    standing, largest, largest_m, rotation, displacement, wrong = zip(*families, strict=True)
    return FamilyScore(sum(standing), max(largest), max(largest_m), min(rotation), min(displacement), sum(wrong))


def _degrees(angle: float) -> str:
    """Angle with one digit, or without decimals [deg]."""
    return f"{angle:.1g}" if angle < 1.0 else f"{angle:.0f}"


def _covered(one: FamilyScore) -> str:
    """Shares covered of rotation and displacement, in per cent."""
    return f"{100.0 * one.rotation:.2f}, {100.0 * one.displacement:.2f}"


def wild_table(grid: Path, count: int = DESIGNS, seed: int = SEED) -> Table:
    """Return errors and coverage of usual designs, of every family, and of the worst of the families.

    Parameters
    ----------
    grid
        File of a grid of usual designs.
    count
        Designs of each family, and about as many of the grid.
    seed
        Of the random numbers.
    """
    of_grid = sampled_designs(load(grid), count).table
    usual = {"usual, random": random_table(count, seed + 1), "usual, M30 grid": of_grid}
    families = usual | wild_families(count, seed)
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(families, pool.map(_measured, families.values()), strict=True))
    found["late, of all these"] = _measured_late(late_designs(count, seed), grid)
    wild = [by for family, by in found.items() if family not in usual]
    found["worst of thirteen"] = {name: _worst([by[name] for by in wild if name in by]) for name in STEPS}
    head = ("family", "designs that stand", *(f"`{name}` [°]" for name in STEPS))
    table = Table((*head, "covered [%]", "wrong verdicts"))
    for family, by in found.items():
        table.add(
            family,
            f"{by['balanced'].standing:,}",
            *(_degrees(by[name].largest_deg) if name in by else "" for name in STEPS),
            _covered(by["balanced"]),
            ", ".join(str(by[name].wrong) if name in by else "-" for name in STEPS),
        )
    return table
