"""What a site gives, as the commands show it: constants of the soil by a borehole, the speed of a street."""

from __future__ import annotations

import textwrap
from pathlib import Path

from click.testing import CliRunner

from boulder_sweep import load
from boulder_sweep.cli.vehicle_commands import speed
from boulder_sweep.settings.sweep import derived_words

STREET = ("--length", "80 m", "--from", "0 mph", "--acceleration", "1.2 m/s^2")

BOREHOLE = Path("configs/borehole.yaml")


def notes_of_borehole(root: Path) -> str:
    """Return how the inputs of the example follow, as every command prints it."""
    notes = (f"note: {words}" for words in derived_words(load(root / BOREHOLE).derived))
    lines = [line for note in notes for line in textwrap.wrap(note, 80, subsequent_indent="  ")]
    return "\n".join(["```text", *lines, "```"])


def speed_of_street(_: Path) -> str:
    """Return the speed of the street on the page, as the command prints it."""
    done = CliRunner().invoke(speed, STREET)
    return f"```text\n{done.output.rstrip()}\n```"
