"""What a grid answers: ``sweep need``, ``sweep uncertainty``, ``sweep capacity``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from boulder_sweep.cli.options import (
    OUTPUT,
    Quantity,
    at_option,
    grid_argument,
    jobs_option,
    json_option,
    load_given,
    margin_option,
    quiet_option,
    refuse_missing,
    refuse_units_of_json,
    refuse_unwritable,
    say_notes,
    second_opinion_option,
    set_option,
    units_option,
    with_or_without,
)
from boulder_sweep.cli.output import say, say_written, show, working
from boulder_sweep.errors import EXIT_DONE, EXIT_SOME_ROWS_FAILED
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.problems import Problem

NEED_EXAMPLES = """\b
Examples:
  sweep need configs/site.yaml
  sweep need configs/site.yaml --prefer excavation --plot depths.png
  sweep need configs/site.yaml --margin 0 --any --table
  sweep need configs/site.yaml --least height -o heights.parquet
  sweep need configs/uncertain_site.yaml --probability 0.95
  sweep need configs/site.yaml --most speed --between '5 m/s' '40 m/s'
"""
REPEATED = (
    *("units", "least", "most", "margin", "probability", "between", "robust", "second_opinion", "prefer", "at"),
    "overrides",
)
"""Parameters of `need` that decide the answer, which a further question repeats where they were given."""


@click.command("need", short_help="The boulder to bury, and the least depth that passes.", epilog=NEED_EXAMPLES)
@grid_argument
@click.option("--least", metavar="KEY", help="Input whose smallest passing value is wanted [embedment_depth].")
@click.option("--most", metavar="KEY", help="Input whose largest passing value is wanted, e.g. speed.")
@click.option("--margin", metavar="SHARE", help="Least margin to the limits [25 %; 0 with --probability].")
@click.option("--probability", metavar="P", help="Probability of passing, e.g. 0.95, if inputs have distributions.")
@click.option(
    "--between",
    nargs=2,
    type=Quantity(),
    metavar="A B",
    help="Range to search, with units, e.g. '5 ft' '9 ft' [default: the axis of the file, or the usual].",
)
@click.option(
    "--robust/--any",
    default=None,
    help="Count only passes that stand under every second opinion, with the margin, or any pass [robust where second "
    "opinions know such designs, and without --probability].",
)
@second_opinion_option
@click.option(
    "--prefer",
    type=click.Choice(("mass", "depth", "excavation")),
    default="mass",
    show_default=True,
    help="What is to be least of the design to build.",
)
@click.option("--table", is_flag=True, help="Print every answer, with all its columns.")
@click.option("--notes", is_flag=True, help="Print what the words mean, and what the model leaves out.")
@jobs_option
@click.option("-o", "--output", "out", type=OUTPUT, metavar="F.parquet", help="Table of all answers.")
@click.option("--plot", "picture", type=OUTPUT, metavar="F.png", help="Design chart (.png, .svg or .pdf).")
@quiet_option
@units_option
@at_option
@set_option
@json_option
def need(
    grid: str,
    out: str | None,
    picture: str | None,
    units: str | None,
    at: str | None,
    jobs: int | None,
    quiet: bool,
    overrides: tuple[str, ...],
    second_opinion: bool | None,
    as_json: bool,
    table: bool,
    notes: bool,
    **question: Any,
) -> int:
    """Name the boulder of GRID to bury, and how deep; or find the least KEY that passes.

    The design named passes in every soil and before every vehicle of GRID with the margin, and stands under every
    second opinion; of those that do, it is the lightest (--prefer). The table has the least KEY for every combination
    of the other inputs.

    If KEY is an axis of the grid, the axis is the search range; otherwise the usual range, for depths from 0.35 of the
    height to where the truck would go over the boulder. Every answer has a bracket: the value that passes and the next
    one, which does not, both judged as in `sweep run`. A largest speed or vehicle mass is the end of the interval from
    zero in which everything passes; from a least friction angle or embedment on everything passes. A row of which
    nothing passes is `blocked_by_overlap` if the truck goes over the boulder at the end of the range (overlap below
    criterion.min_overlap), `undecided` if the last value tried is, `error` if it cannot
    be computed, and `never` otherwise.
    """
    from boulder_sweep.answers.advice import Again
    from boulder_sweep.answers.need import need as answer
    from boulder_sweep.answers.printing import need_lines
    from boulder_sweep.judge.quantiles import at_values
    from boulder_sweep.settings import load

    refuse_units_of_json(units, as_json)
    if question["probability"] is not None and at is not None:
        raise click.UsageError("--at and --probability cannot be used together")
    sweep = load(grid, with_or_without(overrides, second_opinion))
    units = units or sweep.units
    if question["probability"] is None:
        sweep = at_values(sweep, at)
    refuse_unwritable(out, picture)

    notes_told = _notes(sweep, question["most"] or question["least"], grid)
    shares = {name: question[name] for name in ("margin", "probability")}
    say_how = partial(say_notes, replace(sweep, notes=notes_told), units, **shares)
    with working(quiet, of="designs" if question["probability"] is None else "values") as progress:
        result = answer(sweep, **question, jobs=jobs, progress=progress, ready=None if quiet else say_how)
    if as_json:
        show(json.dumps(result.to_dict()))
    else:
        show(*need_lines(result, units, Again(grid, _given(REPEATED)), table=table, notes=notes))
    if not quiet:
        counts = ", ".join(f"{word} {count:,}" for word, count in result.counts().items())
        say(f"{counted(len(result), 'row')}: {counts}; {counted(result.simulated, 'simulation')}")
    if out is not None:
        result.write(out)
        say_written(quiet, out)
    if picture is not None:
        result.plot(picture, units=units)
        say_written(quiet, picture)
    return EXIT_SOME_ROWS_FAILED if result.errors else EXIT_DONE


def _notes(sweep: Sweep, word: str | None, file: str) -> tuple[Problem, ...]:
    """Return the notes of a file; of an embedment that it gives in vain, since one is searched, that it is not used."""
    from boulder_sweep.answers.keys import key_of
    from boulder_sweep.settings.fields import BY_NAME, EMBEDMENT
    from boulder_sweep.settings.problems import Position, Problem

    given = sweep.plan.given.keys() - {name for axis in sweep.axes for name in axis.columns}
    unused = [name for name in EMBEDMENT if name in given and not sweep.depth_sought]
    if not unused or (word and key_of(word).name not in EMBEDMENT):
        return sweep.notes
    told = [note for note in sweep.notes if not note.key.startswith("site.embedment")]
    told += [Problem(Position(file), "not used: the depth is searched", BY_NAME[name].path) for name in unused]
    return tuple(told)


def _given(names: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Return the options among these that the user gave to the command that runs, as words to type again."""
    context = click.get_current_context()
    words: list[tuple[str, ...]] = []
    for one in context.command.params:
        if one.name not in names or context.get_parameter_source(one.name) != ParameterSource.COMMANDLINE:
            continue
        value = context.params[one.name]
        if isinstance(value, bool):
            words.append((one.opts[0] if value else one.secondary_opts[0],))
        elif one.multiple:
            words += [(one.opts[0], each) for each in value]
        else:
            words.append((one.opts[0], *([value] if isinstance(value, str) else value)))
    return tuple(words)


