"""A vehicle whose front stiffens in the page: its simulator has the same physics as the command line."""

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.report import write_explorer, write_report

STAGES = "vehicle.spring=[{stiffness: 3103.3 kN/m}, {beyond: 0.4 m, stiffness: 9 MN/m}]"


@pytest.fixture(scope="module")
def sweep():
    return boulder_sweep.load("configs/rwg.yaml", [STAGES])


def test_the_simulator_knows_the_second_spring(sweep, tmp_path, opened):
    page = opened(write_explorer(sweep, 0, tmp_path / "two.html"))
    found = page.evaluate("page.simulator.whole(page.design)")
    theirs = boulder_sweep.simulate(sweep, sample_s=0.5 / 400)
    known = theirs.summary()
    for name in ("verdict", "reason", "validity"):
        assert found["judged"][name] == known[name]
    for name in ("max_rotation_deg", "vehicle_crush_m", "peak_force_kN", "rotation_error_deg"):
        assert found["judged"][name] == pytest.approx(known[name], rel=1e-5)
    ledger = theirs.energy()
    columns = page.evaluate(
        "Object.fromEntries(Object.entries(page.motions.live.motion.columns).map(([k, v]) => [k, [...v]]))"
    )
    lasting = ledger.crush_damper_J + ledger.crush_spent_J
    assert columns["crush_damper"] == pytest.approx(lasting, abs=1e-6 * ledger.initial)
    assert columns["F_v"] == pytest.approx(theirs.contact_force_N, abs=1.0)
    assert ledger.crush_spent_J[-1] > 0.0


@pytest.mark.nightly
def test_the_copied_file_has_it(sweep, tmp_path, opened):
    page = opened(write_explorer(sweep, 0, tmp_path / "two.html"))
    (tmp_path / "copied.yaml").write_text(page.input_value("#yaml"))
    assert boulder_sweep.load(tmp_path / "copied.yaml").constants == sweep.constants
    refused = page.evaluate("page.simulator.rows([{ ...page.design, vehicle_second_spring_N_m: 1e6 }])")
    assert refused[0]["reason"] == "second spring of the vehicle is softer than the first"


@pytest.mark.nightly
def test_a_report_has_it_in_its_rows(tmp_path, opened):
    grid = boulder_sweep.load(
        "configs/rwg.yaml", [STAGES.replace("0.4 m", "[0.4 m, 5 m]"), "vehicle.speed=[12, 14] m/s"]
    )
    boulder_sweep.run(grid, tmp_path / "two.sweep")
    table = boulder_sweep.read(tmp_path / "two.sweep")
    page = opened(write_report(tmp_path / "two.sweep", tmp_path / "two.html", designs=[0]))
    rows = [{name: float(table[name][k]) for name in grid.plan.columns} for k in range(len(table))]
    found = page.evaluate("(designs) => page.simulator.rows(designs)", rows)
    rotation = [one["max_rotation_deg"] for one in found]
    np.testing.assert_allclose(rotation, table.max_rotation_deg, rtol=1e-9)
    assert len({round(value, 3) for value in rotation}) == 4
