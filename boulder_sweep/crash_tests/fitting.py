"""Spring and damper of a vehicle from a rigid-wall crash pulse (Eqs 49 to 51).

The measured displacement, velocity or acceleration, or several of them at once, is compared by least squares with the
exact response of a Maxwell element (`boulder_sweep.crash_tests.rigid_wall`). The time of first touch is fitted too,
since the trigger sets the zero of the times of a record, and the speed unless it is given. The zero offset of an
acceleration is its mean before first touch.

How sure the result is follows from a jackknife: it is fitted again without each of some 20 stretches of the record in
turn. Neighbouring samples share their noise, so whole stretches are left out (Kuensch 1989, Ann. Stat. 17, 1217-1241).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.crash_tests.measured import FEWEST_SAMPLES, PULSE_UNITS, Pulse
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.drawing import draw
from boulder_sweep.errors import FitError
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.values import is_unusual, range_words

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

SYSTEMATIC_SHARE, GO_TOGETHER = 0.02, 0.5
"""A misfit left after the noise has been averaged out, as a share of the signal's range, from which on the vehicle
cannot be called a Maxwell element, provided that neighbouring residuals go together."""
SMOOTHING_SHARE = 0.05
"""Part of the pulse over which noise is averaged out."""
NOT_NEAR = 0.25
"""The same misfit from which on the fit is refused."""
UNSURE = 0.5
"""Error of a constant as a share of it from which on the user is warned; from 1 on it is refused."""
MOST_CRUSH_M = 10.0
"""Crush of a front that is longer than any vehicle's."""
GAUGE_SHARE = 0.01
"""What the gain of an accelerometer may be wrong by."""
SURE = 1.5
"""A speed is contradicted by the record beyond this many errors of 95 %."""
RATIO_BOUNDS = (2e-3, 2e2)
"""Range of c/sqrt(k m) that is searched; at its ends one of the two elements is as good as rigid."""
PASSES = 4
"""How often the weights of the signals, the offset and the rows it stands on are renewed from the last fit."""
LEAST_SHIFT_S = 5e-4
"""A first touch this close to the zero of the times is not worth a word."""
MOST_SHIFT = 0.1
"""Share of the crush by which a front that is no spring and damper may move first touch: it may be soft at first."""
BLOCKS, BLOCKS_BESIDE = 16, 4
"""Stretches that are left out in turn: from first touch to separation, and before and after it."""
FEWEST_BEFORE = 5
"""Rows before first touch from which on they give a zero offset."""
SMEAR = 0.1
"""Part of the rise to the peak force, ahead of first touch, into which a filter may smear the impact."""


@dataclass(frozen=True)
class SignalMisfit:
    """How far the fitted response is from one signal.

    Attributes
    ----------
    rms, share : float
        Root mean square of the residuals, in the unit of the signal and as a share of its range.
    systematic_share : float
        Largest residual after the noise has been averaged out, as a share of the range.
    correlation : float
        Correlation of neighbouring residuals.
    """

    rms: float
    share: float
    systematic_share: float
    correlation: float


