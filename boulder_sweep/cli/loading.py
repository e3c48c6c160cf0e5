"""Load settings the way every command does."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from boulder_sweep.cli.output import say
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep


def load_sweep(path: str, overrides: Sequence[str], quiet: bool) -> Sweep:
    """Load settings and print the notes on them."""
    from boulder_sweep.settings import load

    sweep = load(path, overrides)
    if not quiet:
        for note in sweep.notes:
            say(f"note: {note}")
    return sweep


def refuse_missing(sweep: Sweep, path: str, number: int) -> None:
    """Refuse the number of a design that the file does not hold."""
    if number >= sweep.n_designs:
        held = counted(sweep.n_designs, "design")
        raise click.UsageError(f"{path} holds {held}, numbered from 0; there is no {number}")


def refuse_units_of_json(units: str, as_json: bool) -> None:
    """Refuse ``--json`` in US units, for commands whose objects are in those of the table."""
    if as_json and units != "si":
        raise click.UsageError(f"--json is in SI units for this command; leave out --units {units} or --json")


def refuse_unwritable(table: str | None, picture: str | None = None) -> None:
    """Refuse a table or a picture that cannot be written, before anything is computed; None where none is wanted."""
    if table is not None:
        from boulder_sweep.answers.tables import checked_parquet

        checked_parquet(table)
    if picture is not None:
        from boulder_sweep.views.figures import checked_kind, require_matplotlib

        require_matplotlib()
        checked_kind(picture)


def refuse_unwritable_history(
    plot: str | None, trajectory: str | None, energy: str | None = None, animation: str | None = None
) -> None:
    """Refuse what cannot be written of a time history, before anything is computed; None where it is not wanted."""
    names = [name for name in (plot, trajectory, energy, animation) if name is not None]
    for place, name in enumerate(names):
        if any(Path(name).resolve() == Path(other).resolve() for other in names[:place]):
            raise click.UsageError(f"{name} is named twice; give each output a name of its own")
    refuse_unwritable(None, plot)
    if trajectory is not None:
        from boulder_sweep.impact.trajectory_file import checked_history

        checked_history(trajectory)
    refuse_unwritable(None, energy)
    if animation is not None:
        from boulder_sweep.views.animation import checked_animation

        checked_animation(animation)


def quantity_of(option: str, text: str, unit: str) -> float:
    """Return the positive number that an option gives with its unit, in the unit of the table."""
    from boulder_sweep.settings.numbers import NumberError, split_number
    from boulder_sweep.settings.units import EXPECTED, UnitError, factor

    try:
        number, unit_text = split_number(text, unit)
        if not unit_text:
            raise click.UsageError(f"{option} '{text}': write the unit too ({EXPECTED[unit].examples})")
        value = float(number * factor(unit_text, unit))
    except (NumberError, UnitError) as error:
        raise click.UsageError(f"{option}: {error}") from None
    if not value > 0.0:
        raise click.UsageError(f"{option} '{text}': must be positive")
    return value
