"""One design over time: ``sweep simulate``, and ``sweep explain`` for one row of a result, from the result alone."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import (
    OUTPUT,
    at_option,
    json_option,
    load_sweep,
    refuse_missing,
    refuse_unwritable_history,
    result_argument,
    set_option,
    take_values,
    talk_options,
    units_option,
)
from boulder_sweep.cli.output import say, show, working, wrap
from boulder_sweep.errors import EXIT_SOME_ROWS_FAILED

if TYPE_CHECKING:
    from boulder_sweep.impact.explanation import Explanation
    from boulder_sweep.impact.trajectory import Trajectory
    from boulder_sweep.settings.model import Model

SIMULATE_EXAMPLES = """\b
Examples:
  sweep simulate configs/rwg.yaml --plot rwg.png
  sweep simulate configs/crash_tests.yaml --design 1 --trajectory rwg.parquet
  sweep simulate configs/abg.yaml --set model.readings=as_printed --json
"""


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
@click.option("--animate", type=OUTPUT, metavar="F.gif", help="Animate the side view.")
@units_option
@at_option
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
    at: str | None,
    overrides: tuple[str, ...],
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Simulate one design of CASE with its time history, beyond the rotation limit and to the end."""
    from boulder_sweep.cli import console

    sweep = take_values(load_sweep(case, overrides, quiet, units), at, quiet, units)
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
    from boulder_sweep.judge.quantiles import words_of
    from boulder_sweep.settings.shown_units import shown_values
    from boulder_sweep.views.wording import verdict_line

    with working(quiet):
        result = simulate_design(sweep, number)
    decided_at = [case for case in sweep.cases if case.taken_at == result.settings["taken_at"]]
    if decided_at and not quiet:
        say("\n".join(wrap(f"note: what follows is decided and drawn with {words_of(decided_at[0], units)}")))
    # Before anything else: there may be nothing to draw, and a film takes a while.
    row = result.summary()
    whole = shown_values(row | _to_build(result), units)
    if as_json:
        show(json.dumps(whole))
    else:
        lines = [] if row["max_rotation_deg"] is None else impact_lines(row, result, units)
        columns = ["", *console.value_lines(whole)] if every else []
        show(*wrap(verdict_line(result)), *lines, *_cautions(row | result.inputs, sweep.model), *columns)
    if plot is not None:
        result.plot(plot, units=units)
    if trajectory is not None:
        result.to_parquet(trajectory, energy=energy is not None)
    if energy is not None:
        result.plot_energy(energy, units=units)
    if animate is not None:
        with working(quiet, f"drawing {animate}", "frames") as progress:
            result.animate(animate, progress)
    for file in (plot, trajectory, energy, animate):
        if file is not None and not quiet:
            say(f"written  {file}")
    return EXIT_SOME_ROWS_FAILED if result.verdict == "error" else 0


def _cautions(row: dict[str, Any], model: Model) -> list[str]:
    """Return the remarks that go with the result."""
    from boulder_sweep.answers.printing import foot_lines, grade_lines
    from boulder_sweep.judge.validity import NOT_A_RATING, meanings

    cautions = [f"caution: {words}" for words in meanings(row["validity"] or "")]
    cautions += ["see docs/validity.md"] if cautions else []
    if row["verdict"] == "pass":
        cautions = [*grade_lines([row]), *cautions, f"pass: {NOT_A_RATING}"]
    return [*cautions, *foot_lines(model, [row["reason"]])]


EXPLAIN_EXAMPLES = """\b
Examples:
  sweep explain m30-sizing.sweep 4711
  sweep explain m30-sizing.sweep 4711 --plot 4711.png
"""