@dataclass(frozen=True, eq=False)
class VehicleFit:
    """Result of `fit_pulse`. Every error is half the width of a 95 % interval.

    Attributes
    ----------
    pulse : Pulse
        What was fitted.
    wall : RigidWall
        The fitted vehicle: mass, speed, spring, damper.
    touch_s : float
        First touch, in times of the pulse [s].
    offset_m_s2 : float or None
        Zero offset that was taken from the acceleration [m/s^2]; None where no rows before first touch show it.
    spring_error_N_m, damper_error_N_s_m, touch_error_s : float
        Errors by the scatter of the record. They say nothing about whether a Maxwell element is right at all.
    speed_error_m_s : float or None
        Error of the speed; None where the speed was given.
    misfits : dict of str to SignalMisfit
        By signal.
    warnings : tuple of str
        What the user of the fit should know before trusting it.
    """

    pulse: Pulse
    wall: RigidWall
    touch_s: float
    offset_m_s2: float | None
    spring_error_N_m: float
    damper_error_N_s_m: float
    touch_error_s: float
    speed_error_m_s: float | None
    misfits: dict[str, SignalMisfit]
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the pulse as plain data."""
        wall = self.wall
        return {
            "vehicle_mass_kg": wall.mass_kg,
            "vehicle_spring_N_m": wall.spring_N_m,
            "vehicle_spring_error_95_N_m": self.spring_error_N_m,
            "vehicle_damper_N_s_m": wall.damper_N_s_m,
            "vehicle_damper_error_95_N_s_m": self.damper_error_N_s_m,
            "impact_speed_m_s": wall.speed_m_s,
            "impact_speed_error_95_m_s": self.speed_error_m_s,
            "first_touch_s": self.touch_s,
            "first_touch_error_95_s": self.touch_error_s,
            "zero_offset_m_s2": self.offset_m_s2,
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

    def fitted(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Fitted response at times since first touch [s], by signal, with the zero offset of the acceleration in it."""
        values = dict(zip(PULSE_UNITS, self.wall.response(time_s), strict=True))
        return {name: values[name] + (self.offset_m_s2 or 0.0) * (name == "acceleration") for name in self.misfits}

    def plot(self, path: str | Path) -> None:
        """Draw pulse, fit and residuals.

        Raises
        ------
        PictureError
            The picture cannot be written, or matplotlib is not installed.
        """
        draw("crash_curves", "draw_fit", self, path)


