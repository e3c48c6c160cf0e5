"""``sweep validate``: the paper's two crash tests, both presets, beside what the paper states."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import OUTPUT, json_option
from boulder_sweep.cli.output import show

if TYPE_CHECKING:
    from collections.abc import Callable

    from boulder_sweep.impact.trajectory import Trajectory

EXAMPLES = """\b
Examples:
  sweep validate -o validation
  sweep validate --measured my_test.csv --case my_test.yaml -o validation

\b
The first line of a --measured file names its columns, with units:
  time [ms], rotation [deg], boulder_displacement [mm],
  vehicle_displacement [m]
The boulder's displacement is that of its own centre of mass.
Empty cells are gaps in a track.
"""


@click.command("validate", short_help="The paper's crash tests against what the paper states.", epilog=EXAMPLES)
@click.option("-o", "--output", "out", type=OUTPUT, metavar="DIR", help="Folder for pictures and Parquet files.")
@click.option("--measured", type=click.Path(), metavar="FILE.csv", help="Your own test data, drawn over the result.")
@click.option("--case", metavar="CASE", help="The test they belong to: abg, rwg, or a settings file with one design.")
@json_option
def validate(out: str | None, measured: str | None, case: str | None, as_json: bool) -> int:
    """Simulate both crash tests of the paper, with its formulas as printed and corrected, beside what it says of them.

    With -o the figures of the paper are redrawn for the simulated side and all time histories written. The exit code
    is 1 if a statement of the paper is contradicted.
    """
    if (measured is None) != (case is None):
        raise click.UsageError("--measured FILE.csv and --case abg|rwg|CASE.yaml go together")
    from boulder_sweep.crash_tests.validation import NOT_COMPARED
    from boulder_sweep.crash_tests.validation import validate as run_validation

    overlaid = None if measured is None or case is None else _overlay(measured, case)
    validation = run_validation(out)
    content: dict[str, Any] = validation.to_dict()
    text = [validation.text(), "", f"note: {NOT_COMPARED}"]
    if overlaid is not None:
        overlay, draw = overlaid
        written = [] if out is None else [draw(Path(out))]
        content["measured"] = {preset: [d.to_dict() for d in rows] for preset, rows in overlay.items()}
        content["files"] += written
        from boulder_sweep.crash_tests.measured import deviation_table

        text = [validation.text(), "", f"{measured} against {case}:", deviation_table(overlay).text()]
    if out is not None:
        text += ["", *(f"written  {file}" for file in content["files"])]
    if as_json:
        show(json.dumps(content))
    else:
        words = (line for part in text for line in part.split("\n"))
        show(*(part for line in words for part in (textwrap.wrap(line, 80) if line.startswith("note:") else [line])))
    return 0 if validation.holds else 1


def _overlay(measured: str, case: str) -> tuple[dict[str, Any], Callable[[Path], str]]:
    """Compare a user's data with both presets; return a function that draws them into a folder, too."""
    from boulder_sweep.crash_tests.cases import NAMES, crash_test
    from boulder_sweep.crash_tests.measured import TEST_SIGNALS, compare, read_history
    from boulder_sweep.impact.simulation import simulate
    from boulder_sweep.settings import load
    from boulder_sweep.settings.model import PRESETS

    history = read_history(measured, TEST_SIGNALS)
    sweep = crash_test(case) if case in NAMES else load(case)
    if sweep.n_designs != 1:
        raise click.UsageError(f"--case {case} holds {sweep.n_designs:,} designs; a test is one")
    end = float(history.time_s[-1])
    horizon = max(end, 0.0) or None
    trajectories: dict[str, Trajectory] = {p: simulate(sweep, readings=p, horizon_s=horizon) for p in PRESETS}
    deviations = {preset: compare(trajectory, history) for preset, trajectory in trajectories.items()}

    def draw(folder: Path) -> str:
        from boulder_sweep.views.crash_curves import draw_crash_test

        target = folder / f"measured_{Path(measured).stem}.png"
        draw_crash_test(sweep.name, trajectories, target, history)
        return str(target)

    return deviations, draw
