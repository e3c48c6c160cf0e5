"""``sweep plot``: pass/fail maps from a result table."""

from __future__ import annotations

import click

from boulder_sweep.cli.output import say, show
from boulder_sweep.places import beside, place_of

EXAMPLES = """\b
Examples:
  sweep plot m30-sizing.sweep
  sweep plot m30-sizing.sweep -o map.png --at boulder_width_m=1.8
  sweep plot m30-sizing.sweep --across boulder_width_m --at embedment_ratio=0.6
"""
COLUMN = "COLUMN"


@click.command("plot", short_help="Draw which designs of a result pass.", epilog=EXAMPLES)
@click.argument("out", type=click.Path())
@click.option("-o", "--output", "picture", type=click.Path(), metavar="F.png", help="Picture [default: OUT.png].")
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
def plot(out: str, picture: str | None, at: tuple[str, ...], **axes: str | None) -> int:
    """Draw a map of the verdicts in OUT: embedment across, height up, one map for each soil.

    OUT may belong to a run in progress; finished designs are drawn. COLUMN is the name of an input column of the
    table, or embedment_ratio.
    """
    held = dict(_held(text) for text in at)
    from boulder_sweep.errors import PictureError
    from boulder_sweep.store.finished import FinishedRows
    from boulder_sweep.views.figures import checked_kind, require_matplotlib
    from boulder_sweep.views.pieces import finished_pieces
    from boulder_sweep.views.verdict_map import draw_verdict_map
    from boulder_sweep.views.wording import terms_line

    require_matplotlib()
    folder = place_of(out)
    finished = FinishedRows(folder)
    target = checked_kind(picture or beside(folder, ".png"))
    if finished.rows_done == 0:
        raise PictureError(f"{out} holds no finished designs yet; see `sweep status {out}`")
    settings = finished.identity["settings"]
    shown = draw_verdict_map(
        finished_pieces(finished), target, title=settings["name"], terms=terms_line(settings), at=held, **axes
    )
    for name, value in held.items():
        taken = shown.fixed.get(name, value)
        if abs(taken - value) > 1e-6 * abs(value):
            say(f"note: {name} is {taken:.6g} in this map, the value nearest to {value:.6g}")
    if finished.rows_done < finished.rows:
        say(f"note: the run is not finished; {shown.total:,} designs are drawn")
    show(f"{target}: {shown.count:,} of {shown.total:,} designs")
    return 0


def _held(text: str) -> tuple[str, float]:
    """Read ``COLUMN=VALUE``."""
    name, equals, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise click.UsageError(
            f"--at {text}: must be COLUMN=VALUE, with a number in the unit of the column"
            if equals
            else f"--at {text}: no = found; write COLUMN=VALUE"
        ) from None
