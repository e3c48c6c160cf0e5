"""The command ``sweep``: parse, call, print. It calls the Python interface and adds nothing of its own."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from boulder_sweep.options import (
    CHECK_EXAMPLES,
    GROUP_EPILOG,
    RUN_EXAMPLES,
    SIMULATE_EXAMPLES,
    STATUS_EXAMPLES,
    OrderedGroup,
    json_option,
    run_options,
    set_option,
    talk_options,
    version_option,
)
from boulder_sweep.subcommands import COMMANDS

# Everything heavy (numba, pandas, pyarrow, even numpy) is imported inside the commands that need it:
# `sweep --help` and `sweep check` answer at once.
if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

EXIT_INTERNAL, EXIT_WRONG_USE, EXIT_SOME_ROWS_FAILED, EXIT_INTERRUPTED = 1, 2, 3, 130
REPORT = "this is a mistake in boulder-sweep, not in your file; please report it with command and file"


@click.group(cls=OrderedGroup, epilog=GROUP_EPILOG, context_settings={"help_option_names": ["-h", "--help"]})
@version_option
def cli() -> None:
    """Tell which boulder, buried how deep in which soil, stops a truck.

    A file describes boulders, soils and a vehicle as ranges of values. `sweep run` simulates every
    combination and writes one table with a verdict for each.
    """


@cli.command(short_help="Simulate every design of a file into one table.", epilog=RUN_EXAMPLES)
@click.argument("grid", type=click.Path())
@run_options
@set_option
@json_option
@talk_options
def run(
    grid: str,
    out: str | None,
    overrides: tuple[str, ...],
    accuracy: str | None,
    dry_run: bool,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Simulate every design of GRID and write the table of verdicts."""
    from boulder_sweep import console

    if options["resume"] and options["overwrite"]:
        raise click.UsageError("--resume and --overwrite exclude each other: go on, or begin again")
    if options["scheduler"] and options["backend"] != "dask":
        raise click.UsageError("--scheduler needs --backend dask")
    sweep = _load(grid, (*overrides, *([] if accuracy is None else [f"--accuracy={accuracy}"])), quiet)
    target = Path(out or f"{sweep.name.replace(' ', '-')}.sweep")
    if dry_run:
        return _dry_run(sweep, target, options, as_json)
    if verbose:
        console.say("\n".join(console.value_lines(sweep.resolved())))
    if not quiet:
        console.say(f"{sweep.name}: {console.counted(sweep.n_designs, 'design')} into {target}")
    from boulder_sweep.sweeper import run as run_sweep

    with console.progress(quiet) as show:
        summary = run_sweep(
            sweep,
            target,
            progress=show,
            command=shlex.join(["sweep", *sys.argv[1:]]),
            resume_command=_resume_command(grid, target, overrides, accuracy, options),
            **options,
        )
    for note in summary.notes:
        console.say(f"note: {note}")
    if as_json:
        click.echo(json.dumps({"name": sweep.name, **summary.to_dict()}))
    else:
        click.echo("\n".join(console.summary_lines(sweep.name, summary)))
    return summary.exit_code


def _dry_run(sweep: Sweep, out: Path, options: dict[str, Any], as_json: bool) -> int:
    """Show what a run would do."""
    from boulder_sweep import console
    from boulder_sweep.sweeper import estimate

    effort = estimate(sweep, out, jobs=options["jobs"], backend=options["backend"], resume=options["resume"])
    if as_json:
        record = {"settings": sweep.resolved(), "out": str(out), "estimate": effort.to_dict()}
        click.echo(json.dumps(record | {"objections": effort.objections()}))
    else:
        click.echo("\n".join(console.dry_run_lines(sweep, out, effort)))
    return 0


def _resume_command(
    grid: str, out: Path, overrides: Sequence[str], accuracy: str | None, options: dict[str, Any]
) -> str:
    """Return the command line that goes on with this run."""
    words = ["sweep", "run", grid, "-o", str(out)]
    for name in ("jobs", "backend", "scheduler"):
        if options[name] is not None and options[name] != "threading":
            words += [f"--{name}", str(options[name])]
    words += ["--accuracy", accuracy] if accuracy else []
    for override in overrides:
        words += ["--set", override]
    return shlex.join([*words, "--resume"])


@cli.command(short_help="Check a file: every mistake at once, with its line.", epilog=CHECK_EXAMPLES)
@click.argument("grid", type=click.Path())
@set_option
def check(grid: str, overrides: tuple[str, ...]) -> int:
    """Check GRID without simulating: every mistake at once, with file, line and column."""
    from boulder_sweep import console

    sweep = _load(grid, overrides, quiet=False)
    click.echo("\n".join([f"{grid}: valid", *console.grid_lines(sweep)]))
    return 0