@click.command("explain", short_help="Recompute one row of a result over time.", epilog=EXPLAIN_EXAMPLES)
@result_argument
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
    from boulder_sweep.impact.explanation import explain as compute_again
    from boulder_sweep.settings.shown_units import shown_values

    refuse_unwritable_history(plot, trajectory)
    try:
        with working(as_json):
            explanation = compute_again(out, design_id)
    except IndexError as problem:
        raise click.UsageError(str(problem)) from None
    if explanation.trajectory is not None:
        if plot is not None:
            explanation.trajectory.plot(plot, units=units)
        if trajectory is not None:
            explanation.trajectory.to_parquet(trajectory)
    elif plot is not None or trajectory is not None:
        say("note: the design cannot be computed; there is no time history")
    if as_json:
        show(json.dumps(explanation.as_dict(units)))
        return 0
    values = {"design": shown_values(explanation.inputs, units), "outcome": shown_values(explanation.stored, units)}
    show(*value_lines(values), *why_lines(explanation, units))
    for name in explanation.unequal:
        show(f"differs now: {name} was {explanation.stored[name]!r}, comes out as {explanation.recomputed[name]!r}")
    for line in explanation.changed:
        show(f"changed since: {line}")
    if explanation.judged_by:
        show(f"as stored, the row was {explanation.judged_by}")
    if not explanation.unequal:
        show("computed again: the same to the last bit")
    return 0


def why_lines(explanation: Explanation, units: str = "si") -> list[str]:
    """Return what decided a row, and how near it came to every limit."""
    from boulder_sweep.judge.validity import BY_FLAG
    from boulder_sweep.views.wording import REASON_WORDS, ground_words

    row, history = explanation.stored, explanation.trajectory
    reason = REASON_WORDS.get(row["reason"], row["reason"])
    lines = ["why", f"  {row['verdict']}{f': {reason}' if reason else ''}"]
    if history is None or row["max_rotation_deg"] is None:
        return lines
    ground = ground_words(history.settings, units)
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


def impact_lines(row: Mapping[str, Any], history: Trajectory, units: str = "si") -> list[str]:
    """Return how near one design came to every limit, when, and to within what.

    Parameters
    ----------
    row
        Its outcome columns, in the units of the table; it has touched the truck.
    history
        The impact over time.
    units
        ``si`` or ``us``.
    """
    from boulder_sweep.judge.verdict import PENETRATION_LIMITS_M
    from boulder_sweep.settings.shown_units import quantity_text

    metres = partial(quantity_text, "m", units)
    limit = math.degrees(history.motion.control.theta_limit)
    if row["time_to_limit_s"] is not None:
        reached_ms = 1e3 * row["time_to_limit_s"]
        lines = [f"  rotation: the limit of {limit:g} deg is reached {reached_ms:.1f} ms after contact"]
    else:
        rating = history.settings["criterion"]["rating"]
        lines = [
            f"  rotation: {row['max_rotation_deg']:.4g} deg of {limit:g} deg allowed, "
            f"{1 - row['max_rotation_deg'] / limit:.1%} below, "
            f"{1e3 * history.decided.maxima.t_theta:.0f} ms after contact",
            f"  penetration: {metres(row['penetration_m'])}, {rating} allows "
            f"{metres(PENETRATION_LIMITS_M[rating], digits='.3g')} beyond the far face",
            f"  displacement: boulder {metres(row['max_displacement_m'], digits='.3g')}, "
            f"truck {metres(row['max_vehicle_displacement_m'], digits='.3g')}; "
            f"peak force {quantity_text('kN', units, row['peak_force_kN'], digits=',.0f')}",
        ]
    lines.append(build_line(history, units))
    if row["time_to_limit_s"] is None:
        error = row["rotation_error_deg"]
        lines.append(f"  numerical error of the rotation: {'unknown' if error is None else f'{error:.1g} deg'}")
    return lines


def _to_build(history: Trajectory) -> dict[str, float]:
    """Return what a design takes to build, by the names of columns."""
    from boulder_sweep.judge.quantities import quantities_by

    return {name: float(value) for name, value in quantities_by(history.inputs, history.settings).items()}


def build_line(history: Trajectory, units: str = "si") -> str:
    """Return in words what a design takes to build."""
    from boulder_sweep.settings.shown_units import quantity_text

    mass, above, *volumes = _to_build(history).values()
    weight = f"{mass / 1e3:.1f} t" if units == "si" else quantity_text("kg", units, mass, digits=",.0f")
    dig, fill = (quantity_text("m^3", units, volume, digits=".1f") for volume in volumes)
    height = quantity_text("m", units, above, digits=".3g")
    return f"  to build: {weight}, {height} above ground; dig {dig}, fill {fill}"
