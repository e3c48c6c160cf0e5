"""The command ``sweep``: parse, call, print. All work is done by the Python interface."""

from __future__ import annotations

import atexit
import ctypes
import gc
import io
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

import click

# Every command imports heavy packages (numba, pandas, pyarrow, even numpy) inside its function, so that
# `sweep --help` and `sweep check` are instant.
from boulder_sweep.cli.ask import capacity, need, uncertainty
from boulder_sweep.cli.doctor import doctor
from boulder_sweep.cli.output import ready_streams, say
from boulder_sweep.cli.quality import fit_vehicle, tradeoff, validate
from boulder_sweep.cli.run import compare, run
from boulder_sweep.cli.settings_files import check, examples, new
from boulder_sweep.cli.share import explore, export, plot, report
from boulder_sweep.cli.simulate import simulate
from boulder_sweep.cli.stone import stone
from boulder_sweep.errors import (
    EXIT_INTERNAL,
    EXIT_INTERRUPTED,
    EXIT_WRONG_USE,
    BoulderSweepError,
    Interrupted,
    OlderRulesWarning,
    SettingsWarning,
)
from boulder_sweep.locations import gather_temporary_files
from boulder_sweep.signals import install, noted_signals
from boulder_sweep.text import why

THREADS_OF_OPENBLAS = "OPENBLAS_NUM_THREADS"
ALLOCATOR_OF_ARROW = "ARROW_DEFAULT_MEMORY_POOL"
_OBJECTS_BETWEEN_COLLECTIONS = 250_000
"""How many new objects Python's search for unused circles of objects waits for; by default 700."""
_ALLOCATOR = {-8: 1, -3: 32 << 20, -1: 256 << 20}
"""M_ARENA_MAX, M_MMAP_THRESHOLD and M_TRIM_THRESHOLD of the GNU C library: one heap for all threads, also for arrays of
up to 32 MB, which gives memory back once there are 256 MB of it."""


def start_light() -> None:
    """Halve the time of a short command, before anything heavy is imported.

    NumPy's linear algebra starts a thread for each core, and the systems solved here have a few unknowns; a number of
    threads that the user has set stands. Imports make hundreds of thousands of objects that stay until the end. By
    default Python searches them for unused ones hundreds of times, and thrice more at the end, where the system takes
    all back. Each block has arrays as large as the next. By default each thread and Arrow have a heap of their own, and
    the system gets freed arrays back and clears them anew: more memory by a fifth, and twice the page faults.
    """
    os.environ.setdefault(THREADS_OF_OPENBLAS, "1")
    os.environ.setdefault(ALLOCATOR_OF_ARROW, "system")
    with suppress(OSError, AttributeError, TypeError):  # another C library
        for parameter, value in _ALLOCATOR.items():
            ctypes.CDLL(None).mallopt(parameter, value)
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    atexit.register(gc.freeze)


GROUPS = {
    "Ask": (new, examples, check, stone, need, uncertainty, capacity, simulate, explore),
    "Tables": (run, compare),
    "Share": (plot, report, export),
    "Model": (tradeoff, validate, fit_vehicle, doctor),
}
"""Commands in the order of ``sweep --help``: questions, tables, what others receive, the model itself."""
COMMANDS = tuple(command for group in GROUPS.values() for command in group)
COMPLETION = "_SWEEP_COMPLETE"
"""Set by the completion of a shell."""
REPORT = "this is a bug in boulder-sweep, not in your file; please report it with the command and the file"


# "\b" tells click to keep the lines of a paragraph as they are.
EPILOG = """\b
Start with:
  sweep check configs/m30_sizing.yaml     is the file valid, how many designs has it?
  sweep run configs/m30_sizing.yaml       simulate them all into m30-sizing.sweep
  sweep simulate configs/rwg.yaml         one design with its time history

\b
Exit codes:
  0 done (also when designs fail)
  1 internal error, or a result that is damaged
  2 wrong use, invalid file, or a path that cannot be written
  3 some designs could not be computed
  4 the output exists already, or is of another version
  130, 143 interrupted; the run can be resumed
"""


