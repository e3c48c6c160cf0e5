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


def designs(path, n=DESIGNS, damper=138.91e3):
    """Write random designs that meet every rule: high bumpers, short beds, slow and fast trucks; damper in N s/m."""
    rng = np.random.default_rng(8)
    height = rng.uniform(1.0, 4.0, n)
    columns = {
        "boulder_length_m": rng.uniform(0.6, 2.5, n),
        "boulder_width_m": rng.uniform(0.6, 4.0, n),
        "boulder_height_m": height,
        "boulder_density_kg_m3": rng.uniform(2300.0, 3000.0, n),
        "embedment_depth_m": height * rng.uniform(0.5, 0.9, n),
        "impact_height_m": height * rng.uniform(0.02, 0.1, n),
        "soil_density_kg_m3": rng.uniform(1500.0, 2200.0, n),
        "friction_angle_deg": rng.uniform(28.0, 46.0, n),
        "subgrade_reaction_MN_m3": rng.uniform(5.0, 120.0, n),
        "vehicle_mass_kg": rng.uniform(800.0, 12000.0, n),
        "impact_speed_m_s": rng.uniform(1.0, 20.0, n),
        "bumper_height_m": rng.uniform(0.2, 0.8, n),
        "bed_offset_m": rng.choice([0.02, 0.3, 2.9], n),
        "vehicle_spring_N_m": np.full(n, 3103.3e3),
        "vehicle_damper_N_s_m": np.full(n, damper),
        "hood_height_m": np.full(n, 1.4),
    }
    pd.DataFrame(columns).to_parquet(path)


def shallow(count, seed):
    """Draw shallow designs that the truck hits, with the columns of a table of designs."""
    rng = np.random.default_rng(seed)
    n = 4 * count
    H = rng.uniform(1.2, 4.0, n)
    drawn = pd.DataFrame(
        {
            "boulder_length_m": rng.uniform(1.0, 3.0, n),
            "boulder_width_m": rng.uniform(0.8, 2.5, n),
            "boulder_height_m": H,
            "boulder_density_kg_m3": rng.uniform(2400.0, 3074.0, n),
            "embedment_depth_m": rng.uniform(0.02, 0.35, n) * H,
            "soil_density_kg_m3": rng.uniform(1520.0, 2240.0, n),
            "friction_angle_deg": rng.uniform(27.0, 49.0, n),
            "subgrade_reaction_MN_m3": rng.uniform(10.0, 110.0, n),
            "strain_rate_factor": rng.uniform(1.0, 1.2, n),
            "vehicle_mass_kg": rng.uniform(1500.0, 7500.0, n),
            "impact_speed_m_s": rng.uniform(4.0, 14.0, n),
            "vehicle_spring_N_m": rng.uniform(1.5e6, 4.0e6, n),
            "vehicle_damper_N_s_m": rng.uniform(0.9e5, 2.4e5, n),
            "bumper_height_m": rng.uniform(0.3, 0.55, n),
            "hood_height_m": rng.uniform(0.8, 1.6, n),
        }
    )
    reached = drawn.boulder_height_m - drawn.embedment_depth_m > drawn.bumper_height_m + 0.3
    return drawn[reached].head(count).reset_index(drop=True)


def judged_by_both(folder, overrides, opened):
    """Run a list of designs, and have the page judge them; return both as frames, and the page."""
    (folder / "grid.yaml").write_text("table: designs.parquet\n")
    sweep = boulder_sweep.load(folder / "grid.yaml", overrides)
    boulder_sweep.run(sweep, folder / "grid.sweep")
    table = boulder_sweep.read(folder / "grid.sweep")
    first = int(np.flatnonzero(table.verdict != "error")[0])
    page = opened(write_explorer(sweep, first, folder / "page.html"))
    inputs = [{name: float(table[name][k]) for name in sweep.plan.columns} for k in range(len(table))]
    return table, pd.DataFrame(page.evaluate("(designs) => page.simulator.rows(designs)", inputs)), page


def assert_alike(judged, table):
    """Check that every row has the same words."""
    for name in ("verdict", "reason", "rating", "validity"):
        ours, theirs = (one[name].astype(object).fillna("").tolist() for one in (judged, table))
        assert ours == theirs, name


@pytest.mark.parametrize("case", CASES)
def test_a_thousand_designs_are_judged_alike(case, tmp_path, opened):
    designs(tmp_path / "designs.parquet")
    table, judged, _ = judged_by_both(tmp_path, CASES[case], opened)
    assert_alike(judged, table)
    np.testing.assert_allclose(*(one.margin.to_numpy(dtype=float) for one in (judged, table)), rtol=1e-9)
    counts = table.reason.value_counts()
    assert counts[["no_contact", "overturns", "crush", "override", REASONS[case]]].min() >= 5, counts


def test_rows_that_go_on_past_the_horizon_are_confirmed_alike(tmp_path, opened):
    shallow(1200, 5).to_parquet(tmp_path / "designs.parquet")
    table, judged, _ = judged_by_both(tmp_path, (), opened)
    assert_alike(judged, table)
    late = table.end_time_s > 1.0
    for verdict, reason, least in (("pass", "", 15), ("undecided", "validity", 150), ("fail", "overturns", 10)):
        assert (late & (table.verdict == verdict) & (table.reason == reason)).sum() >= least
    assert (late & (table.step_s < 0.004)).sum() >= 3, "some are decided by finer steps"
    # Rocking amplifies last bits: of a few, one of two solutions that hardly differ confirms the other by one alone.
    assert (judged.step_s[late] != table.step_s[late]).sum() <= 0.005 * late.sum()


def test_what_needs_the_last_resort_has_it_in_the_page_too(tmp_path, opened):
    designs(tmp_path / "designs.parquet", 40, damper=0.1)
    table, judged, page = judged_by_both(tmp_path, ("allow_unusual=[vehicle.damper]",), opened)
    assert_alike(judged, table)
    assert (table.step_s[table.verdict != "error"] < 0.0005).sum() >= 20
    shown = page.evaluate("() => page.simulator.whole(page.design).judged")  # refused beyond the limit of rotation
    first = table[table.verdict != "error"].iloc[0]
    assert (shown["verdict"], shown["reason"]) == (first.verdict, first.reason)
    assert shown["max_vehicle_displacement_m"] == pytest.approx(first.max_vehicle_displacement_m)
