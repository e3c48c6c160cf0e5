"""``sweep explain``: one row of a result, computed again from the result alone."""

from __future__ import annotations

import json

import click

from boulder_sweep.cli.options import json_option
from boulder_sweep.cli.output import say, show

EXAMPLES = """\b
Examples:
  sweep explain m30-sizing.sweep 4711
  sweep explain m30-sizing.sweep 4711 --plot 4711.png
"""


@click.command("explain", short_help="Compute one row of a result again, over time.", epilog=EXAMPLES)
@click.argument("out", type=click.Path())
@click.argument("design_id", type=click.IntRange(min=0))
@click.option("--plot", type=click.Path(), metavar="F.png", help="Draw rotation, displacements and forces over time.")
@click.option("--trajectory", type=click.Path(), metavar="F.parquet", help="Write the time history.")
@json_option
def explain(out: str, design_id: int, plot: str | None, trajectory: str | None, as_json: bool) -> int:
    """Compute row DESIGN_ID of the result in OUT again, from the result alone.

    Says whether every outcome comes out the same to the last bit and, where not, what has changed since:
    versions, kernels, rules. The time history goes on beyond the rotation limit, as that of `sweep simulate`.
    """
    from boulder_sweep.cli.console import value_lines
    from boulder_sweep.impact.explanation import explain as compute_again

    try:
        found = compute_again(out, design_id)
    except IndexError as problem:
        raise click.UsageError(str(problem)) from None
    if found.trajectory is not None:
        if plot is not None:
            found.trajectory.plot(plot)
        if trajectory is not None:
            found.trajectory.to_parquet(trajectory)
    elif plot is not None or trajectory is not None:
        say("note: the design cannot be computed; there is no time history")
    if as_json:
        show(json.dumps(found.as_dict()))
        return 0
    show(*value_lines({"design": found.inputs, "outcome": found.stored}))
    for name in found.unequal:
        show(f"differs now: {name} was {found.stored[name]!r}, comes out as {found.recomputed[name]!r}")
    for line in found.changed:
        show(f"changed since: {line}")
    if not found.unequal:
        show("computed again: the same to the last bit")
    return 0
