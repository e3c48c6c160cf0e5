"""``sweep run``: every design of a file simulated into one table."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.options import (
    JOBS,
    OUTPUT,
    Quantity,
    at_option,
    cluster_options,
    grid_argument,
    json_option,
    load_sweep,
    second_opinion_option,
    set_option,
    take_values,
    talk_options,
)
from boulder_sweep.cli.output import Notes, progress, say, show
from boulder_sweep.errors import Interrupted
from boulder_sweep.locations import Location, location_of
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep


RUN_EXAMPLES = """\b
Examples:
  sweep run configs/m30_sizing.yaml
  sweep run grid.yaml -o results/m50 --set vehicle.speed='50 mph'
  sweep run grid.yaml --dry-run
  sweep run grid.yaml --resume
"""


@click.command(short_help="Simulate every design of a file into one table.", epilog=RUN_EXAMPLES)
@grid_argument
@click.option("-o", "--output", "out", type=OUTPUT, help="Folder for the table [default: NAME.sweep].")
@click.option("--jobs", type=JOBS, help="Workers [default: all cores].")
@click.option("--resume", is_flag=True, help="Resume an interrupted run.")
@click.option("--overwrite", is_flag=True, help="Replace the table of an earlier run.")
@click.option("--dry-run", is_flag=True, help="Show designs, settings and cost; write nothing.")
@click.option("--accuracy", type=Quantity("deg"), metavar="NAME", help="fast, balanced, fine, or '0.01 deg'.")
@second_opinion_option
@at_option
@cluster_options
@set_option
@json_option
@talk_options
def run(
    grid: str,
    out: str | None,
    overrides: tuple[str, ...],
    accuracy: str | None,
    second_opinion: bool,
    at: str | None,
    dry_run: bool,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Simulate every design of GRID and write the table of verdicts."""
    from boulder_sweep.cli import console

    if options["resume"] and options["overwrite"]:
        raise click.UsageError("--resume and --overwrite cannot be used together")
    chosen = overrides if accuracy is None else (*overrides, f"--accuracy={accuracy}")
    sweep = take_values(load_sweep(grid, chosen, quiet, second_opinion=second_opinion), at, quiet)
    target = location_of(out or f"{sweep.name.replace(' ', '-')}.sweep")
    if dry_run:
        return _dry_run(sweep, target, options, as_json)
    if verbose:
        say("\n".join(console.value_lines(sweep.resolved())))
    if not quiet:
        say(f"{sweep.name}: {counted(sweep.n_designs, 'design')} into {target}")
    from boulder_sweep.runner.interruption import noted_signals
    from boulder_sweep.runner.sweeper import run as run_sweep

    notes = Notes()
    # Who waits for this command does not act on a signal before it has said how to go on.
    with noted_signals() as signals, signals.deferred(), progress(quiet, notes) as shown:
        try:
            summary = run_sweep(
                sweep,
                target,
                progress=shown,
                command=shlex.join(["sweep", *sys.argv[1:]]),
                resume_command=_resume_command(grid, target, overrides, accuracy, second_opinion, at, options),
                **options,
            )
        except Interrupted as stop:
            say(str(stop))  # before the bar closes: another signal meanwhile ends the process
            signals.answered = True
            return stop.exit_code
    for note in notes.new(summary.notes):
        say(f"note: {note}")
    if as_json:
        show(json.dumps({"name": sweep.name, **summary.to_dict()}))
    else:
        show(*console.summary_lines(sweep.name, summary))
    return summary.exit_code


def _dry_run(sweep: Sweep, out: Location, options: dict[str, Any], as_json: bool) -> int:
    """Show what a run would do."""
    from boulder_sweep.cli import console
    from boulder_sweep.runner.estimate import too_large
    from boulder_sweep.runner.sweeper import estimate

    effort = estimate(sweep, out, jobs=options["jobs"], resume=options["resume"])
    objection = too_large(effort.rows, "about", effort.disk_bytes, out)
    if as_json:
        record = {"settings": sweep.resolved(), "out": str(out), "estimate": asdict(effort)}
        show(json.dumps(record | {"objection": objection}))
    else:
        show(*console.dry_run_lines(sweep, out, effort, objection))
    return 0


def _resume_command(
    grid: str,
    out: Location,
    overrides: Sequence[str],
    accuracy: str | None,
    second_opinion: bool,
    at: str | None,
    options: dict[str, Any],
) -> str:
    """Return the command that resumes this run."""
    words = ["sweep", "run", grid, "-o", str(out)]
    for name in ("jobs", "backend", "scheduler"):
        if options[name] is not None and options[name] != "threading":
            words += [f"--{name}", str(options[name])]
    words += ["--accuracy", accuracy] if accuracy else []
    words += ["--second-opinion"] if second_opinion else []
    words += ["--at", at] if at else []
    for override in overrides:
        words += ["--set", override]
    return shlex.join([*words, "--resume"])
