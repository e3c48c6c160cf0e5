"""What goes to others: ``sweep plot``, ``report`` and ``export`` of a result, and ``sweep explore`` for one design."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import (
    OUTPUT,
    Quantity,
    at_option,
    load_given,
    refuse_missing,
    result_argument,
    say_notes,
    second_opinion_option,
    set_option,
    units_option,
)
from boulder_sweep.cli.output import say, show
from boulder_sweep.locations import beside, location_of
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.answers.outputs import AnswerFile

PLOT_EXAMPLES = """\b
Examples:
  sweep plot m30-sizing.sweep
  sweep plot m30-sizing.sweep -o map.png --at width=1.8m
  sweep plot m30-sizing.sweep --units us
  sweep plot m30-sizing.sweep --across width
  sweep plot depths.parquet
"""
COLUMN = "COLUMN"


@click.command("plot", short_help="Draw which designs of a result pass.", epilog=PLOT_EXAMPLES)
@result_argument
@click.option("-o", "--output", "picture", type=OUTPUT, metavar="F.png", help="Picture [default: OUT.png].")
@click.option("--across", metavar=COLUMN, help="Input on the horizontal axis [default: embedment].")
@click.option("--up", metavar=COLUMN, help="Input on the vertical axis [default: boulder height].")
@click.option("--columns", metavar=COLUMN, help="Input over the columns of maps [default: subgrade reaction].")
@click.option("--rows", metavar=COLUMN, help="Input over the rows of maps [default: friction angle].")
@click.option(
    "--at",
    multiple=True,
    type=Quantity(),
    metavar="COLUMN=VALUE",
    help="Hold another input at a value [default: its middle one] (may be repeated).",
)
@units_option
def plot(out: str, picture: str | None, at: tuple[str, ...], units: str | None, **axes: Any) -> int:
    """Draw a map of the verdicts in OUT: embedment across, height up, one map for each soil.

    OUT is the folder of a run, perhaps in progress, of which finished designs are drawn. Of a file that -o of
    `sweep need`, `capacity` or `uncertainty` wrote, a chart of the answers is drawn.
    COLUMN is an input as in the file (boulder.width or width) or as in the table (boulder_width_m), or soil or vehicle
    where these have names.
    """
    axes = {option: name and _column(option, name) for option, name in axes.items()}
    given: dict[str, str] = {}
    for name, text in map(_given, at):
        if name in given:
            raise click.UsageError(f"--at {name} is given twice; give each column one value")
        given[name] = text
    from boulder_sweep.answers.advice import advice
    from boulder_sweep.answers.outputs import AnswerFile, result_of
    from boulder_sweep.errors import PictureError
    from boulder_sweep.report.answers import answer_of
    from boulder_sweep.report.rows import read_rows
    from boulder_sweep.settings.sweep import units_in
    from boulder_sweep.views.pictures import checked_kind, require_matplotlib
    from boulder_sweep.views.verdict_map import draw_verdict_map, finished_pieces
    from boulder_sweep.views.wording import terms_line

    require_matplotlib()
    finished = result_of(location_of(out), PictureError)
    target = checked_kind(picture or beside(location_of(out.removesuffix(".parquet")), ".png"))
    settings = finished.identity["settings"]
    units = units or units_in(settings)
    if isinstance(finished, AnswerFile):
        return _plot_answers(finished, target, units, [*filter(None, axes.values()), *given])
    if finished.rows_done == 0:
        raise PictureError(f"{out} holds no finished designs yet")
    sets = settings.get("labels", {}) if settings["order"] != "table" else {}
    held = {name: _held(name, text, sets) for name, text in given.items()}
    judged = finished.judged_by
    judged = f" {judged[0].upper()}{judged[1:]}." if judged else ""
    words = {"title": settings["name"], "terms": f"{terms_line(settings, units)}{judged}"}
    if settings["model"].get("second_opinion"):  # else the page asks them, which takes long
        words["found"] = advice(answer_of(read_rows(location_of(out))).need, units)[0]
    shown = draw_verdict_map(finished_pieces(finished), target, at=held, sets=sets, units=units, **words, **axes)
    for name, value in held.items():
        taken = shown.fixed.get(name, value)
        if abs(taken - value) > 1e-6 * abs(value):
            say(f"note: {name} is {taken:.6g} in this map, the value nearest to {value:.6g}")
    if finished.rows_done < finished.rows:
        say(f"note: the run is not finished; {shown.total:,} designs are drawn")
    show(f"{target}: {shown.count:,} of {shown.total:,} designs")
    return 0


def _plot_answers(file: AnswerFile, target: Path, units: str, asked: Sequence[str]) -> int:
    """Draw a file of answers as its command does; which inputs are across and up follows from what varies."""
    from boulder_sweep.answers.outputs import NEED, UNCERTAINTY
    from boulder_sweep.drawing import draw

    if asked:
        options = "--across, --up, --columns, --rows and --at"
        raise click.UsageError(f"{options} choose a part of the result of a run; a chart of answers takes none")
    of_one = "draw_uncertainty" if file.kind == UNCERTAINTY and file.rows == 1 else "draw_answers"
    chart = "draw_design_chart" if file.kind == NEED else of_one
    draw("answer_charts", chart, file.answers(), target, units=units)
    show(f"{target}: {counted(file.rows, 'answer')}")
    return 0


def _given(text: str) -> tuple[str, str]:
    """Read ``COLUMN=VALUE``; the value of an input has its unit, behind it or in the name of the column."""
    from boulder_sweep.settings.fields import BY_NAME
    from boulder_sweep.settings.values import NumberError, refuse_bare

    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        raise click.UsageError(f"--at {text}: missing =; write COLUMN=VALUE")
    column = _column("at", name)
    if column in BY_NAME and column != name:
        try:
            refuse_bare(f"--at {name}=", [value], BY_NAME[column].unit)
        except NumberError as error:
            raise click.UsageError(str(error)) from None
    return column, value


def _column(option: str, word: str) -> str:
    """Return the column of the input that a word names; a name of sets stays as it is."""
    from boulder_sweep.settings.fields import UnknownNameError, named

    if word in ("soil", "vehicle"):
        return word
    try:
        return named(word).name
    except UnknownNameError as problem:
        raise click.UsageError(f"--{option} {problem}") from None


def _held(name: str, text: str, sets: Mapping[str, Sequence[str]]) -> float:
    """Return the value at which an input is held, in the unit of the table; of a named soil or vehicle its number."""
    from boulder_sweep.settings.fields import BY_NAME
    from boulder_sweep.settings.problems import Position, SettingsError
    from boulder_sweep.settings.tree import Scalar
    from boulder_sweep.settings.values import read_quantity

    if name in sets:
        if text in sets[name]:
            return float(sets[name].index(text))
        raise click.UsageError(f"--at {name}={text}: there are {', '.join(sets[name])}")
    if name not in BY_NAME:
        raise click.UsageError(f"--at {name}={text}: this result has no named sets of {name}")
    try:
        return float(read_quantity(Scalar(Position("--at"), text), BY_NAME[name].unit).value)
    except SettingsError as error:
        raise click.UsageError(f"--at {name}={text}: {error.problems[0].message}") from None


REPORT_EXAMPLES = """\b
Examples:
  sweep report m30-sizing.sweep
  sweep report m30-sizing.sweep --design 4711 --design 104960 -o site.html
  sweep report m30-sizing.sweep --units us
  sweep report depths.parquet
  sweep report m30-sizing.sweep --project "Main Street" -o report.pdf
