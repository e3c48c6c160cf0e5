"""One design with its time history: from a sweep, a file or a row of a table to a `Trajectory`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from boulder_kernels import Control, Outcome, Readings, Record, no_record
from boulder_kernels import simulate as simulate_impact
from boulder_kernels._jit import plain
from boulder_kernels.control import control_for
from boulder_kernels.dynamics import BOX, constants_in
from boulder_kernels.outcomes import FINER, NONE_NEEDED
from boulder_kernels.table import is_layered, is_paired, problem_at, step_of_solution
from boulder_sweep.columns import BOULDER_MASS, BY_NAME, INPUT_COLUMNS, OPTIONAL_COLUMNS, SHAPES
from boulder_sweep.impact.history import MODE_NAMES, Motion, forces_along
from boulder_sweep.impact.trajectory import Trajectory
from boulder_sweep.judge.accuracy import accuracy_of, finer_controls, reported_step_s
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.judged import Judged, worst_case, worst_of
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.fields import FIELDS, INPUTS
from boulder_sweep.settings.model import Model, ReadingChoice, SolverSettings
from boulder_sweep.settings.problems import nearest
from boulder_sweep.stones.rock import ROCK_KG_M3

__all__ = ["Trajectory", "simulate"]

SAMPLE_S = 0.0005
"""Time between two samples of a trajectory [s]."""
MOST_SAMPLES = 1_000_000
SEEN_AFTER = 0.5
"""A boulder that overturns is shown for at least this share of the horizon beyond its limit."""
BEFORE_THE_END = 1.0 - 1e-14
"""The last sample is taken this close to the end, so that rounding cannot place it after the end."""

_DEFAULTS = {field.name: field.default for field in FIELDS if field.default is not None}
"""Inputs that a design given as a mapping may leave out, as a file may."""


def simulate(
    design: Sweep | str | Path | Mapping[str, Any],
    design_id: int = 0,
    *,
    readings: str | ReadingChoice | None = None,
    soil_elements: int | None = None,
    step_s: float | None = None,
    horizon_s: float | None = None,
    sample_s: float = SAMPLE_S,
) -> Trajectory:
    """Simulate one design: its row of ``sweep run``, and its time history, beyond the rotation limit.

    Parameters
    ----------
    design : Sweep, path, or mapping
        A sweep, a file of settings, or one design by the names and units of the table's input columns (a row
        of a result table will do; ``embedment_ratio`` may stand in for ``embedment_depth_m``). What else decides a
        verdict then has the defaults of a file: 20 deg, P1, corrected readings, balanced accuracy, 1 s.
    design_id : int
        Number of the design within the sweep.
    readings : str or ReadingChoice, optional
        ``as_printed``, ``corrected``, or single readings; the sweep's by default.
    soil_elements : int, optional
        Number of soil elements, 0 for the closed form; as the sweep says by default.
    step_s : float, optional
        Step of the integrator [s], used as it is; by default what the accuracy of the sweep asks for.
    horizon_s : float, optional
        Time simulated [s]; the sweep's by default.
    sample_s : float
        Time between two samples of the trajectory [s]. Maxima do not depend on it.

    Returns
    -------
    Trajectory
        Arrays in SI units. No samples where the truck passes over the boulder or the design cannot be
        computed; ``summary()`` then says why.

    Raises
    ------
    SettingsError
        The file is not valid.
    IndexError
        There is no such design.
    ValueError
        An input is missing, or a time is not positive.

    Notes
    -----
    What is said of the design is its row of ``sweep run``, from the same function: verdict, reason, margin, maxima up
    to ``end_time_s``, where the rotation has reached its limit or nothing can grow any more. The arrays go on: to the
    horizon, past the limit up to half a turn, and at least as long as the row was simulated. Beyond the limit the model
    no longer holds: what is shown there is how it goes wrong. A design so stiff, thousands of times what is met in
    practice, that its row was simulated as a last resort has no samples.
    """
    sweep = _as_sweep(design)
    sweep = at_values(sweep)
    sweep = _changed(sweep, readings, soil_elements, step_s, horizon_s)
    block = sweep.block(design_id, design_id + 1)
    if block.reasons[0]:
        raise ValueError(f"design {design_id} cannot be computed: {block.reasons[0]}")
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    evaluation = evaluation.asked() if sweep.model.second_opinion else evaluation
    return history_of(sweep, design_id, evaluation, evaluation.by_case(block), sample_s)


def history_of(
    sweep: Sweep, design_id: int, evaluation: Evaluation, cases: list[Judged], sample_s: float = SAMPLE_S
) -> Trajectory:
    """Return the time history of a design that can be computed, by how its row was simulated (Eqs 53, 54, 55).

    The row is given as judged in each case: the history is of the one that decides. Raise ValueError where there would
    be too many samples, or `sample_s` is not positive.
    """
    judged, worst = worst_of(cases), int(worst_case(cases)[0])
    sweep = (sweep, *sweep.cases)[worst]
    block = dataclasses.replace(sweep.block(design_id, design_id + 1), cases=())
    inputs = {name: float(column.to_numpy()[0]) for name, column in block.columns.items()}
    designs = evaluation.designs(block)
    row, how = judged.row(0), evaluation.readings
    if row["shape"] is not None:
        designs = designs.in_shape(SHAPES.index(row["shape"]), sweep.model)
    control = evaluation.control_of_shape(row["shape"])
    deciding = _deciding(control, how, row["step_s"], layered=is_layered(designs.table))
    drawn = deciding._replace(stop_at_limit=False, horizon=_drawn_s(row, deciding.horizon))
    times = _sample_times(drawn.horizon, sample_s)
    record = _empty_record(times)
    problem = problem_at(designs.table, 0, drawn)
    outcome = simulate_impact(problem, how, drawn, record)
    c = constants_in(problem.design, how, drawn.elements, problem.profile)
    outline = BOX if problem.profile is None else problem.profile.outline
    record = _kept(record, times, outcome)
    motion = Motion(problem.design, how, c, drawn, record, outcome, outline)
    decided = simulate_impact(problem_at(designs.table, 0, deciding), how, deciding, no_record())
    x_b, v_b, theta, omega, x_v, v_v = record.states.T
    along, up = motion.body.x - c.c_x, motion.body.y - c.c_y
    return Trajectory(
        name=sweep.name,
        design_id=design_id,
        inputs=inputs,
        settings=sweep.resolved(),
        time_s=record.times,
        boulder_displacement_m=x_b,
        boulder_centre_displacement_m=x_b - along * 2.0 * np.sin(0.5 * theta) ** 2 + up * np.sin(theta),
        boulder_velocity_m_s=v_b,
        rotation_rad=theta,
        angular_velocity_rad_s=omega,
        vehicle_displacement_m=x_v,
        vehicle_velocity_m_s=v_v,
        **forces_along(motion),
        rotation_mode=np.array([MODE_NAMES[int(mode)] for mode in record.turning], dtype=object),
        in_contact=np.where(record.touching, "touching", "coasting").astype(object),
        judged=judged,
        decided=decided,
        motion=motion,
    )


def _as_sweep(design: Sweep | str | Path | Mapping[str, Any]) -> Sweep:
    """Return the design as a sweep."""
    if isinstance(design, Sweep):
        return design
    if isinstance(design, str | Path):
        return load(design)
    given = dict(design.items())
    names = (*INPUT_COLUMNS, *OPTIONAL_COLUMNS, "embedment_ratio")
    meant = dict.fromkeys(names) | {field.key: field.name for field in INPUTS}
    for key, value in given.items():  # a row may have labels, too
        if key in (*BY_NAME, *names) or isinstance(value, str) or str(key).lower().endswith(("id", "name")):
            continue
        if near := nearest(str(key), meant, cutoff=0.8):
            raise ValueError(f"'{key}' is no column of a design; did you mean {meant[near] or near}?")
    constants = _DEFAULTS | {name: float(given[name]) for name in names if name in given}
    if "embedment_depth_m" in constants:
        constants.pop("embedment_ratio", None)
    rock_assumed = BOULDER_MASS in constants and "boulder_density_kg_m3" not in constants
    if rock_assumed:
        constants["boulder_density_kg_m3"] = ROCK_KG_M3
    optional = {"impact_height_m", "embedment_depth_m" if "embedment_ratio" in constants else ""}
    missing = [name for name in INPUT_COLUMNS if name not in constants and name not in optional]
    if missing:
        raise ValueError(f"the design lacks {', '.join(missing)}")
    return Sweep(name="design", path=None, axes=(), constants=constants, model=Model(rock_assumed=rock_assumed))


def _changed(
    sweep: Sweep,
    readings: str | ReadingChoice | None,
    soil_elements: int | None,
    step_s: float | None,
    horizon_s: float | None,
) -> Sweep:
    """Return the sweep with the caller's changes."""
    model, solver = sweep.model, sweep.solver
    if readings is not None:
        choice = ReadingChoice.of_preset(readings) if isinstance(readings, str) else readings
        if isinstance(readings, str) and choice.preset != readings:
            raise ValueError(f"readings are 'as_printed', 'corrected' or a ReadingChoice, not {readings!r}")
        model = dataclasses.replace(model, readings=choice)
    if soil_elements is not None:
        if soil_elements < 0:
            raise ValueError("soil_elements must be 0 (closed form) or the number of elements")
        model = dataclasses.replace(model, soil_elements=soil_elements)
    if step_s is not None or horizon_s is not None:
        for name, value in (("step_s", step_s), ("horizon_s", horizon_s)):
            if not isinstance(value, Real | None):
                raise TypeError(f"{name} must be a number of seconds, not {value!r}")
            if value is not None and not 0.0 < value < math.inf:
                raise ValueError(f"{name} must be a positive time in seconds, not {value}")
        solver = SolverSettings(
            accuracy=solver.accuracy if step_s is None else None,
            step_s=solver.step_s if step_s is None else float(step_s),
            horizon_s=solver.horizon_s if horizon_s is None else float(horizon_s),
        )
    return dataclasses.replace(sweep, model=model, solver=solver)


