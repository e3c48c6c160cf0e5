"""The files that come with the package are right, and are what the paper and the documentation say."""

from pathlib import Path

import pytest

from boulder_sweep.settings import load

CONFIGS = Path(__file__).parents[2] / "configs"

# Tables 1 to 3 of the paper.
SHARED = {
    "soil_density_kg_m3": 1859.9,
    "friction_angle_deg": 43.2,
    "subgrade_reaction_MN_m3": 95.0,
    "strain_rate_factor": 1.0,
    "vehicle_spring_N_m": 3103300.0,
    "vehicle_damper_N_s_m": 138910.0,
    "hood_height_m": 1.4,
    "bed_offset_m": 2.9,
}
ABG = {
    "boulder_length_m": 0.762,
    "boulder_width_m": 1.016,
    "boulder_height_m": 2.2,
    "boulder_density_kg_m3": 3074.0,
    "embedment_depth_m": 1.2,
    "impact_height_m": 0.754,
    "vehicle_mass_kg": 6795.0,
    "impact_speed_m_s": 13.36,
    "bumper_height_m": 0.508,
}
RWG = {
    "boulder_length_m": 1.65,
    "boulder_width_m": 1.68,
    "boulder_height_m": 3.44,
    "boulder_density_kg_m3": 2596.0,
    "embedment_depth_m": 2.03,
    "impact_height_m": 0.938,
    "vehicle_mass_kg": 6722.0,
    "impact_speed_m_s": 14.5,
    "bumper_height_m": 0.5,
}


def _row(file, design=0):
    block = load(CONFIGS / file).block(design, design + 1)
    assert block.reasons[0] == ""
    return {name: column.to_numpy()[0] for name, column in block.columns.items()}


@pytest.mark.parametrize(
    ("file", "design", "expected"),
    [("crash_tests.yaml", 0, ABG), ("crash_tests.yaml", 1, RWG), ("abg.yaml", 0, ABG), ("rwg.yaml", 0, RWG)],
)
def test_crash_tests_hold_the_tables_of_the_paper(file, design, expected):
    assert _row(file, design) == SHARED | expected


def test_the_sizing_grid():
    sweep = load(CONFIGS / "m30_sizing.yaml")
    assert sweep.n_designs == 107_008
    assert {axis.name for axis in sweep.axes} == {
        "boulder_height_m",
        "boulder_width_m",
        "embedment_ratio",
        "friction_angle_deg",
        "subgrade_reaction_MN_m3",
    }
    assert not sweep.block(0, sweep.n_designs).reasons.any


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.yaml")), ids=lambda path: path.name)
def test_every_file_is_valid_without_remarks(path):
    assert load(path).notes == ()
