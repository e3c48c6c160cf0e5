"""A user's crash test against every form of the model that is asked about: peaks, time to the limit, curves.

The forms are the paper's law of the soil by both presets of readings, the model of the settings file where that is
another one, and the second opinions for which the file asks. Beyond the limit of the rotation the model does not hold,
so all but the time of the limit is compared up to where test or simulation first reaches it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import Status
from boulder_kernels.second_opinion import HeaveControl, HeaveRecord, second_opinions
from boulder_sweep.crash_tests.measured import BOULDER, ROTATION, TEST_SIGNALS, TIME, VEHICLE_ACCELERATION, TimeHistory
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.errors import ComparisonError
from boulder_sweep.impact.simulation import SAMPLE_S, simulate
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.robustness import can_be_asked
from boulder_sweep.settings.model import PRESETS, RESISTANCES
from boulder_sweep.soils import with_law

if TYPE_CHECKING:
    from boulder_sweep.impact.trajectory import Trajectory
    from boulder_sweep.settings import Sweep

UNITS = {signal.name: signal.unit for signal in TEST_SIGNALS if signal is not TIME}


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
        Values of the largest magnitude up to the last of the samples, with their signs.
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
        """By how much the simulated peak is larger, as a share of the measured one; NaN where their signs differ."""
        return _share(self.measured_peak, self.simulated_peak)

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
    if name == VEHICLE_ACCELERATION.name:
        return trajectory.vehicle_acceleration_m_s2
    return trajectory.vehicle_displacement_m


def compare(trajectory: Trajectory, measured: TimeHistory) -> list[Deviation]:
    """Compare a simulation with measured signals, over the whole time and up to the rotation limit.

    Parameters
    ----------
    trajectory
        The simulation.
    measured
        Signals of `TEST_SIGNALS`; gaps are left out.

    Returns
    -------
    list of Deviation
        For every signal one over the time that both cover, and where the simulated or the measured boulder passes its
        rotation limit a second one up to then, because the model does not hold beyond.

    Raises
    ------
    ComparisonError
        No measured value lies within the simulated time.
    """
    end = float(trajectory.time_s[-1]) if len(trajectory) else 0.0
    when = time_of_limit(measured, math.degrees(trajectory.motion.control.theta_limit))
    limits = [time for time in (trajectory.motion.outcome.t_limit, when) if time < end]
    deviations = []
    for name, values in measured.signals.items():
        curve = simulated_signal(trajectory, name)
        for until in (end, min(limits)) if limits else (end,):
            inside = np.isfinite(values) & (measured.time_s >= 0.0) & (measured.time_s <= until)
            if not inside.any():
                continue
            times, data = measured.time_s[inside], values[inside]
            error = np.interp(times, trajectory.time_s, curve) - data
            peaks = _peaks(times, data, trajectory.time_s, curve)
            deviations.append(
                Deviation(
                    signal=name,
                    unit=UNITS[name],
                    until_s=until,
                    samples=len(data),
                    rms=float(np.sqrt(np.mean(error**2))),
                    largest=float(error[np.argmax(np.abs(error))]),
                    measured_peak=peaks[0],
                    simulated_peak=peaks[1],
                )
            )
    if not deviations:
        raise ComparisonError(
            f"{measured.path}: no measured value lies within the simulated time, 0 to {end:g} s; "
            f"time counts from first touch"
        )
    return deviations


def deviation_table(by_preset: dict[str, list[Deviation]]) -> Table:
    """Return deviations by preset as a table."""
    what, errors = ("signal", "readings", "up to [s]", "values"), ("RMS error", "largest error")
    table = Table((*what, *errors, "measured peak", "simulated peak", "peak error"))
    for preset, deviations in by_preset.items():
        for d in deviations:
            digits = {"deg": 2, "m/s^2": 1}.get(d.unit, 4)
            unit = "°" if d.unit == "deg" else f" {d.unit}"
            share = "-" if math.isnan(d.peak_error) else f"{d.peak_error:+.1%}"
            texts = (number(value, digits) + unit for value in (d.rms, d.largest, d.measured_peak, d.simulated_peak))
            label = d.signal.replace("_", " ")
            table.add(label, preset.replace("_", " "), f"{d.until_s:.3f}", str(d.samples), *texts, share)
    return table


def opposed(trajectories: Collection[Trajectory], measured: TimeHistory) -> list[str]:
    """Return what to say of signals that run against every simulation, as a film from the other side makes them.

    Parameters
    ----------
    trajectories
        Simulations of the test.
    measured
        What was measured.
    """
    notes = []
    for signal in TEST_SIGNALS:
        values = measured.signals.get(signal.name)
        if values is None:
            continue
        alike = []
        for trajectory in trajectories:
            inside = np.isfinite(values) & (measured.time_s >= 0.0) & (measured.time_s <= trajectory.time_s[-1])
            curve = np.interp(measured.time_s[inside], trajectory.time_s, simulated_signal(trajectory, signal.name))
            size = float(np.linalg.norm(curve) * np.linalg.norm(values[inside]))
            alike.append(float(curve @ values[inside]) / size if size > 0.0 else 0.0)
        if max(alike) < OPPOSED:
            notes.append(
                f"the measured {signal.name} runs against the simulated one, as in a mirrored film, taken from the "
                f"other side, or from a sensor turned round. It counts as positive {signal.positive}; if it is "
                f"mirrored, change the sign of this column. The figures take it as it is"
            )
    return notes


def _peaks(times: np.ndarray, data: np.ndarray, curve_times: np.ndarray, curve: np.ndarray) -> tuple[float, float]:
    """Return measured and simulated values of the largest magnitude, with their signs.

    Between the samples of a camera the simulation may move further: its own samples up to the last of them count.
    """
    whole = curve[curve_times <= times[-1]]
    return float(data[np.argmax(np.abs(data))]), float(whole[np.argmax(np.abs(whole))])


def _share(measured: float, simulated: float) -> float:
    """Return by how much a simulated peak is larger, as a share of the measured one; NaN where their signs differ."""
    return math.nan if measured == 0.0 or measured * simulated < 0.0 else simulated / measured - 1.0


OPPOSED = -0.5
"""Correlation about zero below which a measured signal runs against the simulated one."""
TIME_TO_LIMIT = "time to the limit"
MOST_TIMES = 20_000
"""Most samples of a second opinion."""


@dataclass(frozen=True, eq=False)
class Form:
    """One form of the model for one test.

    Attributes
    ----------
    name : str
        In words.
    time_s : ndarray
        Times [s].
    signals : dict of str to ndarray
        What a test may measure, by the names and units of `boulder_sweep.crash_tests.measured.TEST_SIGNALS`.
    t_limit_s : float
        Time at which the rotation reaches its limit; NaN for never.
    """

    name: str
    time_s: np.ndarray
    signals: Mapping[str, np.ndarray]
    t_limit_s: float


@dataclass(frozen=True)
class Score:
    """How one form of the model does in one respect.

    Attributes
    ----------
    form, quantity, unit : str
        What is compared.
    measured, simulated : float or None
        Values; None for a limit that is never reached. Of a curve, 0 and the root mean square of the difference.
    error : float or None
        Their difference as a share of the measured value; of a curve, of the measured peak.
    side : str
        ``safe`` where the model moves more or reaches the limit earlier than the test, ``unsafe`` where less; empty
        where neither can be said.
    """

    form: str
    quantity: str
    unit: str
    measured: float | None
    simulated: float | None
    error: float | None
    side: str

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return asdict(self)


def forms_of(sweep: Sweep, trajectories: Mapping[str, Trajectory], horizon_s: float | None) -> list[Form]:
    """Return the forms of the model that a test is scored against.

    Parameters
    ----------
    sweep
        One design, without uncertain inputs.
    trajectories
        The paper's law by preset, as of `by_the_paper`.
    horizon_s
        Time simulated [s]; that of the sweep for None.
    """
    forms = [_of_trajectory(f"paper's law, {preset.replace('_', ' ')}", t) for preset, t in trajectories.items()]
    model = sweep.model
    other = [model.resistance] if model.resistance != RESISTANCES[0] else []
    if other or model.preset not in PRESETS:
        words = ", ".join(name.replace("_", " ") for name in (model.preset, *other))
        forms.append(_of_trajectory(f"the file's model: {words}", simulate(sweep, horizon_s=horizon_s)))
    if can_be_asked(sweep):
        forms += [_of_opinion(sweep, law, horizon_s or sweep.solver.horizon_s) for law in model.second_opinion]
    return forms


def by_the_paper(sweep: Sweep, preset: str, horizon_s: float | None) -> Trajectory:
    """Return the impact by the paper's law of the soil and a preset of readings."""
    model = dataclasses.replace(sweep.model, resistance=RESISTANCES[0])
    return simulate(dataclasses.replace(sweep, model=model), readings=preset, horizon_s=horizon_s)


