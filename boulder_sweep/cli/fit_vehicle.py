"""``sweep fit-vehicle``: spring and damper of a vehicle from a rigid-wall crash pulse."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from boulder_sweep.cli.options import OUTPUT, json_option, quantity_of, refuse_unwritable
from boulder_sweep.cli.output import say, show

if TYPE_CHECKING:
    from boulder_sweep.crash_tests.fitting import StagedFit, VehicleFit

EXAMPLES = """\b
Examples:
  sweep fit-vehicle docs/examples/rigid_wall_pulse.csv --mass "6800 kg"
  sweep fit-vehicle pulse.csv --mass "15000 lb" --plot fit.png
  sweep fit-vehicle pulse.csv --mass "6800 kg" --stages 2

\b
The first line of PULSE names what its columns hold, with units:
  time [ms], displacement [mm], velocity [m/s], acceleration [g]
One of the three beside time is enough. Time counts from first touch; earlier
rows are left out. An acceleration is negative while the vehicle slows down;
where it is not, name the column deceleration. Empty cells are gaps.
"""


@click.command("fit-vehicle", short_help="Fit spring and damper of a vehicle to a crash pulse.", epilog=EXAMPLES)
@click.argument("pulse", type=click.Path())
@click.option("--mass", required=True, metavar="'6800 kg'", help="Mass of the vehicle, with its unit.")
@click.option("--speed", metavar="'30 mph'", help="Speed of impact, with its unit [default: fitted too].")
@click.option("--stages", type=click.IntRange(1, 2), default=1, help="Springs of the front [default: 1].")
@click.option("--plot", type=OUTPUT, metavar="F.png", help="Draw pulse, fit and residuals.")
@json_option
def fit_vehicle(pulse: str, mass: str, speed: str | None, stages: int, plot: str | None, as_json: bool) -> int:
    """Fit spring and damper of a Maxwell element to PULSE, a vehicle's crash against a rigid wall.

    With `--stages 2` also a second, stiffer spring from a crush on; refused where it fits no better than one spring.
    """
    mass_kg = quantity_of("--mass", mass, "kg")
    speed_m_s = None if speed is None else quantity_of("--speed", speed, "m/s")
    from boulder_sweep.crash_tests.fitting import fit_pulse, fit_stages
    from boulder_sweep.crash_tests.measured import read_pulse

    refuse_unwritable(None, plot)
    fit = (fit_pulse if stages == 1 else fit_stages)(read_pulse(pulse), mass_kg, speed_m_s=speed_m_s)
    if plot is not None:
        fit.plot(plot)
    for warning in fit.warnings:
        say(f"caution: {warning}")
    show(*([json.dumps(fit.to_dict())] if as_json else lines(fit)))
    return 0


def lines(fit: VehicleFit) -> list[str]:
    """Return the result for people, and the line for a settings file."""
    from boulder_sweep.crash_tests.fitting import StagedFit

    wall = fit.wall
    staged = fit if isinstance(fit, StagedFit) else None
    speed = f"{wall.speed_m_s:.3f} m/s"
    speed += " (given)" if fit.speed_error_m_s is None else f" ± {fit.speed_error_m_s:.3f}"
    damping = (
        "over-damped: creeps to a stop" if wall.over_damped else f"under-damped: a = {wall.a:.3f}, b = {wall.b:.3f} 1/s"
    )
    rows = [
        ("spring", f"{wall.spring_N_m / 1e3:.1f} ± {fit.spring_error_N_m / 1e3:.1f} kN/m"),
        *(() if staged is None else _second_rows(staged)),
        ("damper", f"{wall.damper_N_s_m / 1e3:.2f} ± {fit.damper_error_N_s_m / 1e3:.2f} kN*s/m"),
        ("impact speed", speed),
        ("damping", damping),
        ("largest crush", f"{wall.max_displacement_m:.3f} m"),
        ("peak force", f"{wall.peak_force / 1e3:.0f} kN at {wall.peak_force_time_s:.4f} s"),
        ("rebound", f"{abs(wall.rebound_speed_m_s):.2f} m/s"),
    ]
    for name, misfit in fit.misfits.items():
        alone = "" if staged is None else f", {staged.one.misfits[name].share:.1%} with one spring"
        rows.append((f"misfit of {name}", f"{misfit.share:.1%} of its range (root mean square){alone}"))
    spring, damper = f"{wall.spring_N_m / 1e3:.6g} kN/m", f"damper: {wall.damper_N_s_m / 1e3:.6g} kN*s/m}}"
    settings = [f"vehicle: {{mass: {wall.mass_kg:.6g} kg, speed: ...,"]
    if staged is None:
        settings.append(f"          spring: {spring}, {damper}")
    else:
        second = f"{{beyond: {staged.wall.second_spring_from_m:.4g} m, "
        second += f"stiffness: {staged.wall.second_spring_N_m / 1e3:.6g} kN/m}}"
        settings += [
            f"          spring: [{{stiffness: {spring}}}, {second}],",
            f"          calibrated_crush: {wall.max_displacement_m:.3g} m, {damper}",
        ]
    return [*(f"{name:<24}{text}" for name, text in rows), "", *settings]


def _second_rows(fit: StagedFit) -> list[tuple[str, str]]:
    """Return the rows of a second spring."""
    wall = fit.wall
    return [
        ("second spring", f"{wall.second_spring_N_m / 1e3:.1f} ± {fit.second_error_N_m / 1e3:.1f} kN/m"),
        ("acts from a crush of", f"{wall.second_spring_from_m:.3f} ± {fit.from_error_m:.3f} m"),
    ]
