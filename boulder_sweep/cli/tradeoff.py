"""``sweep tradeoff``: speed against accuracy, measured on the designs of a grid."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from boulder_sweep.cli.options import cluster_options, json_option, set_option
from boulder_sweep.cli.output import say, show

if TYPE_CHECKING:
    from boulder_sweep.tradeoff.study import Tradeoff

EXAMPLES = """\b
Examples:
  sweep tradeoff configs/m30_sizing.yaml
  sweep tradeoff configs/m30_sizing.yaml -o tradeoff --seconds 20
"""


@click.command("tradeoff", short_help="Measure speed against accuracy on a grid.", epilog=EXAMPLES)
@click.argument("grid", type=click.Path())
@click.option("-o", "--output", "out", type=click.Path(), metavar="DIR", help="Folder for table and picture.")
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
@set_option
@json_option
def tradeoff(
    grid: str,
    out: str | None,
    designs: int,
    seconds: float,
    quiet: bool,
    backend: str,
    scheduler: str | None,
    overrides: tuple[str, ...],
    as_json: bool,
) -> int:
    """Simulate a sample of GRID by many methods and compare each with a far finer solution.

    The sample holds the corners of the grid and rows spread over all of its axes. Steps, soil in closed form and by
    sums over elements, both readings of the paper: errors, changed verdicts, and CPU time per design. With -o the table
    is written as Parquet and CSV, and a picture.
    """
    from boulder_sweep.cli.progress import working
    from boulder_sweep.settings import load
    from boulder_sweep.tradeoff.study import measure

    if math.isnan(seconds):
        raise click.UsageError("--seconds nan: give a number of seconds")
    sweep = load(grid, overrides)
    if out is not None:
        from boulder_sweep.views.figures import make_folder, require_matplotlib

        require_matplotlib()
        make_folder(Path(out))
    with working(quiet, doing="measuring"):
        tell = None if quiet else say
        found = measure(sweep, designs=designs, seconds=seconds, backend=backend, scheduler=scheduler, tell=tell)
    files = [] if out is None else found.write(out)
    if as_json:
        show(json.dumps({**found.to_dict(), "files": [str(file) for file in files]}))
        return 0
    if found.points:
        _show(found)
    for sentence in found.recommendation():
        show(sentence)
    for method in found.left_out:
        show(f"left out for time: {method.readings}, {method.soil}, {method.steps}")
    for file in files:
        show(f"written  {file}")
    return 0


def _show(found: Tradeoff) -> None:
    """Print the table, whole whatever the terminal's width."""
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table

    table = Table(box=SIMPLE, title=None, pad_edge=False)
    for name in ("readings", "soil", "step"):
        table.add_column(name, no_wrap=True)
    for name in (
        *("us per\ndesign", "rotation\nrms [deg]", "\n99 %", "\nmax", "movement\nrms [mm]", "\n99 %", "\nmax"),
        *("error\ncovered", "verdicts\nflipped", "un-\ndecided", "of\ndesigns"),
    ):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    before = ("", 0, False, False)
    for point in found.points:
        method = point.method
        group = (method.readings, method.soil_elements, method.error_estimate, method.locate_yield)
        if group != before and before[0]:
            table.add_section()
        before = group
        metres = (point.displacement_rms_m, point.displacement_p99_m, point.displacement_max_m)
        table.add_row(
            method.readings,
            method.soil,
            method.steps,
            f"{point.cpu_us:.3g}" if point.cpu_us < 1000 else f"{point.cpu_us:,.0f}",
            *(f"{v:.1e}" for v in (point.rotation_rms_deg, point.rotation_p99_deg, point.rotation_max_deg)),
            *(f"{1e3 * v:.1e}" for v in metres),
            f"{point.covered:.2%}" if method.error_estimate else "",
            str(point.flips),
            str(point.undecided),
            f"{point.designs:,}",
            point.accuracy + (" *" if point.pareto else ""),
        )
    wide = Console(width=1000)
    console = Console(width=max(Console().width, wide.measure(table).maximum))
    console.print(table)
    console.print("* no other method with these readings is both cheaper and more accurate (rotation, 99 %)")
    for readings, error in found.reference_deg.items():
        console.print(f"{readings}: against steps of {found.reference_step_ms:g} ms, known to {error:.0e} deg")
    console.print()
