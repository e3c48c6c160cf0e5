"""How good the model is: its speed against its accuracy, and the paper's crash tests.

``sweep tradeoff`` measures the first on the designs of a grid; ``sweep validate`` shows the two crash tests, both
presets, beside what the paper states.
"""

from __future__ import annotations

import json
import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import (
    OUTPUT,
    at_option,
    cluster_options,
    grid_argument,
    json_option,
    set_option,
    take_values,
)
from boulder_sweep.cli.output import say, show, working

if TYPE_CHECKING:
    from rich.table import Table as RichTable

    from boulder_sweep.tradeoff.points import Method
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
    "--designs",
    type=click.IntRange(min=1),
    default=4096,
    show_default=True,
    metavar="N",
    help="Size of the sample.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0.0),
    default=60.0,
    show_default=True,
    metavar="S",
    help="Start no new measurement after this many seconds.",
)
@click.option("-q", "--quiet", is_flag=True, help="No progress.")
@cluster_options
@at_option
@set_option
@json_option
def tradeoff(
    grid: str,
    out: str | None,
    quiet: bool,
    at: str | None,
    overrides: tuple[str, ...],
    as_json: bool,
    **options: Any,
) -> int:
    """Simulate a sample of GRID by many methods and compare each with a far finer solution.

    The sample holds the corners of the grid and rows spread over all of its axes. Steps, soil in closed form and by
    sums over elements, both readings of the paper: errors, changed verdicts, and CPU time per design. With -o the table
    is written as Parquet and CSV, and a picture.
    """
    from boulder_sweep.settings import load
    from boulder_sweep.tradeoff.study import measure

    if math.isnan(options["seconds"]):
        raise click.UsageError("--seconds nan: give a number of seconds")
    sweep = take_values(load(grid, overrides), at, quiet)
    if out is not None:
        from boulder_sweep.views.pictures import make_folder, require_matplotlib

        require_matplotlib()
        make_folder(Path(out))
    with working(quiet, doing="measuring"):
        result = measure(sweep, **options, progress=None if quiet else say)
    files = [] if out is None else result.write(out)
    if as_json:
        show(json.dumps({**result.to_dict(), "files": [str(file) for file in files]}))
        return 0
    if result.points:
        _show(result)
    for sentence in result.recommendation():
        show(*textwrap.wrap(sentence, 80))
    if result.left_out:
        ways = len(result.points) + len(result.left_out)
        show(f"left out for time: {len(result.left_out)} of {ways} methods (--json lists them)")
    for file in files:
        show(f"written  {file}")
    return 0


def _show(result: Tradeoff) -> None:
    """Print the table: all of it where the terminal is wide enough, else the columns that matter most."""
    from rich.console import Console

    wide = Console(width=1000)
    width = Console().width
    table = _table(result, whole=True)
    whole = wide.measure(table).maximum <= width
    if not whole:
        table = _table(result, whole=False)
    Console(width=max(width, wide.measure(table).maximum)).print(table)
    show("* none with these readings is both cheaper and more accurate (rotation, 99 %)")
    if not whole:
        show("y: yield located; a wider terminal shows more columns, and -o writes all of them")
    for readings, error in result.reference_deg.items():
        show(f"{readings}: against steps of {result.reference_step_ms:g} ms, known to {error:.0e} deg")
    show("")


def _table(result: Tradeoff, *, whole: bool) -> RichTable:
    """Return the methods as a table; not whole, it fits a terminal of 80 columns."""
    from rich.box import SIMPLE
    from rich.table import Table as RichTable

    table = RichTable(box=SIMPLE if whole else None, title=None, pad_edge=False, padding=(0, 2 if whole else 1, 0, 0))
    for name in ("readings", "soil", "step") if whole else ("readings\nand soil", "step\n[ms]"):
        table.add_column(name, no_wrap=True)
    heads = ["us per\ndesign", "rotation\nrms [deg]", "\n99 %", "\nmax", "movement\nrms [mm]", "\n99 %", "\nmax"]
    heads += ["error\ncovered", "verdicts\nflipped", "un-\ndecided", "of\ndesigns"]
    shown = range(len(heads)) if whole else (0, 2, 3, 5, 7, 8)
    if not whole:
        heads[2], heads[5], heads[8] = "rotation\n99 % [deg]", "movement\n99 % [mm]", "\nflips"
    for k in shown:
        table.add_column(heads[k], justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    before = ("", 0, False, False)
    for point in result.points:
        method = point.method
        group = (method.readings, method.soil_elements, method.error_estimate, method.locate_yield)
        if group != before and before[0]:
            table.add_section()
        words = (method.readings, method.soil) if whole else (method.readings if group != before else "",)
        if not whole and group != before and method.soil_elements:
            words = (method.soil,)
        before = group
        metres = (point.displacement_rms_m, point.displacement_p99_m, point.displacement_max_m)
        cells = [
            f"{point.cpu_us:.3g}" if point.cpu_us < 1000 else f"{point.cpu_us:,.0f}",
            *(f"{v:.1e}" for v in (point.rotation_rms_deg, point.rotation_p99_deg, point.rotation_max_deg)),
            *(f"{1e3 * v:.1e}" for v in metres),
            f"{point.covered:.2%}" if method.error_estimate else "",
            str(point.flips),
            str(point.undecided),
            f"{point.designs:,}",
        ]
        last = point.accuracy + (" *" if point.pareto else "")
        steps = method.steps if whole else _short(method)
        table.add_row(*words, steps, *(cells[k] for k in shown), last)
    return table


def _short(method: Method) -> str:
    """Steps of a method in a narrow column [ms]."""
    steps = "+".join(f"{step:g}" for step in method.steps_ms)
    return f"{steps} y" if method.locate_yield else steps


VALIDATE_EXAMPLES = """\b
Examples:
  sweep validate -o validation
  sweep validate --measured my_test.csv --case my_test.yaml -o validation

\b
The first line of a --measured file names its columns, with units:
  time [ms], rotation [deg], boulder_displacement [mm],
  vehicle_displacement [m], vehicle_acceleration [g]
The boulder's displacement is that of its own centre of mass.
Displacements are positive in the direction in which the truck
travels, the rotation while the boulder's top moves away from it.
Empty cells are gaps in a track.
"""


@click.command(
    "validate", short_help="The paper's crash tests against what the paper states.", epilog=VALIDATE_EXAMPLES
)
@click.option("-o", "--output", "out", type=OUTPUT, metavar="DIR", help="Folder for pictures and Parquet files.")
@click.option(
    "--measured", type=click.Path(), metavar="FILE.csv", help="Your own test data, drawn over the simulation."
)
@click.option("--case", metavar="CASE", help="The test they belong to: abg, rwg, or a settings file with one design.")
@json_option
def validate(out: str | None, measured: str | None, case: str | None, as_json: bool) -> int:
    """Simulate both crash tests of the paper, with its formulas as printed and corrected, beside what it says of them.

    Your own test (--measured) is laid over the simulation, with a table of peaks: docs/measuring.md says what to
    measure.

    With -o the figures of the paper are redrawn for the simulated side and all time histories written. The exit code
    is 1 if a statement of the paper is contradicted.
    """
    if (measured is None) != (case is None):
        raise click.UsageError("--measured FILE.csv and --case abg|rwg|CASE.yaml go together")
    from boulder_sweep.crash_tests.validation import NOT_COMPARED
    from boulder_sweep.crash_tests.validation import validate as run_validation

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
