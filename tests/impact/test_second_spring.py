"""A vehicle whose front stiffens: from the file to the time history, and back from a row of a table."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep import Trajectory
from boulder_sweep.cli.main import execute
from boulder_sweep.columns import SECOND_SPRING_COLUMNS
from boulder_sweep.impact.explanation import explain
from boulder_sweep.impact.trajectory import SPENT
from boulder_sweep.settings import Sweep, load
from tests import oracle
from tests.kernels.samples import inputs_of

CONFIG = Path(__file__).parents[2] / "configs" / "rwg.yaml"
STAGES = "vehicle.spring=[{stiffness: 3103.3 kN/m}, {beyond: [0.4 m, 0.6 m], stiffness: 9 MN/m}]"


@pytest.fixture(scope="module")
def sweep() -> Sweep:
    return load(CONFIG, [STAGES])


@pytest.fixture(scope="module")
def found(sweep: Sweep) -> Trajectory:
    return boulder_sweep.simulate(sweep, 0)


@pytest.fixture(scope="module")
def known(found: Trajectory) -> oracle.Impact:
    return oracle.simulate(replace(inputs_of(found.motion.design), k_2=9e6, s_2=0.4), oracle.CORRECTED)


def test_time_history_is_that_of_the_oracle(found: Trajectory, known: oracle.Impact) -> None:
    some = slice(1, None, 50)
    states = known.states(found.time_s[some])
    assert found.rotation_rad[some] == pytest.approx(states[2], abs=1e-6)
    assert found.vehicle_displacement_m[some] == pytest.approx(states[4], abs=1e-6)
    assert found.contact_force_N[some] == pytest.approx(known.force(found.time_s[some]), abs=2.0)


def test_ledger_closes_and_knows_what_is_spent(found: Trajectory, known: oracle.Impact) -> None:
    ledger = found.energy()
    assert ledger.largest_residual < 1e-7
    spent = known.energy(found.time_s[-1:]).crush_spent[0]
    assert ledger.crush_spent_J[-1] == pytest.approx(spent, rel=1e-6)
    assert spent > 0.02 * ledger.initial
    before = found.time_s < known.time_of("second spring")
    assert np.all(ledger.crush_spent_J[before] == 0.0)
    assert np.ptp(ledger.crush_spent_J[~before]) == 0.0
    assert SPENT.name in found.columns(energy=True)


def test_rows_carry_the_spring_and_come_out_again(sweep: Sweep, tmp_path: Path) -> None:
    boulder_sweep.run(sweep, tmp_path / "two.sweep")
    table = boulder_sweep.read(tmp_path / "two.sweep")
    assert table[list(SECOND_SPRING_COLUMNS)].to_numpy().tolist() == [[9e6, 0.4], [9e6, 0.6]]
    for row in range(2):
        again = explain(tmp_path / "two.sweep", row)
        assert again.unequal == ()
        assert again.inputs["vehicle_second_spring_from_m"] == table.vehicle_second_spring_from_m[row]
        one = boulder_sweep.simulate({name: table[name][row] for name in again.inputs}, horizon_s=0.5)
        assert one.summary()["max_rotation_deg"] == pytest.approx(table.max_rotation_deg[row], rel=1e-4)
    alone = boulder_sweep.simulate(CONFIG).summary()["max_rotation_deg"]
    assert (table.max_rotation_deg < 0.9 * alone).all()


def test_explain_says_when_it_took_over(
    sweep: Sweep, known: oracle.Impact, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    boulder_sweep.run(load(CONFIG, [STAGES.replace("[0.4 m, 0.6 m]", "[0.4 m, 5 m]")]), tmp_path / "two.sweep")
    for row in ("0", "1"):
        assert execute(["explain", str(tmp_path / "two.sweep"), row]) == 0
    text = capsys.readouterr().out
    when = 0.5 * np.ceil(2e3 * known.time_of("second spring"))  # the next sample [ms]
    assert f"front: its second spring acts from a crush of 0.4 m on, reached {when:.0f} ms after contact" in text
    assert "front: its second spring acts from a crush of 5 m on, not reached" in text


def test_a_mapping_needs_both_numbers(found: Trajectory) -> None:
    design = {name: value for name, value in found.inputs.items() if name != SECOND_SPRING_COLUMNS[1]}
    with pytest.raises(ValueError, match=SECOND_SPRING_COLUMNS[1]):
        boulder_sweep.simulate(design)


def test_a_map_has_it_on_an_axis(sweep: Sweep, tmp_path: Path) -> None:
    speeds = load(CONFIG, [STAGES, "vehicle.speed=[12, 14] m/s"])
    boulder_sweep.run(speeds, tmp_path / "two.sweep")
    assert execute(["plot", str(tmp_path / "two.sweep"), "-o", str(tmp_path / "map.png")]) == 0
    assert (tmp_path / "map.png").stat().st_size > 0
