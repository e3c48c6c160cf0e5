"""``sweep run``: every design of a file simulated into one table."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from boulder_sweep.cli.loading import load_sweep
from boulder_sweep.cli.options import RUN_EXAMPLES, cluster_options, json_option, run_options, set_option, talk_options
from boulder_sweep.cli.output import say, show
from boulder_sweep.errors import Interrupted
from boulder_sweep.locations import Location, location_of
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep


@click.command(short_help="Simulate every design of a file into one table.", epilog=RUN_EXAMPLES)
@click.argument("grid", type=click.Path())
@run_options
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
    dry_run: bool,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Simulate every design of GRID and write the table of verdicts."""
    from boulder_sweep.cli import console
    from boulder_sweep.cli.progress import Notes, kernels_for, progress

    if options["resume"] and options["overwrite"]:
        raise click.UsageError("--resume and --overwrite cannot be used together")
    if options["dashboard"] and (options["scheduler"] or options["backend"] != "dask"):
        raise click.UsageError("--dashboard needs --backend dask, without --scheduler, which has its own dashboard")
    from boulder_sweep.settings.overrides import ALL_OPINIONS

    chosen = [] if accuracy is None else [f"--accuracy={accuracy}"]
    chosen += [ALL_OPINIONS] if second_opinion else []
    sweep = load_sweep(grid, (*overrides, *chosen), quiet)
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
    # Who waits for this command does not act on a signal before it has told how to go on.
    with noted_signals() as signals, signals.deferred(), progress(quiet, notes, kernels_for(sweep)) as shown:
        try:
            summary = run_sweep(
                sweep,
                target,
                progress=shown,
                command=shlex.join(["sweep", *sys.argv[1:]]),
                resume_command=_resume_command(grid, target, overrides, accuracy, second_opinion, options),
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
    from boulder_sweep.runner.sweeper import estimate

    effort = estimate(sweep, out, jobs=options["jobs"], resume=options["resume"])
    if as_json:
        record = {"settings": sweep.resolved(), "out": str(out), "estimate": effort.to_dict()}
        show(json.dumps(record | {"objections": effort.objections}))
    else:
        show(*console.dry_run_lines(sweep, out, effort))
    return 0


def _resume_command(
    grid: str,
    out: Location,
    overrides: Sequence[str],
    accuracy: str | None,
    second_opinion: bool,
    options: dict[str, Any],
) -> str:
    """Return the command that resumes this run."""
    words = ["sweep", "run", grid, "-o", str(out)]
    for name in ("jobs", "backend", "scheduler"):
        if options[name] is not None and options[name] != "threading":
            words += [f"--{name}", str(options[name])]
    words += ["--accuracy", accuracy] if accuracy else []
    words += ["--second-opinion"] if second_opinion else []
    for override in overrides:
        words += ["--set", override]
    return shlex.join([*words, "--resume"])
