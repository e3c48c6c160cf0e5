"""A rigid-wall crash pulse, one or more signals over the time since first touch, and what a fit to it gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boulder_sweep.crash_tests.measured import PULSE_SIGNALS, TimeHistory, read_history
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.drawing import draw
from boulder_sweep.errors import FitError

RESPONSES: dict[str, Callable[[RigidWall, np.ndarray], np.ndarray]] = {
    "displacement": RigidWall.displacement,
    "velocity": RigidWall.velocity,
    "acceleration": RigidWall.acceleration,
}
"""What a Maxwell element answers to each signal."""
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
FEWEST_SAMPLES = 8
SIZES = (1e-9, 1e9)
"""Least and greatest peak of a signal that is accepted, in its unit: far beyond any impact."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """A rigid-wall crash pulse.

    Attributes
    ----------
    name : str
        Where it comes from.
    time_s : ndarray, shape (n,)
        Times since first touch [s], ascending, from 0 on.
    signals : dict of str to ndarray, shape (n,)
        ``displacement`` [m], ``velocity`` [m/s], ``acceleration`` [m/s^2], one or more; NaN in gaps.
    """

    name: str
    time_s: np.ndarray
    signals: dict[str, np.ndarray]


def read_pulse(path: str | Path) -> Pulse:
    """Read a crash pulse from a CSV file; see `boulder_sweep.crash_tests.measured` for its header.

    Raises
    ------
    SettingsError
        The file is not valid.
    FitError
        Its signals contradict the direction of an impact.
    """
    return pulse_of(read_history(path, PULSE_SIGNALS))


def pulse_of(history: TimeHistory) -> Pulse:
    """Return the part of a measured history from first touch on; a deceleration becomes an acceleration.

    Raises
    ------
    FitError
        Fewer than 8 samples are left, the vehicle seems to be accelerated by the wall or to move away from it, or a
        signal does not change or has a size that no impact has.
    """
    signals = dict(history.signals)
    if "deceleration" in signals:
        if "acceleration" in signals:
            raise FitError(f"{history.path}: holds both acceleration and deceleration; give one of them")
        signals["acceleration"] = -signals.pop("deceleration")
    after = history.time_s >= 0.0
    time = history.time_s[after]
    signals = {name: values[after] for name, values in signals.items()}
    for name, values in signals.items():
        if np.isfinite(values).sum() < FEWEST_SAMPLES:
            raise FitError(f"{history.path}: {name} has fewer than {FEWEST_SAMPLES} values from first touch (t = 0) on")
        _check_size(f"{history.path}: the {name}", values, name)
    if "acceleration" in signals and np.nanmean(signals["acceleration"]) > 0.0:
        raise FitError(
            f"{history.path}: the acceleration is positive, as if the wall pushed the vehicle on; "
            f"if it counts slowing down as positive, name the column deceleration"
        )
    for name, values in signals.items():
        # The first that noise does not explain: the rebound, which is negative, comes later.
        if name != "acceleration" and values[np.abs(values) >= 0.25 * np.nanmax(np.abs(values))][0] < 0.0:
            raise FitError(f"{history.path}: the {name} is negative at first; it counts as positive towards the wall")
    return Pulse(str(history.path), time, signals)


def _check_size(label: str, values: np.ndarray, name: str) -> None:
    """Refuse a signal without motion, or of a size that no impact has; a constant deceleration stops a vehicle too."""
    size, unit = float(np.nanmax(np.abs(values))), UNITS[name]
    if size == 0.0 or (name != "acceleration" and np.nanmin(values) == np.nanmax(values)):
        raise FitError(f"{label} does not change; it must show how the wall stops the vehicle")
    if not SIZES[0] <= size <= SIZES[1]:
        raise FitError(f"{label} reaches {size:.3g} {unit}, which is not that of an impact; check the column's unit")


@dataclass(frozen=True)
class SignalMisfit:
    """How far the fitted response is from one signal.

    Attributes
    ----------
    rms : float
        Root mean square of the residuals, in the unit of the signal.
    share : float
        The same as a share of the signal's range.
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
                f"{name} [{UNITS[name]}]": {"rms": m.rms, "share_of_range": m.share, "systematic": m.systematic_share}
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
