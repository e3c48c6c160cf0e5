"""Energy: parts against the oracle, and the audit of whole impacts."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import FREE, TURNING_BACK, TURNING_FORWARD, Modes, State, signed_arm, switches_of
from boulder_kernels.outcomes import exchange_rates, stored_energies
from tests import oracle
from tests.oracle.dynamics import Rotation, loads
from tests.oracle.energy import ledger, path_rates

from .samples import (
    ALL_READINGS,
    compression,
    control,
    design_of,
    inputs_of,
    literal_state,
    oracle_readings,
    random_designs,
    random_state,
)

SAMPLES = 26


class Audit(NamedTuple):
    """Energies over the time history of one impact [J], arrays of shape (n,)."""

    total: np.ndarray
    """All parts; it should not change."""
    drag: np.ndarray
    damper: np.ndarray
    restoring: np.ndarray
    pull: np.ndarray


def audit(design: bk.Design, readings: bk.Readings, h: float, horizon: float = 0.5) -> Audit:
    """Simulate an impact and sum up its energies at evenly spaced instants."""
    record = bk.Record(
        np.linspace(0.0, horizon, SAMPLES),
        np.full((SAMPLES, 6), np.nan),
        np.full(SAMPLES, -1, np.int8),
        np.zeros(SAMPLES, np.bool_),
        np.full((SAMPLES, 4), np.nan),
    )
    bk.simulate_design(design, readings, control(h, horizon), record)
    c = constants_of(design, readings, 0)
    written = record.turning >= 0
    stored = []
    for y, touching in zip(record.states[written], record.touching[written], strict=True):
        # As printed, the truck stays tied to the boulder by its spring when it should have come off.
        tied = bool(touching) or not readings.separation_released
        stored.append(sum(stored_energies(State(*y), design.m_v, tied, readings.restoring_gravity, c)))
    drag, damper, restoring, pull = record.exchanged[written].T
    total = np.array(stored) + drag + damper - pull
    if not readings.restoring_gravity:  # the printed moment has no potential: its work is not stored
        total = total + restoring
    return Audit(total, drag, damper, restoring, pull)


def imbalance(found: Audit) -> float:
    """Largest change of the total as a fraction of the truck's initial energy."""
    return float(np.max(np.abs(found.total / found.total[0] - 1.0)))


def test_parts_are_those_of_the_oracle() -> None:
    """Stored energies and powers at random states, in both readings of the restoring moment."""
    rng = np.random.default_rng(91)
    names = ("vehicle_kinetic", "boulder_linear", "boulder_angular", "soil_elastic", "crush_spring")
    for design in random_designs(5, seed=92):
        for readings in ALL_READINGS[::3]:
            c = constants_of(design, readings, 0)
            problem = oracle.problem(inputs_of(design), oracle_readings(readings))
            for _ in range(5):
                y = random_state(rng, (0.0, 1.2))
                if compression(y, c) < 0.0:
                    continue
                literal = np.append(literal_state(y, c), np.zeros(4))
                known = ledger(problem, literal[:, None])
                found = stored_energies(y, design.m_v, True, readings.restoring_gravity, c)
                for name, value in zip(names, found, strict=False):
                    assert value == pytest.approx(getattr(known, name)[0], rel=1e-9, abs=1e-6)
                turning, rotation = turning_of(y, readings)
                if readings.restoring_gravity:
                    assert found.gravity == pytest.approx(known.gravity[0], rel=1e-11, abs=1e-6)
                else:
                    assert found.gravity == 0.0
                arm = signed_arm(np.sin(y.theta_b), 1.0 - np.cos(y.theta_b), c)
                modes = Modes(turning, True, 1.0, 1.0 if arm >= 0.0 else -1.0, 0, 0)
                rates = exchange_rates(y, modes, switches_of(modes, readings, c), c)
                load = loads(problem, literal, oracle.Modes(rotation, "touching"))
                expected = path_rates(problem, literal, load)
                size = float(np.sum(np.abs(expected))) + 1.0
                assert np.array(rates) == pytest.approx(expected, abs=1e-9 * size)


def turning_of(y: State, readings: bk.Readings) -> tuple[int, Rotation]:
    """Mode of rotation at a state turned forward, in the words of both; printed, the one without restoring moment."""
    if readings.restoring_gravity:
        return (TURNING_FORWARD, "clockwise") if y.theta_b >= 0.0 else (TURNING_BACK, "anticlockwise")
    return FREE, "backward"


