"""``sweep report``: a result as one page that carries the simulator."""

from __future__ import annotations

import shlex
import sys

import click

from boulder_sweep.cli.options import OUTPUT, units_option
from boulder_sweep.cli.output import show
from boulder_sweep.locations import beside, location_of

EXAMPLES = """\b
Examples:
  sweep report m30-sizing.sweep
  sweep report m30-sizing.sweep --design 4711 --design 104960 -o site.html
  sweep report m30-sizing.sweep --units us
  sweep report chances.parquet
  sweep report m30-sizing.sweep --project "Main Street" --client "City of Springfield" -o report.pdf
"""


@click.command("report", short_help="Write a result as one page with the simulator inside.", epilog=EXAMPLES)
@click.argument("out", type=click.Path())
@click.option("-o", "--output", "page", type=OUTPUT, metavar="F.html|.pdf", help="The page [default: OUT.html].")
@click.option(
    "--design",
    "designs",
    type=click.IntRange(min=0),
    multiple=True,
    metavar="N",
    help="Show this design in full (may be repeated) [default: the lightest and the shallowest that pass].",
)
@click.option("--project", metavar="TEXT", help="Heading of the report; wins over report.project in the file.")
@click.option("--client", metavar="TEXT", help="The same of the client.")
@click.option("--author", metavar="TEXT", help="The same of the author.")
@click.option("--date", metavar="TEXT", help="The same of the date.")
@units_option
def report(out: str, page: str | None, designs: tuple[int, ...], units: str, **heading: str | None) -> int:
    """Write the result in OUT as one HTML file: the answer, the map, and the simulator, which runs in the page.

    OUT is the folder of a run, or a file of `sweep uncertainty -o`, whose probabilities of passing then stand first.

    The file needs no network and no server: it opens from disk in any browser, and whoever gets it can change a
    design and see the impact simulated anew. With -o F.pdf the page is printed by a Chromium or Chrome on this machine.
    """
    from boulder_sweep.report import checked_page, write_report
    from boulder_sweep.settings.heading import Heading, wrong_with

    given = {key: text for key, text in heading.items() if text is not None}
    for key, text in given.items():
        if wrong := wrong_with(text):
            raise click.UsageError(f"--{key} {wrong}")

    folder = location_of(out)
    target = checked_page(page) if page else beside(location_of(out.removesuffix(".parquet")), ".html")
    command = shlex.join(["sweep", *sys.argv[1:]])
    written = write_report(folder, target, designs=designs, units=units, command=command, heading=Heading(**given))
    size = f"{written.stat().st_size / 1e6:.1f} MB"
    printed = written.suffix.lower() == ".pdf"
    show(f"{written}: {size}" if printed else f"{written}: {size}, opens in any browser, needs no network")
    return 0
