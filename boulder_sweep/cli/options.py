"""What several commands share: options, settings as every command loads them, refusals before anything is computed."""

from __future__ import annotations

import functools
import os
import textwrap
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.output import say, wrap
from boulder_sweep.runner.pool import MOST_JOBS
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

Command = Callable[..., Any]
SYSTEMS = ("si", "us")
JOBS = click.IntRange(1, MOST_JOBS)


class OutputPath(click.Path):
    """Name of a file or folder to write; an empty one, such as an unset shell variable, is refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse an empty name."""
        if os.fspath(value) == "":
            self.fail("the name is empty", param, ctx)
        return super().convert(value, param, ctx)


class Quantity(click.ParamType):
    """A number of some dimension: it needs its unit, whatever `--units` says, and stays the text that it is.

    Without a unit of the table an input that is named with it decides, and the command refuses bare numbers.
    """

    name = "quantity"

    def __init__(self, unit: str | None = None) -> None:
        self.unit = unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse a number without a unit."""
        from boulder_sweep.settings.values import NumberError, refuse_bare

        if self.unit is not None and param is not None:
            try:
                refuse_bare(param.opts[0], [value], self.unit)
            except NumberError as error:
                raise click.UsageError(str(error), ctx) from None
        return value


OUTPUT = OutputPath()

grid_argument = click.argument("grid", type=click.Path())
result_argument = click.argument("out", type=click.Path())
set_option = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace one entry of the file, e.g. --set vehicle.speed='50 mph' (may be repeated).",
)
jobs_option = click.option("--jobs", type=JOBS, help="Threads [default: all cores].")
at_option = click.option(
    "--at",
    metavar="QUANTILE",
    help="Uncertain inputs: at both ends, p5 [default], p10, ..., and the mean, or mean alone.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object on stdout.")
units_option = click.option("--units", type=click.Choice(SYSTEMS), help="Units shown [as in the file].")
quiet_option = click.option("-q", "--quiet", is_flag=True, help="No notes.")
margin_option = click.option("--margin", default="0", metavar="SHARE", help="Least margin to the limits, e.g. '25 %'.")
second_opinion_option = click.option(
    "--second-opinion/--no-second-opinion",
    default=None,
    help="Simulate every pass again with friction, vertical motion and a weaker soil model: robust or sensitive? [as "
    "in the file, where nothing is said: yes]",
)


def talk_options(function: Command) -> Command:
    """Add ``-q`` and ``-v``, which exclude each other."""

    @click.option("-q", "--quiet", is_flag=True, help="No progress, no notes.")
    @click.option("-v", "--verbose", is_flag=True, help="More detail; tracebacks of internal errors.")
    @functools.wraps(function)
    def command(*args: Any, quiet: bool, verbose: bool, **options: Any) -> Any:
        if quiet and verbose:
            raise click.UsageError("--quiet and --verbose cannot be used together")
        return function(*args, quiet=quiet, verbose=verbose, **options)

    return command


def with_or_without(overrides: Sequence[str], second_opinion: bool | None) -> Sequence[str]:
    """Return overrides with second opinions or without, as the user says; None for what the file says."""
    from boulder_sweep.settings.loader import NO_SECOND_OPINION, SECOND_OPINION

    if second_opinion is None:
        return overrides
    return (*overrides, SECOND_OPINION if second_opinion else NO_SECOND_OPINION)


def load_given(path: str, overrides: Sequence[str], at: str | None = None) -> Sweep:
    """Load settings for a command that needs a depth and one value for every uncertain input; nothing is said."""
    from boulder_sweep.judge.quantiles import at_values
    from boulder_sweep.settings import load

    sweep = load(path, overrides)
    sweep.need_depth()
    return at_values(sweep, at)


def say_notes(sweep: Sweep, units: str | None = None, **shares: str | None) -> None:
    """Print the notes on settings, how inputs follow from the data of a site, and which values uncertain inputs have.

    They are in the units of the file where none are asked for. Of options that are shares, it is said where a bare
    number above 1 is read as per cent; those that are no numbers are refused later.
    """
    from boulder_sweep.judge.quantiles import words_of
    from boulder_sweep.settings.sweep import derived_words

    for words in derived_words(sweep.derived, units or sweep.units):
        say("\n".join(textwrap.wrap(f"note: {words}", 80, subsequent_indent="  ")))
    for note in sweep.notes:
        say(f"note: {note}")
    if sweep.taken_at:
        say("\n".join(wrap(f"note: {words_of(sweep, units or sweep.units)}")))
    for name, text in shares.items():
        with suppress(ValueError):
            if text is not None and float(text) > 1.0:
                say(f"note: --{name.replace('_', '-')} {text} is read as {text} %")


def refuse_missing(sweep: Sweep, path: str, number: int) -> None:
    """Refuse the number of a design that the file does not hold."""
    if number >= sweep.n_designs:
        held = counted(sweep.n_designs, "design")
        raise click.UsageError(f"{path} holds {held}, numbered from 0; there is no {number}")


def refuse_units_of_json(units: str | None, as_json: bool) -> None:
    """Refuse ``--json`` in US units, for commands that print objects in the units of the table."""
    if as_json and units == "us":
        raise click.UsageError(f"--json is in SI units for this command; leave out --units {units} or --json")


def refuse_unwritable(table: str | None, picture: str | None = None) -> None:
    """Refuse a table or a picture that cannot be written, before anything is computed; None where none is wanted."""
    if table is not None:
        from boulder_sweep.answers.result import checked_parquet

        checked_parquet(table)
    _refuse_picture(picture)


def _refuse_picture(path: str | None, *, animated: bool = False) -> None:
    """Refuse a picture that cannot be written; None where none is wanted."""
    if path is not None:
        from boulder_sweep.views import pictures

        pictures.require_matplotlib()
        pictures.checked_kind(path, pictures.ANIMATED if animated else pictures.KINDS)


def refuse_unwritable_history(
    plot: str | None, trajectory: str | None, energy: str | None, animation: str | None
) -> None:
    """Refuse outputs of a time history that cannot be written, before anything is computed; None: not wanted."""
    names = [name for name in (plot, trajectory, energy, animation) if name is not None]
    for index, name in enumerate(names):
        if any(Path(name).resolve() == Path(other).resolve() for other in names[:index]):
            raise click.UsageError(f"{name} is named twice; give each output a name of its own")
    _refuse_picture(plot)
    if trajectory is not None:
        from boulder_sweep.impact.trajectory import checked_history

        checked_history(trajectory)
    _refuse_picture(energy)
    _refuse_picture(animation, animated=True)


def quantity_of(option: str, text: str, unit: str) -> float:
    """Return the positive number that an option gives with its unit, in the unit of the table."""
    from boulder_sweep.settings.units import UnitError, factor
    from boulder_sweep.settings.values import NumberError, split_number

    try:
        number, unit_text = split_number(text, unit)
        value = float(number * factor(unit_text, unit))
    except (NumberError, UnitError) as error:
        raise click.UsageError(f"{option}: {error}") from None
    if not value > 0.0:
        raise click.UsageError(f"{option} '{text}': must be positive")
    return value