def _of_trajectory(name: str, trajectory: Trajectory) -> Form:
    signals = {signal: simulated_signal(trajectory, signal) for signal in UNITS}
    when = trajectory.motion.outcome.t_limit
    return Form(name, trajectory.time_s, signals, when if math.isfinite(when) else math.nan)


def _of_opinion(sweep: Sweep, law: str, horizon_s: float) -> Form:
    """Return a second opinion: the impact with friction and vertical motion under another law of the soil."""
    designs = designs_of(sweep.block(0, 1), None, sweep.model)
    table = with_law(designs.table, law, sweep.model.resistance)
    limit = math.radians(sweep.criterion.max_rotation_deg)
    times = np.linspace(0.0, horizon_s, min(round(horizon_s / SAMPLE_S) + 1, MOST_TIMES))
    record = HeaveRecord(times, np.full((len(times), 8), np.nan), np.full(len(times), np.nan))
    second_opinions(table, HeaveControl(limit, horizon_s, stop=False), record=record)
    decided = second_opinions(table, HeaveControl(limit, horizon_s))
    kept = np.isfinite(record.states[:, 0])
    x, theta, _, x_v = record.states[kept, :4].T
    v_v = record.states[kept, 7]
    body = simulate(sweep, horizon_s=horizon_s).motion
    along, up = 0.5 * body.design.L - body.constants.c_x, 0.5 * body.design.H - body.constants.c_y
    signals = {
        ROTATION.name: np.degrees(theta),
        BOULDER.name: x + along * (np.cos(theta) - 1.0) + up * np.sin(theta),
        "vehicle_displacement": x_v,
        "vehicle_acceleration": np.gradient(v_v, times[kept]),
    }
    status, reached_at = (float(np.asarray(array)[0]) for array in (decided.status, decided.t_limit))
    when = reached_at if status == Status.LIMIT.value else math.nan
    return Form(f"second opinion, {law.replace('_', ' ')}", times[kept], signals, when)


