"""Spring and damper of a vehicle from a rigid-wall crash pulse (Eqs 49 to 51).

The measured displacement, velocity or acceleration, or several of them at once, is compared by least squares with the
exact response of a Maxwell element (`boulder_sweep.crash_tests.rigid_wall`). The time of first touch is fitted too,
since the trigger sets the zero of the times of a record, and so are the speed, unless it is given, and the zero offset
of an acceleration that was recorded before first touch.

How sure the result is follows from a jackknife: it is fitted again without each of some 20 stretches of the record in
turn. Neighbouring samples share their noise, so whole stretches are left out (Kuensch 1989, Ann. Stat. 17, 1217-1241).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.crash_tests.measured import FEWEST_SAMPLES, PULSE_UNITS, TimeHistory
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.drawing import draw
from boulder_sweep.errors import FitError
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.units import range_words
from boulder_sweep.settings.values import is_unusual

MISFIT, NOT_NEAR = 0.05, 0.15
"""Root mean square of a misfit as a share of the signal's range, from which on the user is warned, and from which on
the fit is refused."""
UNSURE = 0.5
"""Error of a constant as a share of it from which on the user is warned; from 1 on it is refused."""
MOST_CRUSH_M = 10.0
"""Crush of a front that is longer than any vehicle's."""
SURE, GAUGE_SHARE = 1.5, 0.02
"""A speed is contradicted by the record beyond this many errors of 95 %, and this share of it."""
RATIO_BOUNDS = (2e-3, 2e2)
"""Range of c/sqrt(k m) that is searched; at its ends one of the two elements is as good as rigid."""
LEAST_SHIFT_S = 5e-4
"""A first touch this close to the zero of the times is not worth a word."""
BLOCKS, BLOCKS_BESIDE = 16, 4
"""Stretches that are left out in turn: from first touch to separation, and before and after it."""
FEWEST_BEFORE = 5
"""Rows before first touch from which on a zero offset is fitted."""
ROWS_AT_START = 300
"""Rows that starts are chosen by."""


class SignalMisfit(NamedTuple):
    """How far the fitted response is from one signal."""

    rms: float
    """Root mean square of the residuals, in the unit of the signal."""
    share: float
    """Root mean square of the residuals as a share of the range of the signal."""


@dataclass(frozen=True, eq=False)
class VehicleFit:
    """Result of `fit_pulse`. Every error is half the width of a 95 % interval.

    Errors follow from the scatter of the record. They say nothing about whether a Maxwell element is right at all.
    """

    pulse: TimeHistory
    wall: RigidWall
    touch_s: float
    """First touch, in times of the pulse [s]."""
    offset_m_s2: float | None
    """Zero offset of the acceleration; None where no rows before first touch show it."""
    spring_error_N_m: float
    damper_error_N_s_m: float
    touch_error_s: float
    speed_error_m_s: float | None
    """Error of the speed; None where the speed was given."""
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
                f"{name} [{PULSE_UNITS[name]}]": {"rms": m.rms, "share_of_range": m.share}
                for name, m in self.misfits.items()
            },
            "warnings": list(self.warnings),
        }

    def fitted(self, time_s: np.ndarray) -> dict[str, np.ndarray]:
        """Fitted response at times since first touch [s], by signal, with the zero offset of the acceleration in it."""
        values = dict(zip(PULSE_UNITS, self.wall.response(time_s), strict=True))
        return {name: values[name] + (self.offset_m_s2 or 0.0) * (name == "acceleration") for name in self.misfits}

    def plot(self, path: str | Path) -> None:
        """Draw pulse, fit and residuals, or raise a `PictureError`."""
        draw("crash_curves", "draw_fit", self, path)


