"""Where a table, a page or a picture may be written."""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.locations import Location
from boulder_sweep.store.files import is_file
from boulder_sweep.store.generations import MANIFEST_NAME


def check_target(target: Location, refusal: type[BoulderSweepError]) -> None:
    """Check that a file may be written at a place; readers would take one within a result for rows of it.

    Parameters
    ----------
    target
        The file, by path or URL.
    refusal
        The error to raise.

    Raises
    ------
    BoulderSweepError
        Its folder does not exist, cannot be written or holds the result of a run, or a folder has its name.
    LinkError
        A link has its name.
    """
    if not isinstance(target, Path):
        with suppress(OSError):  # a store that does not answer, or lets nobody read: writing will tell
            _check_no_result(target, target.parent, refusal)
        return
    folder = target.absolute().parent
    if not folder.is_dir():
        raise refusal(f"{target}: the folder {folder} does not exist")
    _check_no_result(target, folder, refusal)
    if target.is_dir():
        raise refusal(f"{target} cannot be written: {os.strerror(errno.EISDIR)}")
    try:
        is_there = is_file(target)
    except OSError as problem:
        raise refusal(f"{target} cannot be written: {problem.strerror}") from problem
    if not os.access(folder, os.W_OK | os.X_OK) or (is_there and not os.access(target, os.W_OK)):
        raise refusal(f"{target} cannot be written: {os.strerror(errno.EACCES)}")


def _check_no_result(target: Location, folder: Location, refusal: type[BoulderSweepError]) -> None:
    """Check that a folder is not the result of a run."""
    if (folder / MANIFEST_NAME).exists():
        raise refusal(f"{target}: the folder {folder} holds the result of a run; name a file outside it")
