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

    from boulder_sweep.crash_tests.score import Score
    from boulder_sweep.impact.trajectory import Trajectory

EXAMPLES = """\b
Examples:
  sweep validate -o validation
  sweep validate --measured my_test.csv --case my_test.yaml -o validation

\b
The first line of a --measured file names its columns, with units:
  time [ms], rotation [deg], boulder_displacement [mm],
  vehicle_displacement [m], vehicle_acceleration [g]
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

    Your own test (--measured) is scored as well: docs/measuring.md says what to measure, and what the scores are.

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
        overlay, scored, draw = overlaid
        written = [] if out is None else [draw(Path(out))]
        content["measured"] = {preset: [d.to_dict() for d in rows] for preset, rows in overlay.items()}
        content["scores"] = [own.to_dict() for own in scored]
        content["files"] += written
        from boulder_sweep.crash_tests.score import deviation_table, score_table
        from boulder_sweep.crash_tests.tables import WIDTH

        tables = [deviation_table(overlay).text()]
        if max(map(len, tables[0].split("\n"))) > WIDTH:  # too many signals for one: a table for each
            signals = dict.fromkeys(d.signal for rows in overlay.values() for d in rows)
            by_signal = ({p: [d for d in rows if d.signal == name] for p, rows in overlay.items()} for name in signals)
            tables = [deviation_table(own).text() for own in by_signal]
        text = [validation.text(), "", f"{measured} against {case}:", "\n\n".join(tables)]
        text += ["", "scores, up to the limit of the rotation:", score_table(scored).text()]
        text += ["safe: the model moves more, or reaches the limit earlier, than the test did"]
    if out is not None:
        text += ["", *(f"written  {file}" for file in content["files"])]
    if as_json:
        show(json.dumps(content))
    else:
        words = (line for part in text for line in part.split("\n"))
        show(*(part for line in words for part in (textwrap.wrap(line, 80) if line.startswith("note:") else [line])))
    return 0 if validation.holds else 1


def _overlay(measured: str, case: str) -> tuple[dict[str, Any], list[Score], Callable[[Path], str]]:
    """Compare a user's data with both presets, and score them; return a function that draws them into a folder, too."""
    from boulder_sweep.crash_tests.cases import NAMES, crash_test
    from boulder_sweep.crash_tests.measured import TEST_SIGNALS, read_history
    from boulder_sweep.crash_tests.score import by_the_paper, compare, forms_of, scores
    from boulder_sweep.judge.quantiles import MEAN, at_values
    from boulder_sweep.settings import load
    from boulder_sweep.settings.model import PRESETS

    history = read_history(measured, TEST_SIGNALS)
    sweep = crash_test(case) if case in NAMES else load(case)
    if sweep.n_designs != 1:
        raise click.UsageError(f"--case {case} holds {sweep.n_designs:,} designs; a test is one")
    sweep = at_values(sweep, MEAN) if sweep.distributions else sweep  # what the test was, not the worst that it may be
    end = float(history.time_s[-1])
    horizon = max(end, 0.0) or None
    trajectories: dict[str, Trajectory] = {p: by_the_paper(sweep, p, horizon) for p in PRESETS}
    deviations = {preset: compare(trajectory, history) for preset, trajectory in trajectories.items()}
    scored = scores(forms_of(sweep, trajectories, horizon), history, sweep.criterion.max_rotation_deg)

    def draw(folder: Path) -> str:
        from boulder_sweep.views.crash_curves import draw_crash_test

        target = folder / f"measured_{Path(measured).stem}.png"
        draw_crash_test(sweep.name, trajectories, target, history)
        return str(target)

    return deviations, scored, draw
