"""``sweep compare``: which verdicts changed between two results, and why."""

from __future__ import annotations

import json

import click

from boulder_sweep.cli.loading import refuse_units_of_json
from boulder_sweep.cli.options import json_option, units_option
from boulder_sweep.cli.output import show
from boulder_sweep.text import counted

EXAMPLES = """\b
Examples:
  sweep compare before.sweep after.sweep
  sweep compare before.sweep after.sweep --show 20 --units us
"""
LEAST = {"mass_kg": ("lightest boulder", "kg"), "depth_m": ("shallowest depth", "m")}


@click.command("compare", short_help="Which verdicts changed between two results, and why.", epilog=EXAMPLES)
@click.argument("before", type=click.Path())
@click.argument("after", type=click.Path())
@click.option(
    "--show", "listed", type=click.IntRange(min=0), default=5, metavar="N", help="Changed designs to list [5]."
)
@units_option
@json_option
def compare(before: str, after: str, listed: int, units: str, as_json: bool) -> int:
    """Compare the results in BEFORE and AFTER design by design, matched by their inputs.

    Shows what differs in settings and versions, how many verdicts changed and how, and the least mass and depth that
    pass. Lists the designs whose rotation changed most.
    """
    from boulder_sweep.report.comparison import compare as match
    from boulder_sweep.settings.shown_units import shown_unit

    refuse_units_of_json(units, as_json)
    found = match(before, after)
    if as_json:
        show(json.dumps(found.to_dict()))
        return 0
    for name, judged_by in zip((before, after), found.judged_by, strict=True):
        if any(found.judged_by):
            show(f"rules    {name}: {judged_by or 'judged by the rules of this version'}")
    for line in found.changed:
        show(f"changed  {line}")
    alone = f"{found.only_before:,} only before, {found.only_after:,} only after"
    show(f"{counted(len(found.matched), 'design')} in both; {alone}")
    show(f"{counted(len(found.flipped), 'verdict')} changed")
    for change, count in found.flips().items():
        show(f"  {count:>9,}  {change}")
    for name, pair in found.least.items():
        words, unit = LEAST[name]
        shown, size = shown_unit(unit, units)
        values = ["none passes" if value is None else f"{value / size:,.5g} {shown}" for value in pair]
        show(f"{words} that passes: {values[0]} before, {values[1]} after")
    for row in found.flipped.head(listed).itertuples():
        show(
            f"  design {row.design_id_before:,} -> {row.design_id_after:,}: "
            f"{row.max_rotation_deg_before:.4g} -> {row.max_rotation_deg_after:.4g} deg"
        )
    return 0
