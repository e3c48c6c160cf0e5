"""A user's own test data beside the simulation: root mean square and peak errors."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.errors import ComparisonError

if TYPE_CHECKING:
    from boulder_sweep.crash_tests.measured import TimeHistory
    from boulder_sweep.impact.trajectory import Trajectory

UNITS = {"rotation": "deg", "boulder_displacement": "m", "vehicle_displacement": "m"}


@dataclass(frozen=True)
class Deviation:
    """How far the simulation is from one measured signal.

    Attributes
    ----------
    signal, unit : str
        What was measured.
    until_s : float
        End of the time compared [s].
    samples : int
        Measured values compared.
    rms : float
        Root mean square of simulated minus measured.
    largest : float
        Largest difference, with its sign.
    measured_peak, simulated_peak : float
        Largest values up to that time.
    """

    signal: str
    unit: str
    until_s: float
    samples: int
    rms: float
    largest: float
    measured_peak: float
    simulated_peak: float

    @property
    def peak_error(self) -> float:
        """Simulated peak minus measured peak, as a share of the measured one."""
        if self.measured_peak == 0.0:
            return math.nan
        return (self.simulated_peak - self.measured_peak) / abs(self.measured_peak)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        error = self.peak_error
        return {**asdict(self), "peak_error": None if math.isnan(error) else error}


def simulated_signal(trajectory: Trajectory, name: str) -> np.ndarray:
    """Return what a measured signal is compared with; the boulder's own centre, as a camera tracks it."""
    if name == "rotation":
        return np.degrees(trajectory.rotation_rad)
    if name == "boulder_displacement":
        return trajectory.boulder_centre_displacement_m
    return trajectory.vehicle_displacement_m


def compare(trajectory: Trajectory, measured: TimeHistory) -> list[Deviation]:
    """Compare a simulation with measured signals, over the whole time and up to the rotation limit.

    Parameters
    ----------
    trajectory
        The simulation.
    measured
        Signals ``rotation`` [deg], ``boulder_displacement`` and ``vehicle_displacement`` [m]; gaps are left out.

    Returns
    -------
    list of Deviation
        For every signal one over the time that both cover, and where the simulated boulder passes its rotation limit a
        second one up to then, because the model does not hold beyond.

    Raises
    ------
    ComparisonError
        No measured value lies within the simulated time.
    """
    end = float(trajectory.time_s[-1]) if len(trajectory) else 0.0
    limit = trajectory.motion.outcome.t_limit
    found = []
    for name, values in measured.signals.items():
        for until in (end, limit) if math.isfinite(limit) else (end,):
            inside = np.isfinite(values) & (measured.time_s >= 0.0) & (measured.time_s <= until)
            if not inside.any():
                continue
            times, data = measured.time_s[inside], values[inside]
            simulated = np.interp(times, trajectory.time_s, simulated_signal(trajectory, name))
            error = simulated - data
            found.append(
                Deviation(
                    signal=name,
                    unit=UNITS[name],
                    until_s=until,
                    samples=len(data),
                    rms=float(np.sqrt(np.mean(error**2))),
                    largest=float(error[np.argmax(np.abs(error))]),
                    measured_peak=_peak(data),
                    simulated_peak=_peak(simulated),
                )
            )
    if not found:
        raise ComparisonError(
            f"{measured.path}: no measured value lies within the simulated time, 0 to {end:g} s; "
            f"time counts from first touch"
        )
    return found


def deviation_table(found: dict[str, list[Deviation]]) -> Table:
    """Return deviations by preset as a table."""
    table = Table(
        (
            "signal",
            "readings",
            "up to [s]",
            "values",
            "RMS error",
            "largest error",
            "measured peak",
            "simulated peak",
            "peak error",
        )
    )
    for preset, deviations in found.items():
        for d in deviations:
            digits = 2 if d.unit == "deg" else 4
            unit = "°" if d.unit == "deg" else f" {d.unit}"
            share = "-" if math.isnan(d.peak_error) else f"{d.peak_error:+.1%}"
            texts = (number(value, digits) + unit for value in (d.rms, d.largest, d.measured_peak, d.simulated_peak))
            label = d.signal.replace("_", " ")
            table.add(label, preset.replace("_", " "), f"{d.until_s:.3f}", str(d.samples), *texts, share)
    return table


def _peak(values: np.ndarray) -> float:
    """Value of the largest magnitude, with its sign."""
    return float(values[np.argmax(np.abs(values))])