"""


@click.command("report", short_help="Write a result as one page with the simulator inside.", epilog=REPORT_EXAMPLES)
@result_argument
@click.option("-o", "--output", "page", type=OUTPUT, metavar="F.html|.pdf", help="The page [default: OUT.html].")
@click.option(
    "--design",
    "designs",
    type=click.IntRange(min=0),
    multiple=True,
    metavar="N",
    help="Show this design in full (may be repeated) [default: the one that is recommended].",
)
@second_opinion_option
@click.option("--project", metavar="TEXT", help="Heading of the report; wins over report.project in the file.")
@click.option("--client", metavar="TEXT", help="The same of the client,")
@click.option("--site", metavar="TEXT", help="the site,")
@click.option("--date", metavar="TEXT", help="the date; a PDF has today's where none is given,")
@click.option("--revision", metavar="TEXT", help="the revision,")
@click.option("--author", metavar="TEXT", help="who made it,")
@click.option("--checked-by", metavar="TEXT", help="and who checked it.")
@units_option
def report(
    out: str,
    page: str | None,
    designs: tuple[int, ...],
    second_opinion: bool | None,
    units: str | None,
    **heading: str | None,
) -> int:
    """Write the result in OUT as one HTML file: the answer, the map, and the simulator, which runs in the page.

    OUT is the folder of a run, or a file that -o of `sweep need`, `capacity` or `uncertainty` wrote: the answers then
    stand first.

    The file needs no network and no server: it opens from disk in any browser, and whoever gets it can change a
    design and see the impact simulated anew. With -o F.pdf the page is printed by a Chromium or Chrome on this machine.
    """
    from boulder_sweep.report import checked_page, write_report
    from boulder_sweep.settings.sweep import Heading, wrong_with

    given = {key: text for key, text in heading.items() if text is not None}
    for key, text in given.items():
        if wrong := wrong_with(text):
            raise click.UsageError(f"--{key.replace('_', '-')} {wrong}")
    target = checked_page(page) if page else beside(location_of(out.removesuffix(".parquet")), ".html")
    asked = second_opinion is not False
    words: Any = {"units": units, "command": _command(), "heading": Heading(**given)}
    _show_page(write_report(location_of(out), target, designs=designs, second_opinion=asked, **words))
    return 0


def _command() -> str:
    """Return this command as it was typed, for the page to name."""
    return shlex.join(["sweep", *sys.argv[1:]])


def _show_page(page: Path) -> None:
    """Say where a page is, and how large."""
    size = f"{page.stat().st_size / 1e6:.1f} MB"
    printed = page.suffix.lower() == ".pdf"
    show(f"{page}: {size}" if printed else f"{page}: {size}, opens in any browser, needs no network")


EXPORT_EXAMPLES = """\b
Examples:
  sweep export m30-sizing.sweep -o designs.xlsx --units us
  sweep export m30-sizing.sweep -o designs.csv
  sweep export depths.parquet -o depths.xlsx
