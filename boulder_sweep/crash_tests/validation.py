"""The paper's two crash tests under both presets, beside what the paper states of them."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from boulder_sweep.crash_tests.cases import (
    CLOSE_UNTIL_S,
    NAMES,
    Statement,
    crash_test,
    rigid_wall_test,
    statement_table,
    statements,
)
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.drawing import draw
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.impact.trajectory import Trajectory
from boulder_sweep.settings.model import PRESETS

NOT_COMPARED = (
    "The measured curves of the paper are in its figures, not in its text or tables; they are not compared here. "
    "What is checked is what the paper says in words and numbers. `--measured FILE.csv` lays your own test data over "
    "the simulation."
)


@dataclass(frozen=True, eq=False)
class Validation:
    """Result of `validate`.

    Attributes
    ----------
    trajectories : dict of (str, str) to Trajectory
        By test (``abg``, ``rwg``) and preset (``as_printed``, ``corrected``).
    wall : RigidWall
        The paper's truck against a rigid wall.
    files : list of Path
        What was written.
    """

    trajectories: dict[tuple[str, str], Trajectory]
    wall: RigidWall
    statements: list[Statement]
    files: list[Path] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """Whether no statement that can be checked is contradicted."""
        return all(statement.holds is not False for statement in self.statements)

    def table(self) -> Table:
        """Return both tests under both presets."""
        rotation = ("max rotation [deg]", "at [s]", "20° at [s]")
        moved = ("max x_b [m]", "max boulder centre [m]", "max vehicle [m]", "at [s]")
        table = Table(("test", "readings", "verdict", *rotation, *moved, "peak force [kN]"))
        for (test, preset), row in self.rows().items():
            table.add(
                NAMES[test],
                preset.replace("_", " "),
                row["verdict"] + (f", {row['reason']}" if row["reason"] else ""),
                number(row["max_rotation_deg"], 2),
                number(row["time_of_max_rotation_s"], 4),
                number(row["time_to_limit_s"], 4, "never"),
                number(row["max_displacement_m"], 4),
                number(row["max_boulder_centre_displacement_m"], 4),
                number(row["max_vehicle_displacement_m"], 4) + (" *" if row["vehicle_still_moving"] else ""),
                number(row["time_of_max_vehicle_displacement_s"], 4),
                number(row["peak_force_kN"], 1),
            )
        return table

    def rows(self) -> dict[tuple[str, str], dict[str, Any]]:
        """Return the same as plain data, by test and preset."""
        return {key: _row(trajectory) for key, trajectory in self.trajectories.items()}

    def text(self) -> str:
        """Return the report for a terminal."""
        moving = any(row["vehicle_still_moving"] for row in self.rows().values())
        footnote = ["* still moving at the end of the simulated time"] if moving else []
        return "\n".join([self.table().turned().text(), *footnote, "", statement_table(self.statements).text()])

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the time histories as plain data."""
        return {
            "crash_tests": [
                {"test": test, "preset": preset}
                | {key: None if isinstance(value, float) and math.isnan(value) else value for key, value in row.items()}
                for (test, preset), row in self.rows().items()
            ],
            "statements": [asdict(statement) for statement in self.statements],
            "rigid_wall": wall_figures(self.wall),
            "not_compared": NOT_COMPARED,
            "files": [str(file) for file in self.files],
        }


def validate(out: str | Path | None = None) -> Validation:
    """Simulate both crash tests under both presets and compare them with what the paper states.

    Parameters
    ----------
    out
        Folder for pictures and Parquet files; nothing is written without one.

    Raises
    ------
    PictureError
        The folder cannot be written, or matplotlib is not installed.
    """
    trajectories = {(test, preset): simulate(crash_test(test), readings=preset) for test in NAMES for preset in PRESETS}
    wall = rigid_wall_test()
    result = Validation(trajectories, wall, statements(trajectories, wall))
    if out is not None:
        result.files.extend(draw("crash_curves", "write_validation", result, Path(out)))
    return result


def wall_figures(wall: RigidWall) -> dict[str, float]:
    """Return the characteristic figures of a rigid-wall impact."""
    return {
        "a_per_s": wall.a,
        "b_per_s": wall.b,
        "max_displacement_m": wall.max_displacement_m,
        "time_of_max_displacement_s": wall.max_displacement_time_s,
        "peak_force_kN": wall.peak_force / 1e3,
        "time_of_peak_force_s": wall.peak_force_time_s,
        "separation_time_s": wall.separation_time_s,
        "rebound_speed_m_s": -wall.rebound_speed_m_s,
    }


def _row(trajectory: Trajectory) -> dict[str, Any]:
    """Figures of one test under one preset; NaN where there is none."""
    row = {key: math.nan if value is None else value for key, value in trajectory.summary().items()}
    if trajectory.row["time_to_limit_s"] is not None:  # the paper follows the boulder beyond its limit
        beyond = trajectory.motion.outcome.maxima
        row |= {
            "max_rotation_deg": math.degrees(beyond.theta),
            "time_of_max_rotation_s": beyond.t_theta,
            "max_displacement_m": beyond.x_b,
            "max_vehicle_displacement_m": beyond.x_v,
            "time_of_max_vehicle_displacement_s": beyond.t_x_v,
            "peak_force_kN": beyond.F_v / 1e3,
        }
    row["max_boulder_centre_displacement_m"] = float(trajectory.boulder_centre_displacement_m.max())
    row["vehicle_still_moving"] = bool(
        trajectory.vehicle_velocity_m_s[-1] > 0.0
        and trajectory.vehicle_displacement_m[-1] >= trajectory.vehicle_displacement_m.max()
    )
    early = np.searchsorted(trajectory.time_s, CLOSE_UNTIL_S)
    row["rotation_at_0.1_s_deg"] = math.degrees(trajectory.rotation_rad[early])
    row["boulder_centre_displacement_at_0.1_s_m"] = float(trajectory.boulder_centre_displacement_m[early])
    return row
