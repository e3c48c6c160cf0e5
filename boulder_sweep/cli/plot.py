"""``sweep plot``: pass/fail maps from a result table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import click

from boulder_sweep.cli.options import OUTPUT, units_option
from boulder_sweep.cli.output import say, show
from boulder_sweep.locations import beside, location_of

EXAMPLES = """\b
Examples:
  sweep plot m30-sizing.sweep
  sweep plot m30-sizing.sweep -o map.png --at width=1.8
  sweep plot m30-sizing.sweep --units us
  sweep plot m30-sizing.sweep --across width
"""
COLUMN = "COLUMN"


@click.command("plot", short_help="Draw which designs of a result pass.", epilog=EXAMPLES)
@click.argument("out", type=click.Path())
@click.option("-o", "--output", "picture", type=OUTPUT, metavar="F.png", help="Picture [default: OUT.png].")
@click.option("--across", metavar=COLUMN, help="Input on the horizontal axis [default: embedment].")
@click.option("--up", metavar=COLUMN, help="Input on the vertical axis [default: boulder height].")
@click.option("--columns", metavar=COLUMN, help="Input over the columns of maps [default: subgrade reaction].")
@click.option("--rows", metavar=COLUMN, help="Input over the rows of maps [default: friction angle].")
@click.option(
    "--at",
    multiple=True,
    metavar="COLUMN=VALUE",
    help="Hold another input at a value, in the unit of its column [default: its middle one] (may be repeated).",
)
@units_option
def plot(out: str, picture: str | None, at: tuple[str, ...], units: str, **axes: Any) -> int:
    """Draw a map of the verdicts in OUT: embedment across, height up, one map for each soil.

    OUT is the folder of a run, perhaps in progress, of which finished designs are drawn.
    COLUMN is an input as in the file (boulder.width or width) or as in the table (boulder_width_m), or soil or vehicle
    where these have names.
    """
    axes = {option: name and _column(option, name) for option, name in axes.items()}
    given: dict[str, str] = {}
    for name, text in map(_given, at):
        if name in given:
            raise click.UsageError(f"--at {name} is given twice; give each column one value")
        given[name] = text
    from boulder_sweep.errors import PictureError
    from boulder_sweep.store.reader import FinishedRows
    from boulder_sweep.views.figures import checked_kind, require_matplotlib
    from boulder_sweep.views.pieces import finished_pieces
    from boulder_sweep.views.verdict_map import draw_verdict_map
    from boulder_sweep.views.wording import terms_line

    require_matplotlib()
    finished = FinishedRows(location_of(out))
    target = checked_kind(picture or beside(location_of(out), ".png"))
    if finished.rows_done == 0:
        raise PictureError(f"{out} holds no finished designs yet; see `sweep status {out}`")
    settings = finished.identity["settings"]
    sets = settings.get("labels", {}) if settings["order"] != "table" else {}
    held = {name: _held(name, text, sets) for name, text in given.items()}
    judged = finished.judged_by
    judged = f" {judged[0].upper()}{judged[1:]}." if judged else ""
    words = {"title": settings["name"], "terms": f"{terms_line(settings)}{judged}"}
    shown = draw_verdict_map(finished_pieces(finished), target, at=held, sets=sets, units=units, **words, **axes)
    for name, value in held.items():
        taken = shown.fixed.get(name, value)
        if abs(taken - value) > 1e-6 * abs(value):
            say(f"note: {name} is {taken:.6g} in this map, the value nearest to {value:.6g}")
    if finished.rows_done < finished.rows:
        say(f"note: the run is not finished; {shown.total:,} designs are drawn")
    show(f"{target}: {shown.count:,} of {shown.total:,} designs")
    return 0


def _given(text: str) -> tuple[str, str]:
    """Read ``COLUMN=VALUE``."""
    name, equals, value = text.partition("=")
    if not equals:
        raise click.UsageError(f"--at {text}: missing =; write COLUMN=VALUE")
    return _column("at", name.strip()), value.strip()


def _column(option: str, word: str) -> str:
    """Return the column of the input that a word names; a name of sets stays as it is."""
    from boulder_sweep.settings.names import UnknownNameError, named

    if word in ("soil", "vehicle"):
        return word
    try:
        return named(word).name
    except UnknownNameError as problem:
        raise click.UsageError(f"--{option} {problem}") from None


def _held(name: str, text: str, sets: Mapping[str, Sequence[str]]) -> float:
    """Return the value at which an input is held; of a named soil or vehicle its place."""
    if name in sets:
        if text in sets[name]:
            return float(sets[name].index(text))
        raise click.UsageError(f"--at {name}={text}: there are {', '.join(sets[name])}")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise click.UsageError(f"--at {name}={text}: must be COLUMN=VALUE, with a finite number in the column's unit")
    return value
