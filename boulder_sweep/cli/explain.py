"""``sweep explain``: one row of a result, computed again from the result alone."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from boulder_sweep.cli.loading import refuse_unwritable_history
from boulder_sweep.cli.options import OUTPUT, json_option, units_option
from boulder_sweep.cli.output import say, show

if TYPE_CHECKING:
    from boulder_sweep.impact.explanation import Explanation

EXAMPLES = """\b
Examples:
  sweep explain m30-sizing.sweep 4711
  sweep explain m30-sizing.sweep 4711 --plot 4711.png
"""


@click.command("explain", short_help="Recompute one row of a result over time.", epilog=EXAMPLES)
@click.argument("out", type=click.Path())
@click.argument("design_id", type=click.IntRange(min=0))
@click.option("--plot", type=OUTPUT, metavar="F.png", help="Draw rotation, displacements and forces over time.")
@click.option("--trajectory", type=OUTPUT, metavar="F.parquet", help="Write the time history.")
@units_option
@json_option
def explain(out: str, design_id: int, plot: str | None, trajectory: str | None, units: str, as_json: bool) -> int:
    """Compute row DESIGN_ID of the result in OUT again, from the result alone, and say what decided it.

    Says whether every outcome is the same to the last bit and, if not, what has changed since: versions, kernels,
    rules. As in `sweep simulate`, the time history continues beyond the rotation limit.
    """
    from boulder_sweep.cli.console import value_lines
    from boulder_sweep.cli.progress import working
    from boulder_sweep.impact.explanation import explain as compute_again
    from boulder_sweep.settings.shown_units import shown_values

    refuse_unwritable_history(plot, trajectory)
    try:
        with working(as_json, "design"):
            found = compute_again(out, design_id)
    except IndexError as problem:
        raise click.UsageError(str(problem)) from None
    if found.trajectory is not None:
        if plot is not None:
            found.trajectory.plot(plot, units=units)
        if trajectory is not None:
            found.trajectory.to_parquet(trajectory)
    elif plot is not None or trajectory is not None:
        say(f"note: the design cannot be computed{' again' if found.unfamiliar else ''}; there is no time history")
    if as_json:
        show(json.dumps(found.as_dict(units)))
        return 0
    values = {"design": shown_values(found.inputs, units), "outcome": shown_values(found.stored, units)}
    show(*value_lines(values), *why_lines(found, units))
    for name in found.unequal:
        show(f"differs now: {name} was {found.stored[name]!r}, comes out as {found.recomputed[name]!r}")
    for line in found.changed:
        show(f"changed since: {line}")
    if found.judged_by:
        show(f"as stored, the row was {found.judged_by}")
    if found.unfamiliar:
        show(f"not computed again: {found.unfamiliar}")
    elif not found.unequal:
        show("computed again: the same to the last bit")
    return 0


def why_lines(found: Explanation, units: str = "si") -> list[str]:
    """Return what decided a row, and how near it came to every limit."""
    from boulder_sweep.cli.console import impact_lines
    from boulder_sweep.judge.validity import BY_FLAG
    from boulder_sweep.views.wording import REASON_WORDS, ground_words

    row, history = found.stored, found.trajectory
    reason = REASON_WORDS.get(row["reason"], row["reason"])
    lines = ["why", f"  {row['verdict']}{f': {reason}' if reason else ''}"]
    if history is None or row["max_rotation_deg"] is None:
        return lines
    ground = ground_words(history.settings)
    lines += [f"  soil: {ground}"] if ground else []
    lines += impact_lines(row, history, units)
    if row.get("robustness"):
        stands = row["stands_under"]
        under = f", stands under {', '.join(stands.split(';'))}" if stands else ""
        lines.append(f"  second opinion: {row['robustness']}{under}")
    if row.get("validity"):
        lines.append("  outside what the model was tested on (docs/validity.md):")
        names = row["validity"].split(";")
        lines += [f"    {name}: {BY_FLAG[name].meaning}" if name in BY_FLAG else f"    {name}" for name in names]
    return lines
