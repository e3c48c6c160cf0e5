"""One impact over time: rotation, forces, displacements; and where the energy of the vehicle goes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.errors import PictureError
from boulder_sweep.views import pictures
from boulder_sweep.views.pictures import AMBER, BLACK, BLUE, GREEN, GREY, LIGHT_GREY, ORANGE, PURPLE, SKY, YELLOW
from boulder_sweep.views.wording import design_line, sized, verdict_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from boulder_sweep.impact.trajectory import Trajectory


BEYOND_LIMIT, AFTER_PEAK = "#F3E7DF", "#F0F0F0"
"""Behind the curves where the model no longer holds, and where the soil returns all the energy that it took."""


def draw_trajectory(trajectory: Trajectory, path: str | Path, *, units: str = "si") -> None:
    """Draw rotation, forces and displacements of one impact."""
    require_samples(trajectory)
    with pictures.figure(path, 9.0, 6.2) as fig:
        (rotation, force), (boulder, vehicle) = fig.subplots(2, 2, sharex=True)
        _rotation(rotation, trajectory)
        _force(force, trajectory, units)
        _boulder(boulder, trajectory, units)
        _vehicle(vehicle, trajectory, units)
        start, end = unreliable_from(trajectory)[0], float(trajectory.time_s[-1])
        if start < end:
            colour = AFTER_PEAK if trajectory.row["time_to_limit_s"] is None else BEYOND_LIMIT
            for axes in (rotation, force, boulder, vehicle):
                axes.axvspan(start, end, color=colour, zorder=-2, linewidth=0)
        for axes in (boulder, vehicle):  # those above share their axis
            pictures.time_axis(axes, end)
        _peaks(rotation, force, boulder, vehicle, trajectory, units)
        pictures.headline(fig, verdict_line(trajectory))
        pictures.caption(fig, design_line(trajectory, units), size=8.5)


def require_samples(trajectory: Trajectory) -> None:
    """Refuse a trajectory without samples, with the reason."""
    if len(trajectory) == 0:
        why = "the truck passes over the boulder" if trajectory.reason == "no_contact" else trajectory.reason
        if trajectory.row["max_rotation_deg"] is not None:
            why = "the design needs more steps than are allowed beyond the limit"
        raise PictureError(f"there is no motion to draw: {why}")


def unreliable_from(trajectory: Trajectory) -> tuple[float, str]:
    """Return the time from which the motion is not to be relied on [s], and why.

    The time of the rotation limit; where it is not reached, of the last peak of rotation and displacement.
    """
    maxima, reached = trajectory.decided.maxima, trajectory.row["time_to_limit_s"]
    if reached is not None:
        limit = math.degrees(trajectory.motion.control.theta_limit)
        return reached, f"shaded: beyond {limit:g}° the model no longer holds"
    peak = max(maxima.t_theta, maxima.t_x_b)
    return peak, "shaded: rebound (the soil of the model has no memory)"


def _rotation(axes: Axes, trajectory: Trajectory) -> None:
    limit = math.degrees(trajectory.motion.control.theta_limit)
    degrees = np.degrees(trajectory.rotation_rad)
    axes.plot(trajectory.time_s, degrees, color=BLUE)
    for line in (limit, -limit) if degrees.min() < -0.5 * limit else (limit,):
        axes.axhline(line, color=ORANGE, linestyle="--", linewidth=1.3)
    axes.set_ylim(min(1.1 * degrees.min(), -0.04 * limit), 1.18 * max(limit, degrees.max()))
    pictures.note_line(axes, f"limit {limit:g}°", 0.99, limit, ha="right", color=ORANGE)
    axes.set_title("Rotation of the boulder")
    axes.set_ylabel("rotation [deg]")


def _force(axes: Axes, trajectory: Trajectory, units: str) -> None:
    unit, size = sized("N", units)
    contact, soil = trajectory.contact_force_N / size, -trajectory.soil_force_N / size
    axes.plot(trajectory.time_s, contact, color=ORANGE, label="vehicle on boulder")
    axes.plot(trajectory.time_s, soil, color=GREEN, linestyle="--", label="soil against boulder")
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    top = max(float(soil.max()), float(contact.max()))
    pictures.limit_y(axes, min(1.15 * float(soil.min()), -0.05 * top), top)
    _legend_above(axes)
    axes.set_title("Horizontal forces")
    axes.set_ylabel(f"force [{unit}]")


def _boulder(axes: Axes, trajectory: Trajectory, units: str) -> None:
    unit, size = sized("m", units)
    axes.plot(trajectory.time_s, trajectory.boulder_displacement_m / size, color=BLUE, label="boulder and wedge")
    centre = trajectory.boulder_centre_displacement_m / size
    axes.plot(trajectory.time_s, centre, color=PURPLE, linestyle="--", label="boulder alone (as filmed)")
    _legend_above(axes)
    axes.set_title("Displacement of the centre of mass")
    axes.set_ylabel(f"displacement [{unit}]")


def _vehicle(axes: Axes, trajectory: Trajectory, units: str) -> None:
    unit, size = sized("m", units)
    axes.plot(trajectory.time_s, trajectory.vehicle_displacement_m / size, color=ORANGE)
    _room_above(axes)
    axes.set_title("Displacement of the vehicle")
    axes.set_ylabel(f"displacement [{unit}]")
    start, why = unreliable_from(trajectory)
    if start < trajectory.time_s[-1]:
        axes.annotate(why, (0.98, 0.05), xycoords="axes fraction", ha="right", fontsize=8.5, color=GREY)


def _room_above(axes: Axes, share: float = 0.12) -> None:
    """Leave room above the curves, for the label of a peak."""
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom, top + share * (top - bottom))


def _legend_above(axes: Axes) -> None:
    """Put the legend on a line of its own above curves and labels of peaks."""
    _room_above(axes, share=0.32)
    axes.legend(loc="upper left", ncols=2, columnspacing=1.0, handlelength=1.7, borderpad=0.2, borderaxespad=0.2)


def _peaks(rotation: Axes, force: Axes, boulder: Axes, vehicle: Axes, trajectory: Trajectory, units: str) -> None:
    m, row = trajectory.decided.maxima, trajectory.row
    # The largest |rotation| may be a backward one.
    at = np.interp(m.t_theta, trajectory.time_s, trajectory.rotation_rad)
    theta, force_N = row["max_rotation_deg"], 1e3 * row["peak_force_kN"]
    pictures.mark_peak(rotation, m.t_theta, math.copysign(theta, float(at)), f"{theta:.2f}°", BLUE)
    (force_unit, force_size), (unit, size) = sized("N", units), sized("m", units)
    pictures.mark_peak(force, m.t_F_v, force_N / force_size, f"{force_N / force_size:.0f} {force_unit}", ORANGE)
    x_b, x_v = row["max_displacement_m"] / size, row["max_vehicle_displacement_m"] / size
    pictures.mark_peak(boulder, m.t_x_b, x_b, f"{x_b:.3f} {unit}", BLUE, below=True)
    pictures.mark_peak(vehicle, m.t_x_v, x_v, f"{x_v:.3f} {unit}", ORANGE)


LAYERS = (
    ("crush_damper_J", "crush of the vehicle (lasting)", ORANGE),
    ("crush_spring_J", "crush of the vehicle (springs back)", AMBER),
    ("soil_drag_J", "soil: drag (lost)", GREEN),
    ("soil_elastic_J", "soil: springs", YELLOW),
    ("gravity_J", "weight of the boulder lifted", PURPLE),
    ("boulder_linear_J", "boulder moving", BLUE),
    ("boulder_angular_J", "boulder turning", SKY),
    ("vehicle_kinetic_J", "vehicle moving", LIGHT_GREY),
)
"""What is stacked, from below: first what is lost for good, last what the vehicle still has."""


def draw_energy(trajectory: Trajectory, path: str | Path, *, units: str = "si") -> None:
    """Draw the energy ledger of one impact, stacked over time, negative parts below zero.

    Under printed readings the work against the restoring moment can be negative, and the pull on the vehicle without
    a partner takes energy out of nothing: the bands above zero rise over the energy at first touch by as much.
    """
    require_samples(trajectory)
    ledger = trajectory.energy()
    time = ledger.time_s
    unit, size = sized("J", units)
    initial = ledger.initial / size
    with pictures.figure(path, 8.0, 4.9) as fig:
        axes = fig.subplots()
        above, below = np.zeros_like(time), np.zeros_like(time)
        layers = [(getattr(ledger, name) / size, label, colour) for name, label, colour in LAYERS]
        if np.abs(ledger.pull_J).max() > 0.0:
            layers.append((ledger.pull_J / size, "out of nothing (printed separation)", BLACK))
        handles = []
        for values, label, colour in layers:
            up, down = np.maximum(values, 0.0), np.minimum(values, 0.0)
            style: dict[str, Any] = {"color": colour, "linewidth": 0.4, "edgecolor": "white"}
            handles.append(axes.fill_between(time, above, above + up, label=label, **style))
            axes.fill_between(time, below, below + down, **style)
            above, below = above + up, below + down
        axes.axhline(initial, color=BLACK, linestyle="--", linewidth=1.0)
        pictures.note_line(axes, f"at first touch {initial:.0f} {unit}", 0.01, initial)
        pictures.time_axis(axes, float(time[-1]))
        pictures.limit_y(axes, 1.05 * float(below.min()), 1.09 * max(float(above.max()), initial))
        axes.grid(visible=False)
        if (when := trajectory.row["time_to_limit_s"]) is not None:
            axes.axvline(when, color=BLACK, linestyle=":", linewidth=1.2)
            limit = math.degrees(trajectory.motion.control.theta_limit)
            words = f" {limit:g}°: beyond, the model no longer holds"
            axes.annotate(words, (when, 0.02), xycoords=("data", "axes fraction"), fontsize=8.5)
        axes.set_ylabel(f"energy [{unit}]")
        axes.set_title(
            f"The parts add up to the energy at first touch to within {ledger.largest_residual:.0e} of it.",
            fontsize=8.5,
            fontweight="normal",
        )
        axes.legend(handles=handles[::-1], loc="center left", bbox_to_anchor=(1.0, 0.5))
        pictures.headline(fig, verdict_line(trajectory))
        pictures.caption(fig, design_line(trajectory, units))
