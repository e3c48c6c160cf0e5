"""``sweep simulate``: one design with its time history."""

from __future__ import annotations

import json
from typing import Any

import click

from boulder_sweep.cli.loading import load_sweep, refuse_missing, refuse_unwritable_history
from boulder_sweep.cli.options import OUTPUT, SIMULATE_EXAMPLES, json_option, set_option, talk_options, units_option
from boulder_sweep.cli.output import say, show
from boulder_sweep.errors import EXIT_SOME_ROWS_FAILED


@click.command(short_help="Simulate one design with its time history.", epilog=SIMULATE_EXAMPLES)
@click.argument("case", type=click.Path())
@click.option("--design", type=click.IntRange(min=0), metavar="N", help="Number of the design [default: 0].")
@click.option("--plot", type=OUTPUT, metavar="F.png", help="Draw the time history.")
@click.option("--trajectory", type=OUTPUT, metavar="F.parquet", help="Write the time history.")
@click.option(
    "--energy",
    type=OUTPUT,
    metavar="F.png",
    help="Draw where the energy goes, and add its columns to the time history.",
)
@click.option("--all", "every", is_flag=True, help="Print every column of the outcome as well.")
@click.option("--animate", type=OUTPUT, metavar="F.gif|.mp4|.html", help="Animate the side view.")
@units_option
@set_option
@json_option
@talk_options
def simulate(
    case: str,
    design: int | None,
    plot: str | None,
    trajectory: str | None,
    energy: str | None,
    every: bool,
    animate: str | None,
    units: str,
    overrides: tuple[str, ...],
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Simulate one design of CASE with its time history, beyond the rotation limit and to the end."""
    from boulder_sweep.cli import console
    from boulder_sweep.cli.progress import kernels_for, working

    sweep = load_sweep(case, overrides, quiet)
    number = design or 0
    refuse_missing(sweep, case, number)
    refuse_unwritable_history(plot, trajectory, energy, animate)
    if design is None and sweep.n_designs > 1 and not quiet:
        say(f"note: {case} holds {sweep.n_designs:,} designs; this is number 0 (--design N for another)")
    reason = sweep.block(number, number + 1).reasons[0]
    if reason:
        say(f"design {number} cannot be computed: {reason}")
        return EXIT_SOME_ROWS_FAILED
    if (words := sweep.model.ground.words) and not quiet:
        say(f"note: {words}")
    if verbose:
        say("\n".join(console.value_lines(sweep.resolved())))
    from boulder_sweep.impact.simulation import simulate as simulate_design
    from boulder_sweep.settings.shown_units import shown_values
    from boulder_sweep.views.wording import verdict_line

    with working(quiet, kernels_for(sweep, "design")):
        result = simulate_design(sweep, number)
    # Before anything else: there may be nothing to draw, and a film takes a while.
    row = result.summary()
    if as_json:
        show(json.dumps(shown_values(row, units)))
    else:
        lines = [] if row["max_rotation_deg"] is None else console.impact_lines(row, result, units)
        columns = ["", *console.value_lines(shown_values(row, units))] if every else []
        show(*console.wrapped(verdict_line(result)), *lines, *_cautions(row), *columns)
    if plot is not None:
        result.plot(plot, units=units)
    if trajectory is not None:
        result.to_parquet(trajectory, energy=energy is not None)
    if energy is not None:
        result.plot_energy(energy, units=units)
    if animate is not None:
        with working(quiet, None, f"drawing {animate}", "frames") as progress:
            result.animate(animate, progress)
    for file in (plot, trajectory, energy, animate):
        if file is not None and not quiet:
            say(f"written  {file}")
    return EXIT_SOME_ROWS_FAILED if result.verdict == "error" else 0


def _cautions(row: dict[str, Any]) -> list[str]:
    """Return the remarks that go with the result."""
    from boulder_sweep.answers.printing import grade_lines
    from boulder_sweep.judge.validity import NOT_A_RATING, meanings

    cautions = [f"caution: {words}" for words in meanings(row["validity"] or "")]
    cautions += ["see docs/validity.md"] if cautions else []
    if row["verdict"] != "pass":
        return cautions
    return [*grade_lines([row]), *cautions, f"pass: {NOT_A_RATING}"]
