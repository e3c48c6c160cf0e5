"""Boulders that are no boxes in reports: the simulator has their outline, and the pictures show the stone as given."""

from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.report import write_explorer, write_report
from boulder_sweep.report.figures import sketch_of
from boulder_sweep.report.rows import read_rows
from boulder_sweep.settings import load_text
from boulder_sweep.settings.model import tapered
from tests.report.test_ground import SOILS

STONE = """\
name: stone
boulder:
  {boulder}
  density: 2596 kg/m^3
site: {{embedment_depth: 2.03 m}}
soil: {{density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 95 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""
TAPERED = "length: 1.65 m\n  width: 1.68 m\n  height: 3.44 m\n  taper: 0.8"
LEANING = (
    "profile: [{height: 0, width: 1.5, length: 1.5}, {height: 1.6, width: 1.8, near: 0.9, far: 0.8}, "
    "{height: 3.44, width: 1.5, near: 0.8, far: 0.5}]"
)
SIDES = [f"boulder_{side}_m" for side in ("length", "width", "height")]
STRUCK = np.interp(2.03 + 0.95, [1.6, 3.44], [0.9, 0.8])
"""Near face of the leaning stone at the height of the blow, (1.4 + 0.5) / 2 over the soil line [m]."""


def stone(boulder, *overrides):
    return load_text(STONE.format(boulder=boulder), Path("stone.yaml"), overrides)


def check_design(page, sweep):
    """Hold the design in the simulator of a page against the command line."""
    found = page.evaluate("page.simulator.whole(page.design)")["judged"]
    known = boulder_sweep.simulate(sweep).summary()
    for name in ("verdict", "reason", "rating", "validity", "step_s"):
        assert found[name] == known[name], name
    for name in ("max_rotation_deg", "max_displacement_m", "peak_force_kN", "penetration_m", "overlap_m", "solidity"):
        assert found[name] == pytest.approx(known[name], rel=1e-9), name
    for name in ("rotation_error_deg", "displacement_error_m"):
        # There is no error of a rotation that ended at the limit.
        expected = None if known[name] is None else pytest.approx(known[name], rel=1e-5, abs=1e-11)
        assert found[name] == expected, name


def check_copied(page, sweep):
    """Hold the settings file of the page against the design's own."""
    copied = load_text(page.input_value("#yaml"), Path("copied.yaml"))
    assert copied.constants == pytest.approx(sweep.constants, rel=1e-5)
    points = [[astuple(point) for point in one.model.shape.points] for one in (copied, sweep)]
    np.testing.assert_allclose(*points, rtol=0, atol=1e-5)


def corners_of(shape):
    """Corners of a drawn polygon, y upwards."""
    points = [[float(number) for number in point.split(",")] for point in shape.get_attribute("points").split()]
    return np.array(points) * (1.0, -1.0)


def test_a_tapered_boulder_is_that_of_the_table_and_can_be_moved(tmp_path, opened):
    sweep = stone(TAPERED, "boulder.height=[3, 3.44] m", "site.embedment_depth=[1.5, 2.03] m")
    boulder_sweep.run(sweep, tmp_path / "stone.sweep")
    table, rows = boulder_sweep.read(tmp_path / "stone.sweep"), read_rows(tmp_path / "stone.sweep")
    mass = table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
    np.testing.assert_allclose(np.broadcast_to(rows.mass(), rows.shape).ravel(), mass * tapered(0.8).filled)
    page = opened(write_report(tmp_path / "stone.sweep", tmp_path / "stone.html", designs=[3]))
    inputs = [{name: float(table[name][k]) for name in sweep.plan.columns} for k in range(len(table))]
    found = page.evaluate("(designs) => page.simulator.rows(designs)", inputs)
    assert [one["verdict"] for one in found] == table.verdict.tolist()
    assert set(table.verdict) == {"pass", "fail"}
    np.testing.assert_allclose([one["max_rotation_deg"] for one in found], table.max_rotation_deg, rtol=1e-6)
    np.testing.assert_allclose([one["penetration_m"] for one in found], table.penetration_m, rtol=1e-6)
    assert "boulder tapered, its top 0.8 times as wide as its foot" in page.inner_text("main").lower()
    for drawn in (".section .boulder", "#live-scene .first"):
        np.testing.assert_allclose(np.ptp(corners_of(page.locator(drawn))[:, 0]), 1.65)
    check_copied(page, stone(TAPERED))
    page.fill("#in-boulder_width_m", "1.8")
    check_design(page, stone(TAPERED, "boulder.width=1.8 m"))
    assert page.complaints == []