def scores(forms: Sequence[Form], measured: TimeHistory, limit_deg: float) -> list[Score]:
    """Return how every form does, in the order of what was measured.

    Parameters
    ----------
    forms
        The forms.
    measured
        What was measured.
    limit_deg
        Limit of the rotation [deg].
    """
    when = time_of_limit(measured, limit_deg)
    rows = []
    if ROTATION.name in measured.signals:
        rows += [_of_time(form, when) for form in forms]
    for name in measured.signals:
        for form in forms:
            rows += _of_signal(form, measured, name, when)
    return rows


def time_of_limit(measured: TimeHistory, limit_deg: float) -> float:
    """Return when a measured rotation first reaches a limit, linear between samples [s]; NaN for never or unknown."""
    values = measured.signals.get(ROTATION.name)
    if values is None:
        return math.nan
    known = np.isfinite(values) & (measured.time_s >= 0.0)
    time, angle = measured.time_s[known], np.abs(values[known])
    beyond = np.flatnonzero(angle >= limit_deg)
    if not len(beyond):
        return math.nan
    at = int(beyond[0])
    if at == 0:
        return float(time[0])
    share = (limit_deg - angle[at - 1]) / (angle[at] - angle[at - 1])
    return float(time[at - 1] + share * (time[at] - time[at - 1]))


def _of_time(form: Form, when: float) -> Score:
    """Compare the times at which the rotation reaches its limit; one that is never reached is the latest."""
    measured, simulated = (None if math.isnan(time) else time for time in (when, form.t_limit_s))
    test, model = (math.inf if time is None else time for time in (measured, simulated))
    error = (model - test) / test if math.isfinite(test) and math.isfinite(model) and test > 0.0 else None
    side = "" if test == model else "safe" if model < test else "unsafe"
    return Score(form.name, TIME_TO_LIMIT, "s", measured, simulated, error, side)


def _of_signal(form: Form, measured: TimeHistory, name: str, when: float) -> list[Score]:
    """Compare the peak of one signal, and its curve, up to the limit."""
    ends = (float(form.time_s[-1]) if len(form.time_s) else 0.0, when, form.t_limit_s)
    end = min(time for time in ends if not math.isnan(time))
    values = measured.signals[name]
    inside = np.isfinite(values) & (measured.time_s >= 0.0) & (measured.time_s <= end)
    if not inside.any() or not len(form.time_s):
        return []
    times, data = measured.time_s[inside], values[inside]
    simulated = np.interp(times, form.time_s, form.signals[name])
    peaks = _peaks(times, data, form.time_s, form.signals[name])
    share = _share(*peaks)
    unsaid = share == 0.0 or math.isnan(share) or name == VEHICLE_ACCELERATION.name
    side = "" if unsaid else "safe" if share > 0.0 else "unsafe"
    error = None if math.isnan(share) else share
    rms = float(np.sqrt(np.mean((simulated - data) ** 2)))
    words, unit = name.replace("_", " "), UNITS[name]
    return [
        Score(form.name, f"peak {words}", unit, *peaks, error, side),
        Score(form.name, f"curve of {words}", unit, 0.0, rms, rms / abs(peaks[0]) if peaks[0] else None, ""),
    ]


def score_table(scored: Sequence[Score]) -> Table:
    """Return scores as a table."""
    table = Table(("what", "model", "test", "model's", "error", "side"))
    for score in scored:
        digits = {"deg": 2, "s": 4, "m/s^2": 1}.get(score.unit, 3)
        unit = "°" if score.unit == "deg" else f" {score.unit}"
        curve = score.quantity.startswith("curve")
        measured, simulated = (
            "never" if value is None else number(value, digits) + unit for value in (score.measured, score.simulated)
        )
        error = "-" if score.error is None else f"{score.error:.1%} RMS" if curve else f"{score.error:+.1%}"
        table.add(score.quantity, score.form, "-" if curve else measured, simulated, error, score.side or "-")
    return table