class _Problem:
    """The least-squares problem: unknowns log sqrt(k/m), log(c/sqrt(k m)), first touch and, where not given, v_0."""

    def __init__(self, pulse: Pulse, mass_kg: float, speed_m_s: float | None) -> None:
        self.time, self.signals = pulse.time_s, pulse.signals
        self.mass_kg, self.speed_m_s = mass_kg, speed_m_s
        self.ranges = {
            name: float(np.nanmax(np.abs(v)) + np.nanmax(v) - np.nanmin(v)) for name, v in pulse.signals.items()
        }
        self.scales = dict(self.ranges)
        self.offset: float | None = None
        self.rows: dict[str, np.ndarray] = {}
        self.known = {name: np.isfinite(values) for name, values in pulse.signals.items()}
        self.differences = dict.fromkeys(pulse.signals, 0)
        latest = min(self.time[known][-FEWEST_SAMPLES] for known in self.known.values())
        span = self.time[-1] - self.time[0]
        low = [math.log(0.01 / span), math.log(RATIO_BOUNDS[0]), self.time[0] - span, 1e-9]
        high = [math.log(2000.0 / span), math.log(RATIO_BOUNDS[1]), latest, 1e4]
        count = 4 if speed_m_s is None else 3
        self.bounds = np.array(low[:count]), np.array(high[:count])

    def wall(self, unknowns: np.ndarray) -> RigidWall:
        """Vehicle that the unknowns stand for."""
        rate, ratio = math.exp(unknowns[0]), math.exp(unknowns[1])
        speed = float(unknowns[3]) if self.speed_m_s is None else self.speed_m_s
        return RigidWall(self.mass_kg, speed, self.mass_kg * rate**2, ratio * rate * self.mass_kg)

    def by_signal(self, unknowns: np.ndarray) -> dict[str, np.ndarray]:
        """Measured minus computed in the rows in use, in the units of the signals."""
        response = dict(zip(PULSE_UNITS, self.wall(unknowns).response(self.time - unknowns[2]), strict=True))
        left = {name: (values - response[name])[self.rows[name]] for name, values in self.signals.items()}
        if self.offset is not None:
            left["acceleration"] = left["acceleration"] - self.offset
        return left

    def compared(self, unknowns: np.ndarray) -> dict[str, np.ndarray]:
        """What is made small: the residuals, or their differences from row to row where they wander."""
        found = self.by_signal(unknowns)
        for name, order in self.differences.items():
            if order:
                spread = np.full(len(self.time), np.nan)
                spread[self.rows[name]] = found[name]
                apart = np.diff(spread[self.known[name]], order)
                found[name] = apart[np.isfinite(apart)]
        return found

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """What is made small, of all signals, as multiples of their scales."""
        return np.concatenate([values / self.scales[name] for name, values in self.compared(unknowns).items()])

    def choose(self, unknowns: np.ndarray, kept: np.ndarray) -> None:
        """Take the rows that are kept, and the zero offset from them; it stays where they show none.

        A displacement counts from first touch: some records hold it at 0 before, others let it come up from below.
        """
        after = self.time >= unknowns[2]
        self.rows = {
            name: known & kept & (after if name == "displacement" else True) for name, known in self.known.items()
        }
        if "acceleration" in self.signals:
            clear = unknowns[2] - SMEAR * self.wall(unknowns).peak_force_time_s
            before = self.rows["acceleration"] & (self.time < clear)
            if before.sum() >= FEWEST_BEFORE:
                self.offset = float(self.signals["acceleration"][before].mean())

    def solve(self, start: np.ndarray, tolerance: float) -> OptimizeResult:
        """Solve from a start."""
        from scipy.optimize import least_squares  # heavy, and only fits need it

        tight = {"xtol": tolerance, "ftol": tolerance, "gtol": tolerance}
        return least_squares(self.residuals, np.clip(start, *self.bounds), bounds=self.bounds, x_scale="jac", **tight)

    def starts(self, count: int = 4) -> list[np.ndarray]:
        """Return the best vehicles of a grid of rates, ratios and first touches; the speed follows from each.

        First touch is sought at the zero of the times, and at and ahead of the first row that shows the impact.
        """
        every = max(1, len(self.time) // 300)
        signals = {name: values[::every] for name, values in self.signals.items()}
        thin = _Problem(Pulse("", self.time[::every], signals), self.mass_kg, None)
        found, span, onset = [], float(self.time[-1] - self.time[0]), _onset(self)
        for rate in np.geomspace(0.5, 200.0, 14) / span:
            for ratio in np.geomspace(0.02, 20.0, 7):
                for touch in (0.0, onset, onset - 0.3 / rate, onset - 0.8 / rate):
                    guess = np.array([math.log(rate), math.log(ratio), touch, 0.0])
                    if not thin.bounds[0][2] <= touch <= onset:
                        continue
                    thin.offset = None
                    thin.choose(guess, np.full(len(thin.time), True))
                    data = thin.residuals(guess)
                    shape = data - thin.residuals(guess + np.array([0.0, 0.0, 0.0, 1.0]))
                    fitting = float(data @ shape) / max(float(shape @ shape), 1e-300)
                    speed = max(fitting, 1e-6) if self.speed_m_s is None else self.speed_m_s
                    guess[3] = speed
                    found.append((float(np.mean((data - speed * shape) ** 2)), guess[: len(self.bounds[0])]))
        return [guess for _, guess in sorted(found, key=lambda pair: pair[0])[:count]]

    def best(self) -> np.ndarray:
        """Solve, with every signal weighted by its own scatter in the end."""
        everything, tried = np.full(len(self.time), True), []
        for start in self.starts():
            self.offset = None
            self.choose(start, everything)
            solved = self.solve(start, 1e-8)
            tried.append((solved.cost / len(solved.fun), solved.x))
        unknowns = min(tried, key=lambda pair: pair[0])[1]
        for _ in range(PASSES):
            self.offset = None
            self.choose(unknowns, everything)
            unknowns = self.solve(unknowns, 1e-14).x
            for name, values in self.compared(unknowns).items():
                misfit = _misfit_of(values, self.ranges[name])
                self.scales[name] = max(misfit.rms, 1e-9 * self.ranges[name])
                wanders = name != "acceleration" and misfit.rms > 1e-9 * self.ranges[name]
                if wanders and misfit.correlation > GO_TOGETHER and misfit.systematic_share < SYSTEMATIC_SHARE:
                    self.differences[name] = min(self.differences[name] + 1, 2)
                    self.scales[name] = max(_rms(np.diff(values)), 1e-12 * self.ranges[name])
        return unknowns

    def errors(self, unknowns: np.ndarray) -> np.ndarray:
        """Half widths of the 95 % intervals of log k_v, log c_v, first touch and, where not given, v_0, shape (p,).

        A jackknife over stretches of the record gives them. None is narrower than white noise and the curvature of the
        misfit would make it: the curvature shows a flat valley that the jackknife may not follow.
        """
        from scipy.stats import t as student

        to_logs = np.eye(len(unknowns))
        to_logs[0, 0], to_logs[1, 0] = 2.0, 1.0  # k = m exp(2 u_0), c = m exp(u_0 + u_1)
        offset, rows = self.offset, self.rows
        solved = self.solve(unknowns, 1e-14)
        _, sizes, vectors = np.linalg.svd(solved.jac, full_matrices=False)
        free = max(len(solved.fun) - len(unknowns), 1)
        roots = to_logs @ vectors.T / np.maximum(sizes, 1e-300) * math.sqrt(2.0 * solved.cost / free)
        white = np.sqrt((roots**2).sum(axis=1))
        moved = []
        for block in self.stretches(unknowns):
            kept = np.full(len(self.time), True)
            kept[block] = False
            self.choose(unknowns, kept)
            moved.append(self.solve(unknowns, 1e-9).x - unknowns)
            self.offset, self.rows = offset, rows
        count = len(moved)
        scatter = np.sqrt((count - 1) / count * ((np.array(moved) @ to_logs.T) ** 2).sum(axis=0))
        return float(student.ppf(0.975, min(BLOCKS, count) - 1)) * np.maximum(scatter, white)

    def speed_of_record(self, unknowns: np.ndarray, error_m_s: float) -> tuple[float, float]:
        """Speed before first touch by the record's own change of speed, and how far it may be off [m/s].

        The change is the integral of the acceleration where there is one; what the fit makes of the speed at the end of
        the record is added. By how much fit and integral differ is part of the error.
        """
        drift = 0.0
        if "acceleration" in self.signals:
            drift = -float(np.trapezoid(self.by_signal(unknowns)["acceleration"], self.time[self.rows["acceleration"]]))
        record = float(unknowns[3]) + drift
        return record, SURE * error_m_s + abs(drift) + GAUGE_SHARE * record

    def stretches(self, unknowns: np.ndarray) -> list[np.ndarray]:
        """Rows of each stretch: before first touch, up to separation, after it."""
        ends = unknowns[2], unknowns[2] + self.wall(unknowns).separation_time_s
        parts = np.split(np.arange(len(self.time)), np.searchsorted(self.time, ends))
        counts = (BLOCKS_BESIDE, BLOCKS, BLOCKS_BESIDE)
        return [b for part, n in zip(parts, counts, strict=True) for b in np.array_split(part, n) if len(b)]


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
        Mass or speed are not those of a vehicle, the record contradicts the speed, no vehicle comes near the record,
        the record does not determine spring or damper, or they are not those of a vehicle.
    """
    for name, column, value in (("mass", "vehicle_mass_kg", mass_kg), ("speed", "impact_speed_m_s", speed_m_s)):
        if value is not None and not 0.0 < value < math.inf:
            raise FitError(f"the {name} of the vehicle must be positive, not {value:g}")
        if value is not None and (words := _far_out(column, value)):
            raise FitError(f"--{name}: {words}; check its unit")
    problem = _Problem(pulse, float(mass_kg), None)
    unknowns = problem.best()
    errors = problem.errors(unknowns)
    if speed_m_s is not None:
        record, error = problem.speed_of_record(unknowns, float(errors[3]))
        if abs(record - speed_m_s) > error:
            raise FitError(
                f"{pulse.name}: by its change of speed the record says {record:.1f} ± {max(error, 0.05):.1f} m/s, "
                f"--speed {speed_m_s:.1f} m/s; check the speed, and the units and the zero offset of the record"
            )
        problem = _Problem(pulse, float(mass_kg), float(speed_m_s))
        unknowns = problem.best()
        errors = problem.errors(unknowns)
    wall, residuals = problem.wall(unknowns), problem.by_signal(unknowns)
    misfits = {name: _misfit_of(values, problem.ranges[name]) for name, values in residuals.items()}
    fit = VehicleFit(
        pulse=pulse,
        wall=wall,
        touch_s=float(unknowns[2]),
        offset_m_s2=problem.offset,
        spring_error_N_m=float(errors[0]) * wall.spring_N_m,
        damper_error_N_s_m=float(errors[1]) * wall.damper_N_s_m,
        touch_error_s=float(errors[2]),
        speed_error_m_s=None if speed_m_s is not None else float(errors[3]),
        misfits=misfits,
        warnings=(),
    )
    _refuse(fit)
    return replace(fit, warnings=tuple(_warnings(fit)))


def _far_out(name: str, value: float) -> str:
    """Return what is wrong with an input that no vehicle has, or nothing."""
    field = BY_NAME[name]
    usual, admitted = field.usual, field.admitted
    assert usual is not None
    assert admitted is not None
    if admitted.low <= value <= admitted.high and not is_unusual(np.array([value]), field)[0]:
        return ""
    unit = {"N/m": "kN/m", "N*s/m": "kN*s/m"}.get(field.unit, field.unit)
    ends = range_words(usual.low, usual.high, field.unit, unit)
    return f"{range_words(value, value, field.unit, unit)} is far outside what vehicles have, {ends}"


def _systematic(misfits: dict[str, SignalMisfit]) -> dict[str, float]:
    """Misfits that noise does not explain, as shares of the ranges."""
    return {
        name: misfit.systematic_share
        for name, misfit in misfits.items()
        if misfit.systematic_share > SYSTEMATIC_SHARE and misfit.correlation > GO_TOGETHER
    }


def _refuse(fit: VehicleFit) -> None:
    """Refuse a fit that says nothing about a vehicle, with its reasons and what to do."""
    wall, ratio = fit.wall, fit.wall.damper_N_s_m / math.sqrt(fit.wall.spring_N_m * fit.wall.mass_kg)
    reasons = [
        f"no spring and damper in series come near it: the {name} is off by {share:.0%} of its range"
        for name, share in _systematic(fit.misfits).items()
        if share > NOT_NEAR
    ]
    at_once = wall.peak_force_time_s < 2.0 * float(np.median(np.diff(fit.pulse.time_s)))
    open_ends = (
        ("spring", "damper", at_once or ratio < 2.0 * RATIO_BOUNDS[0], fit.spring_error_N_m / wall.spring_N_m),
        ("damper", "spring", ratio > 0.5 * RATIO_BOUNDS[1], fit.damper_error_N_s_m / wall.damper_N_s_m),
    )
    for name, other, alone, share in open_ends:
        if alone or share > 1.0:
            why = f"a {other} alone fits as well" if alone else "its error is larger than itself"
            if alone and other == "spring" and fit.pulse.time_s[-1] - fit.touch_s > wall.separation_time_s:
                why += ", since the vehicle leaves the wall as fast as it came, which no front of sheet metal does"
            reasons.append(f"the record does not determine the {name}: {why}")
    shift, least = fit.touch_s, max(fit.touch_error_s, LEAST_SHIFT_S)
    unseen = shift > least or fit.pulse.time_s[0] - shift > least
    far = abs(shift) * wall.speed_m_s > MOST_SHIFT * wall.max_displacement_m
    if unseen and far and abs(shift) > least and _systematic(fit.misfits):
        words = f"a spring and a damper in series fit it only from {1e3 * shift:.1f} ms on, and not well"
        later = f"; if first touch is then, take {1e3 * shift:.1f} ms from its times" if shift > 0.0 else ""
        reasons.append(words + later)
    if not reasons:
        names = "impact_speed_m_s", "vehicle_spring_N_m", "vehicle_damper_N_s_m"
        found = ((BY_NAME[name].key, _far_out(name, fit.to_dict()[name])) for name in names)
        reasons = [f"the fitted {key} of {text}" for key, text in found if text]
        if wall.max_displacement_m > MOST_CRUSH_M:
            reasons.append(f"the fitted vehicle is crushed by {wall.max_displacement_m:,.0f} m, more than it is long")
    if reasons:
        raise FitError(f"{fit.pulse.name}: {'; '.join(reasons)}. {_what_to_do(fit)}")


def _what_to_do(fit: VehicleFit) -> str:
    """Return how a record that was refused may be put right."""
    first, last = fit.pulse.time_s[[0, -1]] - fit.touch_s
    ways = ["check the units of its columns and --mass"]
    if first > 0.0 or (fit.offset_m_s2 is None and "acceleration" in fit.pulse.signals):
        ways.insert(0, "give rows from before first touch on")
    if last < min(fit.wall.separation_time_s, 2.0 * fit.wall.peak_force_time_s):
        open_speed = fit.speed_error_m_s is not None and last < fit.wall.max_displacement_time_s
        longer = f"give a record until the vehicle leaves the wall (it ends {last:.3f} s after first touch)"
        ways.insert(0, f"{longer}{', or --speed' if open_speed else ''}")
    return f"To do: {'; '.join(ways)}"


def _warnings(fit: VehicleFit) -> Iterator[str]:
    """Yield what the user of a fit should know before trusting it."""
    wall = fit.wall
    for name, share in _systematic(fit.misfits).items():
        yield (
            f"the {name} is off by {share:.0%} of its range even with the noise averaged out: this front is not a "
            f"spring and a damper in series (it may stiffen as it is crushed); use the constants only for impacts that "
            f"crush it about as far"
        )
    shares = ("spring", fit.spring_error_N_m / wall.spring_N_m), ("damper", fit.damper_error_N_s_m / wall.damper_N_s_m)
    for name, share in shares:
        if share > UNSURE:
            yield f"the record hardly determines the {name}: its error is {share:.0%} of it"
    least = max(fit.touch_error_s, LEAST_SHIFT_S)
    first, last = fit.pulse.time_s[[0, -1]] - fit.touch_s
    if abs(fit.touch_s) > least:
        yield (
            f"the record shows first touch at {1e3 * fit.touch_s:.1f} ± {1e3 * fit.touch_error_s:.1f} ms, not at its "
            f"time 0; the fit counts from there"
        )
    if first > least:
        yield f"the record begins {1e3 * first:.1f} ms after first touch: what came before is what the fit makes of it"
    if list(fit.misfits) == ["acceleration"] and fit.offset_m_s2 is None:
        yield "the record has no rows before first touch to take the zero of the accelerometer from: it counts as right"
    if last < wall.peak_force_time_s:
        yield (
            f"the record ends {last:.3f} s after first touch, before the force peaks "
            f"({wall.peak_force_time_s:.3f} s by this fit)"
        )
    elif last < wall.max_displacement_time_s < math.inf:
        yield (
            f"the record ends {last:.3f} s after first touch, before the vehicle stops "
            f"({wall.max_displacement_time_s:.3f} s by this fit)"
        )


def _onset(problem: _Problem) -> float:
    """Return the first time at which a signal shows the impact, noise averaged out [s]."""
    times = []
    for name, values in problem.signals.items():
        time, smooth = problem.time[problem.known[name]], _smooth(values[problem.known[name]], 0.02)
        change = {"acceleration": -smooth, "velocity": smooth[0] - smooth, "displacement": smooth}[name]
        times.append(float(time[np.argmax(change > 0.3 * change.max())]))
    return min(times)


def _smooth(values: np.ndarray, share: float) -> np.ndarray:
    """Means over windows of a share of the values."""
    window = max(1, round(share * len(values)))
    sums = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((sums[window:] - sums[:-window]) / window)


def _rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _misfit_of(residuals: np.ndarray, span: float) -> SignalMisfit:
    """Describe the residuals of one signal."""
    smooth = _smooth(residuals, SMOOTHING_SHARE)
    scatter = float(residuals @ residuals)
    correlation = float(residuals[1:] @ residuals[:-1]) / scatter if scatter > 0.0 else 0.0
    size = _rms(residuals)
    return SignalMisfit(size, size / span, float(np.abs(smooth).max()) / span, correlation)
