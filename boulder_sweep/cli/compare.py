"""``sweep compare``: which verdicts changed between two results, and why."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import json_option, refuse_units_of_json, units_option
from boulder_sweep.cli.output import show, wrap
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from collections.abc import Callable

    from boulder_sweep.report.comparison import Comparison

EXAMPLES = """\b
Examples:
  sweep compare before.sweep after.sweep
  sweep compare before.sweep after.sweep --show 20 --units us
"""
WHEN = ("before", "after")
MOST_PAIRS = 4
"""Most values shown of an input that differs."""
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
    """Compare the results in BEFORE and AFTER design by design, matched by the inputs they share.

    They are folders of runs, or files that -o of `sweep need`, `capacity` or `uncertainty` wrote, whose answers are
    compared as well. Of an input of which they share no value, as of two soils, the values are paired in order. Shows
    what differs in settings and versions, how many verdicts changed and how, and the least mass and depth that pass.
    Lists the designs that changed most.
    """
    from boulder_sweep.report.comparison import compare as match
    from boulder_sweep.settings.shown_units import shown_unit

    refuse_units_of_json(units, as_json)
    comparison = match(before, after)
    if as_json:
        show(json.dumps(comparison.to_dict()))
        return 0
    for name, judged_by in zip((before, after), comparison.judged_by, strict=True):
        if any(comparison.judged_by):
            show(f"rules    {name}: {judged_by or 'judged by the rules of this version'}")
    for line in comparison.changed:
        show(f"changed  {line}")
    show(*_count_lines(before, after, comparison, units))
    for change, count in comparison.flips().items():
        show(f"  {count:>9,}  {change}")
    for name, pair in comparison.least.items():
        words, unit = LEAST[name]
        shown, size = shown_unit(unit, units)
        values = ["none passes" if value is None else f"{value / size:,.5g} {shown}" for value in pair]
        show(f"{words} that passes: {values[0]} before, {values[1]} after")
    for name in comparison.answers:
        show(*_answer_lines(name, comparison, listed, units))
    for row in comparison.flipped.head(listed).to_dict("records"):
        rotation = _change(row, "max_rotation_deg", lambda value: f"{value:.4g}")
        show(*_design_lines(row, f"{_change(row, 'verdict', str)}, {rotation} deg", comparison, units))
    return 0


def _count_lines(before: str, after: str, comparison: Comparison, units: str) -> list[str]:
    """Return how many designs both have, what tells them apart, and how many verdicts changed."""
    from boulder_sweep.views.wording import name_of, size_of, unit_of

    turned, matched = comparison.turned(), len(comparison.matched)
    alone = f"{comparison.only_before:,} only before, {comparison.only_after:,} only after"
    lines = [f"{counted(matched, 'design')} in both; {alone}"]
    for name in comparison.differ:
        size, pairs = size_of(name, units), comparison.values(name)
        shown = [f"{one / size:.6g} -> {other / size:.6g}" for one, other in pairs[:MOST_PAIRS]]
        more = f" and {len(pairs) - MOST_PAIRS} more" if len(pairs) > MOST_PAIRS else ""
        lines += wrap(f"differs  {name_of(name)}: {', '.join(shown)} {unit_of(name, units)}".rstrip() + more)
    passes, less = ("answers", "have none") if comparison.kind == "need" else ("passes", "do not pass")
    lines += wrap(f"{turned['passes_lost']:,} of {turned['passes']:,} {passes} in {before} {less} in {after}")
    lines += wrap(f"{turned['passes_gained']:,} of {matched - turned['passes']:,} others do")
    return [*lines, f"{counted(len(comparison.flipped), 'verdict')} changed"]


def _answer_lines(name: str, comparison: Comparison, listed: int, units: str) -> list[str]:
    """Return how an answer changed in all, and the designs in which it changed most."""
    from boulder_sweep.settings.shown_units import shown_as

    shown = shown_as(name, comparison.answers[name], "", units)
    counts = comparison.to_dict()["answers"][name]
    words = [f"{counts[sense]:,} {sense}" for sense in ("larger", "smaller", "equal")]
    ends = [f"{counts[end] / shown.size:+.4g}" for end in ("least_change", "largest_change")]
    change = f" (by {ends[0]} to {ends[1]})" if ends[0] != "+0" or ends[1] != "+0" else ""
    lines = wrap(f"{shown.name}: {', '.join(words)} after{change}")
    for row in comparison.matched.loc[comparison.moved(name).index[:listed]].to_dict("records"):
        values = _change(row, name, lambda value: f"{value / shown.size:.5g}")
        lines += _design_lines(row, values, comparison, units)
    return lines


def _design_lines(row: dict[str, Any], words: str, comparison: Comparison, units: str) -> list[str]:
    """Return one design: how it changed, and the inputs that tell it apart."""
    from boulder_sweep.views.wording import value_text

    inputs = [
        value_text(name, row[name], units)
        if name in row
        else _change(row, name, partial(value_text, name, units=units))
        for name in comparison.varying
    ]
    ids = _change(row, "design_id", str)
    return [f"  design {ids}: {words}", *(f"    {line}" for line in wrap(", ".join(inputs), 76))]


def _change(row: dict[str, Any], name: str, text: Callable[[Any], str]) -> str:
    """Return a column of a design before and after."""
    return " -> ".join(text(row[f"{name}_{when}"]) for when in WHEN)