@cli.command(short_help="Simulate one design with its time history.", epilog=SIMULATE_EXAMPLES)
@click.argument("case", type=click.Path())
@click.option("--design", type=click.IntRange(min=0), metavar="N", help="Number of the design [default: 0].")
@click.option("--plot", type=click.Path(), metavar="F.png", help="Draw the time history.")
@click.option("--trajectory", type=click.Path(), metavar="F.parquet", help="Write the time history.")
@click.option(
    "--energy",
    type=click.Path(),
    metavar="F.png",
    help="Draw where the energy goes, and add its columns to the time history.",
)
@click.option("--animate", type=click.Path(), metavar="F.gif|.mp4|.html", help="Make a film of the side view.")
@set_option
@json_option
@talk_options
def simulate(
    case: str,
    design: int | None,
    plot: str | None,
    trajectory: str | None,
    energy: str | None,
    animate: str | None,
    overrides: tuple[str, ...],
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Simulate one design of CASE with its time history, beyond the rotation limit and to the end."""
    from boulder_sweep import console

    sweep = _load(case, overrides, quiet)
    number = design or 0
    if number >= sweep.n_designs:
        held = console.counted(sweep.n_designs, "design")
        raise click.UsageError(f"{case} holds {held}, numbered from 0; there is no {number}")
    if design is None and sweep.n_designs > 1 and not quiet:
        console.say(f"note: {case} holds {sweep.n_designs:,} designs; this is number 0 (--design N for another)")
    reason = sweep.block(number, number + 1).reasons[0]
    if reason:
        console.say(f"design {number} cannot be computed: {reason}")
        return EXIT_SOME_ROWS_FAILED
    if verbose:
        console.say("\n".join(console.value_lines(sweep.resolved())))
    from boulder_sweep.simulation import simulate as simulate_design

    result = simulate_design(sweep, number)
    # First of all: a picture may be impossible where nothing moved, a film takes its time.
    values = result.summary()
    click.echo(json.dumps(values) if as_json else "\n".join(console.value_lines(values)))
    if plot is not None:
        result.plot(plot)
    if trajectory is not None:
        result.to_parquet(trajectory, energy=energy is not None)
    if energy is not None:
        result.plot_energy(energy)
    if animate is not None:
        result.animate(animate)
    return EXIT_SOME_ROWS_FAILED if result.verdict == "error" else 0


@cli.command(short_help="Show how far a run got and how to go on.", epilog=STATUS_EXAMPLES)
@click.argument("out", type=click.Path())
@click.option("--verify", is_flag=True, help="Read every part and compare its checksum.")
@json_option
def status(out: str, verify: bool, as_json: bool) -> int:
    """Show how far the run into OUT got, what is missing, and the command to go on."""
    from boulder_sweep import console
    from boulder_sweep.store import status as look

    found = look(out, verify=verify)
    lines = [json.dumps(found.to_dict(), default=str)] if as_json else console.status_lines(found)
    click.echo("\n".join(lines))
    return EXIT_INTERNAL if found.damaged else 0


for command in COMMANDS:
    cli.add_command(command)


def _load(path: str, overrides: Sequence[str], quiet: bool) -> Sweep:
    """Load settings and show the remarks on them."""
    from boulder_sweep.console import say
    from boulder_sweep.settings import load

    sweep = load(path, overrides)
    if not quiet:
        for note in sweep.notes:
            say(f"note: {note}")
    return sweep


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and end the process with its exit code."""
    sys.exit(execute(arguments))


def execute(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words behind ``sweep``; those of this process by default.

    Returns
    -------
    int
        Exit code, as ``sweep --help`` lists them.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        # Not cli.main(): it would turn an interruption into an exception without signal and words.
        with cli.make_context("sweep", words) as context:
            code = cli.invoke(context)
        sys.stdout.flush()
        return int(code)
    except click.exceptions.Exit as end:  # after --help or --version
        return end.exit_code
    except click.ClickException as error:
        error.show()
        return EXIT_WRONG_USE
    except BrokenPipeError:
        # Who read our output has gone (sweep status ... | head); Python must not complain of it at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt as stop:
        print(str(stop) or "interrupted", file=sys.stderr)
        return int(getattr(stop, "exit_code", EXIT_INTERRUPTED))
    except Exception as error:
        return _report(error, verbose=bool({"-v", "--verbose"} & set(words)))


def _report(error: Exception, verbose: bool) -> int:
    """Say what went wrong; errors meant for the user bring their exit code along."""
    from boulder_sweep.settings.problems import SettingsError

    if isinstance(error, SettingsError):
        print(error, file=sys.stderr)
        return EXIT_WRONG_USE
    code = getattr(error, "exit_code", None)
    if code is not None:
        print(f"error: {error}", file=sys.stderr)
        return int(code)
    if verbose:
        import traceback

        traceback.print_exception(error)
    if isinstance(error, OSError):  # a place that cannot be read or written
        place = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error
        print(f"error: {place}", file=sys.stderr)
        return EXIT_WRONG_USE
    print(f"internal error: {type(error).__name__}: {error}; {REPORT}", file=sys.stderr)
    return EXIT_INTERNAL
