"""Replacements of the kernels that wait, are slow or raise; found by name from worker processes."""

from __future__ import annotations

import os
import threading
import time
import uuid
from pathlib import Path

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings
from tests.runner.grids import plausible
from tests.waiting import wait_until

POISON = "TEST_POISON"
"""Environment variable: the subgrade reactions that do harm [MN/m^3]."""
BAR = "TEST_BAR"
"""Environment variable: the folder of a `Bar`."""
_BEFORE_THE_RUN = "interruptible work"
"""Name of the thread that computes the sample of a run."""


class Bar:
    """How far a run with the stand-in `held` may go, and which of its calls have begun or wait.

    Parameters
    ----------
    folder
        Holds all this, for other processes to see; it is made.
    rows
        Of the grid (`grid_of`).
    """

    def __init__(self, folder: Path, rows: int):
        self._folder, self._rows = folder, rows
        folder.mkdir()
        self.environment = {BAR: str(folder)}

    def allow(self, rows: int | None = None) -> None:
        """Let blocks pass that end at this row or before; all by default."""
        highest = np.inf if rows is None else 20.0 + 80.0 * (rows - 0.5) / (self._rows - 1)
        new = self._folder / "new"
        new.write_text(str(float(highest)))
        new.replace(self._folder / "bar")

    def begun(self) -> int:
        """How many blocks of the run were begun."""
        return len(list(self._folder.glob("begun-*")))

    def waiting(self) -> int:
        """Return how many wait, killed workers included."""
        return len(list(self._folder.glob("waiting-*")))

    def wait_for(self, blocks: int) -> None:
        """Wait until so many blocks wait, one a thread: then nothing is computed any more."""
        wait_until(lambda: self.waiting() >= blocks, f"{blocks} blocks wait at the bar")


def held(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Wait at designs beyond the bar until it is raised; what is computed before the run passes."""
    warming_up = control.horizon <= control.h
    if not warming_up and threading.current_thread().name != _BEFORE_THE_RUN:
        _pass(Path(os.environ[BAR]), float(table.beta.max()))
    return plausible(table, readings, control)


def _pass(folder: Path, highest: float) -> None:
    """Wait until the bar is above a subgrade reaction [MN/m^3]."""
    name = uuid.uuid4().hex
    (folder / f"begun-{name}").touch()

    def may_pass() -> bool:
        return highest < float((folder / "bar").read_text())

    if not may_pass():
        waiting = folder / f"waiting-{name}"
        waiting.touch()
        wait_until(may_pass, "the bar is raised")
        waiting.unlink()


def never_ends(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Tell that the first designs, the sample, are computed, and go on doing so."""
    if control.horizon > control.h:
        (Path(os.environ[BAR]) / f"waiting-{uuid.uuid4().hex}").touch()
        wait_until(lambda: False, "the process is ended")
    return plausible(table, readings, control)


def slowly(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Take 0.1 ms a design, so that what else happens falls into the run."""
    time.sleep(1e-4 * len(table.L))
    return plausible(table, readings, control)


def poisoned(table: DesignTable) -> bool:
    """Whether a design of the table does harm."""
    harmful = [float(value) for value in os.environ[POISON].split()]
    return bool(np.isin(np.round(table.beta, 6), harmful).any())


def raises(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Raise at a design."""
    if poisoned(table):
        raise ArithmeticError("this design cannot be")
    return plausible(table, readings, control)
