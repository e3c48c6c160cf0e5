"""A user's crash test over the simulation by both presets of readings: a table of peaks, and a picture of the curves.

Beyond the limit of the rotation the model does not hold, so peaks count up to where either reaches it first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.crash_tests import measured as files
from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.drawing import draw
from boulder_sweep.errors import ComparisonError
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.quantiles import MEAN, at_values
from boulder_sweep.settings import load
from boulder_sweep.settings.model import PRESETS

if TYPE_CHECKING:
    from boulder_sweep.impact.trajectory import Trajectory

OPPOSED = -0.5
"""Correlation about zero below which a measured signal runs against the simulated one."""
DIGITS = {"deg": 2, "m/s^2": 1, "m": 4}


@dataclass(frozen=True)
class Peak:
    """Values of the largest magnitude of one signal up to a time, with their signs, by one preset of readings.

    `error` is by how much the simulated one is larger, as a share of the measured one; None where their signs differ.
    """

    signal: str
    unit: str
    readings: str
    until_s: float
    measured: float
    simulated: float
    error: float | None


@dataclass(frozen=True, eq=False)
class Overlay:
    """A test and its simulations: trajectories by preset, the peaks of every signal, and notes.

    The notes name signals that run against every simulation.
    """

    name: str
    measured: files.TimeHistory
    trajectories: Mapping[str, Trajectory]
    peaks: list[Peak]
    notes: list[str]

    def table(self) -> Table:
        """Return the peaks as a table."""
        table = Table(("signal", "readings", "up to [s]", "measured peak", "simulated peak", "error"))
        for peak in self.peaks:
            unit = "°" if peak.unit == "deg" else f" {peak.unit}"
            values = (number(value, DIGITS[peak.unit]) + unit for value in (peak.measured, peak.simulated))
            error = "-" if peak.error is None else f"{peak.error:+.1%}"
            words = (text.replace("_", " ") for text in (peak.signal, peak.readings))
            table.add(*words, f"{peak.until_s:.3f}", *values, error)
        return table

    def to_dict(self) -> dict[str, Any]:
        """Return peaks and notes as plain data."""
        return {"peaks": [asdict(peak) for peak in self.peaks], "notes": self.notes}

    def plot(self, folder: Path) -> Path:
        """Draw the curves into a folder, and return the picture; raise `PictureError` where that fails."""
        target = folder / f"measured_{self.measured.path.stem}.png"
        draw("crash_curves", "draw_crash_test", self.name, self.trajectories, target, self.measured)
        return target


def overlay(measured: str | Path, case: str) -> Overlay:
    """Simulate a crash test that a user has made, under both presets, for as long as it was measured.

    The test is measured in a CSV file, see `read_history`; `case` is ``abg`` or ``rwg``, the tests of the paper, or a
    settings file with one design. Uncertain inputs are taken at their means: what the test was, not the worst that it
    may have been. Raise `SettingsError` where a file is not valid, `ComparisonError` where the settings hold several
    designs, or there is nothing to compare.
    """
    history = files.read_history(measured, files.TEST_SIGNALS)
    sweep = crash_test(case) if case in NAMES else load(case)
    if sweep.n_designs != 1:
        raise ComparisonError(f"--case {case} holds {sweep.n_designs:,} designs; a test is one")
    sweep = at_values(sweep, MEAN) if sweep.distributions else sweep
    horizon = max(float(history.time_s[-1]), 0.0) or None
    trajectories = {preset: simulate(sweep, readings=preset, horizon_s=horizon) for preset in PRESETS}
    for trajectory in trajectories.values():
        if not len(trajectory):
            reason = trajectory.reason.replace("_", " ")
            raise ComparisonError(f"--case {case}: there is no motion to compare with: {trajectory.verdict}, {reason}")
    peaks = list(peaks_of(history, trajectories))
    if not peaks:
        end = min(float(trajectory.time_s[-1]) for trajectory in trajectories.values())
        raise ComparisonError(
            f"{history.path}: no measured value lies within the simulated time, 0 to {end:g} s; "
            f"time counts from first touch"
        )
    return Overlay(sweep.name, history, trajectories, peaks, list(opposed(history, trajectories)))


def peaks_of(measured: files.TimeHistory, trajectories: Mapping[str, Trajectory]) -> Iterator[Peak]:
    """Yield the peaks of every measured signal under every preset, up to the limit of the rotation."""
    for signal in (one for one in files.TEST_SIGNALS if one.name in measured.signals):
        for readings, trajectory in trajectories.items():
            limit = math.degrees(trajectory.motion.control.theta_limit)
            ends = float(trajectory.time_s[-1]), trajectory.motion.outcome.t_limit, _reached(measured, limit)
            until = min(end for end in ends if not math.isnan(end))
            times, values = _known(measured, signal.name, until)
            if not len(times):
                continue
            # Between the samples of a camera the simulation may move further: its own samples count.
            curve = simulated_signal(trajectory, signal.name)[trajectory.time_s <= times[-1]]
            test, own = (float(found[np.argmax(np.abs(found))]) for found in (values, curve))
            error = None if test == 0.0 or test * own < 0.0 else own / test - 1.0
            yield Peak(signal.name, signal.unit, readings, until, test, own, error)


def opposed(measured: files.TimeHistory, trajectories: Mapping[str, Trajectory]) -> Iterator[str]:
    """Yield what to say of signals that run against every simulation, as a film from the other side makes them."""
    for signal in (one for one in files.TEST_SIGNALS if one.name in measured.signals):
        alike = []
        for trajectory in trajectories.values():
            times, values = _known(measured, signal.name, float(trajectory.time_s[-1]))
            curve = np.interp(times, trajectory.time_s, simulated_signal(trajectory, signal.name))
            size = float(np.linalg.norm(curve) * np.linalg.norm(values))
            alike.append(float(curve @ values) / size if size > 0.0 else 0.0)
        if max(alike) < OPPOSED:
            yield (
                f"the measured {signal.name} runs against the simulated one, as in a mirrored film, taken from the "
                f"other side, or from a sensor turned round. It counts as positive {signal.positive}; if it is "
                f"mirrored, change the sign of this column. The figures take it as it is"
            )


def simulated_signal(trajectory: Trajectory, name: str) -> np.ndarray:
    """Return what a measured signal is compared with; the boulder's own centre, as a camera tracks it."""
    return {
        files.ROTATION.name: np.degrees(trajectory.rotation_rad),
        files.BOULDER.name: trajectory.boulder_centre_displacement_m,
        files.VEHICLE.name: trajectory.vehicle_displacement_m,
        files.VEHICLE_ACCELERATION.name: trajectory.vehicle_acceleration_m_s2,
    }[name]


def _known(measured: files.TimeHistory, name: str, until_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values of a signal from first touch to a time, without gaps, shape (n,)."""
    values, time = measured.signals[name], measured.time_s
    known = np.isfinite(values) & (time >= 0.0) & (time <= until_s)
    return time[known], values[known]


def _reached(measured: files.TimeHistory, limit_deg: float) -> float:
    """Return when a measured rotation first reaches a limit, linear between samples [s]; NaN for never or unknown."""
    if files.ROTATION.name not in measured.signals:
        return math.nan
    time, angle = _known(measured, files.ROTATION.name, math.inf)
    beyond = np.flatnonzero(np.abs(angle) >= limit_deg)
    if not len(beyond):
        return math.nan
    around = slice(max(int(beyond[0]) - 1, 0), int(beyond[0]) + 1)
    return float(np.interp(limit_deg, np.abs(angle[around]), time[around]))
