"""The errors meant for a user, and the exit codes of the command line.

Everything that a user can cause or fix is a `BoulderSweepError`: its text says what is wrong and what is allowed,
and its exit code is the command's. Any other exception is a bug in this package.
"""

from __future__ import annotations

import signal

EXIT_DONE = 0
EXIT_INTERNAL = 1
EXIT_WRONG_USE = 2
EXIT_SOME_ROWS_FAILED = 3
EXIT_CONFLICT = 4
EXIT_INTERRUPTED = 130


class BoulderSweepError(Exception):
    """Base of all errors meant for a user, with the exit code of the command line."""

    exit_code = EXIT_WRONG_USE

    def user_message(self) -> str:
        """Return what the command line prints."""
        return f"error: {self}"


class OlderRulesWarning(UserWarning):
    """Other rules than this version's judged a table; it is read all the same."""


class SettingsWarning(UserWarning):
    """A note on settings that are valid; the command line prints it as a note."""


class BackendError(BoulderSweepError):
    """Workers are not available; the text says why and what to do."""


class ClusterLostError(BackendError):
    """The scheduler or the last worker of a cluster was lost during a run; the run can be resumed."""

    exit_code = EXIT_INTERRUPTED


class ComparisonError(BoulderSweepError):
    """Measurement and simulation cannot be compared."""


class ComputationError(BoulderSweepError):
    """So many designs could not be computed that something must be wrong with all of them."""

    exit_code = EXIT_INTERNAL


class ExistingFileError(BoulderSweepError):
    """A file that would be written is there already."""

    exit_code = EXIT_CONFLICT


class FitError(BoulderSweepError):
    """A crash pulse cannot be fitted."""


class HistoryFileError(BoulderSweepError):
    """A time history cannot be written."""


class LinkError(BoulderSweepError):
    """A link lies where a file is to be written; whoever put it there would choose what is overwritten."""


class NothingToMeasureError(BoulderSweepError, ValueError):
    """None of the designs of a sample can be computed."""


class PictureError(BoulderSweepError):
    """A picture cannot be made."""


class QuestionError(BoulderSweepError, ValueError):
    """A question that cannot be answered as it is put."""


class ReportError(BoulderSweepError):
    """A report cannot be written."""


class ScanError(BoulderSweepError):
    """A scan of a stone that cannot be used."""


def safe_words(rows_done: int | None, rows: int) -> str:
    """Say how many rows of a table are safe; None stands for the rows of an earlier run, which were not counted yet."""
    return f"{'the rows that were there' if rows_done is None else f'{rows_done:,} of {rows:,} rows'} are safe"


class Interrupted(KeyboardInterrupt):
    """A run was stopped by a signal; the finished rows are safe and the run can be resumed by a command.

    Not a `BoulderSweepError`, because code that handles errors must not swallow an interruption. The rows on disk are
    None where they were not counted yet.
    """

    def __init__(self, signum: int, rows_done: int | None = 0, rows: int = 0, resume_command: str = ""):
        self.signum = signum
        self.rows_done, self.rows = rows_done, rows
        name = signal.Signals(signum).name
        text = f"interrupted by {name}"
        if resume_command:
            text += f"; {safe_words(rows_done, rows)}. Resume with:\n  {resume_command}"
        super().__init__(text)

    @property
    def exit_code(self) -> int:
        """Exit code of the process, as the shell expects it: 130 for SIGINT, 143 for SIGTERM."""
        return 128 + self.signum
