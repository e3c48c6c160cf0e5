"""Soils as they lie in the page: its simulator has the same physics as the command line."""

import dataclasses
from itertools import product

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.report import write_explorer, write_report
from boulder_sweep.settings.model import RESISTANCES
from tests.soils.test_ground import IN_FILE

LAYERS, COHESION, WATER, SLOPE = IN_FILE
SOILS = {
    "layers": (LAYERS,),
    "cohesion": (COHESION,),
    "water": (WATER,),
    "water at a boundary": (LAYERS, "soil.water_table=0.5 m"),
    "water up to the soil line": (LAYERS, "soil.water_table=0 m"),
    "all": IN_FILE,
    "elements": ("model.soil={elements: 60}",),
    "elements in all": (*IN_FILE, "model.soil={elements: 60}"),
}


IN_EVERY_RUN = (("layers", RESISTANCES[0]), ("all", RESISTANCES[1]))
EVERY_SOIL = [*((soil, RESISTANCES[0]) for soil in SOILS), *product(["all"], RESISTANCES[1:])]


@pytest.mark.parametrize(
    ("soil", "law"),
    [pytest.param(*case, marks=[] if case in IN_EVERY_RUN else pytest.mark.nightly) for case in EVERY_SOIL],
)
def test_the_simulator_has_the_soil_of_the_command_line(soil, law, tmp_path, opened):
    sweep = boulder_sweep.load("configs/rwg.yaml", [*SOILS[soil], f"model.resistance={law}"])
    page = opened(write_explorer(sweep, 0, tmp_path / "page.html"))
    found = page.evaluate("page.simulator.whole(page.design)")["judged"]
    known = boulder_sweep.simulate(sweep).summary()
    for name in ("verdict", "reason", "rating", "validity", "step_s"):
        assert found[name] == known[name], name
    for name in ("max_rotation_deg", "max_displacement_m", "vehicle_crush_m", "peak_force_kN", "end_time_s"):
        assert found[name] == pytest.approx(known[name], rel=1e-9), name
    for name in ("rotation_error_deg", "displacement_error_m"):  # differences of solutions that agree to many digits
        wanted = known[name] if known[name] is None else pytest.approx(known[name], rel=1e-5, abs=1e-11)
        assert found[name] == wanted, name


@pytest.mark.parametrize(
    "soil",
    ["all", *(pytest.param(soil, marks=pytest.mark.nightly) for soil in ("elements", "elements in all"))],
)
def test_curves_and_energies_are_those_of_the_command_line(soil, tmp_path, opened):
    sweep = boulder_sweep.load("configs/rwg.yaml", SOILS[soil])
    page = opened(write_explorer(sweep, 0, tmp_path / "page.html"))
    columns = page.evaluate(
        "Object.fromEntries(Object.entries(page.motions.live.motion.columns).map(([k, v]) => [k, [...v]]))"
    )
    theirs = boulder_sweep.simulate(sweep, sample_s=0.5 / 400)
    energy = theirs.energy()
    np.testing.assert_allclose(columns["theta_b"], theirs.rotation_rad, rtol=0, atol=1e-9)
    np.testing.assert_allclose(columns["F_v"], theirs.contact_force_N, rtol=0, atol=1e-9 * theirs.contact_force_N.max())
    for name in ("soil_elastic", "soil_drag", "crush_damper", "gravity"):
        np.testing.assert_allclose(columns[name], getattr(energy, f"{name}_J"), rtol=0, atol=1e-9 * energy.initial)
    assert page.complaints == []


@pytest.mark.nightly
def test_the_map_around_a_slow_design_comes_in_pieces_and_gives_way_to_another(tmp_path, opened):
    sweep = boulder_sweep.load("configs/rwg.yaml", ["model.soil={elements: 2000}"])
    page = opened(write_explorer(sweep, 0, tmp_path / "page.html"))
    page.wait_until_it_is_true(
        "/^Simulating \\d+ of 144 designs/.test(document.getElementById('live-words').textContent)"
    )
    page.fill("#in-embedment_depth_m", "2.1")
    page.wait_until_it_is_true("/^Of 12 × 12 designs/.test(document.getElementById('live-words').textContent)")
    cells = page.evaluate("page.maps.live.cells.map((cell) => ({ ...cell.pick(), verdict: cell.name.split(':')[0] }))")
    depths = sorted({cell["embedment_depth_m"] for cell in cells})
    assert (depths[0], depths[-1]) == pytest.approx((0.75 * 2.1, 1.25 * 2.1))
    one = cells[70]
    changed = [f"site.embedment_depth={one['embedment_depth_m']}", f"soil.friction_angle={one['friction_angle_deg']}"]
    known = boulder_sweep.load("configs/rwg.yaml", ["model.soil={elements: 2000}", *changed])
    assert boulder_sweep.simulate(known).verdict == one["verdict"]


@pytest.mark.nightly
def test_the_copied_file_has_it(tmp_path, opened):
    sweep = boulder_sweep.load("configs/rwg.yaml", [*IN_FILE, "partial_factor.friction_angle=1.25"])
    page = opened(write_explorer(sweep, 0, tmp_path / "page.html"))
    (tmp_path / "copied.yaml").write_text(page.input_value("#yaml"))
    copied, ground = boulder_sweep.load(tmp_path / "copied.yaml").model.ground, sweep.model.ground
    assert dataclasses.replace(copied, layers=()) == dataclasses.replace(ground, layers=())
    for ours, theirs in zip(copied.layers, ground.layers, strict=True):
        assert dataclasses.astuple(ours) == pytest.approx(dataclasses.astuple(theirs), rel=5e-6)


@pytest.mark.nightly
def test_a_report_has_it_in_its_rows(tmp_path, opened):
    """Rows of several depths, for some of which not every layer is in the way."""
    depths = "site.embedment_depth=[0.4, 0.5, 0.9, 1.6, 2.3] m"
    grid = boulder_sweep.load("configs/rwg.yaml", [*IN_FILE, depths, "soil.friction_angle=[34, 40] deg"])
    boulder_sweep.run(grid, tmp_path / "soil.sweep")
    table = boulder_sweep.read(tmp_path / "soil.sweep")
    page = opened(write_report(tmp_path / "soil.sweep", tmp_path / "soil.html", designs=[0]))
    rows = [{name: float(table[name][k]) for name in grid.plan.columns} for k in range(len(table))]
    found = page.evaluate("(designs) => page.simulator.rows(designs)", rows)
    assert [one["verdict"] for one in found] == table.verdict.tolist()
    np.testing.assert_allclose([one["max_rotation_deg"] for one in found], table.max_rotation_deg, rtol=1e-9)
    assert "3 layers of soil, cohesion 4 / 2 / 0 kPa, water table 0.8 m down" in page.inner_text("main")
    assert table.verdict.nunique() > 1
