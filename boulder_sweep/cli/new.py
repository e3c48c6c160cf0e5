"""``sweep new``: a commented settings file to start from."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import click

from boulder_sweep.cli.options import OutputPath
from boulder_sweep.cli.output import show

EXAMPLES = """\b
Examples:
  sweep new
  sweep new my-site.yaml
  sweep new my-site.yaml --yes
"""


@click.command("new", short_help="Write a commented settings file to start from.", epilog=EXAMPLES)
@click.argument("file", type=OutputPath(dir_okay=False, path_type=Path), default="my-site.yaml")
@click.option("-y", "--yes", is_flag=True, help="Do not prompt; take the answers in brackets.")
def new(file: Path, yes: bool) -> int:
    """Write FILE [my-site.yaml], a settings file with a comment for every entry, after three questions."""
    from boulder_sweep.errors import ExistingFileError
    from boulder_sweep.settings import load
    from boulder_sweep.settings.starter import CLASSES, UNITS, UNPUBLISHED, starter

    if file.exists() or file.is_symlink():
        raise ExistingFileError(f"{file} exists already; name another file")
    name = re.sub(r"[^\w.+-]+", "-", file.stem).strip("-.+")[:80] or "my-site"
    vehicle, units = next(iter(CLASSES)), UNITS[0]
    if not yes and sys.stdin.isatty():
        name = click.prompt("Name of the study", default=name, value_proc=_checked_name, err=True)
        vehicle = click.prompt("Class of the vehicle", type=click.Choice(list(CLASSES)), default=vehicle, err=True)
        units = click.prompt("Units", type=click.Choice(UNITS), default=units, err=True)
    with file.open("x", encoding="utf-8") as new_file:  # no link is followed that has come since
        new_file.write(starter(name, vehicle, "us" if units == "us" else "si", str(file)))
    quoted = shlex.quote(str(file))
    if CLASSES[vehicle][0] != CLASSES[next(iter(CLASSES))][0]:
        show(
            f"{file}: fill in {', '.join(UNPUBLISHED)};",
            f"none is published for {vehicle} (sweep fit-vehicle fits the first two). Then: sweep check {quoted}",
        )
        return 0
    show(f"{file}: {load(file).n_designs:,} designs. Edit it, then: sweep need {quoted}")
    return 0


def _checked_name(text: str) -> str:
    """Return the name of a study; a prompt asks again where it is refused."""
    from boulder_sweep.settings.entries import NAME, NAME_RULE

    if not NAME.fullmatch(text):
        raise click.UsageError(f"the name {NAME_RULE}")
    return text
