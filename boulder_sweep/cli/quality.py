"""How good the model is: its speed against its accuracy, and the paper's crash tests.

``sweep tradeoff`` measures the first on the designs of a grid; ``sweep validate`` shows the two crash tests, both
presets, beside what the paper states.
"""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import (
    OUTPUT,
    Quantity,
    at_option,
    grid_argument,
    json_option,
    load_given,
    quantity_of,
    quiet_option,
    refuse_unwritable,
    say_notes,
    set_option,
)
from boulder_sweep.cli.output import say, show, working

if TYPE_CHECKING:
    from boulder_sweep.crash_tests.fitting import VehicleFit
    from boulder_sweep.tradeoff.study import Tradeoff

TRADEOFF_EXAMPLES = """\b
Examples:
  sweep tradeoff configs/m30_sizing.yaml
  sweep tradeoff configs/m30_sizing.yaml -o tradeoff --seconds 20
"""


@click.command("tradeoff", short_help="Measure speed against accuracy on a grid.", epilog=TRADEOFF_EXAMPLES)
@grid_argument
@click.option("-o", "--output", "out", type=OUTPUT, metavar="DIR", help="Folder for table and picture.")
@click.option(
    "--designs", type=click.IntRange(min=1), default=4096, show_default=True, metavar="N", help="Size of the sample."
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0.0),
    default=60.0,
    show_default=True,
    metavar="S",
    help="Start no new measurement after this many seconds.",
)
@quiet_option
@at_option
@set_option
@json_option
def tradeoff(
    grid: str,
    out: str | None,
    designs: int,
    seconds: float,
    quiet: bool,
    at: str | None,
    overrides: tuple[str, ...],
    as_json: bool,
) -> int:
    """Simulate a sample of GRID by many methods and compare each with a far finer solution.

    The sample holds the corners of the grid and rows spread over all of its axes. Steps, soil in closed form and by
    sums over elements, both readings of the paper: errors, changed verdicts, and CPU time per design. With -o the table
    is written as Parquet, and a picture.
    """
    from boulder_sweep.tradeoff.study import measure

    if math.isnan(seconds):
        raise click.UsageError("--seconds nan: give a number of seconds")
    sweep = load_given(grid, overrides, at)
    if not quiet:
        say_notes(sweep)
    if out is not None:
        from boulder_sweep.views.pictures import make_folder, require_matplotlib

        require_matplotlib()
        make_folder(Path(out))
    with working(quiet, doing="measuring"):
        result = measure(sweep, designs=designs, seconds=seconds)
    files = [] if out is None else result.write(Path(out))
    if as_json:
        rows = [point.to_dict() for point in result.points]
        record = {"name": sweep.name, "designs": sweep.n_designs, "reference_error_deg": result.reference_deg}
        show(json.dumps({**record, "points": rows, "left_out": result.left_out, "files": [*map(str, files)]}))
        return 0
    ways = len(result.points) + result.left_out
    left_out = [f"left out for time: {result.left_out} of {ways} methods"] if result.left_out else []
    show(*_rows(result), *(f"written  {file}" for file in files), *left_out)
    return 0


def _rows(result: Tradeoff) -> Iterator[str]:
    """Yield a line for every method, under a heading for each way of simulating."""
    from boulder_sweep.tradeoff.study import REFERENCE_STEP_MS

    if result.points:
        yield "steps [ms]     us per  rotation [deg]    movement  flips  un-"
        yield "               design  99 %     max      99 % [m]         decided"
    before = ""
    for point in result.points:
        method = point.method
        soil = f"sums over {method.soil_elements} elements" if method.soil_elements else "closed form"
        heading = f"{method.readings}, {soil}{', error of every design' if method.error_estimate else ''}"
        if heading != before:
            yield heading
        before = heading
        cost = f"{point.cpu_us:.3g}" if point.cpu_us < 1000 else f"{point.cpu_us:,.0f}"
        errors = (point.rotation_p99_deg, point.rotation_max_deg, point.displacement_p99_m)
        numbers = "  ".join(f"{error:.1e}" for error in errors)
        last = f"{point.flips:<7}{point.undecided:<9}{'* ' if point.pareto else '  '}{point.accuracy}"
        yield f"  {method.steps:<13}{cost:<8}{numbers}   {last}".rstrip()
    if result.points:
        yield "y: yield located; *: none with these readings is cheaper and more accurate"
    for readings, error in result.reference_deg.items():
        yield f"{readings}: against steps of {REFERENCE_STEP_MS:g} ms, known to {error:.0e} deg"


VALIDATE_EXAMPLES = """\b
Examples:
  sweep validate -o validation
  sweep validate --measured my_test.csv --case my_test.yaml -o validation

\b
The first line of a --measured file names its columns, with units:
  time [ms], rotation [deg], boulder_displacement [mm],
  vehicle_displacement [m], vehicle_acceleration [g]
The boulder's displacement is measured at its own centre of mass.
Displacements are positive in the direction in which the truck
travels, the rotation while the boulder's top moves away from it.
Empty cells are gaps in a track.
"""


@click.command(
    "validate", short_help="The paper's crash tests against what the paper states.", epilog=VALIDATE_EXAMPLES
)
@click.option("-o", "--output", "out", type=OUTPUT, metavar="DIR", help="Folder for pictures and time histories.")
@click.option(
    "--measured", type=click.Path(), metavar="FILE.csv", help="Your own test data, drawn over the simulation."
)
@click.option("--case", metavar="CASE", help="The test they belong to: abg, rwg, or a settings file with one design.")
@json_option
def validate(out: str | None, measured: str | None, case: str | None, as_json: bool) -> int:
    """Simulate both crash tests of the paper, with its formulas as printed and corrected, beside what it says of them.

    Your own test (--measured) is laid over the simulation, with a table of peaks: docs/validation.md says what
    to measure.

    With -o the figures of the paper are redrawn for the simulated side and all time histories written. The exit code
    is 1 if a statement of the paper is contradicted.
    """
    if (measured is None) != (case is None):
        raise click.UsageError("--measured FILE.csv and --case abg|rwg|CASE.yaml go together")
    from boulder_sweep.crash_tests.cases import NOT_COMPARED
    from boulder_sweep.crash_tests.cases import validate as run_validation

    tested = None
    if measured is not None and case is not None:
        from boulder_sweep.crash_tests.overlay import overlay

        tested = overlay(measured, case)
    validation = run_validation(out)
    content: dict[str, Any] = validation.to_dict()
    text = [validation.text(), "", f"note: {NOT_COMPARED}"]
    if tested is not None:
        content["files"] += [] if out is None else [str(tested.plot(Path(out)))]
        content |= tested.to_dict()
        text = [validation.text(), "", f"{measured} against {case}, up to the limit of the rotation:"]
        text += [*(f"note: {note}" for note in tested.notes), tested.table().text()]
    if out is not None:
        text += ["", *(f"written  {file}" for file in content["files"])]
    if as_json:
        show(json.dumps(content))
    else:
        words = (line for part in text for line in part.split("\n"))
        show(*(part for line in words for part in (textwrap.wrap(line, 80) if line.startswith("note:") else [line])))
    return 0 if validation.holds else 1


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
    return [
        *(f"{name:<24}{text}" for name, text in rows),
        "",
        f"vehicle: {{mass: {wall.mass_kg:.6g} kg, speed: ...,",
        f"          spring: {wall.spring_N_m / 1e3:.6g} kN/m, damper: {wall.damper_N_s_m / 1e3:.6g} kN*s/m}}",
    ]
