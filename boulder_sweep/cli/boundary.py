"""``sweep boundary``: the map of a grid from a part of its designs."""

from __future__ import annotations

import json

import click

from boulder_sweep.cli.loading import load_sweep, refuse_unwritable
from boulder_sweep.cli.options import OUTPUT, jobs_option, json_option, set_option, units_option
from boulder_sweep.cli.output import show

EXAMPLES = """\b
Examples:
  sweep boundary configs/m30_sizing.yaml --plot map.png
  sweep boundary configs/m30_sizing.yaml -o map.parquet
"""


@click.command("boundary", short_help="A map from a part of a grid.", epilog=EXAMPLES)
@click.argument("grid", type=click.Path())
@jobs_option
@click.option("-o", "--output", "out", type=OUTPUT, metavar="F.parquet", help="Table of all designs.")
@click.option("--plot", "picture", type=OUTPUT, metavar="F.png", help="Map (.png, .svg or .pdf).")
@click.option("-q", "--quiet", is_flag=True, help="No notes.")
@units_option
@set_option
@json_option
def boundary(
    grid: str,
    jobs: int | None,
    out: str | None,
    picture: str | None,
    units: str,
    quiet: bool,
    overrides: tuple[str, ...],
    as_json: bool,
) -> int:
    """Map which designs of GRID pass, simulated only near where the verdict changes.

    Useful where a design is expensive, as with sums over soil elements. Assumes that the verdict changes only once
    along the longest axis; `sweep run` assumes nothing.
    """
    from boulder_sweep.answers.boundary import boundary as find
    from boulder_sweep.cli.console import counted
    from boulder_sweep.cli.progress import kernels_for, working

    sweep = load_sweep(grid, overrides, quiet)
    refuse_unwritable(out, picture)
    with working(quiet, kernels_for(sweep)):
        found = find(sweep, jobs=jobs)
    counts = found.counts()
    if as_json:
        record = {"name": sweep.name, "designs": sweep.n_designs, "simulations": found.simulations, "verdicts": counts}
        show(json.dumps(record))
    else:
        for verdict, count in counts.items():
            show(f"  {verdict:<10}{count:>13,}{count / sweep.n_designs:>8.1%}")
        done = f"{counted(found.simulations, 'simulation')} for {counted(sweep.n_designs, 'design')}"
        if found.share < 1.0:
            show(f"{done}: {found.share:.1%}, {1.0 - found.share:.1%} saved")
        else:
            show(f"{done}: nothing saved; 'sweep run' simulates each design once")
    if out is not None:
        found.write(out)
    if picture is not None:
        found.plot(picture, units=units)
    return 0
