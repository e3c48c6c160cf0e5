"""Spring and damper of a vehicle, as the commands print them: the fit to the example, and the caution."""

from __future__ import annotations

import tempfile
import textwrap
from pathlib import Path

from boulder_sweep.cli.quality import fit_lines
from boulder_sweep.crash_tests.fitting import fit_pulse
from boulder_sweep.crash_tests.measured import read_pulse
from boulder_sweep.settings import load
from docs.studies.example_pulse import example_pulse


def caution_text(root: Path) -> str:
    """Which caution ``sweep check`` prints of a heavy truck on a lighter one's spring, and at which speeds none."""

    def caution(override: str) -> list[str]:
        notes = (str(note) for note in load(root / "configs" / "rwg.yaml", [override]).notes)
        return [note.partition(": ")[2] for note in notes if "against a rigid wall" in note]

    (heavy,) = caution("vehicle.mass=65000 lb")
    speeds = [mph for mph in range(10, 61) if not caution(f"vehicle.speed={mph} mph")]
    return (
        f"```text\n{textwrap.fill(heavy, 100)}\n```\n\nThat is `configs/rwg.yaml` with a truck of 65,000 lb on the "
        "spring and damper of one of 15,000 lb. With its own mass that truck has no caution "
        f"from {speeds[0]} to {speeds[-1]} mph."
    )


def fit_text(_: Path) -> str:
    """What ``sweep fit-vehicle`` prints for the example."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "pulse.csv"
        file.write_text(example_pulse(), encoding="utf-8")
        fit = fit_pulse(read_pulse(file), 6800.0)
    return "```text\n" + "\n".join(fit_lines(fit)) + "\n```"
