"""What a site gives, as the commands show it: constants of the soil by a borehole, and its log."""

from __future__ import annotations

import textwrap
from pathlib import Path

from boulder_sweep import load
from boulder_sweep.settings.sweep import derived_words
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