UNCERTAINTY_EXAMPLES = """\b
Examples:
  sweep uncertainty configs/uncertain_site.yaml
  sweep uncertainty configs/uncertain_site.yaml --plot chances.png
  sweep uncertainty configs/uncertain_site.yaml -o chances.parquet
"""


@click.command(
    "uncertainty", short_help="The probability of passing with uncertain inputs.", epilog=UNCERTAINTY_EXAMPLES
)
@grid_argument
@click.option("--half-width", default="0.01", metavar="P", help="Largest half-width of the interval [0.01].")
@click.option("--confidence", default="95 %", metavar="SHARE", help="Confidence level of the interval [95 %].")
@margin_option
@click.option("--seed", type=click.IntRange(min=0), default=0, metavar="N", help="Seed of the random numbers [0].")
@jobs_option
@click.option("-o", "--output", "out", type=OUTPUT, metavar="F.parquet", help="Table; samples next to it.")
@click.option("--plot", "picture", type=OUTPUT, metavar="F.png", help="Picture (.png, .svg or .pdf) of one design.")
@click.option("--design", type=click.IntRange(min=0), default=0, metavar="ID", help="The design of --plot [0].")
@second_opinion_option
@quiet_option
@units_option
@set_option
@json_option
def uncertainty(
    grid: str,
    out: str | None,
    picture: str | None,
    design: int,
    second_opinion: bool | None,
    units: str | None,
    quiet: bool,
    overrides: tuple[str, ...],
    as_json: bool,
    **question: Any,
) -> int:
    """Estimate the probability of passing for every design of GRID, in which some inputs have distributions.

    An input takes a distribution instead of a value: {mean: 38 deg, sd: 3 deg}, or with cov: 5 %. Sampling continues
    until the interval is narrow enough.
    """
    from boulder_sweep.answers.printing import uncertainty_lines
    from boulder_sweep.answers.uncertainty import uncertainty as estimate
    from boulder_sweep.settings import load

    refuse_units_of_json(units, as_json)
    sweep = load(grid, with_or_without(overrides, second_opinion))
    units = units or sweep.units
    refuse_missing(sweep, grid, design)
    refuse_unwritable(out, picture)

    shares = {name: question[name] for name in ("margin", "confidence", "half_width")}
    say_how = partial(say_notes, sweep, units, **shares)
    with working(quiet) as progress:
        result = estimate(sweep, **question, progress=progress, ready=None if quiet else say_how)
    show(*([json.dumps(result.to_dict())] if as_json else uncertainty_lines(result, units=units)))
    if not quiet:
        drawn = sum(result.arrow["p_pass_designs"].to_pylist())
        say(f"{counted(len(result), 'row')}; {counted(drawn, 'design')} drawn for the chances; seed {question['seed']}")
    if out is not None:
        say_written(quiet, *result.write(out))
    if picture is not None:
        result.plot(picture, design, units=units)
        say_written(quiet, picture)
    return 0


