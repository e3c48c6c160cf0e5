"""Both springs of a front that stiffens, from a rigid-wall crash pulse (Eq 111).

Beside the unknowns of one spring, the ratio of the second spring to the first and the crush from which it acts. Two
more unknowns always fit a little better, so they are believed only if the gain is more than noise explains: by the
Bayesian information criterion, counting correlated residuals as fewer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_sweep.crash_tests.fitting.cautions import UNSURE, warnings_of
from boulder_sweep.crash_tests.fitting.fit import fit_pulse, misfit_of, rms
from boulder_sweep.crash_tests.fitting.problem import Problem
from boulder_sweep.crash_tests.fitting.pulse import Pulse
from boulder_sweep.crash_tests.fitting.result import SignalMisfit, VehicleFit
from boulder_sweep.crash_tests.stiffening_wall import StiffeningWall
from boulder_sweep.errors import FitError

RATIOS = (1.0, 1e3)
"""Range of the second spring over the first that is searched."""
SHARES = (0.02, 0.98)
"""Range of the crush from which it acts, as a share of the largest crush by one spring."""
STARTS = tuple((ratio, share) for ratio in (1.5, 4.0) for share in (0.25, 0.5, 0.75))
EXACT = 1e-9
"""A misfit this small, as a share of a signal's range, leaves nothing for a second spring to explain."""


class StagedProblem(Problem):
    """The least-squares problem with two springs: log(k_2/k_v) and s_2 come after the unknowns of `Problem`."""

    least_share = 0.0
    """None is left out: where the force peaks as the second spring begins, its beginning hardly shows."""

    def wall(self, unknowns: np.ndarray) -> StiffeningWall:
        """Vehicle that the unknowns stand for."""
        one = super().wall(unknowns[:-2])
        second = one.spring_N_m * math.exp(unknowns[-2])
        return StiffeningWall(one.mass_kg, one.speed_m_s, one.spring_N_m, one.damper_N_s_m, second, float(unknowns[-1]))


