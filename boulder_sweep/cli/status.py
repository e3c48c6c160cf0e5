"""``sweep status``: how far a run got."""

from __future__ import annotations

import json

import click

from boulder_sweep.cli.options import STATUS_EXAMPLES, json_option
from boulder_sweep.cli.output import show
from boulder_sweep.errors import EXIT_INTERNAL


@click.command(short_help="Show how far a run got and how to resume it.", epilog=STATUS_EXAMPLES)
@click.argument("out", type=click.Path())
@click.option("--verify", is_flag=True, help="Read every part and compare its checksum.")
@json_option
def status(out: str, verify: bool, as_json: bool) -> int:
    """Show how far the run into OUT got, what is missing, and the command that resumes it."""
    from boulder_sweep.cli import console
    from boulder_sweep.store import status as look

    found = look(out, verify=verify)
    show(*[json.dumps(found.to_dict(), default=str)] if as_json else console.status_lines(found))
    return EXIT_INTERNAL if found.damaged else 0
