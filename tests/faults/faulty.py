"""Replacements of the kernels that are slow or raise; found by name from worker processes."""

from __future__ import annotations

import os
import time

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings
from tests.runner.grids import plausible

POISON = "TEST_POISON"
"""Environment variable: the subgrade reactions that raise [MN/m^3]."""


def slowly(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Take 0.1 ms a design."""
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
