"""Families of designs far from usual ones: true errors of the named accuracies, and how often estimates cover them."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Status, corrected, simulate_table
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.accuracy import STEPS, Steps
from docs.studies.coverage import (
    HORIZON_S,
    LIMIT,
    REFERENCE_STEP_S,
    ROUNDING_M,
    ROUNDING_RAD,
    grid_table,
    random_table,
)

DESIGNS = 20_000
"""Of each family."""
SEED = 7
"""Of the random numbers: not one of those by which `boulder_kernels.error_estimates` was chosen."""


def wild_families(count: int, seed: int) -> dict[str, DesignTable]:
    """Return nine families of designs, made of usual ones.

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

    return {
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


class Compared(NamedTuple):
    """One accuracy on the designs of a family."""

    standing: int
    """Designs that turn no further than the limit, by either solution."""
    largest_deg: float
    """Largest true error of the rotation of these."""
    rotation: float
    """Share of these whose estimated error of the rotation is no smaller than the true one."""
    displacement: float
    """The same of the displacements, over all designs that both solutions or neither stopped at the limit."""
    twice: float
    """Share of all designs that had a second solution by half the step."""
    wrong: int
    """Designs on the wrong side of the limit that are not undecided."""


def _solved(table: DesignTable, steps: Steps, *, estimate: bool, paired: bool = False) -> OutcomeTable:
    """Simulate a family."""
    control = Control(steps.step_s, HORIZON_S, LIMIT, 0, estimate, True, steps.locate_yield, paired=paired)
    return simulate_table(table, corrected(), control)


def _compared(found: OutcomeTable, known: OutcomeTable) -> Compared:
    """Compare estimated with true errors."""
    computed = np.isfinite(found.theta_max) & np.isfinite(known.theta_max)
    fell, falls = found.status == Status.LIMIT, known.status == Status.LIMIT
    standing, alike = computed & ~fell & ~falls, computed & (fell == falls)
    turned = np.abs(found.theta_max - known.theta_max)[standing]
    moved = np.maximum(np.abs(found.x_b_max - known.x_b_max), np.abs(found.x_v_max - known.x_v_max))[alike]
    unsure = ~fell & (LIMIT - found.theta_max < found.theta_error) | np.isinf(found.theta_error)
    return Compared(
        int(standing.sum()),
        math.degrees(float(turned.max(initial=0.0))),
        float(np.mean(turned <= found.theta_error[standing] + ROUNDING_RAD)),
        float(np.mean(moved <= found.x_error[alike] + ROUNDING_M)),
        float(np.mean(found.step < np.nanmax(found.step))),
        int((computed & (fell != falls) & ~unsure).sum()),
    )


def _measured(designs: DesignTable) -> dict[str, Compared]:
    """Compare the named accuracies, and two solutions of every design by the steps of ``balanced``."""
    known = _solved(designs, Steps(REFERENCE_STEP_S, locate_yield=True), estimate=False)
    found = {name: _compared(_solved(designs, steps, estimate=name != "fast"), known) for name, steps in STEPS.items()}
    return found | {"two": _compared(_solved(designs, STEPS["balanced"], estimate=True, paired=True), known)}


def _worst(families: list[Compared]) -> Compared:
    """Return the worst of each number, and how many designs stand and are wrong in all."""
    standing, largest, rotation, displacement, twice, wrong = zip(*families, strict=True)
    return Compared(sum(standing), max(largest), min(rotation), min(displacement), max(twice), sum(wrong))


def _degrees(angle: float) -> str:
    """Angle with one digit, or without decimals [deg]."""
    return f"{angle:.1g}" if angle < 1.0 else f"{angle:.0f}"


def _covered(one: Compared) -> str:
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
    usual = {"usual, random": random_table(count, seed + 1), "usual, M30 grid": grid_table(grid, count)}
    families = usual | wild_families(count, seed)
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(families, pool.map(_measured, families.values()), strict=True))
    wild = [by for family, by in found.items() if family not in usual]
    found["worst of nine"] = {name: _worst([by[name] for by in wild]) for name in (*STEPS, "two")}
    head = ("family", "designs that stand", *(f"`{name}` [°]" for name in STEPS), "by half the step")
    table = Table((*head, "covered [%]", "by two", "by `fast`", "by `fine`", "wrong verdicts"))
    for family, by in found.items():
        table.add(
            family,
            f"{by['balanced'].standing:,}",
            *(_degrees(by[name].largest_deg) for name in STEPS),
            f"{by['balanced'].twice:.1%}",
            *(_covered(by[name]) for name in ("balanced", "two", "fast", "fine")),
            ", ".join(str(by[name].wrong) for name in STEPS),
        )
    return table
