"""What a fit found: the vehicle, how sure it is, and where it does not fit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boulder_sweep.crash_tests.fitting.pulse import RESPONSES, UNITS, Pulse
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.drawing import draw


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
        draw("vehicle_fit", "draw_fit", self, path)
