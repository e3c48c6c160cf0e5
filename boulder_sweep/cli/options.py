"""Options that several commands share, and the examples that ``--help`` shows."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from typing import Any

import click

from boulder_sweep.runner.pool import BACKENDS, MOST_JOBS

Command = Callable[..., Any]
JOBS = click.IntRange(1, MOST_JOBS)

# "\b" tells click to keep the lines of a paragraph as they are.
GROUP_EPILOG = """\b
Start with:
  sweep check configs/m30_sizing.yaml     is the file valid, how many designs has it?
  sweep run configs/m30_sizing.yaml       simulate them all into m30-sizing.sweep
  sweep simulate configs/rwg.yaml         one design with its time history

\b
Exit codes:
  0 done (also when designs fail)
  1 internal error, or a result that is damaged
  2 wrong use, invalid file, or a place that cannot be written
  3 some designs could not be computed
  4 the output exists already, or is of another version
  130, 143 interrupted; the run can be resumed
"""

RUN_EXAMPLES = """\b
Examples:
  sweep run configs/m30_sizing.yaml
  sweep run grid.yaml -o results/m50 --set vehicle.speed='50 mph'
  sweep run grid.yaml --dry-run
  sweep run grid.yaml --resume
"""

CHECK_EXAMPLES = """\b
Example:
  sweep check configs/m30_sizing.yaml
"""

SIMULATE_EXAMPLES = """\b
Examples:
  sweep simulate configs/rwg.yaml --plot rwg.png
  sweep simulate configs/crash_tests.yaml --design 1 --trajectory rwg.parquet
  sweep simulate configs/abg.yaml --set model.readings=as_printed --json
"""

STATUS_EXAMPLES = """\b
Example:
  sweep status m30-sizing.sweep --verify
"""


class OutputPath(click.Path):
    """Name of a file or folder to write; an empty one, as of a shell variable that is not set, names nothing."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse an empty name."""
        if os.fspath(value) == "":
            self.fail("the name is empty", param, ctx)
        return super().convert(value, param, ctx)


OUTPUT = OutputPath()


class GroupedCommands(click.Group):
    """Group that lists its commands under headings, in the order in which they were added."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.headings: dict[str, str] = {}
        """Heading of every command; one without is not listed."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands that are listed."""
        return list(self.headings)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each heading."""
        width = formatter.width - 6 - max(map(len, self.headings))
        for heading in dict.fromkeys(self.headings.values()):
            with formatter.section(heading):
                own = [name for name, under in self.headings.items() if under == heading]
                formatter.write_dl([(name, self.commands[name].get_short_help_str(width)) for name in own])


def version_option(function: Command) -> Command:
    """Add ``--version``."""
    return click.option(
        "--version",
        is_flag=True,
        is_eager=True,
        expose_value=False,
        callback=_show_version,
        help="Show the version.",
    )(function)


def _show_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        # Reading the installed version takes longer than printing the help.
        from importlib.metadata import version

        click.echo(f"sweep {version('boulder-sweep')}")
        ctx.exit()


def set_option(function: Command) -> Command:
    """Add ``--set KEY=VALUE``, any number of times."""
    return click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="KEY=VALUE",
        help="Replace one entry of the file, e.g. --set vehicle.speed='50 mph' (may be repeated).",
    )(function)


def jobs_option(function: Command) -> Command:
    """Add ``--jobs``, a number of threads."""
    return click.option("--jobs", type=JOBS, help="Threads [default: all cores].")(function)


def json_option(function: Command) -> Command:
    """Add ``--json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print one JSON object on stdout.")(function)


def second_opinion_option(function: Command) -> Command:
    """Add ``--second-opinion``."""
    return click.option(
        "--second-opinion",
        is_flag=True,
        help="Simulate every pass again with friction, vertical motion and weaker laws: robust or sensitive?",
    )(function)


def units_option(function: Command) -> Command:
    """Add ``--units``."""
    return click.option(
        "--units", type=click.Choice(["si", "us"]), default="si", show_default=True, help="Units shown."
    )(function)


def talk_options(function: Command) -> Command:
    """Add ``-q`` and ``-v``, which exclude each other."""

    @click.option("-q", "--quiet", is_flag=True, help="No progress, no notes.")
    @click.option("-v", "--verbose", is_flag=True, help="More detail; tracebacks of internal errors.")
    @functools.wraps(function)
    def command(*args: Any, quiet: bool, verbose: bool, **options: Any) -> Any:
        if quiet and verbose:
            raise click.UsageError("--quiet and --verbose cannot be used together")
        return function(*args, quiet=quiet, verbose=verbose, **options)

    return command


def cluster_options(function: Command) -> Command:
    """Add ``--backend`` and ``--scheduler``."""

    @click.option(
        "--backend",
        type=click.Choice(BACKENDS),
        default=BACKENDS[0],
        show_default=True,
        help="Threads, or a Dask cluster.",
    )
    @click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler, with --backend dask.")
    @functools.wraps(function)
    def command(*args: Any, backend: str, scheduler: str | None, **options: Any) -> Any:
        if scheduler and backend != "dask":
            raise click.UsageError("--scheduler needs --backend dask")
        return function(*args, backend=backend, scheduler=scheduler, **options)

    return command


def run_options(function: Command) -> Command:
    """Add the options that only ``sweep run`` has."""
    for option in reversed(
        (
            click.option("-o", "--output", "out", type=OUTPUT, help="Folder for the table [default: NAME.sweep]."),
            click.option("--jobs", type=JOBS, help="Workers [default: all cores]."),
            click.option(
                "--dashboard",
                metavar="ADDRESS",
                help="Where Dask's dashboard listens [default: this machine only].",
            ),
            click.option("--resume", is_flag=True, help="Resume an interrupted run."),
            click.option("--overwrite", is_flag=True, help="Replace the table of an earlier run."),
            click.option("--force", is_flag=True, help="Run even if disk or memory seem too small."),
            click.option("--dry-run", is_flag=True, help="Show designs, settings and cost; write nothing."),
            click.option("--accuracy", metavar="NAME", help="fast, balanced, fine, or '0.01 deg'."),
            second_opinion_option,
        )
    ):
        function = option(function)
    return function