class GroupedCommands(click.Group):
    """Group that lists its commands under the headings of `GROUPS`, in that order."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in their order."""
        return list(self.commands)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each heading."""
        width = formatter.width - 6 - max(map(len, self.commands))
        for heading, commands in GROUPS.items():
            with formatter.section(heading):
                formatter.write_dl([(str(each.name), each.get_short_help_str(width)) for each in commands])


CONTEXT = {"help_option_names": ["-h", "--help"]}


@click.group(cls=GroupedCommands, commands=COMMANDS, epilog=EPILOG, context_settings=CONTEXT)
@click.version_option(package_name="boulder-sweep", message="sweep %(version)s", help="Show the version.")
def cli() -> None:
    """Find out which boulder, buried how deep in which soil, stops a truck.

    A file describes boulders, soils and a vehicle as ranges of values. `sweep run` simulates every
    design and writes one table with a verdict for each.
    """


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and end the process with its exit code."""
    signals = install()  # for the rest of the process
    start_light()
    ready_streams()
    _have_home()
    gather_temporary_files()
    code = execute(arguments)
    signals.at_exit()  # before the libraries' own, which stumble over what still runs
    sys.exit(code)


def _have_home() -> None:
    """Name a home that does not exist where there is none, as for some service accounts: libraries ask on import."""
    try:
        Path.home()
    except RuntimeError:
        os.environ["HOME"] = "/nonexistent"


def execute(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, by default with the words of this process; return one of the codes of ``sweep --help``."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    completion = os.environ.get(COMPLETION)
    if completion:
        from click.shell_completion import shell_complete

        return shell_complete(cli, {}, "sweep", COMPLETION, completion)
    try:
        with noted_signals() as signals, _report_warnings():
            code = signals.call(lambda: _invoke(words))
        sys.stdout.flush()
        return code
    except click.exceptions.Exit as end:  # after --help or --version
        return end.exit_code
    except click.ClickException as error:
        say(_usage_text(error))
        return EXIT_WRONG_USE
    except BrokenPipeError:
        # The reader of the output has gone (sweep check ... | head); keep Python from reporting it at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Interrupted as stop:
        say(str(stop))
        return stop.exit_code
    except (KeyboardInterrupt, click.exceptions.Abort):  # a prompt ends with Abort, at Ctrl-C and at Ctrl-D
        say("interrupted")
        return EXIT_INTERRUPTED
    except Exception as error:
        return _report(error, verbose=bool({"-v", "--verbose"} & set(words)))


@contextmanager
def _report_warnings() -> Iterator[None]:
    """Say by whose rules a table was judged in one line, however often it is read.

    Warnings of libraries about numbers, or to programmers, tell a user nothing; others stay as they are.
    """
    said: set[str] = set()
    with warnings.catch_warnings():
        warnings.simplefilter("always", OlderRulesWarning)
        warnings.simplefilter("ignore", SettingsWarning)  # commands print these notes themselves
        usual = warnings.showwarning

        def showwarning(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            if issubclass(category, RuntimeWarning | DeprecationWarning | FutureWarning):
                return
            if not issubclass(category, OlderRulesWarning):
                usual(message, category, *where, **more)
            elif str(message) not in said:
                said.add(str(message))
                say(f"note: {message}")

        warnings.showwarning = showwarning
        yield


def _usage_text(error: click.ClickException) -> str:
    """Return what click says of wrong use, with its line on usage if there is one."""
    with io.StringIO() as text:
        error.show(text)
        return text.getvalue().rstrip()


def _invoke(words: list[str]) -> int:
    """Run a command, and return its exit code."""
    # Not cli.main(): it would replace an interruption by an exception without the signal and the message.
    with cli.make_context("sweep", words) as context:
        return int(cli.invoke(context))


def _report(error: Exception, verbose: bool) -> int:
    """Say what went wrong, and return the exit code."""
    if isinstance(error, BoulderSweepError):
        say(error.user_message())
        return error.exit_code
    if verbose:
        import traceback

        traceback.print_exception(error)
    if isinstance(error, MemoryError):
        say("error: there is not enough memory")
        return EXIT_INTERNAL
    if isinstance(error, OSError):  # a path that cannot be read or written
        path = f"{error.filename}: " if error.filename else ""
        say(f"error: {path}{why(error)}")
        return EXIT_WRONG_USE
    say(f"internal error: {type(error).__name__}: {error}; {REPORT}")
    return EXIT_INTERNAL
