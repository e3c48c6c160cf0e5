"""What a site gives, as the commands show it: the speed of a street."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner

from boulder_sweep.cli.speed import speed

STREET = ("--length", "80 m", "--from", "0 mph", "--acceleration", "1.2 m/s^2")


def speed_of_street(_: Path) -> str:
    """Return the speed of the street on the page, as the command prints it."""
    done = CliRunner().invoke(speed, STREET)
    return f"```text\n{done.output.rstrip()}\n```"
