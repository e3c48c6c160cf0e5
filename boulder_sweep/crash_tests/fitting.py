"""Spring and damper of a vehicle from a rigid-wall crash pulse (Eqs 49 to 51), and its second spring.

The pulse is fitted by least squares with the exact response of a Maxwell element, under-damped or over-damped as the
data have it; see `boulder_sweep.crash_tests.fit_problem`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boulder_sweep.crash_tests.fit_problem import (
    RATIO_BOUNDS,
    RESPONSES,
    FitProblem,
    SignalMisfit,
    StagedProblem,
)
from boulder_sweep.crash_tests.measured import PULSE_UNITS, Pulse
from boulder_sweep.crash_tests.rigid_wall import RigidWall, StiffeningWall
from boulder_sweep.drawing import draw
from boulder_sweep.errors import FitError


@dataclass(frozen=True, eq=False)
class VehicleFit:
    """Result of `fit_pulse`.

    Attributes
    ----------
    pulse : Pulse
        What was fitted.
    wall : RigidWall
        The fitted vehicle: mass, speed, spring, damper.
    spring_error_N_m, damper_error_N_s_m : float
        Standard errors. They allow for noise that is correlated in time, by a filter or because it was integrated from
        an accelerometer, and between the signals; they say nothing about whether a Maxwell element is right at all.
    speed_error_m_s : float or None
        Standard error of the speed; None where the speed was given.
    misfits : dict of str to SignalMisfit
        By signal.
    warnings : tuple of str
        Where the Maxwell element cannot fit, or the pulse does not determine it.
    """

    pulse: Pulse
    wall: RigidWall
    spring_error_N_m: float
    damper_error_N_s_m: float
    speed_error_m_s: float | None
    misfits: dict[str, SignalMisfit]
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the pulse as plain data."""
        wall = self.wall
        return {
            "vehicle_mass_kg": wall.mass_kg,
            "vehicle_spring_N_m": wall.spring_N_m,
            "vehicle_spring_standard_error_N_m": self.spring_error_N_m,
            "vehicle_damper_N_s_m": wall.damper_N_s_m,
            "vehicle_damper_standard_error_N_s_m": self.damper_error_N_s_m,
            "impact_speed_m_s": wall.speed_m_s,
            "impact_speed_standard_error_m_s": self.speed_error_m_s,
            "damping": "over-damped" if wall.over_damped else "under-damped",
            "a_per_s": wall.a,
            "b_per_s": None if wall.over_damped else wall.b,
            "max_displacement_m": wall.max_displacement_m,
            "peak_force_kN": wall.peak_force / 1e3,
            "rebound_speed_m_s": -wall.rebound_speed_m_s,
            "misfit": {
                f"{name} [{PULSE_UNITS[name]}]": {
                    "rms": m.rms,
                    "share_of_range": m.share,
                    "systematic": m.systematic_share,
                }
                for name, m in self.misfits.items()
            },
            "warnings": list(self.warnings),
        }

    @property
    def residuals(self) -> dict[str, np.ndarray]:
        """Measured minus fitted, by signal; NaN in gaps."""
        return {
            name: values - RESPONSES[name](self.wall, self.pulse.time_s) for name, values in self.pulse.signals.items()
        }

    def plot(self, path: str | Path) -> None:
        """Draw pulse, fit and residuals.

        Raises
        ------
        PictureError
            The picture cannot be written, or matplotlib is not installed.
        """
        draw("crash_curves", "draw_fit", self, path)


SYSTEMATIC_SHARE = 0.02
"""A misfit left after the noise has been averaged out, as a share of the signal's range, from which on the vehicle
cannot be called a Maxwell element, provided that neighbouring residuals go together:"""
GO_TOGETHER = 0.5
UNSURE = 0.25
"""Standard error of a constant as a share of it, from which on the pulse does not determine it."""


def warnings_of(
    wall: RigidWall,
    pulse: Pulse,
    misfits: dict[str, SignalMisfit],
    spring_error_N_m: float,
    damper_error_N_s_m: float,
) -> tuple[str, ...]:
    """Return what the user of a fit should know before trusting it.

    Parameters
    ----------
    wall
        The fitted vehicle.
    pulse
        What it was fitted to.
    misfits
        How far it is off, by signal.
    spring_error_N_m, damper_error_N_s_m
        Standard errors.
    """
    warnings: list[str] = []
    for name, misfit in misfits.items():
        if misfit.systematic_share > SYSTEMATIC_SHARE and misfit.correlation > GO_TOGETHER:
            warnings.append(
                f"the {name} is off by {misfit.systematic_share:.0%} of its range even with the noise averaged out: "
                f"this front is not a spring and a damper in series (it may stiffen as it is crushed); "
                f"use the constants only for impacts that crush it about as far"
            )
    ratio = wall.damper_N_s_m / math.sqrt(wall.spring_N_m * wall.mass_kg)
    rigid_damper, rigid_spring = ratio > 0.5 * RATIO_BOUNDS[1], ratio < 2.0 * RATIO_BOUNDS[0]
    if rigid_damper:
        warnings.append(
            "the pulse shows no lasting crush: a spring alone fits as well, and the damper is not determined"
        )
    if rigid_spring:
        warnings.append("the pulse shows no spring: a damper alone fits as well, and the spring is not determined")
    unsure = (
        ("spring", spring_error_N_m / wall.spring_N_m, rigid_spring),
        ("damper", damper_error_N_s_m / wall.damper_N_s_m, rigid_damper),
    )
    for name, share, said in unsure:
        if share > UNSURE and not said:
            warnings.append(f"the pulse does not determine the {name}: its standard error is {share:.0%} of it")
    last = float(pulse.time_s[-1])
    if last < wall.peak_force_time_s:
        warnings.append(
            f"the pulse ends at {last:.3f} s, before the force peaks ({wall.peak_force_time_s:.3f} s by this fit)"
        )
    elif last < wall.max_displacement_time_s < math.inf:
        warnings.append(
            f"the pulse ends at {last:.3f} s, before the vehicle stops "
            f"({wall.max_displacement_time_s:.3f} s by this fit)"
        )
    return tuple(warnings)