def test_a_stone_with_a_profile_is_simulated_and_drawn_as_given_and_keeps_its_sides(tmp_path, opened):
    sweep = stone(LEANING)
    page = opened(write_explorer(sweep, 0, tmp_path / "stone.html"))
    check_design(page, sweep)
    check_copied(page, sweep)
    assert all(page.is_disabled(f"#in-{name}") and page.is_disabled(f"#slide-{name}") for name in SIDES)
    assert "its length, width and height cannot be moved" in page.inner_text("#controls")
    assert not set(SIDES) & set(page.evaluate("[...document.getElementById('live-up').options].map((o) => o.value)"))
    first = corners_of(page.locator("#live-scene .first"))
    expected = [(STRUCK + 0.75, 0), (STRUCK + 0.8, 1.6), (STRUCK + 0.5, 3.44)]
    expected += [(STRUCK - 0.8, 3.44), (STRUCK - 0.9, 1.6), (STRUCK - 0.75, 0)]
    np.testing.assert_allclose(first, np.array(expected) - (0, 2.03), atol=1e-9)
    page.fill("#in-embedment_depth_m", "1.9")
    check_design(page, stone(LEANING, "site.embedment_depth=1.9 m"))
    assert page.complaints == []


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("soil", "law", "boulder"),
    [
        ("layers", "kp_squared", f"{TAPERED}\n  mass: 18 t"),
        ("cohesion", "broms", TAPERED),
        ("water up to the soil line", "width_capped", TAPERED),
        ("all", "width_capped", LEANING),
        ("elements", "kp_squared", LEANING),
        ("elements in all", "broms", LEANING),
    ],
)
def test_every_elastic_soil_beside_them_is_that_of_the_command_line(soil, law, boulder, tmp_path, opened):
    sweep = stone(boulder, *SOILS[soil], f"model.resistance={law}")
    page = opened(write_explorer(sweep, 0, tmp_path / "stone.html"))
    check_design(page, sweep)
    columns = page.evaluate(
        "Object.fromEntries(Object.entries(page.motions.live.motion.columns).map(([k, v]) => [k, [...v]]))"
    )
    theirs = boulder_sweep.simulate(sweep, sample_s=1.0 / 400)
    energy = theirs.energy()
    np.testing.assert_allclose(columns["theta_b"], theirs.rotation_rad, rtol=0, atol=1e-9)
    for name in ("soil_elastic", "soil_drag", "gravity"):
        np.testing.assert_allclose(columns[name], getattr(energy, f"{name}_J"), rtol=0, atol=1e-9 * energy.initial)


def test_the_section_is_that_of_the_stone_and_its_water_ends_at_the_faces():
    sweep = stone(LEANING, "soil.water_table=0.8 m")
    inputs = sweep.constants | {"impact_height_m": 0.95, "bumper_height_m": 0.5, "hood_height_m": 1.4}
    drawn = sketch_of(inputs, sweep.resolved())
    xs, ys = np.array(drawn.corners).T
    np.testing.assert_allclose(ys, np.array([0, 1.6, 3.44, 3.44, 1.6, 0]) - 2.03)
    reaches = np.array([-0.75, -0.9, -0.8, 0.5, 0.8, 0.75])
    np.testing.assert_allclose(xs, STRUCK + reaches)
    assert drawn.at_water == pytest.approx(STRUCK + np.interp(1.23, [0, 1.6], [0.75, 0.8]))
    x, y, length, width = drawn.plan
    assert (length, width) == pytest.approx((1.7, 1.8))
    assert drawn.foot == pytest.approx((x + 0.15, y - 0.15, 1.5, 1.5))
    assert drawn.truck == pytest.approx(STRUCK - np.interp(2.53, [1.6, 3.44], [0.9, 0.8]))
    length = next(one for one in drawn.dimensions if one.name == "L =")
    assert (length.x1 - length.x0, length.value) == pytest.approx((1.7, 1.7))


@pytest.mark.parametrize(
    ("length", "height", "depth"), [(0.6, 1.6, 0.8), (0.6, 4.6, 2.0), (4, 1.6, 0.7), (4, 4.6, 2.3)]
)
def test_the_length_of_a_box_stands_clear_of_the_truck(length, height, depth):
    sizes = (f"boulder.length={length} m", f"boulder.height={height} m", f"site.embedment_depth={depth} m")
    sweep = stone(TAPERED.replace("0.8", "1"), *sizes)
    inputs = sweep.constants | {"impact_height_m": 0.95, "bumper_height_m": 0.5, "hood_height_m": 1.4}
    drawn = sketch_of(inputs, sweep.resolved())
    below = next(one for one in drawn.dimensions if one.name == "L =")
    assert drawn.bottom + 0.1 < below.at_y < below.y0 < -depth
    assert drawn.foot is None
    assert drawn.truck == 0.0
    _, upper, _, width = drawn.plan
    assert drawn.top > upper + 0.75
    assert drawn.bottom < upper - width - 0.9
