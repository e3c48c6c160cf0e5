"""``sweep simulate``: one design over time, of a settings file, or of a result, from the result alone."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import (
    OUTPUT,
    at_option,
    json_option,
    load_given,
    refuse_missing,
    refuse_unwritable_history,
    say_notes,
    second_opinion_option,
    set_option,
    talk_options,
    units_option,
    with_or_without,
)
from boulder_sweep.cli.output import say, say_written, show, working, wrap
from boulder_sweep.errors import EXIT_SOME_ROWS_FAILED
from boulder_sweep.locations import Location, location_of

if TYPE_CHECKING:
    from boulder_sweep.impact.recomputing import Recomputation
    from boulder_sweep.impact.trajectory import Trajectory
    from boulder_sweep.settings import Sweep

SIMULATE_EXAMPLES = """\b
Examples:
  sweep simulate configs/rwg.yaml --plot rwg.png
  sweep simulate configs/crash_tests.yaml --design 1 --trajectory rwg.parquet
  sweep simulate configs/abg.yaml --set model.readings=as_printed --json
  sweep simulate m30-sizing.sweep --design 4711 --all
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
@click.option("--all", "every", is_flag=True, help="Print every column as well.")
@click.option("--animate", type=OUTPUT, metavar="F.gif", help="Animate the side view.")
@second_opinion_option
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
    second_opinion: bool | None,
    units: str | None,
    at: str | None,
    overrides: tuple[str, ...],
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Simulate one design of CASE with its time history, beyond the rotation limit and to the end.

    CASE is a settings file, or the result of a run. Of a result, a row is computed again from the result alone; where
    not every outcome is the same to the last bit, what has changed since is printed: versions, kernels, rules.
    """
    from boulder_sweep.cli import console
    from boulder_sweep.settings.units import shown_settings, shown_unit

    number, again, location = design or 0, None, location_of(case)
    if _is_result(location):
        if overrides or at is not None or second_opinion is not None:
            given = "--set, --at and --second-opinion"
            raise click.UsageError(f"{given} change the settings of a file; {case} is the result of a run")
        refuse_unwritable_history(plot, trajectory, energy, animate)
        again = _computed_again(location, number, quiet or as_json)
        sweep, designs = again.sweep, again.designs
        reason = again.stored["reason"] if again.trajectory is None else ""
    else:
        sweep = load_given(case, with_or_without(overrides, second_opinion), at)
        refuse_missing(sweep, case, number)
        refuse_unwritable_history(plot, trajectory, energy, animate)
        if not quiet:
            say_notes(sweep, units)
        designs, reason = sweep.n_designs, sweep.block(number, number + 1).reasons[0]
    in_json = units or "si"
    units = units or sweep.units
    if design is None and designs > 1 and not quiet:
        say(f"note: {case} holds {designs:,} designs; this is number 0 (--design N for another)")
    if reason:
        say(f"design {number} cannot be computed: {reason}")
        if again is not None:
            stored = {"design_id": number} | shown_settings(again.inputs | again.stored, in_json)
            show(*[json.dumps(stored | again.compared(in_json))] if as_json else _compared_lines(again))
        return EXIT_SOME_ROWS_FAILED
    if (words := sweep.model.ground.words_in(shown_unit("m", units), shown_unit("kPa", units))) and not quiet:
        say(f"note: {words}")
    if verbose:
        say("\n".join(console.value_lines(shown_settings(sweep.resolved(), sweep.units))))
    from boulder_sweep.impact.simulation import simulate as simulate_design
    from boulder_sweep.judge.quantiles import words_of
    from boulder_sweep.views.wording import verdict_line

    result = None if again is None else again.trajectory
    if result is None:
        with working(quiet):
            result = simulate_design(sweep, number)
    decided_at = [case for case in sweep.cases if case.taken_at == result.settings.get("taken_at")]
    if decided_at and not quiet:
        say("\n".join(wrap(f"note: what follows is decided and drawn with {words_of(decided_at[0], units)}")))
    # Before anything else: there may be nothing to draw, and a film takes a while.
    row = result.summary() if again is None else {"design_id": number, **again.inputs, **again.stored}
    whole = shown_settings(row | _to_build(result), in_json if as_json else units)
    if as_json:
        show(json.dumps(whole if again is None else whole | again.compared(in_json)))
    else:
        lines = [] if row["max_rotation_deg"] is None else impact_lines(row, result, units)
        compared = [] if again is None else _compared_lines(again)
        columns = ["", *console.value_lines(whole)] if every else []
        cautions = _cautions(row | result.inputs, sweep)
        show(*wrap(verdict_line(result)), *lines, *cautions, *compared, *columns)
    if plot is not None:
        result.plot(plot, units=units)
    if trajectory is not None:
        result.to_parquet(trajectory, energy=energy is not None)
    if energy is not None:
        result.plot_energy(energy, units=units)
    if animate is not None:
        with working(quiet, f"drawing {animate}", "frames") as progress:
            result.animate(animate, progress)
    say_written(quiet, plot, trajectory, energy, animate)
    return EXIT_SOME_ROWS_FAILED if row["verdict"] == "error" else 0


def _is_result(case: Location) -> bool:
    """Whether a case is the result of a run, or is named like one, and no settings file."""
    return not isinstance(case, Path) or case.is_dir() or case.suffix.lower() in (".sweep", ".parquet")


def _computed_again(folder: Location, number: int, quiet: bool) -> Recomputation:
    """Compute a row of a result again; one that it does not have, or does not say all of, is wrong use."""
    from boulder_sweep.impact.recomputing import recompute

    try:
        with working(quiet):
            return recompute(folder, number)
    except LookupError as problem:
        raise click.UsageError(str(problem)) from None


def _compared_lines(again: Recomputation) -> list[str]:
    """Return how a row of a result comes out now."""
    lines = [
        f"differs now: {name} was {again.stored[name]!r}, comes out as {again.recomputed[name]!r}"
        for name in again.unequal
    ]
    lines += [f"changed since: {line}" for line in again.changed]
    lines += [f"as stored, the design was {again.judged_by}"] if again.judged_by else []
    return lines if again.unequal else [*lines, "computed again: the same to the last bit"]


def _cautions(row: dict[str, Any], sweep: Sweep) -> list[str]:
    """Return the remarks that go with the result."""
    from boulder_sweep.answers.printing import foot_lines, grade_lines
    from boulder_sweep.judge.robustness import can_be_asked
    from boulder_sweep.judge.validity import NOT_A_RATING, meanings

    cautions = [f"caution: {words}" for words in meanings(row["validity"] or "")]
    cautions += ["docs/confidence.md has the bounds of all flags"] if cautions else []
    if row["verdict"] == "pass":
        is_asked = sweep.model.second_opinion or not can_be_asked(sweep)
        grades = grade_lines([row]) if is_asked else ["open: not asked (--second-opinion asks)"]
        cautions = [*grades, *cautions, f"pass: {NOT_A_RATING}"]
    return [*cautions, *foot_lines(sweep.model, [row["reason"]])]


def impact_lines(row: Mapping[str, Any], history: Trajectory, units: str) -> list[str]:
    """Return how near one design, which touched the truck, came to every limit, when, and to within what.

    `row` has its outcome columns, in the units of the table.
    """
    from boulder_sweep.judge.verdict import PENETRATION_LIMITS_M
    from boulder_sweep.settings.units import quantity_text

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
    mass, above, *volumes = _to_build(history).values()
    weight = f"{mass / 1e3:.1f} t" if units == "si" else quantity_text("kg", units, mass, digits=",.0f")
    dig, fill = (quantity_text("m^3", units, volume, digits=".1f").replace("^3", "³") for volume in volumes)
    lines.append(f"  to build: {weight}, {metres(above, digits='.3g')} above ground; dig {dig}, fill {fill}")
    if row["time_to_limit_s"] is None:
        error = row["rotation_error_deg"]
        lines.append(f"  numerical error of the rotation: {'unknown' if error is None else f'{error:.1g} deg'}")
    return lines


def _to_build(history: Trajectory) -> dict[str, float]:
    """Return what a design takes to build, by the names of columns."""
    from boulder_sweep.judge.quantities import quantities_by

    return {name: float(value) for name, value in quantities_by(history.inputs, history.settings).items()}
