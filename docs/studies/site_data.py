"""What a site gives, as the commands show it: constants of the soil by a borehole, and its log."""

from __future__ import annotations

import textwrap
from pathlib import Path

from boulder_sweep import load
from boulder_sweep.settings.distributions import FRACTILE_5
from boulder_sweep.settings.problems import Position
from boulder_sweep.settings.soil_readings import soil_of
from boulder_sweep.settings.sweep import derived_words
from boulder_sweep.settings.tree import block_of
from boulder_sweep.views.log_text import log_lines

BOREHOLE, BOREHOLE_LOG = Path("configs/borehole.yaml"), Path("configs/borehole_log.yaml")


def notes_of_borehole(root: Path) -> str:
    """Return how the inputs of the example follow, as every command prints it."""
    notes = (f"note: {words}" for words in derived_words(load(root / BOREHOLE).derived))
    lines = [line for note in notes for line in textwrap.wrap(note, 80, subsequent_indent="  ")]
    return "\n".join(["```text", *lines, "```"])


def drawing_of_log(root: Path) -> str:
    """Return the log of the example as `sweep check` draws it."""
    (log,) = load(root / BOREHOLE_LOG).derived["soil"]
    return "\n".join(["```text", *log_lines(log), "```"])


def angles_of_counts(_: Path) -> str:
    """Return the friction angles by some blow counts at 1.5 m, and what is taken of them."""
    lines: list[str] = []
    for n in (10, 16, 22, 30):
        node = block_of(Position(""), {"n": f"{n}", "energy_ratio": "60 %", "depth": "1.5 m"})
        soil = soil_of(node, "spt", ("friction_angle",), None)
        mean, sd, (reading,) = soil["friction_angle_deg"], soil["friction_angle_sd_deg"], soil["readings"]
        angles = reading["friction_angles_deg"]
        if not lines:
            lines = [f"| N | (N₁)₆₀ | {' | '.join(angles)} | taken | 5 % |", "|---" * (4 + len(angles)) + "|"]
        shown = " | ".join(f"{angle:.1f}°" for angle in angles.values())
        lines.append(
            f"| {n} | {reading['n1_60']:.1f} | {shown} | {mean:.1f} ± {sd:g}° | {mean - FRACTILE_5 * sd:.1f}° |"
        )
    return "\n".join(lines)
