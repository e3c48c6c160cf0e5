"""Plastic soil, from the file to the table and the time history."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import boulder_sweep
from boulder_sweep.cli.simulate import explain as explain_command
from boulder_sweep.columns import AT_REST
from boulder_sweep.errors import NothingToMeasureError
from boulder_sweep.impact.explanation import explain
from boulder_sweep.judge.accuracy import accuracy_of, control_of
from boulder_sweep.settings.model import PLASTIC_ELEMENTS
from boulder_sweep.settings.problems import SettingsError
from boulder_sweep.tradeoff.study import measure
from boulder_sweep.views.wording import model_words

NAMES = [spec.name for spec in AT_REST]
PLASTIC = ["model.unloading=plastic", "model.soil={elements: 40}", "solver.accuracy=balanced"]


def test_by_elements_and_only_where_asked_for():
    elastic, plastic = (boulder_sweep.load("configs/rwg.yaml", given) for given in ([], PLASTIC[:1]))
    assert (elastic.model.elements, plastic.model.elements) == (0, PLASTIC_ELEMENTS)
    assert [control_of(sweep, accuracy_of(sweep)).unloading for sweep in (elastic, plastic)] == [0, 1]
    assert plastic.resolved()["model"]["soil"] == PLASTIC_ELEMENTS
    assert model_words(elastic.resolved()) == "readings corrected"
    assert model_words(plastic.resolved()) == "readings corrected, plastic unloading"


def test_another_word_is_refused_with_its_place():
    with pytest.raises(SettingsError, match=r"elastic, plastic, plastic_with_gap.*did you mean plastic\?"):
        boulder_sweep.load("configs/rwg.yaml", ["model.unloading=plasic"])


def test_ways_to_compute_elastic_soil_are_not_compared_for_another():
    with pytest.raises(NothingToMeasureError, match=r"model\.unloading is plastic"):
        measure(boulder_sweep.load("configs/rwg.yaml", PLASTIC))


def test_a_table_and_its_explanation_tell_where_the_boulder_rests(tmp_path):
    sweep = boulder_sweep.load("configs/crash_tests.yaml", PLASTIC)
    boulder_sweep.run(sweep, tmp_path / "plastic")
    found = boulder_sweep.read(tmp_path / "plastic")
    assert set(NAMES) < set(found.columns)
    assert found.attrs["units"]["permanent_tilt_deg"] == "deg"
    by_verdict = found.set_index("verdict")
    assert by_verdict.loc["fail", NAMES].isna().all()
    held = by_verdict.loc["pass"]
    assert held["permanent_tilt_deg"] == pytest.approx(12.3, abs=0.1)
    assert held["swing_back_deg"] == pytest.approx(1.6, abs=0.1)
    assert held["permanent_tilt_error_deg"] < 0.3
    row = int(found.index[found["verdict"] == "pass"][0])
    again = explain(tmp_path / "plastic", row)
    assert again.unequal == ()
    assert set(NAMES) < set(again.stored)
    shown = CliRunner().invoke(explain_command, [str(tmp_path / "plastic"), str(row)]).output
    assert "swings back by 1.6" in shown
    assert "computed again: the same to the last bit" in shown

    boulder_sweep.run(boulder_sweep.load("configs/crash_tests.yaml"), tmp_path / "elastic")
    assert not set(NAMES) & set(boulder_sweep.read(tmp_path / "elastic").columns)


@pytest.mark.parametrize("way", ["plastic", "plastic_with_gap"])
def test_the_energy_ledger_closes_with_the_plastic_work(way):
    given = [f"model.unloading={way}", "model.soil={elements: 40}", "solver.step=0.5 ms", "solver.horizon=1 s"]
    ledger = boulder_sweep.simulate(boulder_sweep.load("configs/rwg.yaml", given)).energy()
    assert ledger.largest_residual < 1e-6
    assert ledger.soil_plastic_J[-1] > 0.2 * ledger.initial
    assert np.diff(ledger.soil_plastic_J).min() > -1e-9 * ledger.initial
    assert (ledger.soil_elastic_J >= 0.0).all()


@pytest.mark.parametrize(
    "other",
    [
        "model.resistance=broms",
        "model.resistance=width_capped",
        "soil.slope=10 deg",
        # these compile kernels that no other test needs
        pytest.param("soil.cohesion=5 kPa", marks=pytest.mark.nightly),
        pytest.param(
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_it_combines_with_every_other_law(other):
    """On the way forward nothing unloads, whatever the law; and the ledger closes."""
    given = ["model.soil={elements: 40}", "solver.step=0.5 ms", "solver.horizon=1 s", "vehicle.speed=20 mph"]
    alone, elastic, plastic = (
        boulder_sweep.simulate(boulder_sweep.load("configs/rwg.yaml", [*given, *more]))
        for more in (["model.unloading=plastic"], [other], [other, "model.unloading=plastic"])
    )
    turned = [found.summary()["max_rotation_deg"] for found in (alone, elastic, plastic)]
    assert turned[2] == pytest.approx(turned[1], rel=0.02)
    assert abs(turned[2] - turned[0]) > 0.03 * turned[0]
    ledger = plastic.energy()
    assert ledger.largest_residual < 1e-6
    assert ledger.soil_plastic_J[-1] > 0.05 * ledger.initial


def test_forces_of_a_time_history_are_those_of_the_motion():
    """Momentum: what contact and soil push together is what the boulder gains."""
    found = boulder_sweep.simulate(boulder_sweep.load("configs/rwg.yaml", [*PLASTIC, "solver.horizon=0.5 s"]))
    mass = found.motion.constants.m_eff
    pushed = np.concatenate(([0.0], np.cumsum(_trapezoids(found.contact_force_N + found.soil_force_N, found.time_s))))
    assert mass * found.boulder_velocity_m_s == pytest.approx(pushed, abs=2e-3 * pushed.max())
    assert json.loads(json.dumps(found.summary()))["permanent_tilt_deg"] > 10.0


def _trapezoids(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    return 0.5 * (values[1:] + values[:-1]) * np.diff(times)