def _deciding(control: Control, how: Readings, step_s: float | None, *, layered: bool) -> Control:
    """Return how the solution was computed that decided a row, by its step [s]; None where nothing was integrated."""
    for finer in finer_controls(control):
        if reported_step_s(finer) == step_s:
            control = finer
    first, finer = (plain(control_for)(solution, control) for solution in (NONE_NEEDED, FINER))
    checked = control.error_estimate and not is_paired(how, control, layered=layered)
    return finer if checked and step_s not in (None, step_of_solution(first)) else first


def _drawn_s(row: Mapping[str, Any], horizon: float) -> float:
    """Return how long a time history is [s]: to the horizon, as long as its row was simulated, and past the limit."""
    end = row["end_time_s"] or 0.0
    return max(horizon, end if row["time_to_limit_s"] is None else end + SEEN_AFTER * horizon)


def _sample_times(horizon: float, sample_s: float) -> np.ndarray:
    """Times of the samples [s], both ends included."""
    if not sample_s > 0.0 or horizon / sample_s > MOST_SAMPLES:
        raise ValueError(
            f"sample_s must be positive and give at most {MOST_SAMPLES:,} samples over {horizon} s, not {sample_s}"
        )
    count = max(round(horizon / sample_s), 1)
    return np.linspace(0.0, horizon, count + 1)


def _empty_record(times: np.ndarray) -> Record:
    """Return a record to be filled at the given times; NaN at times the simulation does not reach."""
    n = len(times)
    asked = np.minimum(times, times[-1] * BEFORE_THE_END)
    states, exchanged = np.full((n, 6), np.nan), np.full((n, 4), np.nan)
    return Record(asked, states, np.zeros(n, np.int8), np.zeros(n, np.bool_), exchanged)


def _kept(record: Record, times: np.ndarray, outcome: Outcome) -> Record:
    """Return the samples that the simulation reached, at the times asked for; none where it failed."""
    reached = np.isfinite(record.states).all(axis=1) & math.isfinite(outcome.t_end)
    return Record(times[reached], *(field[reached] for field in record[1:]))
