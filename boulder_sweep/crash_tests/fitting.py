"""Spring and damper of a vehicle from a rigid-wall crash pulse (Eqs 49 to 51).

The measured displacement, velocity or acceleration, or several of them at once, is fitted by least squares with the
exact response of a Maxwell element (`boulder_sweep.crash_tests.rigid_wall`), under-damped or over-damped as the data
have it. What is fitted are the logarithms of sqrt(k/m) and of c/sqrt(k m), and the speed of impact unless it is given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_sweep.crash_tests.pulse import RESPONSES, Pulse, SignalMisfit, VehicleFit
from boulder_sweep.crash_tests.rigid_wall import RigidWall, StiffeningWall
from boulder_sweep.crash_tests.scatter import scatter_of, sum_scatters
from boulder_sweep.errors import FitError

RATIO_BOUNDS = (2e-3, 2e2)
"""Range of c/sqrt(k m) that is searched; at its ends one of the two elements is as good as rigid."""


class FitProblem:
    """The least-squares problem: unknowns log sqrt(k/m), log(c/sqrt(k m)) and, where not given, v_0."""

    least_share = 1e-14
    """Combinations of unknowns that move the response less than this, as a share of the most, are left out."""

    def __init__(self, pulse: Pulse, mass_kg: float, speed_m_s: float | None) -> None:
        self.pulse = pulse
        self.mass_kg = mass_kg
        self.speed_m_s = speed_m_s
        self.known = {name: np.isfinite(values) for name, values in pulse.signals.items()}

    def range(self, name: str) -> float:
        """Range of a signal, never zero."""
        values = self.pulse.signals[name][self.known[name]]
        return max(float(np.abs(values).max()), float(np.ptp(values)), 1e-12)

    def wall(self, unknowns: np.ndarray) -> RigidWall:
        """Vehicle that the unknowns stand for."""
        rate, ratio = math.exp(unknowns[0]), math.exp(unknowns[1])
        speed = float(unknowns[2]) if self.speed_m_s is None else self.speed_m_s
        return RigidWall(self.mass_kg, speed, self.mass_kg * rate**2, ratio * rate * self.mass_kg)

    def by_signal(self, unknowns: np.ndarray) -> dict[str, np.ndarray]:
        """Measured minus computed where there are values, in the units of the signals."""
        wall = self.wall(unknowns)
        return {
            name: (values - RESPONSES[name](wall, self.pulse.time_s))[self.known[name]]
            for name, values in self.pulse.signals.items()
        }

    def residuals(self, unknowns: np.ndarray, scales: dict[str, float]) -> np.ndarray:
        """Residuals of all signals as multiples of their scales."""
        return np.concatenate([values / scales[name] for name, values in self.by_signal(unknowns).items()])

    def scatter(self, residuals: dict[str, np.ndarray]) -> dict[str, float]:
        """Return the scale of each signal by which its residuals are divided: their root mean square, never zero."""
        return {name: max(rms(values), 1e-9 * self.range(name)) for name, values in residuals.items()}

    def misfits(self, residuals: dict[str, np.ndarray]) -> dict[str, SignalMisfit]:
        """Describe the residuals of every signal."""
        return {name: misfit_of(values, self.range(name)) for name, values in residuals.items()}

    def start(self, scales: dict[str, float]) -> np.ndarray:
        """Best of a grid of vehicles; the response is proportional to the speed, which so follows from each."""
        last = float(self.pulse.time_s[-1])
        best, unknowns = math.inf, np.zeros(3)
        for rate in np.geomspace(0.1, 200.0, 31) / last:
            for ratio in np.geomspace(*RATIO_BOUNDS, 21):
                unit = RigidWall(self.mass_kg, 1.0, self.mass_kg * rate**2, ratio * rate * self.mass_kg)
                shape, data = [], []
                for name, values in self.pulse.signals.items():
                    known = self.known[name]
                    shape.append(RESPONSES[name](unit, self.pulse.time_s)[known] / scales[name])
                    data.append(values[known] / scales[name])
                one, other = np.concatenate(shape), np.concatenate(data)
                speed = self.speed_m_s if self.speed_m_s is not None else max(float(one @ other / (one @ one)), 1e-6)
                misfit = float(np.sum((other - speed * one) ** 2))
                if misfit < best:
                    best, unknowns = misfit, np.array([math.log(rate), math.log(ratio), speed])
        return unknowns if self.speed_m_s is None else unknowns[:2]

    def bounds(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Range of the unknowns."""
        last = float(self.pulse.time_s[-1])
        low = [math.log(0.01 / last), math.log(RATIO_BOUNDS[0]), 1e-9]
        high = [math.log(2000.0 / last), math.log(RATIO_BOUNDS[1]), 1e4]
        return np.array(low[: len(start)]), np.array(high[: len(start)])

    def covariance(self, unknowns: np.ndarray, scales: dict[str, float]) -> np.ndarray:
        """Covariance of the unknowns, shape (p, p).

        The sandwich of least squares, (JᵀJ)⁻¹ Jᵀ Σ J (JᵀJ)⁻¹, with the covariance Σ of the residuals of all signals as
        `boulder_sweep.crash_tests.scatter` finds it from them.
        """
        n = len(unknowns)
        steps = 1e-6 * np.maximum(np.abs(unknowns), 1.0)
        columns = []
        for k in range(n):
            ahead, behind = (unknowns + sign * steps * (np.arange(n) == k) for sign in (1.0, -1.0))
            up, down = self.by_signal(ahead), self.by_signal(behind)
            columns.append({name: (up[name] - down[name]) / (2.0 * steps[k]) / scales[name] for name in up})
        bread, scatters = np.zeros((n, n)), []
        for name, residuals in self.by_signal(unknowns).items():
            jacobian = np.stack([column[name] for column in columns], axis=1)
            bread += jacobian.T @ jacobian
            times = self.pulse.time_s[self.known[name]]
            scatters.append(scatter_of(name, times, residuals / scales[name], jacobian))
        masks = list(self.known.values())
        middle = sum_scatters(scatters, together=all(np.array_equal(mask, masks[0]) for mask in masks))
        inverse = np.linalg.pinv(bread, rcond=self.least_share, hermitian=True)
        return np.asarray(inverse @ middle @ inverse)

    def standard_errors(self, unknowns: np.ndarray, scales: dict[str, float]) -> tuple[float, float, float]:
        """Standard errors of spring [N/m], damper [N s/m] and speed [m/s]."""
        n, covariance, wall = len(unknowns), self.covariance(unknowns, scales), self.wall(unknowns)
        # k = m exp(2 u_0), c = m exp(u_0 + u_1)
        of_spring = np.eye(n)[0] * 2.0 * wall.spring_N_m
        of_damper = (np.eye(n)[0] + np.eye(n)[1]) * wall.damper_N_s_m
        of_speed = np.eye(3, n)[2]
        spring, damper, speed = (
            math.sqrt(max(float(g @ covariance @ g), 0.0)) for g in (of_spring, of_damper, of_speed)
        )
        return spring, damper, speed


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
SMOOTHING_SHARE = 0.05
"""Part of the pulse over which noise is averaged out."""


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
    from scipy.optimize import least_squares  # heavy, and only this function needs it

    scales = {name: problem.range(name) for name in pulse.signals}
    unknowns = problem.start(scales)
    bounds = problem.bounds(unknowns)
    for _ in range(PASSES):
        solved = least_squares(
            problem.residuals,
            np.clip(unknowns, *bounds),
            bounds=bounds,
            args=(scales,),
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
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


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def misfit_of(residuals: np.ndarray, span: float) -> SignalMisfit:
    """Describe the residuals of one signal."""
    window = max(1, round(SMOOTHING_SHARE * len(residuals)))
    smooth = np.convolve(residuals, np.full(window, 1.0 / window), mode="valid")
    scatter = float(residuals @ residuals)
    correlation = float(residuals[1:] @ residuals[:-1]) / scatter if scatter > 0.0 else 0.0
    size = rms(residuals)
    return SignalMisfit(size, size / span, float(np.abs(smooth).max()) / span, correlation)


RATIOS = (1.0, 1e3)
"""Range of the second spring over the first that is searched."""
SHARES = (0.02, 0.98)
"""Range of the crush from which it acts, as a share of the largest crush by one spring."""
STARTS = tuple((ratio, share) for ratio in (1.5, 4.0) for share in (0.25, 0.5, 0.75))
EXACT = 1e-9
"""A misfit this small, as a share of a signal's range, leaves nothing for a second spring to explain."""


class StagedProblem(FitProblem):
    """The least-squares problem with two springs: log(k_2/k_v) and s_2 come after the unknowns of `FitProblem`."""

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
    best = min((solved(start) for start in starts), key=lambda fit: fit.cost)
    scales = problem.scatter(problem.by_signal(best.x))
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
