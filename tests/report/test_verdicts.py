"""The page of a report judges as a run does: it calls the same compiled rules."""

import numpy as np
import pandas as pd
import pytest

import boulder_sweep
from boulder_sweep.report import write_explorer

DESIGNS = 1000
"""Designs of each case."""
CASES = {
    "corrected": ("criterion.min_overlap=0.4 m",),
    "as printed, stricter": ("model.readings=as_printed", "criterion={max_rotation: 8 deg, rating: P2}"),
}
REASONS = {"corrected": "", "as printed, stricter": "horizon"}


def designs(path):
    """Write random designs that meet every rule: high bumpers, short beds, slow and fast trucks."""
    rng = np.random.default_rng(8)
    height = rng.uniform(1.0, 4.0, DESIGNS)
    columns = {
        "boulder_length_m": rng.uniform(0.6, 2.5, DESIGNS),
        "boulder_width_m": rng.uniform(0.6, 4.0, DESIGNS),
        "boulder_height_m": height,
        "boulder_density_kg_m3": rng.uniform(2300.0, 3000.0, DESIGNS),
        "embedment_depth_m": height * rng.uniform(0.5, 0.9, DESIGNS),
        "impact_height_m": height * rng.uniform(0.02, 0.1, DESIGNS),
        "soil_density_kg_m3": rng.uniform(1500.0, 2200.0, DESIGNS),
        "friction_angle_deg": rng.uniform(28.0, 46.0, DESIGNS),
        "subgrade_reaction_MN_m3": rng.uniform(5.0, 120.0, DESIGNS),
        "vehicle_mass_kg": rng.uniform(800.0, 12000.0, DESIGNS),
        "impact_speed_m_s": rng.uniform(1.0, 20.0, DESIGNS),
        "bumper_height_m": rng.uniform(0.2, 0.8, DESIGNS),
        "bed_offset_m": rng.choice([0.02, 0.3, 2.9], DESIGNS),
    }
    pd.DataFrame(columns).to_parquet(path)


@pytest.mark.parametrize("case", CASES)
def test_a_thousand_designs_are_judged_alike(case, tmp_path, opened):
    designs(tmp_path / "designs.parquet")
    (tmp_path / "grid.yaml").write_text(
        "table: designs.parquet\nvehicle: {spring: 3103.3 kN/m, damper: 138.91 kN*s/m, hood_height: 1.4 m}\n"
    )
    sweep = boulder_sweep.load(tmp_path / "grid.yaml", CASES[case])
    boulder_sweep.run(sweep, tmp_path / "grid.sweep")
    table = boulder_sweep.read(tmp_path / "grid.sweep")
    first = int(np.flatnonzero(table.verdict != "error")[0])
    page = opened(write_explorer(sweep, first, tmp_path / "page.html"))
    inputs = [{name: float(table[name][k]) for name in sweep.plan.columns} for k in range(len(table))]
    judged = pd.DataFrame(page.evaluate("(designs) => page.simulator.rows(designs)", inputs))
    # Rows that pass or overturn past the horizon are confirmed by finer solutions in a run only.
    confirmed = (table.verdict == "pass") | table.reason.isin(["overturns", "error"])
    compared = ~((table.end_time_s > 1.0) & confirmed)
    assert compared.sum() > 0.9 * DESIGNS
    for name in ("verdict", "reason", "rating"):
        ours, theirs = (one[name][compared].astype(object).fillna("").tolist() for one in (judged, table))
        assert ours == theirs, name
    ours, theirs = (one.margin[compared].to_numpy(dtype=float) for one in (judged, table))
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)
    counts = table.reason[compared].value_counts()
    assert counts[["no_contact", "overturns", "crush", "override", REASONS[case]]].min() >= 5, counts
