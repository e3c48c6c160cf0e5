"""``sweep explore``: one design in the browser, simulated anew at every change."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import click

from boulder_sweep.cli.loading import load_sweep, refuse_missing
from boulder_sweep.cli.options import OUTPUT, set_option, units_option
from boulder_sweep.cli.output import say, show

EXAMPLES = """\b
Examples:
  sweep explore
  sweep explore configs/abg.yaml
  sweep explore configs/m30_sizing.yaml --design 4711 --units us -o 4711.html
"""


@click.command("explore", short_help="Open one design in the browser and change it there.", epilog=EXAMPLES)
@click.argument("case", type=click.Path(), required=False)
@click.option("--design", type=click.IntRange(min=0), default=0, metavar="N", help="Number of the design [default: 0].")
@click.option("-o", "--output", "page", type=OUTPUT, metavar="F.html", help="The page [default: NAME.html].")
@click.option("--no-open", is_flag=True, help="Write the page and do not open it.")
@units_option
@set_option
def explore(
    case: str | None, design: int, page: str | None, no_open: bool, units: str, overrides: tuple[str, ...]
) -> int:
    """Write a page with one design of CASE and open it in the browser.

    Every change in the page simulates the impact anew, in the page: no server, no network. Without CASE it starts with
    the boulder of the paper's second crash test, which stopped its truck.
    """
    import webbrowser

    from boulder_sweep.report import example, write_explorer

    if case is None and overrides:
        raise click.UsageError("--set changes entries of a file: name one")
    sweep = example() if case is None else load_sweep(case, overrides, quiet=False)
    refuse_missing(sweep, case or sweep.name, design)
    target = Path(page or f"{sweep.name.replace('/', '-').replace(' ', '-')}.html")
    written = write_explorer(sweep, design, target, units=units, command=shlex.join(["sweep", *sys.argv[1:]]))
    show(f"{written}: {written.stat().st_size / 1e6:.1f} MB, opens in any browser, needs no network")
    if not no_open and not webbrowser.open(written.resolve().as_uri()):
        say("note: found no browser to open it")
    return 0