"""


@click.command("export", short_help="Write a result as .xlsx, .csv or .parquet.", epilog=EXPORT_EXAMPLES)
@result_argument
@click.option("-o", "--output", "file", type=OUTPUT, required=True, metavar="F.xlsx|.csv|.parquet", help="The table.")
@units_option
def export(out: str, file: str, units: str | None) -> int:
    """Write the result in OUT as one table for colleagues, in SI or US customary units.

    OUT is the folder of a run, or a file that -o of `sweep need`, `capacity` or `uncertainty`, or --trajectory wrote.
    The names of the columns end in their units. A spreadsheet has the recommendation on a sheet before the rows, and
    units, meanings, settings, versions and hashes on one behind them.
    """
    from boulder_sweep.report.export import export as write

    rows = write(out, file, units=units)
    show(f"{file}: {counted(rows, 'row')}")
    return 0


EXPLORE_EXAMPLES = """\b
Examples:
  sweep explore
  sweep explore configs/abg.yaml
  sweep explore configs/m30_sizing.yaml --design 4711 --units us -o 4711.html
"""


@click.command("explore", short_help="Open one design in the browser and change it there.", epilog=EXPLORE_EXAMPLES)
@click.argument("case", type=click.Path(), required=False)
@click.option("--design", type=click.IntRange(min=0), default=0, metavar="N", help="Number of the design [default: 0].")
@click.option("-o", "--output", "page", type=OUTPUT, metavar="F.html", help="The page [default: NAME.html].")
@click.option("--no-open", is_flag=True, help="Write the page and do not open it.")
@units_option
@at_option
@set_option
def explore(
    case: str | None,
    design: int,
    page: str | None,
    no_open: bool,
    at: str | None,
    units: str | None,
    overrides: tuple[str, ...],
) -> int:
    """Write a page with one design of CASE and open it in the browser.

    Every change in the page simulates the impact anew, in the page: no server, no network. Without CASE it starts with
    the boulder of the paper's second crash test, which stopped its truck.
    """
    import webbrowser

    from boulder_sweep.report import example, write_explorer

    if case is None and overrides:
        raise click.UsageError("--set changes entries of a file: name one")
    if case is None and at is not None:
        raise click.UsageError("--at is for a file with uncertain inputs: name one")
    sweep = example() if case is None else load_given(case, overrides, at)
    refuse_missing(sweep, case or sweep.name, design)
    if case is not None:
        say_notes(sweep, units)
    target = Path(page or f"{sweep.name.replace('/', '-').replace(' ', '-')}.html")
    written = write_explorer(sweep, design, target, units=units, command=_command())
    _show_page(written)
    if not no_open and not webbrowser.open(written.resolve().as_uri()):
        say("note: found no browser to open it")
    return 0
