"""``sweep fit-vehicle``: the spring and damper of a vehicle."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from boulder_sweep.cli.options import OUTPUT, Quantity, json_option, quantity_of, refuse_unwritable
from boulder_sweep.cli.output import say, show

if TYPE_CHECKING:
    from boulder_sweep.crash_tests.fitting import VehicleFit

FIT_EXAMPLES = """\b
Examples:
  sweep fit-vehicle docs/examples/rigid_wall_pulse.csv --mass "6800 kg"
  sweep fit-vehicle pulse.csv --mass "15000 lb" --plot fit.png
  sweep fit-vehicle pulse.csv --mass "6800 kg" --speed "30 mph"

\b
The first line of PULSE names what its columns hold, with units:
  time [ms], displacement [mm], velocity [m/s], acceleration [g]
One of the three beside time is enough. First touch is fitted; rows before it
give the zero of an acceleration, which is negative while the vehicle slows
down: where it is not, name the column deceleration. Empty cells are gaps.
"""


@click.command("fit-vehicle", short_help="Fit spring and damper of a vehicle to a crash pulse.", epilog=FIT_EXAMPLES)
@click.argument("pulse", type=click.Path())
@click.option(
    "--mass", required=True, type=Quantity("kg"), metavar="'6800 kg'", help="Mass of the vehicle, with its unit."
)
@click.option(
    "--speed", type=Quantity("m/s"), metavar="'30 mph'", help="Speed of impact, with its unit [default: fitted too]."
)
@click.option("--plot", type=OUTPUT, metavar="F.png", help="Draw pulse, fit and residuals.")
@json_option
def fit_vehicle(pulse: str, mass: str, speed: str | None, plot: str | None, as_json: bool) -> int:
    """Fit spring and damper of a Maxwell element to PULSE, a vehicle's crash against a rigid wall.

    Refused where the record does not determine them, where no vehicle has them, or where the record's own change of
    speed contradicts --speed.
    """
    mass_kg = quantity_of("--mass", mass, "kg")
    speed_m_s = None if speed is None else quantity_of("--speed", speed, "m/s")
    from boulder_sweep.crash_tests.fitting import fit_pulse
    from boulder_sweep.crash_tests.measured import read_pulse

    refuse_unwritable(None, plot)
    fit = fit_pulse(read_pulse(pulse), mass_kg, speed_m_s=speed_m_s)
    if plot is not None:
        fit.plot(plot)
    for warning in fit.warnings:
        say(f"caution: {warning}")
    show(*([json.dumps(fit.to_dict())] if as_json else fit_lines(fit)))
    return 0


def fit_lines(fit: VehicleFit) -> list[str]:
    """Return the result for people, and the line for a settings file."""
    wall, offset = fit.wall, fit.offset_m_s2
    speed = f"{wall.speed_m_s:.3f} m/s"
    speed += " (given)" if fit.speed_error_m_s is None else f" ± {fit.speed_error_m_s:.3f}"
    damping = (
        "over-damped: creeps to a stop" if wall.over_damped else f"under-damped: a = {wall.a:.3f}, b = {wall.b:.3f} 1/s"
    )
    rows = [
        ("spring", f"{wall.spring_N_m / 1e3:.1f} ± {fit.spring_error_N_m / 1e3:.1f} kN/m (95 %)"),
        ("damper", f"{wall.damper_N_s_m / 1e3:.2f} ± {fit.damper_error_N_s_m / 1e3:.2f} kN*s/m (95 %)"),
        ("impact speed", speed),
        ("first touch", f"{round(1e3 * fit.touch_s, 1) + 0.0:.1f} ± {1e3 * fit.touch_error_s:.1f} ms"),
        ("damping", damping),
        ("largest crush", f"{wall.max_displacement_m:.3f} m"),
        ("peak force", f"{wall.peak_force / 1e3:.0f} kN, {wall.peak_force_time_s:.4f} s after first touch"),
        ("rebound", f"{abs(wall.rebound_speed_m_s):.2f} m/s"),
    ]
    if "acceleration" in fit.misfits:
        known = "not known: no rows before first touch"
        words = known if offset is None else f"{round(offset, 2) + 0.0:.2f} m/s^2, taken off"
        rows.append(("zero offset", words))
    for name, misfit in fit.misfits.items():
        rows.append((f"misfit of {name}", f"{misfit.share:.1%} of its range (root mean square)"))
    settings = (
        f"vehicle: {{mass: {wall.mass_kg:.6g} kg, speed: ...,",
        f"          spring: {wall.spring_N_m / 1e3:.6g} kN/m, damper: {wall.damper_N_s_m / 1e3:.6g} kN*s/m}}",
    )
    return [*(f"{name:<24}{text}" for name, text in rows), "", *settings]
