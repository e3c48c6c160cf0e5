"""``sweep capacity``: which truck and soil every design withstands."""

from __future__ import annotations

import json

import click

from boulder_sweep.cli.loading import load_sweep, refuse_units_of_json, refuse_unwritable
from boulder_sweep.cli.options import OUTPUT, jobs_option, json_option, set_option, units_option
from boulder_sweep.cli.output import show

EXAMPLES = """\b
Examples:
  sweep capacity configs/crash_tests.yaml
  sweep capacity configs/site.yaml -o withstands.parquet
"""


@click.command("capacity", short_help="Which truck and soil every design withstands.", epilog=EXAMPLES)
@click.argument("grid", type=click.Path())
@jobs_option
@click.option("-o", "--output", "out", type=OUTPUT, metavar="F.parquet", help="Table of all designs.")
@click.option("-q", "--quiet", is_flag=True, help="No notes.")
@units_option
@set_option
@json_option
def capacity(
    grid: str, jobs: int | None, out: str | None, units: str, quiet: bool, overrides: tuple[str, ...], as_json: bool
) -> int:
    """Find how far speed, mass of the truck and friction angle may change before each verdict does.

    Also names the highest ASTM F2656 class whose nominal speed (30, 40, 50 mph) is withstood. The class is
    simulated; the standard rates by test.
    """
    from boulder_sweep.answers.printing import reserve_lines
    from boulder_sweep.answers.reserves import reserves
    from boulder_sweep.cli.progress import kernels_for, working
    from boulder_sweep.errors import EXIT_DONE, EXIT_SOME_ROWS_FAILED

    refuse_units_of_json(units, as_json)
    sweep = load_sweep(grid, overrides, quiet)
    refuse_unwritable(out)
    with working(quiet, kernels_for(sweep)) as progress:
        found = reserves(sweep, jobs=jobs, progress=progress)
    show(*([json.dumps(found.to_dict())] if as_json else reserve_lines(found, units=units)))
    if out is not None:
        found.write(out)
    errors = found.arrow["verdict"].to_pylist().count("error")
    return EXIT_SOME_ROWS_FAILED if errors else EXIT_DONE
