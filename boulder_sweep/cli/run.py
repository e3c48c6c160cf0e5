"""Tables: ``sweep run`` simulates every design of a file into one; ``sweep compare`` says what changed between two."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import (
    JOBS,
    OUTPUT,
    at_option,
    grid_argument,
    json_option,
    load_given,
    refuse_units_of_json,
    say_notes,
    second_opinion_option,
    set_option,
    talk_options,
    units_option,
    with_or_without,
)
from boulder_sweep.cli.output import progress, say, show, wrap
from boulder_sweep.errors import Interrupted
from boulder_sweep.locations import Location, location_of
from boulder_sweep.runner.pool import BACKENDS, DASK, THREADING
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from collections.abc import Callable

    from boulder_sweep.report.comparison import Comparison
    from boulder_sweep.settings import Sweep


RUN_EXAMPLES = """\b
Examples:
  sweep run configs/m30_sizing.yaml
  sweep run grid.yaml -o results/m50 --set vehicle.speed='50 mph'
  sweep run grid.yaml --dry-run
  sweep run grid.yaml --resume
"""


@click.command(short_help="Simulate every design of a file into one table.", epilog=RUN_EXAMPLES)
@grid_argument
@click.option("-o", "--output", "out", type=OUTPUT, help="Folder for the table [default: NAME.sweep].")
@click.option("--jobs", type=JOBS, help="Workers [default: all cores].")
@click.option("--resume", is_flag=True, help="Resume an interrupted run.")
@click.option("--overwrite", is_flag=True, help="Replace the table of an earlier run.")
@click.option("--dry-run", is_flag=True, help="Show designs, settings and cost; write nothing.")
@click.option("--accuracy", metavar="NAME", help="fast, balanced or fine.")
@second_opinion_option
@at_option
@click.option(
    "--backend", type=click.Choice(BACKENDS), default=THREADING, show_default=True, help="Threads, or a Dask cluster."
)
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler, with --backend dask.")
@set_option
@json_option
@talk_options
def run(
    grid: str,
    out: str | None,
    overrides: tuple[str, ...],
    accuracy: str | None,
    second_opinion: bool | None,
    at: str | None,
    dry_run: bool,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Simulate every design of GRID and write the table of verdicts."""
    from boulder_sweep.cli import console
    from boulder_sweep.settings.units import shown_settings

    if options["resume"] and options["overwrite"]:
        raise click.UsageError("--resume and --overwrite cannot be used together")
    if options["scheduler"] and options["backend"] != DASK:
        raise click.UsageError("--scheduler needs --backend dask")
    chosen = overrides if accuracy is None else (*overrides, f"--accuracy={accuracy}")
    sweep = load_given(grid, with_or_without(chosen, second_opinion), at)
    if not quiet:
        say_notes(sweep)
    target = location_of(out or f"{sweep.name.replace(' ', '-')}.sweep")
    if dry_run:
        return _dry_run(sweep, target, options, as_json)
    if verbose:
        say("\n".join(console.value_lines(shown_settings(sweep.resolved(), sweep.units))))
    if not quiet:
        say(f"{sweep.name}: {counted(sweep.n_designs, 'design')} into {target}")
    from boulder_sweep.runner.run import run as run_sweep

    with progress(quiet) as shown:
        try:
            summary = run_sweep(sweep, target, progress=shown, **options)
        except Interrupted as stop:
            say(str(stop))  # before the bar closes: another signal meanwhile ends the process
            return stop.exit_code
    for note in summary.notes:
        say(f"note: {note}")
    if as_json:
        show(json.dumps({"name": sweep.name, **summary.to_dict()}))
    else:
        show(*console.summary_lines(sweep.name, summary))
    return summary.exit_code


def _dry_run(sweep: Sweep, out: Location, options: dict[str, Any], as_json: bool) -> int:
    """Show what a run would do."""
    from boulder_sweep.cli import console
    from boulder_sweep.runner.progress import too_large
    from boulder_sweep.runner.run import estimate

    effort = estimate(sweep, out, jobs=options["jobs"], resume=options["resume"])
    objection = too_large(effort.rows, "about", effort.disk_bytes, out)
    if as_json:
        record = {"settings": sweep.resolved(), "out": str(out), "estimate": asdict(effort)}
        show(json.dumps(record | {"objection": objection}))
    else:
        show(*console.dry_run_lines(sweep, out, effort, objection))
    return 0


COMPARE_EXAMPLES = """\b
Examples:
  sweep compare before.sweep after.sweep
  sweep compare before.sweep after.sweep --show 20 --units us
"""
WHEN = ("before", "after")
MOST_PAIRS = 4
"""Most values shown of an input that differs."""
LEAST = {"mass_kg": ("lightest boulder", "kg"), "depth_m": ("shallowest depth", "m")}


@click.command("compare", short_help="Which verdicts changed between two results, and why.", epilog=COMPARE_EXAMPLES)
@click.argument("before", type=click.Path())
@click.argument("after", type=click.Path())
@click.option(
    "--show", "listed", type=click.IntRange(min=0), default=5, metavar="N", help="Changed designs to list [5]."
)
@units_option
@json_option
def compare(before: str, after: str, listed: int, units: str | None, as_json: bool) -> int:
    """Compare the results in BEFORE and AFTER design by design, matched by the inputs they share.

    They are folders of runs, or files that -o of `sweep need`, `capacity` or `uncertainty` wrote, whose answers are
    compared as well. Where the two share no value of an input, such as two soils, its values are paired in order. Shows
    what differs in settings and versions, how many verdicts changed and how, and the least mass and depth that pass.
    Lists the designs that changed most.
    """
    from boulder_sweep.report.comparison import compare as match
    from boulder_sweep.settings.units import shown_unit

    refuse_units_of_json(units, as_json)
    comparison = match(before, after)
    units = units or comparison.units
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
    from boulder_sweep.settings.units import shown_as

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
