"""Curves of crash tests: the simulated ones of the paper's figures, with all results of `validate`; a fitted pulse."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.crash_tests.cases import CLOSE_UNTIL_S, NAMES
from boulder_sweep.crash_tests.measured import PULSE_UNITS
from boulder_sweep.crash_tests.overlay import simulated_signal
from boulder_sweep.locations import replacing
from boulder_sweep.views import pictures
from boulder_sweep.views.pictures import BLACK, BLUE, GREY, ORANGE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

    from boulder_sweep.crash_tests.cases import Validation
    from boulder_sweep.crash_tests.fitting import VehicleFit
    from boulder_sweep.crash_tests.measured import TimeHistory
    from boulder_sweep.crash_tests.rigid_wall import RigidWall
    from boulder_sweep.impact.trajectory import Trajectory


STYLES: dict[str, dict[str, Any]] = {
    "corrected": {"color": BLUE},
    "as_printed": {"color": ORANGE, "linestyle": "--"},
}
SIGNALS = {
    "boulder_displacement": ("Displacement of the boulder's centre", "displacement [m]"),
    "rotation": ("Rotation of the boulder", "rotation [deg]"),
    "vehicle_displacement": ("Displacement of the vehicle", "displacement [m]"),
    "vehicle_acceleration": ("Acceleration of the vehicle", "acceleration [m/s²]"),
}
"""Title and axis of the signals that a test may hold; the first three are simulated for the paper's."""
FIGURES = {"abg": ("12 to 14", "figures_12_to_14_abg.png"), "rwg": ("16 to 18", "figures_16_to_18_rwg.png")}


def write_validation(result: Validation, folder: Path) -> list[Path]:
    """Write the pictures and the time histories of `validate` into a folder, which is made, and return the files."""
    pictures.require_matplotlib()
    pictures.make_folder(folder)
    wall, table = folder / "figure_10_rigid_wall.png", folder / "trajectories.parquet"
    draw_rigid_wall(result.wall, wall)
    for test, (_, name) in FIGURES.items():
        by_preset = {preset: t for (t_name, preset), t in result.trajectories.items() if t_name == test}
        draw_crash_test(test, by_preset, folder / name)
    _write_histories(result, table)
    return [wall, *(folder / name for _, name in FIGURES.values()), table]


