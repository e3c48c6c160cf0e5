"""What a design takes to build: against volumes summed in thin slices, and against the wedge of the kernels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boulder_kernels.design import compression_wedge_length, wedge_slope
from boulder_sweep import load
from boulder_sweep.judge import quantities as own
from boulder_sweep.judge.quantities import QUANTITIES, buried_share, quantities, quantities_by
from boulder_sweep.settings.model import Ground, Layer, ProfilePoint, Shape, tapered

BOX = Shape()
PLAIN = Ground()
ROW = {
    "boulder_length_m": 1.65,
    "boulder_width_m": 1.68,
    "boulder_height_m": 3.44,
    "boulder_density_kg_m3": 2596.0,
    "embedment_depth_m": 2.03,
    "friction_angle_deg": 43.2,
}


def summed(row, *, slope, slices=20_000):
    """Volume of the trench by slices: as wide as the boulder, L at its base, wider by the wedge on both sides."""
    height = (np.arange(slices) + 0.5) / slices * row["embedment_depth_m"]
    return (
        np.sum(row["boulder_length_m"] + 2.0 * slope * height)
        * row["embedment_depth_m"]
        / slices
        * row["boulder_width_m"]
    )


@pytest.mark.parametrize("phi", [24.0, 30.0, 36.0, 43.2, 49.0])
def test_the_trench_reaches_as_far_as_both_wedges_of_the_model(phi):
    row = ROW | {"friction_angle_deg": phi}
    d, angle = row["embedment_depth_m"], math.radians(phi)
    reach = max(d * wedge_slope(angle), compression_wedge_length(d, angle))
    found = quantities(row, BOX, PLAIN)
    assert found["excavated_m3"] == pytest.approx(summed(row, slope=reach / d), rel=1e-8)


def test_the_weight_of_both_wedges_is_that_of_the_soil_that_moves():
    """The wedge on one side, by Eqs 1 and 2, is half of what is excavated beside the boulder."""
    found = quantities(ROW, BOX, PLAIN)
    d, W = ROW["embedment_depth_m"], ROW["boulder_width_m"]
    one_side = W * wedge_slope(math.radians(43.2)) * d * d / 2.0
    assert found["backfill_m3"] == pytest.approx(2.0 * one_side, rel=1e-12)


def test_the_box_of_the_paper():
    found = quantities(ROW, BOX, PLAIN)
    assert tuple(found) == tuple(spec.name for spec in QUANTITIES)
    assert found["boulder_mass_kg"] == pytest.approx(24754.6, abs=0.1)
    assert found["height_above_ground_m"] == pytest.approx(1.41)
    assert found["excavated_m3"] - found["backfill_m3"] == pytest.approx(1.65 * 1.68 * 2.03)


@pytest.mark.parametrize(
    "shape",
    [
        tapered(0.6),
        tapered(1.4),
        Shape((ProfilePoint(0, 0.8, 0.3, 0.4), ProfilePoint(0.3, 1.0, 0.6, 0.4), ProfilePoint(1, 0.5, 0.2, 0.3))),
    ],
)
def test_a_profile_is_buried_as_far_as_it_is(shape):
    points = shape.points
    heights = [point.height for point in points]
    for ratio in (0.1, 0.3, 0.55, 0.999, 1.0):
        at = (np.arange(200_000) + 0.5) / 200_000 * ratio
        width, near, far = (
            np.interp(at, heights, [getattr(point, name) for point in points]) for name in ("width", "near", "far")
        )
        assert buried_share(shape, np.array(ratio)) == pytest.approx(np.mean(width * (near + far)) * ratio, rel=1e-8)
    assert buried_share(shape, np.array([1.0, 1.5])) == pytest.approx(shape.filled, rel=1e-12)
    found = quantities(ROW, shape, PLAIN)
    assert found["boulder_mass_kg"] == pytest.approx(24754.6 * shape.filled, rel=1e-5)


def test_the_longest_wedge_of_the_layers_above_the_base_counts():
    dense, loose = (Layer(1.0, 1900.0, phi, 50.0) for phi in (46.0, 40.0))
    longer = quantities(ROW, BOX, Ground(layers=(dense,)))["excavated_m3"]
    assert longer == quantities(ROW | {"friction_angle_deg": 46.0}, BOX, PLAIN)["excavated_m3"]
    assert quantities(ROW, BOX, Ground(layers=(loose,)))["excavated_m3"] == quantities(ROW, BOX, PLAIN)["excavated_m3"]
    deep = Ground(layers=(Layer(2.5, 1900.0, 46.0, 50.0),))
    assert quantities(ROW, BOX, deep)["excavated_m3"] == quantities(ROW, BOX, PLAIN)["excavated_m3"]


def test_a_weighed_boulder_keeps_its_mass_and_fills_its_share_of_the_pit():
    box = quantities(ROW, BOX, PLAIN)
    found = quantities(ROW | {"boulder_mass_kg": 0.7 * box["boulder_mass_kg"]}, BOX, PLAIN)
    assert found["boulder_mass_kg"] == 0.7 * box["boulder_mass_kg"]
    assert found["excavated_m3"] - found["backfill_m3"] == pytest.approx(0.7 * 1.65 * 1.68 * 2.03)
    heavier = quantities(ROW | {"boulder_mass_kg": 1.1 * box["boulder_mass_kg"]}, BOX, PLAIN)
    assert heavier["backfill_m3"] == box["backfill_m3"]


def test_many_designs_at_once():
    depth = np.linspace(0.5, 3.0, 7)
    many = quantities(ROW | {"embedment_depth_m": depth}, tapered(0.7), PLAIN)
    for place, d in enumerate(depth):
        one = quantities(ROW | {"embedment_depth_m": d}, tapered(0.7), PLAIN)
        assert {name: values[place] for name, values in many.items()} == {name: float(one[name]) for name in one}


def test_settings_of_a_table_give_shape_and_layers(tmp_path):
    (tmp_path / "a.yaml").write_text(
        "boulder: {length: 1.65, width: 1.68, height: 3.44, density: 2596, taper: 0.8}\nsite: {embedment_depth: 2.03}\n"
        "soil: {density: 1859.9, friction_angle: 43.2, subgrade_reaction: 95, layers: [{from: 1 m, density: 1900, "
        "friction_angle: 46, subgrade_reaction: 95}]}\n"
        "vehicle: {mass: 6722, speed: 14.5, spring: 3103.3e3, damper: 138.91e3}\n"
    )
    sweep = load(tmp_path / "a.yaml")
    by_model = quantities(ROW, sweep.model.shape, sweep.model.ground)
    assert by_model == quantities_by(ROW, sweep.resolved())
    assert by_model["excavated_m3"] > quantities(ROW, sweep.model.shape, PLAIN)["excavated_m3"]
    assert own.MASS.unit == "kg"