CAPACITY_EXAMPLES = """\b
Examples:
  sweep capacity configs/crash_tests.yaml
  sweep capacity configs/clayey_terrace.yaml -o withstands.parquet
"""


@click.command("capacity", short_help="Which truck and soil every design withstands.", epilog=CAPACITY_EXAMPLES)
@grid_argument
@jobs_option
@click.option("-o", "--output", "out", type=OUTPUT, metavar="F.parquet", help="Table of all designs.")
@quiet_option
@units_option
@second_opinion_option
@at_option
@set_option
@json_option
def capacity(
    grid: str,
    second_opinion: bool | None,
    at: str | None,
    jobs: int | None,
    out: str | None,
    units: str | None,
    quiet: bool,
    overrides: tuple[str, ...],
    as_json: bool,
) -> int:
    """Find up to which speed and mass of the truck, and down to which friction angle, every design passes throughout.

    Also names the highest ASTM F2656 class whose nominal speed (30, 40, 50 mph) is withstood. The class is
    simulated; the standard rates by test.
    """
    from boulder_sweep.answers.printing import reserve_lines
    from boulder_sweep.answers.reserves import capacity as withstood

    refuse_units_of_json(units, as_json)
    sweep = load_given(grid, with_or_without(overrides, second_opinion), at)
    units = units or sweep.units
    refuse_unwritable(out)
    if not quiet:
        say_notes(sweep, units)
    with working(quiet) as progress:
        result = withstood(sweep, jobs=jobs, progress=progress)
    show(*([json.dumps(result.to_dict())] if as_json else reserve_lines(result, units=units)))
    if out is not None:
        result.write(out)
        say_written(quiet, out)
    errors = result.arrow["verdict"].to_pylist().count("error")
    return EXIT_SOME_ROWS_FAILED if errors else EXIT_DONE
