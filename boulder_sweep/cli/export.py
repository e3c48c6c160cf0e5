"""``sweep export``: a result as a spreadsheet, comma-separated values or one Parquet file."""

from __future__ import annotations

import click

from boulder_sweep.cli.options import OUTPUT, units_option
from boulder_sweep.cli.output import show
from boulder_sweep.text import counted

EXAMPLES = """\b
Examples:
  sweep export m30-sizing.sweep -o designs.xlsx --units us
  sweep export m30-sizing.sweep -o designs.csv
  sweep export depths.parquet -o depths.xlsx
"""


@click.command("export", short_help="Write a result as .xlsx, .csv or .parquet.", epilog=EXAMPLES)
@click.argument("out", type=click.Path())
@click.option("-o", "--output", "file", type=OUTPUT, required=True, metavar="F.xlsx|.csv|.parquet", help="The table.")
@units_option
def export(out: str, file: str, units: str) -> int:
    """Write the result in OUT as one table for colleagues, in SI or US customary units.

    OUT is the folder of a run, or a file that -o of `sweep need`, `capacity` or `uncertainty`, or --trajectory wrote.
    The names of the columns end in their units. A spreadsheet has a second sheet with units, meanings, settings,
    versions and hashes.
    """
    from boulder_sweep.report.export import export as write

    rows = write(out, file, units=units)
    show(f"{file}: {counted(rows, 'row')}")
    return 0
