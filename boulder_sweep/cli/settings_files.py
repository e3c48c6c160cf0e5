"""Settings files: ``sweep new`` writes one to start from, ``sweep check`` finds every mistake at once."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import click

from boulder_sweep.cli.options import SYSTEMS, OutputPath, grid_argument, say_notes, set_option
from boulder_sweep.cli.output import say, show, wrap

NEW_EXAMPLES = """\b
Examples:
  sweep new
  sweep new my-site.yaml
  sweep new --class M40 --units us my-site.yaml
"""


@click.command("new", short_help="Write a commented settings file to start from.", epilog=NEW_EXAMPLES)
@click.argument("file", type=OutputPath(dir_okay=False, path_type=Path), default="my-site.yaml")
@click.option("--class", "vehicle", metavar="CLASS", help="Class of the vehicle in ASTM F2656, such as M40 [M30].")
@click.option("--units", type=click.Choice(SYSTEMS), help="Units of the values [si].")
def new(file: Path, vehicle: str | None, units: str | None) -> int:
    """Write FILE [my-site.yaml], a settings file with a comment for every entry.

    On a terminal it asks for name, class and units, unless --class or --units is given.
    """
    from boulder_sweep.errors import ExistingFileError
    from boulder_sweep.settings import load
    from boulder_sweep.settings.fields import CLASSES, is_published, starter

    asks = vehicle is None and units is None and sys.stdin.isatty()
    vehicle, units = (vehicle or next(iter(CLASSES))).upper(), units or SYSTEMS[0]
    if vehicle not in CLASSES:
        raise click.UsageError(f"--class {vehicle} is not a class of ASTM F2656; there are {', '.join(CLASSES)}")
    if file.exists() or file.is_symlink():
        raise ExistingFileError(f"{file} exists already; name another file")
    name = re.sub(r"[^\w.+-]+", "-", file.stem).strip("-.+")[:80] or "my-site"
    if asks:
        name = click.prompt("Name of the study", default=name, value_proc=_checked_name, err=True)
        vehicle = click.prompt("Class of the vehicle", type=click.Choice(list(CLASSES)), default=vehicle, err=True)
        units = click.prompt("Units", type=click.Choice(SYSTEMS), default=units, err=True)
    with file.open("x", encoding="utf-8") as new_file:  # no link is followed that has come since
        new_file.write(starter(name, vehicle, "us" if units == "us" else "si", str(file)))
    if is_published(vehicle):
        show(f"{file}: {load(file).n_designs:,} designs. Edit it, then:", f"  sweep need {shlex.quote(str(file))}")
    else:
        show(*_lines_to_fill_in(file, vehicle, SYSTEMS.index(units)))
    return 0


@click.command(short_help="Copy the example files into a folder.")
@click.argument("folder", type=OutputPath(file_okay=False, path_type=Path), default="configs")
def examples(folder: Path) -> int:
    """Copy the example files into FOLDER [configs], which must not be there yet, and list their questions."""
    import shutil

    from boulder_sweep.errors import ExistingFileError

    package = Path(__file__).parents[1]
    source = package / "examples"
    if not source.is_dir():  # a clone that is not built
        source = package.parent / "configs"
    try:
        shutil.copytree(source, folder)
    except FileExistsError:
        raise ExistingFileError(f"{folder} exists already; name another folder") from None
    for file in sorted(folder.glob("*.yaml")):
        show(*wrap(f"{file}: {_question_of(file)}"))
    return 0


def _question_of(file: Path) -> str:
    """Return the first sentence of the comment at the top of a settings file."""
    lines = file.read_text(encoding="utf-8").splitlines()
    comment = " ".join(line.removeprefix("#").strip() for line in lines[: lines.index("#")])
    return re.split(r"(?<=[.?]) ", comment, maxsplit=1)[0]


def _lines_to_fill_in(file: Path, vehicle: str, units: int) -> list[str]:
    """Return which entries of a vehicle have no published values, and how to measure them."""
    from boulder_sweep.settings.fields import CATEGORIES, CLASSES

    mass = CATEGORIES[CLASSES[vehicle][0]][0][units]
    return [
        f"{file}: fill in three entries; no values are published for {vehicle}.",
        "  vehicle.spring, vehicle.damper: from a crash against a rigid wall. Measure the",
        "    deceleration of the vehicle over time (or its displacement), then",
        f"    sweep fit-vehicle PULSE.csv --mass '{mass}'",
        "  vehicle.bed_offset: from the front bumper to the front of the cargo bed",
        "Then:",
        f"  sweep check {shlex.quote(str(file))}",
    ]


def _checked_name(text: str) -> str:
    """Return the name of a study; a prompt asks again where it is refused."""
    from boulder_sweep.settings.entries import NAME, NAME_RULE

    if not NAME.fullmatch(text):
        raise click.UsageError(f"the name {NAME_RULE}")
    return text


CHECK_EXAMPLES = """\b
Example:
  sweep check configs/m30_sizing.yaml
"""


@click.command(short_help="Check a file: all mistakes at once, with their lines.", epilog=CHECK_EXAMPLES)
@grid_argument
@set_option
def check(grid: str, overrides: tuple[str, ...]) -> int:
    """Check GRID: all mistakes at once, with file, line and column, and notes on what deserves a second look.

    The log of a borehole or of a cone is drawn, with the layers made of it.
    """
    from boulder_sweep.cli import console
    from boulder_sweep.errors import EXIT_WRONG_USE
    from boulder_sweep.settings import load
    from boulder_sweep.views.log_text import log_lines

    sweep = load(grid, overrides)
    say_notes(sweep)
    if why := sweep.why_none_runs():
        say(f"{grid}: no design can be computed: {why}")
        return EXIT_WRONG_USE
    logs = [log_lines(data, sweep.units) for data in sweep.derived.get("soil", ()) if "log" in data]
    show(f"{grid}: valid", *console.grid_lines(sweep), *(line for lines in logs for line in ("", *lines)))
    if sweep.depth_sought:
        show("next, the depth:", f"  {sweep.need_command}")
    return 0
