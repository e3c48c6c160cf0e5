"""The energy ledger: what the vehicle loses is found elsewhere, to the accuracy of the solver."""

from __future__ import annotations

import numpy as np
import pytest

from boulder_sweep.crash_tests.cases import NAMES
from boulder_sweep.judge.accuracy import Steps
from boulder_sweep.settings.model import PRESETS
from docs.studies.energy import PARTS, audit, balances
from tests import oracle
from tests.conftest import Trajectories

BOTH = [(test, preset) for test in NAMES for preset in PRESETS]
CASES = {"abg": oracle.ABG, "rwg": oracle.RWG}
ORACLE_READINGS = {"as_printed": oracle.AS_PRINTED, "corrected": oracle.CORRECTED}


@pytest.mark.parametrize("key", BOTH)
def test_ledger_closes(trajectories: Trajectories, key: tuple[str, str]) -> None:
    ledger = trajectories[key].energy()
    assert ledger.largest_residual < 1e-7
    parts = [getattr(ledger, name) for name, _ in PARTS] + [ledger.pull_J]
    assert np.sum(parts, axis=0) == pytest.approx(ledger.initial, rel=1e-7)
    design = trajectories[key].motion.design
    assert ledger.initial == pytest.approx(design.m_v * design.v_0**2 / 2, rel=1e-15)


@pytest.mark.parametrize("key", BOTH)
def test_parts_are_those_of_the_oracle(trajectories: Trajectories, key: tuple[str, str]) -> None:
    found = trajectories[key].energy()
    some = slice(0, 241, 30)
    known = oracle.simulate(CASES[key[0]], ORACLE_READINGS[key[1]]).energy(found.time_s[some])
    pairs = {
        "vehicle_kinetic_J": known.vehicle_kinetic,
        "boulder_linear_J": known.boulder_linear,
        "boulder_angular_J": known.boulder_angular,
        "soil_elastic_J": known.soil_elastic,
        "soil_drag_J": known.soil_drag,
        "crush_spring_J": known.crush_spring,
        "crush_damper_J": known.crush_damper,
        "gravity_J": known.gravity,
        "pull_J": known.clipped,
    }
    for name, values in pairs.items():
        if name == "crush_spring_J" and key[1] == "corrected":
            values = np.where(trajectories[key].in_contact[some] == "touching", values, 0.0)
        assert getattr(found, name)[some] == pytest.approx(values, abs=1e-5 * found.initial), name


def test_what_is_dissipated_never_comes_back(trajectories: Trajectories) -> None:
    for t in trajectories.values():
        ledger = t.energy()
        for name in ("soil_drag_J", "crush_damper_J"):
            assert np.all(np.diff(getattr(ledger, name)) >= -1e-9 * ledger.initial), name
        for name in ("soil_elastic_J", "crush_spring_J", "vehicle_kinetic_J", "boulder_linear_J", "boulder_angular_J"):
            assert getattr(ledger, name).min() >= 0.0


def test_only_the_printed_separation_makes_energy(trajectories: Trajectories) -> None:
    assert np.all(trajectories["rwg", "corrected"].energy().pull_J == 0.0)
    assert trajectories["rwg", "as_printed"].energy().pull_J[-1] < -100.0


@pytest.mark.parametrize("preset", PRESETS)
def test_ledger_closes_over_a_thousand_random_designs(preset: str) -> None:
    found = audit(preset, Steps(0.001), count=1000, seed=5)
    assert found.shape == (1000,)
    assert np.isfinite(found).all()
    assert found.max() < 2e-6
    assert np.median(found) < 1e-8


def test_residual_shrinks_with_the_fifth_power_of_the_step() -> None:
    coarse, fine = (np.median(audit("corrected", Steps(step, locate_yield=True), count=100)) for step in (0.004, 0.002))
    assert 3.5 < np.log2(coarse / fine) < 6.5


def test_balances_of_the_study_add_up() -> None:
    for balance in balances():
        assert sum(balance.parts_J.values()) == pytest.approx(balance.initial_J, rel=1e-5)