@pytest.mark.parametrize("readings", [bk.as_printed(), bk.corrected()], ids=["as_printed", "corrected"])
def test_balance_of_random_designs(readings: bk.Readings) -> None:
    """Kinetic, stored and dissipated energy and the work of the weight make up the truck's initial energy.

    As printed too, if the work of the restoring moment and of the pull that nothing answers are counted.
    """
    for design in random_designs(40, seed=93):
        found = audit(design, readings, 1e-3)
        assert found.total[0] == pytest.approx(design.m_v * design.v_0**2 / 2, rel=1e-15)
        assert imbalance(found) < 1e-6
        assert np.all(np.diff(found.drag) >= -1e-9 * found.total[0])
        assert np.all(np.diff(found.damper) >= -1e-9 * found.total[0])
        if readings.separation_released:
            assert np.all(found.pull == 0.0)


@pytest.mark.compiled
def test_balance_of_a_thousand_random_designs() -> None:
    found = [imbalance(audit(design, bk.corrected(), 1e-3)) for design in random_designs(1000, seed=94)]
    assert max(found) < 1e-6


def test_balance_improves_with_the_step() -> None:
    """Four times shorter steps leave less than a fiftieth of the imbalance: it is the integrator's error alone."""
    designs = random_designs(12, seed=95)
    coarse, fine = (
        np.exp(np.mean([np.log(imbalance(audit(design, bk.corrected(), h))) for design in designs]))
        for h in (4e-3, 1e-3)
    )
    assert fine < coarse / 50


def test_corrected_energy_after_release_only_falls() -> None:
    """What boulder, soil and weight hold together never grows once the truck moves back."""
    for design in [design_of(oracle.RWG), *random_designs(10, seed=96)]:
        c = constants_of(design, bk.corrected(), 0)
        n = 101
        record = bk.Record(
            np.linspace(0.0, 0.8, n),
            np.full((n, 6), np.nan),
            np.full(n, -1, np.int8),
            np.zeros(n, np.bool_),
            np.full((n, 4), np.nan),
        )
        bk.simulate_design(design, bk.corrected(), control(1e-3, 0.8), record)
        behind = record.states[:, 5] <= 0.0
        held = np.array(
            [
                sum(stored_energies(State(*y), design.m_v, bool(touching), True, c)[1:])
                for y, touching in zip(record.states[behind], record.touching[behind], strict=True)
            ]
        )
        assert np.all(np.diff(held) <= 1e-7 * design.m_v * design.v_0**2)


WRONG_SOILS = """
import json
import boulder_kernels as bk
from boulder_kernels import dynamics
from boulder_kernels.soil import Kinematics, Reaction
from boulder_kernels.dynamics import soil_reaction
from tests import oracle
from tests.kernels.samples import design_of
from tests.kernels.test_energy import audit, imbalance

def scaled(springs, drag, going_back):
    def reaction(k, c):
        spring = soil_reaction(Kinematics(k.A, k.slope_x, 0.0, 0.0, k.q, k.lever_d), c)
        whole = soil_reaction(k, c)
        share = going_back if k.A * k.B < 0.0 else springs
        return Reaction(*(share * s + drag * (w - s) for s, w in zip(spring, whole)))
    return reaction

laws = {"right": (1.0, 1.0, 1.0), "springs": (1.01, 1.0, 1.01), "drag": (1.0, 1.1, 1.0), "lossy": (1.0, 1.0, 0.5)}
found = {}
for name, law in laws.items():
    dynamics.soil_reaction = scaled(*law)
    found[name] = {case: imbalance(audit(design_of(getattr(oracle, case)), bk.corrected(), 2e-3, 0.4))
                   for case in ("ABG", "RWG")}
print(json.dumps(found))
"""


def test_a_wrong_soil_law_does_not_balance() -> None:
    """No entry is what the others leave over: forces that break the ledger's laws show in the balance.

    Springs 1 % too stiff, drag 10 % too strong, and springs that give back half of what they took.
    """
    # The law is replaced in the interpreted kernels, in a process of their own.
    run = subprocess.run(
        [sys.executable, "-c", WRONG_SOILS],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(run.stdout)
    for case in ("ABG", "RWG"):
        assert found["right"][case] < 1e-6
        assert found["springs"][case] > 1e-3
        assert found["drag"][case] > 1e-4
        assert found["lossy"][case] > 5e-3
