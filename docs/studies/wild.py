"""Families of designs far from usual ones: how large the true errors of the named accuracies get there."""

from __future__ import annotations

import math

import numpy as np

from boulder_kernels import Control, DesignTable, Status, corrected, simulate_table
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.accuracy import STEPS, Steps
from docs.studies.coverage import HORIZON_S, LIMIT, REFERENCE_STEP_S, ROUNDING_RAD, random_table

COUNTED = ("larger than estimated", "wrong verdicts")
DESIGNS = 4000
"""Of each family."""


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


def _solved(table: DesignTable, steps: Steps, *, estimate: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return status, rotation and its estimated error."""
    control = Control(steps.step_s, HORIZON_S, LIMIT, 0, estimate, True, steps.locate_yield)
    out = simulate_table(table, corrected(), control)
    return out.status, out.theta_max, out.theta_error


def wild_table(count: int = DESIGNS, seed: int = 1) -> Table:
    """Return the largest true error of the rotation by each named accuracy, of every family and of the worst."""
    table = Table(("family", "designs that stand", *(f"`{name}` [°]" for name in STEPS), *COUNTED))
    worst = dict.fromkeys(STEPS, 0.0)
    stand = wrong = missed = 0
    for family, designs in wild_families(count, seed).items():
        status, theta, _ = _solved(designs, Steps(REFERENCE_STEP_S, locate_yield=True), estimate=False)
        falls = status == Status.LIMIT
        standing, largest, flips, beyond = 0, {}, 0, 0
        for name, steps in STEPS.items():
            found, turned, error = _solved(designs, steps, estimate=name != "fast")
            fell = found == Status.LIMIT
            both = np.isfinite(theta) & np.isfinite(turned) & ~fell & ~falls
            standing = int(both.sum())
            off = np.abs(theta - turned)[both]
            largest[name] = math.degrees(float(off.max(initial=0.0)))
            beyond += int((off > error[both] + ROUNDING_RAD).sum())  # `fast` has no estimate
            worst[name] = max(worst[name], largest[name])
            unsure = ~fell & (LIMIT - turned < np.nan_to_num(error)) | np.isinf(error)
            flips += int((np.isfinite(turned) & np.isfinite(theta) & (fell != falls) & ~unsure).sum())
        stand, wrong, missed = stand + standing, wrong + flips, missed + beyond
        table.add(family, str(standing), *(f"{value:.1g}" for value in largest.values()), str(beyond), str(flips))
    table.add("worst of nine", str(stand), *(f"{value:.1g}" for value in worst.values()), str(missed), str(wrong))
    return table
