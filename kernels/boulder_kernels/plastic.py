"""Impacts in soil that remembers, one design after another, and where their boulders come to rest."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .design import Design, DesignTable, design_at
from .dynamics import State
from .impact import Control, Record, failed, no_record, simulate_with_springs
from .layered import LayeredTable, layered_constants, uniform_layers
from .memory import LAST, PLASTIC_WITH_GAP, SWING, remembering
from .outcomes import SIMULATED, Outcome, OutcomesAtRest, Status, empty_outcomes, write_outcome
from .readings import Readings
from .second_spring import SecondSpring, SecondSprings
from .settling import proof_is_possible
from .unloading import rest_of


class PlasticImpact(NamedTuple):
    """One impact in soil that remembers."""

    outcome: Outcome
    constants: Any
    """`RememberingConstants` of the design, with what its soil remembers in the end and remembered at every sample."""
    theta_rest: float
    """Rotation in which the boulder comes to rest [rad]; NaN where nothing is known of it."""
    doubt: float
    """By how much it may be another, by the energy that is left [rad]."""
    swing_back: float
    """How far the boulder has swung back from its largest rotation [rad]."""


def simulate_plastic(
    design: Design,
    readings: Readings,
    control: Control,
    record: Record,
    second: SecondSpring | None = None,
    layers: np.ndarray | None = None,
) -> PlasticImpact:
    """Simulate one impact in soil that remembers.

    Parameters
    ----------
    design
        The design, SI.
    readings
        Which formulas are read as printed.
    control
        As of `boulder_kernels.impact.simulate_design`; ``unloading`` and ``elements`` must not be 0. No step is cut
        where the soil yields, because what yields depends on what it remembers.
    record
        Filled with the time history at the times it names.
    second
        Second spring of the vehicle, if it has one.
    layers
        Layers of the soil, shape (M, 6), see `boulder_kernels.layered`; that of the design by default.
    """
    layers = uniform_layers(design) if layers is None else layers
    layered = layered_constants(design, layers, readings, control.elements)
    c = remembering(layered, control.unloading == PLASTIC_WITH_GAP, len(record.times))
    if design.H - design.d <= design.e_bumper:
        return PlasticImpact(failed(Status.NO_CONTACT.value), c, np.nan, np.nan, np.nan)
    outcome = simulate_with_springs(c, readings, control._replace(locate_yield=False), record, second)
    y = State(*c.memory.so_far[LAST:])
    if outcome.status not in SIMULATED or outcome.status == Status.LIMIT:
        return PlasticImpact(outcome, c, np.nan, np.nan, np.nan)
    swing_back = float(c.memory.so_far[SWING])
    if y.v_v > 0.0 or not proof_is_possible(readings):
        return PlasticImpact(outcome, c, np.nan, np.nan, swing_back)
    rest = rest_of(y, control.theta_limit, c)
    return PlasticImpact(outcome, c, rest.theta, rest.doubt, swing_back)


def simulate_plastic_rows(
    table: DesignTable, readings: Readings, control: Control, springs: SecondSprings | None = None
) -> Any:
    """Simulate every design of a table once in soil that remembers.

    Returns
    -------
    OutcomesAtRest
        Arrays of shape (n,); ``rest_error`` without a numerical error.
    """
    n = len(table.L)
    out, rest = empty_outcomes(n), np.full((3, n), np.nan)
    for row in range(n):
        second = None if springs is None else SecondSpring(springs.k_2[row], springs.s_2[row])
        layers = table.layers[row] if isinstance(table, LayeredTable) else None
        found = simulate_plastic(design_at(table, row), readings, control, no_record(), second, layers)
        write_outcome(out, row, found.outcome)
        rest[:, row] = found.theta_rest, found.swing_back, found.doubt
    return OutcomesAtRest(out[0].astype(np.int8), *out[1:], *rest)


def add_rest_error(coarse: Any, fine: Any, safety: float) -> None:
    """Add the numerical error to the doubt of where boulders come to rest.

    Parameters
    ----------
    coarse, fine
        `OutcomesAtRest` by a step and by a third of it; the error goes into the finer.
    safety
        Factor from the difference of the two to the error.
    """
    differing = np.maximum(abs(coarse.theta_rest - fine.theta_rest), abs(coarse.swing_back - fine.swing_back))
    fine.rest_error[:] += safety * differing