PASSES = 4
"""How often the weights of the signals are renewed from their own scatter."""


def fit_pulse(pulse: Pulse, mass_kg: float, *, speed_m_s: float | None = None) -> VehicleFit:
    """Fit spring and damper of a Maxwell element to a rigid-wall crash pulse.

    Parameters
    ----------
    pulse
        One or more signals over time.
    mass_kg
        Mass of the vehicle.
    speed_m_s
        Speed of impact; fitted too where it is not given.

    Returns
    -------
    VehicleFit

    Raises
    ------
    FitError
        Mass or speed are not positive, or no vehicle comes near the pulse.
    """
    for name, value in (("mass", mass_kg), ("speed", speed_m_s)):
        if value is not None and not 0.0 < value < math.inf:
            raise FitError(f"the {name} of the vehicle must be positive, not {value:g}")
    problem = FitProblem(pulse, float(mass_kg), speed_m_s)
    scales = {name: problem.range(name) for name in pulse.signals}
    unknowns = problem.start(scales)
    bounds = problem.bounds(unknowns)
    for _ in range(PASSES):
        solved = problem.solved(unknowns, scales, bounds, 1e-14)
        unknowns = solved.x
        residuals = problem.by_signal(unknowns)
        scales = problem.scatter(residuals)
    wall = problem.wall(unknowns)
    if not math.isfinite(solved.cost):
        raise FitError(f"{pulse.name}: no vehicle comes near this pulse")
    misfits = problem.misfits(residuals)
    spring_error, damper_error, speed_error = problem.standard_errors(unknowns, scales)
    return VehicleFit(
        pulse=pulse,
        wall=wall,
        spring_error_N_m=spring_error,
        damper_error_N_s_m=damper_error,
        speed_error_m_s=None if speed_m_s is not None else speed_error,
        misfits=misfits,
        warnings=warnings_of(wall, pulse, misfits, spring_error, damper_error),
    )


RATIOS = (1.0, 1e3)
"""Range of the second spring over the first that is searched."""
SHARES = (0.02, 0.98)
"""Range of the crush from which it acts, as a share of the largest crush by one spring."""
STARTS = tuple((ratio, share) for ratio in (1.5, 4.0) for share in (0.25, 0.5, 0.75))
EXACT = 1e-9
"""A misfit this small, as a share of a signal's range, leaves nothing for a second spring to explain."""


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
        See `fit_pulse`.

    Raises
    ------
    FitError
        As `fit_pulse` does; or two springs fit no better than one, because the front does not stiffen or the pulse does
        not reach its second spring.
    """
    one = fit_pulse(pulse, mass_kg, speed_m_s=speed_m_s)
    if all(misfit.share < EXACT for misfit in one.misfits.values()):
        raise _no_second(one)
    problem = StagedProblem(pulse, float(mass_kg), speed_m_s)
    scales = {name: misfit.rms for name, misfit in one.misfits.items()}
    unknowns, scales = _solve(problem, one, scales)
    residuals, wall = problem.by_signal(unknowns), problem.wall(unknowns)
    misfits = problem.misfits(residuals)
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


def _solve(problem: StagedProblem, one: VehicleFit, scales: dict[str, float]) -> tuple[np.ndarray, dict[str, float]]:
    """Solve from several starts, and once more from the best with the weights of its own scatter."""
    crush = one.wall.max_displacement_m
    rate = math.sqrt(one.wall.spring_N_m / one.wall.mass_kg)
    known = [math.log(rate), math.log(one.wall.damper_N_s_m / (rate * one.wall.mass_kg))]
    known += [one.wall.speed_m_s] if problem.speed_m_s is None else []
    low, high = problem.bounds(np.array(known))
    low = np.append(low, [math.log(RATIOS[0]), SHARES[0] * crush])
    high = np.append(high, [math.log(RATIOS[1]), SHARES[1] * crush])
    starts = [np.array([*known, math.log(ratio), share * crush]) for ratio, share in STARTS]
    best = min((problem.solved(start, scales, (low, high), 1e-12) for start in starts), key=lambda fit: fit.cost)
    scales = problem.scatter(problem.by_signal(best.x))
    return problem.solved(best.x, scales, (low, high), 1e-12).x, scales


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