@dataclass(frozen=True, eq=False)
class StagedFit(VehicleFit):
    """Result of `fit_stages`: a `VehicleFit` whose vehicle has two springs.

    Attributes
    ----------
    one : VehicleFit
        The fit with one spring to the same pulse, for comparison.
    second_error_N_m, from_error_m : float
        Standard errors of the second spring and of the crush from which it acts.
    """

    wall: StiffeningWall
    one: VehicleFit
    second_error_N_m: float
    from_error_m: float

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the pulse as plain data."""
        return super().to_dict() | {
            "vehicle_second_spring_N_m": self.wall.second_spring_N_m,
            "vehicle_second_spring_standard_error_N_m": self.second_error_N_m,
            "vehicle_second_spring_from_m": self.wall.second_spring_from_m,
            "vehicle_second_spring_from_standard_error_m": self.from_error_m,
            "misfit_of_one_spring": self.one.to_dict()["misfit"],
        }


def fit_stages(pulse: Pulse, mass_kg: float, *, speed_m_s: float | None = None) -> StagedFit:
    """Fit two springs and the damper of a front that stiffens to a rigid-wall crash pulse.

    Parameters
    ----------
    pulse, mass_kg, speed_m_s
        As of `boulder_sweep.crash_tests.fitting.fit_pulse`.

    Raises
    ------
    FitError
        As of `fit_pulse`; or two springs fit no better than one, because the front does not stiffen or the pulse does
        not reach its second spring.
    """
    one = fit_pulse(pulse, mass_kg, speed_m_s=speed_m_s)
    if all(misfit.share < EXACT for misfit in one.misfits.values()):
        raise _no_second(one)
    problem = StagedProblem(pulse, float(mass_kg), speed_m_s)
    scales = {name: misfit.rms for name, misfit in one.misfits.items()}
    unknowns, scales = _solved(problem, one, scales)
    residuals, wall = problem.by_signal(unknowns), problem.wall(unknowns)
    misfits = {name: misfit_of(values, problem.range(name)) for name, values in residuals.items()}
    if wall.stage is None or _gain(one, misfits, residuals) <= 0.0:
        raise _no_second(one)
    n, covariance = len(unknowns), problem.covariance(unknowns, scales)
    spring, damper, speed = problem.standard_errors(unknowns, scales)
    of_second = np.zeros(n)  # k_2 = m exp(2 u_0 + u_-2)
    of_second[0], of_second[-2] = 2.0, 1.0
    second_error = wall.second_spring_N_m * math.sqrt(max(float(of_second @ covariance @ of_second), 0.0))
    from_error = math.sqrt(max(float(covariance[-1, -1]), 0.0))
    shares = (
        ("second spring", second_error / wall.second_spring_N_m),
        ("crush from which it acts", from_error / wall.second_spring_from_m),
    )
    unsure = [
        f"the pulse does not determine the {name}: its standard error is more than {UNSURE:.0%} of it"
        for name, share in shares
        if share > UNSURE
    ]
    return StagedFit(
        pulse=pulse,
        wall=wall,
        spring_error_N_m=spring,
        damper_error_N_s_m=damper,
        speed_error_m_s=None if speed_m_s is not None else speed,
        misfits=misfits,
        warnings=(*warnings_of(wall, pulse, misfits, spring, damper), *unsure),
        one=one,
        second_error_N_m=second_error,
        from_error_m=from_error,
    )


def _solved(problem: StagedProblem, one: VehicleFit, scales: dict[str, float]) -> tuple[np.ndarray, dict[str, float]]:
    """Solve from several starts, and once more from the best with the weights of its own scatter."""
    from scipy.optimize import least_squares  # heavy, and only this function needs it

    crush = one.wall.max_displacement_m
    rate = math.sqrt(one.wall.spring_N_m / one.wall.mass_kg)
    known = [math.log(rate), math.log(one.wall.damper_N_s_m / (rate * one.wall.mass_kg))]
    known += [one.wall.speed_m_s] if problem.speed_m_s is None else []
    low, high = problem.bounds(np.array(known))
    low = np.append(low, [math.log(RATIOS[0]), SHARES[0] * crush])
    high = np.append(high, [math.log(RATIOS[1]), SHARES[1] * crush])

    def solved(start: np.ndarray) -> Any:
        tight = {"xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12}
        return least_squares(problem.residuals, np.clip(start, low, high), bounds=(low, high), args=(scales,), **tight)

    starts = [np.array([*known, math.log(ratio), share * crush]) for ratio, share in STARTS]
    best = min((solved(start) for start in starts), key=lambda found: found.cost)
    residuals = problem.by_signal(best.x)
    scales = {name: max(rms(values), 1e-9 * problem.range(name)) for name, values in residuals.items()}
    return solved(best.x).x, scales


def _gain(one: VehicleFit, misfits: dict[str, SignalMisfit], residuals: dict[str, np.ndarray]) -> float:
    """Return by how much the Bayesian information criterion prefers two springs."""
    gain, total = 0.0, 0.0
    for name, misfit in misfits.items():
        r = min(max(misfit.correlation, 0.0), 1.0 - 2.0 / len(residuals[name]))
        count = len(residuals[name]) * (1.0 - r) / (1.0 + r)
        gain += 2.0 * count * math.log(one.misfits[name].rms / max(misfit.rms, EXACT * one.misfits[name].rms))
        total += count
    return gain - 2.0 * math.log(max(total, 2.0))


def _no_second(one: VehicleFit) -> FitError:
    """Return the refusal of a pulse that shows no second spring."""
    shares = ", ".join(f"{name} {misfit.share:.1%}" for name, misfit in one.misfits.items())
    return FitError(
        f"{one.pulse.name}: no second spring found: up to its largest crush of {one.wall.max_displacement_m:.2f} m two "
        f"springs fit the pulse no better than one (misfit with one: {shares}); the front does not stiffen, or the "
        f"pulse does not reach its second spring"
    )