def draw_crash_test(
    test: str, trajectories: Mapping[str, Trajectory], path: Path, measured: TimeHistory | None = None
) -> None:
    """Draw the boulder's own centre, rotation and vehicle of one test by preset, or what was measured and simulated."""
    names = [*SIGNALS][:3] if measured is None else [*measured.signals]
    with pictures.figure(path, 3.6 * len(names), 3.6) as fig:
        row = fig.subplots(1, len(names), squeeze=False)[0]
        for axes, name in zip(row, names, strict=True):
            _signal(axes, name, trajectories, measured)
        handles, labels = row[0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        words = "measured and simulated"  # only as long as was measured, so there is no verdict
        if measured is None:
            words = ", ".join(f"{t.verdict} ({preset.replace('_', ' ')})" for preset, t in trajectories.items())
        figures = f" (Figures {FIGURES[test][0]})" if test in FIGURES and measured is None else ""
        pictures.headline(fig, f"{NAMES.get(test, test)}{figures}: {words}", size=11.0)


def _signal(axes: Axes, name: str, trajectories: Mapping[str, Trajectory], measured: TimeHistory | None) -> None:
    """Draw one signal under all presets."""
    for preset, trajectory in trajectories.items():
        signal, style = simulated_signal(trajectory, name), STYLES[preset]
        axes.plot(trajectory.time_s, signal, label=f"simulated, {preset.replace('_', ' ')}", **style)
        when = trajectory.motion.outcome.t_limit
        if math.isfinite(when):
            value = float(np.interp(when, trajectory.time_s, signal))
            axes.plot([when], [value], "o", color=style["color"], markersize=5.0)
    if measured is not None:
        axes.plot(measured.time_s, measured.signals[name], ".", color=GREY, markersize=3.5, label="measured")
    end = max(float(trajectory.time_s[-1]) for trajectory in trajectories.values())
    pictures.time_axis(axes, end)
    axes.set_title(SIGNALS[name][0])
    axes.set_ylabel(SIGNALS[name][1])
    if any(math.isfinite(t.motion.outcome.t_limit) for t in trajectories.values()):
        axes.axvspan(CLOSE_UNTIL_S, end, color="#F4F0EC", zorder=-2, linewidth=0)
        words = "dots: 20° passed\nshaded: after 0.1 s, where the\npaper sees test and model part"
        if name == "boulder_displacement":
            axes.annotate(words, (0.97, 0.05), xycoords="axes fraction", ha="right", fontsize=7.5, color=GREY)
    if name == "rotation":
        limit = math.degrees(next(iter(trajectories.values())).motion.control.theta_limit)
        axes.axhline(limit, color=BLACK, linewidth=0.9, linestyle=":")
        axes.annotate(f"{limit:g}°", (end, limit), xytext=(-4, 2), textcoords="offset points", ha="right", fontsize=8.5)


def draw_rigid_wall(wall: RigidWall, path: Path) -> None:
    """Draw the paper's truck against a rigid wall, the response of the Maxwell element in Figure 10."""
    time = np.linspace(0.0, 0.2, 401)
    x, v, acceleration = wall.response(time)
    force, peak_kN = -wall.mass_kg * acceleration / 1e3, wall.peak_force / 1e3
    curves = (
        (x, "Displacement", "displacement [m]", wall.max_displacement_time_s, wall.max_displacement_m, "{:.3f} m"),
        (v, "Velocity", "velocity [m/s]", wall.separation_time_s, wall.rebound_speed_m_s, "{:.2f} m/s"),
        (force, "Force on the wall", "force [kN]", wall.peak_force_time_s, peak_kN, "{:.0f} kN"),
    )
    with pictures.figure(path, 9.6, 3.3) as fig:
        for axes, (values, title, label, when, peak, words) in zip(fig.subplots(1, 3), curves, strict=True):
            axes.plot(time, values, color=BLUE)
            pictures.time_axis(axes, float(time[-1]))
            axes.set_title(title)
            axes.set_ylabel(label)
            bottom, top = axes.get_ylim()
            axes.set_ylim(bottom - (0.06 * (top - bottom) if peak < 0.0 else 0.0), top + 0.08 * (top - bottom))
            pictures.mark_peak(axes, when, peak, words.format(peak).replace("-", "−"), BLUE, below=peak < 0.0)
        words = f"Rigid wall (Figure 10): {wall.mass_kg:.0f} kg at {wall.speed_m_s:g} m/s, Maxwell element of the paper"
        pictures.headline(fig, words, size=11.0)


def _write_histories(result: Validation, path: Path) -> None:
    """Write all time histories to a Parquet file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    parts = []
    for (test, preset), trajectory in result.trajectories.items():
        part = trajectory.to_arrow(energy=True).replace_schema_metadata(None)
        for column, text in (("preset", preset), ("test", test)):
            words = pa.array([text] * len(part)).dictionary_encode()
            part = part.add_column(0, pa.field(column, words.type, metadata={"unit": ""}), words)
        parts.append(part)
    with replacing(path) as file:
        pq.write_table(pa.concat_tables(parts).unify_dictionaries(), file, compression="zstd")


ORDER = ("displacement", "velocity", "acceleration")
POINTS = 400


def draw_fit(fit: VehicleFit, path: str | Path) -> None:
    """Draw every signal of a pulse with the fitted response, and the residuals below it."""
    names = [name for name in ORDER if name in fit.pulse.signals]
    time = fit.pulse.time_s - fit.touch_s
    fine = np.linspace(float(time[0]), float(time[-1]), POINTS)
    curves, at_rows = fit.fitted(fine), fit.fitted(time)
    with pictures.figure(path, max(3.4 * len(names), 5.6), 4.9) as fig:
        grid = fig.subplots(2, len(names), sharex=True, squeeze=False, height_ratios=(2.4, 1.0))
        for (above, below), name in zip(grid.T, names, strict=True):
            unit = PULSE_UNITS[name].replace("^2", "²")
            above.plot(time, fit.pulse.signals[name], ".", color=GREY, markersize=3.0, label="measured")
            above.plot(fine, curves[name], color=ORANGE, label="Maxwell element")
            above.set_title(name.capitalize())
            above.set_ylabel(f"{name} [{unit}]")
            residuals = fit.pulse.signals[name] - at_rows[name]
            below.plot(time, residuals, ".", color=GREY, markersize=3.0)
            below.axhline(0.0, color=BLACK, linewidth=0.8)
            reach = 1.15 * float(np.nanmax(np.abs(residuals)))
            below.set_ylim(-reach or -1.0, reach or 1.0)
            below.set_ylabel(f"residual [{unit}]")
            pictures.time_axis(below, float(fine[-1]))
            below.set_xlim(left=float(fine[0]))
            below.locator_params(axis="x", nbins=5)  # more numbers run into one another
        grid[0, 0].legend(loc="best")
        spring = f"spring {fit.wall.spring_N_m / 1e3:.1f} ± {fit.spring_error_N_m / 1e3:.1f} kN/m"
        damper = f"damper {fit.wall.damper_N_s_m / 1e3:.2f} ± {fit.damper_error_N_s_m / 1e3:.2f} kN·s/m"
        pictures.headline(fig, f"{spring}, {damper}", size=10.5)
        if fit.warnings:
            first = "Caution: " + fit.warnings[0].split(":")[0]
            pictures.caption(fig, first, size=8.5, colour=ORANGE)
