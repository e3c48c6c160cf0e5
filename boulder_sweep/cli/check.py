"""``sweep check``: every mistake of a file at once."""

from __future__ import annotations

import click

from boulder_sweep.cli.loading import load_sweep
from boulder_sweep.cli.options import CHECK_EXAMPLES, set_option
from boulder_sweep.cli.output import show


@click.command(short_help="Check a file: all mistakes at once, with their lines.", epilog=CHECK_EXAMPLES)
@click.argument("grid", type=click.Path())
@set_option
def check(grid: str, overrides: tuple[str, ...]) -> int:
    """Check GRID without simulating: all mistakes at once, with file, line and column."""
    from boulder_sweep.cli import console

    sweep = load_sweep(grid, overrides, quiet=False)
    show(f"{grid}: valid", *console.grid_lines(sweep))
    return 0