class _Problem:
    """The least-squares problem in log sqrt(k/m), log(c/sqrt(k m)) and first touch.

    The response is linear in speed and zero offset, so both follow from these three, where they are not given.
    """

    def __init__(self, pulse: TimeHistory, mass_kg: float, speed_m_s: float | None) -> None:
        self.pulse, self.mass_kg, self.speed_m_s = pulse, mass_kg, speed_m_s
        self.has_offset = False
        self.kept = np.full(len(pulse.time_s), True)
        self.ranges = {
            name: float(np.nanmax(np.abs(v)) + np.nanmax(v) - np.nanmin(v)) for name, v in pulse.signals.items()
        }
        self.known = {name: np.isfinite(values) for name, values in pulse.signals.items()}
        time = pulse.time_s
        latest = min(time[known][-FEWEST_SAMPLES] for known in self.known.values())
        span = time[-1] - time[0]
        low = math.log(0.01 / span), math.log(RATIO_BOUNDS[0]), time[0] - span
        self.bounds = np.array(low), np.array([math.log(2000.0 / span), math.log(RATIO_BOUNDS[1]), latest])

    def wall(self, unknowns: np.ndarray, speed_m_s: float) -> RigidWall:
        """Vehicle that the unknowns stand for."""
        rate, ratio = math.exp(unknowns[0]), math.exp(unknowns[1])
        return RigidWall(self.mass_kg, speed_m_s, self.mass_kg * rate**2, ratio * rate * self.mass_kg)

    def solved(self, unknowns: np.ndarray) -> tuple[np.ndarray, float, float | None]:
        """Return measured minus fitted of all rows kept, as shares of the ranges, and speed and zero offset.

        A displacement counts from first touch: some records hold it at 0 before, others let it come up from below.
        """
        time = self.pulse.time_s - unknowns[2]
        response = dict(zip(PULSE_UNITS, self.wall(unknowns, 1.0).response(time), strict=True))
        data, shape, ones = [], [], []
        for name, values in self.pulse.signals.items():
            rows, is_length = self.known[name] & self.kept, name == "displacement"
            before = time[rows] < 0.0
            measured = np.where(before & is_length, np.maximum(values[rows], 0.0), values[rows])
            data.append(measured / self.ranges[name])
            shape.append(np.where(before & is_length, 0.0, response[name][rows]) / self.ranges[name])
            ones.append(np.full(len(measured), (name == "acceleration") / self.ranges[name]))
        left, columns = np.concatenate(data), [np.concatenate(ones)] if self.has_offset else []
        if self.speed_m_s is None:
            columns.insert(0, np.concatenate(shape))
        else:
            left = left - self.speed_m_s * np.concatenate(shape)
        linear = np.zeros(0)
        if columns:
            matrix = np.stack(columns, axis=1)
            linear = np.linalg.lstsq(matrix, left, rcond=None)[0]
            left = left - matrix @ linear
        speed = float(max(linear[0], 1e-6)) if self.speed_m_s is None else self.speed_m_s
        return left, speed, float(linear[-1]) if self.has_offset else None

    def starts(self, count: int = 4) -> list[np.ndarray]:
        """Return the best vehicles of a grid of rates, ratios and first touches.

        First touch is sought at the zero of the times, and at and ahead of the first row that shows the impact.
        """
        time, signals = self.pulse.time_s, self.pulse.signals
        every = max(1, len(time) // ROWS_AT_START)
        few = replace(
            self.pulse, time_s=time[::every], signals={name: values[::every] for name, values in signals.items()}
        )
        if any(np.isfinite(values).sum() < FEWEST_SAMPLES for values in few.signals.values()):
            few = self.pulse
        thin = _Problem(few, self.mass_kg, self.speed_m_s)
        found, onset = [], _onset(self.pulse)
        for rate in np.geomspace(0.5, 200.0, 14) / (time[-1] - time[0]):
            for ratio in np.geomspace(0.02, 20.0, 7):
                for touch in (0.0, onset, onset - 0.3 / rate, onset - 0.8 / rate):
                    guess = np.array([math.log(rate), math.log(ratio), touch])
                    if self.bounds[0][2] <= touch <= onset:
                        found.append((float(np.mean(thin.solved(guess)[0] ** 2)), guess))
        return [guess for _, guess in sorted(found, key=lambda pair: pair[0])[:count]]

    def solve(self, starts: list[np.ndarray]) -> np.ndarray:
        """Return the best solution from some starts."""
        from scipy.optimize import least_squares  # heavy, and only fits need it

        tight: dict[str, Any] = {"bounds": self.bounds, "x_scale": "jac", "xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
        tried = [least_squares(lambda x: self.solved(x)[0], np.clip(one, *self.bounds), **tight) for one in starts]
        return np.asarray(min(tried, key=lambda one: float(one.cost)).x)

    def best(self) -> np.ndarray:
        """Solve, with a zero offset of the acceleration where rows before first touch show it."""
        unknowns = self.solve(self.starts())
        before = self.pulse.time_s < unknowns[2]
        if "acceleration" in self.known and np.sum(self.known["acceleration"] & before) >= FEWEST_BEFORE:
            self.has_offset = True
            unknowns = self.solve([unknowns])
        return unknowns

    def errors(self, unknowns: np.ndarray) -> np.ndarray:
        """Half widths of the 95 % intervals of log k_v, log c_v, first touch and v_0 by a jackknife, shape (4,)."""
        from scipy.stats import t as student

        def constants(x: np.ndarray) -> np.ndarray:
            return np.array([2.0 * x[0], x[0] + x[1], x[2], self.solved(x)[1]])

        moved = []
        for block in self.stretches(unknowns):
            self.kept = np.full(len(self.pulse.time_s), True)
            self.kept[block] = False
            moved.append(constants(self.solve([unknowns])))
        self.kept = np.full(len(self.pulse.time_s), True)
        count = len(moved)
        scatter = np.sqrt((count - 1) / count * ((np.array(moved) - constants(unknowns)) ** 2).sum(axis=0))
        return np.asarray(student.ppf(0.975, min(BLOCKS, count) - 1) * scatter)

    def stretches(self, unknowns: np.ndarray) -> list[np.ndarray]:
        """Rows of each stretch: before first touch, up to separation, after it."""
        ends = unknowns[2], unknowns[2] + self.wall(unknowns, 1.0).separation_time_s
        parts = np.split(np.arange(len(self.pulse.time_s)), np.searchsorted(self.pulse.time_s, ends))
        counts = (BLOCKS_BESIDE, BLOCKS, BLOCKS_BESIDE)
        return [b for part, n in zip(parts, counts, strict=True) for b in np.array_split(part, n) if len(b)]


def fit_pulse(pulse: TimeHistory, mass_kg: float, *, speed_m_s: float | None = None) -> VehicleFit:
    """Fit spring and damper of a Maxwell element to a rigid-wall crash pulse; the speed too where it is not given.

    Raise `FitError` where mass or speed are not a vehicle's, the record contradicts the speed, no vehicle comes near
    the record, the record does not determine spring or damper, or they are not a vehicle's.
    """
    for name, column, value in (("mass", "vehicle_mass_kg", mass_kg), ("speed", "impact_speed_m_s", speed_m_s)):
        if value is not None and not 0.0 < value < math.inf:
            raise FitError(f"the {name} of the vehicle must be positive, not {value:g}")
        if value is not None and (words := _far_out(column, value)):
            raise FitError(f"--{name}: {words}; check its unit")
    fit = _fit(pulse, float(mass_kg), None)
    if speed_m_s is not None:
        record, error = fit.wall.speed_m_s, fit.speed_error_m_s or 0.0
        apart = abs(record - speed_m_s) > SURE * error + GAUGE_SHARE * record
        if apart and not _far_out("impact_speed_m_s", record):  # else the record ends too early to say
            raise FitError(
                f"{pulse.path}: the record says {record:.1f} ± {max(error, 0.05):.1f} m/s, "
                f"--speed {speed_m_s:.1f} m/s; check the speed, and the units and the zero offset of the record"
            )
        fit = _fit(pulse, float(mass_kg), float(speed_m_s))
    _refuse(fit)
    return replace(fit, warnings=tuple(_warnings(fit)))


def _fit(pulse: TimeHistory, mass_kg: float, speed_m_s: float | None) -> VehicleFit:
    """Fit a pulse, whatever comes out."""
    problem = _Problem(pulse, mass_kg, speed_m_s)
    unknowns = problem.best()
    errors = problem.errors(unknowns)
    left, speed, offset = problem.solved(unknowns)
    wall = problem.wall(unknowns, speed)
    ends = np.cumsum([known.sum() for known in problem.known.values()])[:-1]
    shares = {
        name: math.sqrt(float(np.mean(part**2))) for name, part in zip(pulse.signals, np.split(left, ends), strict=True)
    }
    return VehicleFit(
        pulse=pulse,
        wall=wall,
        touch_s=float(unknowns[2]),
        offset_m_s2=offset,
        spring_error_N_m=float(errors[0]) * wall.spring_N_m,
        damper_error_N_s_m=float(errors[1]) * wall.damper_N_s_m,
        touch_error_s=float(errors[2]),
        speed_error_m_s=None if speed_m_s is not None else float(errors[3]),
        misfits={name: SignalMisfit(share * problem.ranges[name], share) for name, share in shares.items()},
        warnings=(),
    )


def _far_out(name: str, value: float) -> str:
    """Return what is wrong with an input that no vehicle has, or nothing."""
    field = BY_NAME[name]
    usual, admitted = field.usual, field.admitted
    assert usual is not None
    assert admitted is not None
    if admitted.low <= value <= admitted.high and not is_unusual(np.array([value]), field)[0]:
        return ""
    unit = {"N/m": "kN/m", "N*s/m": "kN*s/m"}.get(field.unit, field.unit)
    ends = range_words(usual.low, usual.high, field.unit, unit, digits=4)
    return f"{range_words(value, value, field.unit, unit)} is far outside what vehicles have, {ends}"


def _refuse(fit: VehicleFit) -> None:
    """Refuse a fit that says nothing about a vehicle, with its reasons and what to do."""
    wall, ratio = fit.wall, fit.wall.damper_N_s_m / math.sqrt(fit.wall.spring_N_m * fit.wall.mass_kg)
    reasons = [
        f"no spring and damper in series come near it: the {name} is off by {misfit.share:.0%} of its range"
        for name, misfit in fit.misfits.items()
        if misfit.share > NOT_NEAR
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
    if not reasons:
        names = "impact_speed_m_s", "vehicle_spring_N_m", "vehicle_damper_N_s_m"
        found = ((BY_NAME[name].key, _far_out(name, fit.to_dict()[name])) for name in names)
        reasons = [f"the fitted {key} of {text}" for key, text in found if text]
        if wall.max_displacement_m > MOST_CRUSH_M:
            reasons.append(f"the fitted vehicle is crushed by {wall.max_displacement_m:,.0f} m, more than it is long")
    if reasons:
        raise FitError(f"{fit.pulse.path}: {'; '.join(reasons)}. {_what_to_do(fit)}")


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
    for name, misfit in fit.misfits.items():
        if misfit.share > MISFIT:
            yield (
                f"the {name} is off by {misfit.share:.0%} of its range: the record is noisy, or this front is not a "
                f"spring and a damper in series"
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
            f"time 0; the fit counts from there. If time 0 is right, this front is not a spring and a damper in series "
            f"but stiffens as it is crushed: use the constants only for impacts that crush it about as far"
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


def _onset(pulse: TimeHistory) -> float:
    """Return the first time at which a signal has changed by a third of its change [s]."""
    times = []
    for name, values in pulse.signals.items():
        known = np.isfinite(values)
        change = values[known] if name == "displacement" else values[known][0] - values[known]
        times.append(float(pulse.time_s[known][np.argmax(change > change.max() / 3.0)]))
    return min(times)
