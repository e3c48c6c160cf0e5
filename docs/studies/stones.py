"""The example scan on the page of stones: what the command prints of it, and its picture."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep import load
from boulder_sweep.answers.placing import placed
from boulder_sweep.cli.stone import placing_lines, settings_lines, standing_lines, stone_lines
from boulder_sweep.stones.weighing import ScannedStone, scanned

ROCK = Path("docs/examples/rock.ply")
SITE = Path("configs/site.yaml")
MASS_KG = 23_500.0
CHOSEN = ("a", "b")
"""Ends up and to the vehicle in the block of settings that is shown."""


def example_stone(root: Path) -> ScannedStone:
    """Return the stone in the example scan."""
    return scanned(root / ROCK, mass_kg=MASS_KG)


def stone_of_example(root: Path) -> str:
    """Return what the command prints of the example."""
    found = example_stone(root)
    return "\n".join(["```text", *stone_lines(found), "", *standing_lines(found), "```"])


def settings_of_example(root: Path) -> str:
    """Return the block of settings of one way to stand."""
    found = example_stone(root)
    return "\n".join(["```yaml", *settings_lines(found, found.stone.standing(*CHOSEN)), "```"])


def site_of_example(root: Path) -> str:
    """Return what the command prints of the example at a site, without what it says of the stone itself."""
    found = example_stone(root)
    result = placed(found, lambda boulder: load(root / SITE, [boulder]))
    return "\n".join(["```text", *placing_lines(result, str(ROCK), "m", str(SITE)), "```"])
