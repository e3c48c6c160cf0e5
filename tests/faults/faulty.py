"""Replacements of the kernels that are slow or raise; found by name from worker processes."""

from __future__ import annotations

import os
import signal
import time

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings
from tests.runner.grids import plausible

POISON, MAIN_PROCESS = "TEST_POISON", "TEST_MAIN_PROCESS"
"""Environment variables: the subgrade reactions that do harm [MN/m^3], and the process that must not die of them."""


def slowly(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Take 0.1 ms a design."""
    time.sleep(1e-4 * len(table.L))
    return plausible(table, readings, control)


def poisoned(table: DesignTable) -> bool:
    """Whether a design of the table does harm."""
    harmful = [float(value) for value in os.environ[POISON].split()]
    return bool(np.isin(np.round(table.beta, 6), harmful).any())


def ends_its_worker(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Die of a design, as of a crash in compiled code."""
    if poisoned(table) and os.getpid() != int(os.environ[MAIN_PROCESS]):
        os.kill(os.getpid(), signal.SIGKILL)
    return plausible(table, readings, control)


def raises(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Raise at a design."""
    if poisoned(table):
        raise ArithmeticError("this design cannot be")
    return plausible(table, readings, control)
