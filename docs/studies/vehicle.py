"""Spring and damper of a vehicle, as the commands print them: the fit to the example, and the caution."""

from __future__ import annotations

import tempfile
from pathlib import Path

from boulder_sweep.cli.quality import fit_lines
from boulder_sweep.crash_tests.fitting import fit_pulse
from boulder_sweep.crash_tests.measured import read_pulse
from docs.studies.example_pulse import example_pulse


def fit_text(_: Path) -> str:
    """What ``sweep fit-vehicle`` prints for the example."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "pulse.csv"
        file.write_text(example_pulse(), encoding="utf-8")
        fit = fit_pulse(read_pulse(file), 6800.0)
    return "```text\n" + "\n".join(fit_lines(fit)) + "\n```"
