"""Where the energy goes in the crash tests, and whether the ledger closes over many designs."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from boulder_kernels import Control, Readings, Record, as_printed, constants_of, corrected, simulate_design
from boulder_kernels.dynamics import BOX
from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.impact.history import Motion, ledger_of
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import Steps, accuracy_of
from boulder_sweep.settings.model import Model, ReadingChoice, SolverSettings
from docs.studies.random_designs import random_designs

PARTS = (
    ("crush_damper_J", "crush of the vehicle, lasting"),
    ("crush_spring_J", "crush of the vehicle, springs back"),
    ("soil_elastic_J", "springs of the soil"),
    ("soil_drag_J", "drag of the soil"),
    ("gravity_J", "weight of the boulder lifted"),
    ("boulder_linear_J", "boulder and soil wedge, translation"),
    ("boulder_angular_J", "boulder and soil wedge, rotation"),
    ("vehicle_kinetic_J", "vehicle"),
)
AUDIT_DESIGNS = 1000
AUDIT_SAMPLES = 41
AUDIT_HORIZON_S = 0.5
PRESETS: dict[str, Readings] = {"as_printed": as_printed(), "corrected": corrected()}


class Balance(NamedTuple):
    """The ledger of one crash test at one instant."""

    title: str
    """Name of the test and the instant, in words."""
    parts_J: dict[str, float]
    """Energies by part."""
    initial_J: float
    """Energy of the vehicle at first touch."""


def balances() -> list[Balance]:
    """Return the ledgers of both crash tests, corrected, at the instant that decides each."""
    found = []
    for test, name in NAMES.items():
        trajectory = simulate(crash_test(test), readings="corrected")
        outcome, ledger = trajectory.motion.outcome, trajectory.energy()
        time, when = outcome.t_limit, "20° passed"
        if math.isnan(time):
            time, when = outcome.maxima.t_theta, "largest rotation"
        parts = {part: float(np.interp(time, ledger.time_s, getattr(ledger, part))) for part, _ in PARTS}
        found.append(Balance(f"{name} at {time:.3f} s ({when})", parts, ledger.initial))
    return found


def balance_table(found: list[Balance]) -> Table:
    """Return the ledgers as a table."""
    head = (cell for balance in found for cell in (f"{balance.title} [kJ]", "share"))
    table = Table(("energy in", *head))

    def add(words: str, values_J: list[float]) -> None:
        shares = zip(values_J, found, strict=True)
        table.add(words, *(c for value, of in shares for c in (f"{value / 1e3:.1f}", f"{value / of.initial_J:.1%}")))

    for name, words in PARTS:
        add(words, [balance.parts_J[name] for balance in found])
    add("sum", [sum(balance.parts_J.values()) for balance in found])
    return table


def audit(preset: str, steps: Steps, count: int = AUDIT_DESIGNS, seed: int = 0) -> np.ndarray:
    """Return the largest residual of the ledger of many random designs.

    Parameters
    ----------
    preset
        ``as_printed`` or ``corrected``.
    steps
        Step of the integrator, and whether steps end where the soil yields.
    count, seed
        How many designs, and which.

    Returns
    -------
    ndarray, shape (count,)
        Largest residual over 0.5 s as a share of the vehicle's energy at first touch.
    """
    readings = PRESETS[preset]
    control = Control(
        steps.step_s,
        AUDIT_HORIZON_S,
        math.radians(20.0),
        elements=0,
        error_estimate=False,
        stop_at_limit=False,
        locate_yield=steps.locate_yield,
    )
    residuals = np.empty(count)
    for row, design in enumerate(random_designs(count, seed)):
        record = _blank_record()
        outcome = simulate_design(design, readings, control, record)
        reached = np.isfinite(record.states).all(axis=1)
        kept = Record(*(field[reached] for field in record))
        motion = Motion(design, readings, constants_of(design, readings, 0), control, kept, outcome, BOX)
        residuals[row] = ledger_of(motion).largest_residual
    return residuals


def audit_words() -> str:
    """Say how well the ledger closes by `balanced` and corrected readings."""
    largest = audit("corrected", reported_steps("balanced", "corrected")).max()
    return (
        f"Among {AUDIT_DESIGNS} random designs, simulated for {AUDIT_HORIZON_S:g} s by `balanced` and corrected "
        f"readings, the largest residual is {largest:.0e} of the truck's first energy."
    )


def reported_steps(accuracy: str, preset: str) -> Steps:
    """Return the steps of the solution that a row reports, by the names of an accuracy and of a preset."""
    model, solver = Model(ReadingChoice.of_preset(preset)), SolverSettings(accuracy=accuracy)
    sweep = dataclasses.replace(crash_test("rwg"), model=model, solver=solver)
    chosen = accuracy_of(sweep)
    return Steps(float(chosen.to_dict()["reported_step_s"]), chosen.steps.locate_yield)


def _blank_record() -> Record:
    """Return a record to be filled at evenly spaced times."""
    times = np.linspace(0.0, AUDIT_HORIZON_S * (1.0 - 1e-14), AUDIT_SAMPLES)
    n = len(times)
    return Record(times, np.full((n, 6), np.nan), np.zeros(n, np.int8), np.zeros(n, np.bool_), np.full((n, 4), np.nan))
