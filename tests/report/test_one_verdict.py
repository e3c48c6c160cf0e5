"""Whoever asks about a design, by whichever command, is told the same of it: verdict, reason and rotation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import boulder_sweep
from benchmarks.flips import RANGES
from boulder_sweep.answers.placing import placed
from boulder_sweep.answers.reserves import capacity
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.report import write_explorer
from boulder_sweep.settings import Sweep
from boulder_sweep.stones.weighing import scanned
from tests.answers.designs import bare_need
from tests.report.test_verdicts import designs, shallow
from tests.stones.shapes import box, written

DESIGNS = 200
"""Half of them usual, half of them shallow: many of these slide, are late, or fall to a slower truck."""
TOLD = ["verdict", "reason", "max_rotation_deg"]
UNCERTAIN = """\
name: uncertain
boulder: {length: 1.65 m, width: 1.68 m, height: [3.0, 3.4] m, density: 2600 kg/m^3}
site: {embedment_ratio: {from: 0.12, to: 0.72, count: 6}}
soil:
  density: 1860 kg/m^3
  friction_angle: {mean: 38 deg, sd: 3 deg}
  subgrade_reaction: {mean: 60 MN/m^3, cov: 20 %}
vehicle: {mass: 15000 lb, speed: [6 m/s, 13.41 m/s], spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""
STONE = "boulder: {length: 1.2 m, width: 1.6 m, height: 2.5 m, density: 2600 kg/m^3}"


def broad(n: int) -> pd.DataFrame:
    """Draw shallow, broad boulders in weak soil, which slide, before trucks of 15,000 lb at about 30 mph."""
    rng = np.random.default_rng(5)
    ranges = RANGES | {
        "boulder_length_m": (1.9, 2.1),
        "boulder_width_m": (2.2, 2.6),
        "boulder_height_m": (1.9, 2.1),
        "embedment_ratio": (0.25, 0.42),
        "soil_density_kg_m3": (1800.0, 1900.0),
        "friction_angle_deg": (30.0, 34.0),
        "subgrade_reaction_MN_m3": (25.0, 35.0),
        "strain_rate_factor": (1.0, 1.0),
        "vehicle_mass_kg": (6700.0, 6900.0),
        "impact_speed_m_s": (12.0, 14.0),
        "vehicle_spring_N_m": (3.0e6, 3.2e6),
        "vehicle_damper_N_s_m": (1.35e5, 1.43e5),
    }
    rows = pd.DataFrame({name: rng.uniform(*ends, n) for name, ends in ranges.items()})
    rows["embedment_depth_m"] = rows.pop("embedment_ratio") * rows.boulder_height_m
    return rows


def listed(folder: Path, rows: pd.DataFrame) -> Sweep:
    """Write designs as a table, and load the file that lists them."""
    rows.to_parquet(folder / "designs.parquet", index=False)
    (folder / "listed.yaml").write_text("table: designs.parquet\nallow_unusual: all\n")
    return boulder_sweep.load(folder / "listed.yaml")


def ran(sweep: Sweep, folder: Path) -> pd.DataFrame:
    """Run a sweep and return its table."""
    out = folder / f"{sweep.name}.sweep"
    boulder_sweep.run(sweep, out, overwrite=True)
    return boulder_sweep.read(out)


def told(frame: pd.DataFrame) -> list[tuple[Any, ...]]:
    """Return what a table says of each row; empty words where it says nothing."""
    rows = frame[TOLD].astype(object)
    return list(rows.where(rows.notna(), "").itertuples(index=False, name=None))


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Sweep, pd.DataFrame]:
    """The designs, and the table that `sweep run` writes of them."""
    folder = tmp_path_factory.mktemp("one")
    designs(folder / "usual.parquet", DESIGNS // 2)
    usual = pd.read_parquet(folder / "usual.parquet").drop(columns="impact_height_m").assign(strain_rate_factor=1.0)
    usual["bed_offset_m"] = 2.9
    low = shallow(DESIGNS // 4, 11).assign(bed_offset_m=2.9)
    sweep = listed(folder, pd.concat([usual, low, broad(DESIGNS // 4)], ignore_index=True))
    return sweep, ran(sweep, folder)


def test_the_designs_are_of_every_kind(asked):
    _, table = asked
    assert len(table) == DESIGNS
    counts = table.reason.fillna("pass").value_counts()
    for reason, least in (("overturns", 30), ("validity", 20), ("override", 10), ("slower_truck", 1)):
        assert counts[reason] >= least, counts
    assert (table.verdict == "pass").sum() >= 40
    assert (table.end_time_s > 1.0).sum() >= 40


def test_simulate_states_the_row(asked):
    sweep, table = asked
    stated = pd.DataFrame(
        [boulder_sweep.simulate(sweep, k).summary() for k in np.flatnonzero(table.verdict != "error")]
    )
    assert told(stated) == told(table[table.verdict != "error"])


def test_the_page_judges_alike(asked, tmp_path, opened):
    sweep, table = asked
    page = opened(write_explorer(sweep, int(np.flatnonzero(table.verdict == "pass")[0]), tmp_path / "page.html"))
    inputs = [{name: float(table[name][k]) for name in sweep.plan.columns} for k in range(len(table))]
    judged = pd.DataFrame(page.evaluate("(designs) => page.simulator.rows(designs)", inputs))
    assert [row[:2] for row in told(judged)] == [row[:2] for row in told(table)]
    ours, theirs = (one.max_rotation_deg.to_numpy(dtype=float) for one in (judged, table))
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)


def test_capacity_states_the_row_and_what_it_says_follows_from_it(asked):
    _, table = asked
    found = capacity(asked[0]).frame
    assert told(found) == told(table)
    own, withstood = found.impact_speed_m_s.astype(float), found.withstands_speed_m_s
    assert not (withstood >= own)[found.verdict != "pass"].any()
    short = found[(found.verdict == "pass") & ~(withstood > own - 0.01)]
    assert set(short.speed_found) <= {"not_monotone", "unknown"}
    assert len(short) <= 0.05 * len(found), "a slower truck overturns hardly any design that passes"


def test_what_need_finds_is_the_row_of_that_design(asked, tmp_path):
    sweep, table = asked
    found = bare_need(sweep, "embedment_depth").frame
    answered = found[found.embedment_depth_m.notna() & found.found.isin(["found", "always"])]
    assert len(answered) >= 100
    kept = [name for name in table.columns if name in answered.columns and name in sweep.plan.given]
    again = ran(listed(tmp_path, answered[kept].astype(float)), tmp_path)
    assert told(again) == told(answered)
    assert set(again.verdict) == {"pass"}
    # From the least depth on everything passes, the design's own depth too.
    deeper = (answered.embedment_depth_m.astype(float) <= table.embedment_depth_m[answered.index]).to_numpy()
    own = table.loc[answered.index[deeper]]
    assert deeper.sum() >= 20
    assert set(own.verdict[~own.reason.isin(["override", "no_contact"])]) == {"pass"}


def test_what_stone_recommends_is_the_row_of_that_design(asked, tmp_path):
    """In soils and before trucks of every eighth design, each asked for the same block."""
    _, table = asked
    found = scanned(written(box(1.2, 1.6, 2.5), tmp_path / "block.ply"), mass_kg=2600.0 * 1.2 * 1.6 * 2.5)
    way = (found.stone.standing("a", "c"),)
    others = [name for name in table.columns if name in asked[0].plan.given]
    others = [name for name in others if not name.startswith(("boulder_", "embedment_"))]
    depths = []
    for number in range(0, DESIGNS, 8):
        table.loc[[number], others].astype(float).to_parquet(tmp_path / "site.parquet", index=False)
        file = tmp_path / "site.yaml"
        file.write_text(f"table: site.parquet\n{STONE}\nsite: {{embedment_depth: 1 m}}\nallow_unusual: all\n")
        recommended = placed(found, lambda boulder, file=file: boulder_sweep.load(file, [boulder]), way).ways[0]
        if recommended.depth_m is None:
            continue
        pasted = boulder_sweep.load(file, [f"site.embedment_depth={recommended.depth_m} m"])
        again = ran(pasted, tmp_path).iloc[0]
        assert (again.verdict, recommended.row["verdict"]) == ("pass", "pass")
        # The block is an outline there, and a box here.
        assert again.max_rotation_deg == pytest.approx(recommended.row["max_rotation_deg"], abs=0.02)
        depths.append(recommended.depth_m)
    assert len(depths) >= 4


def test_uncertain_soil_is_judged_alike_by_all(tmp_path):
    (tmp_path / "uncertain.yaml").write_text(UNCERTAIN)
    sweep = boulder_sweep.load(tmp_path / "uncertain.yaml")
    table = ran(sweep, tmp_path)
    stated = pd.DataFrame([boulder_sweep.simulate(sweep, k).summary() for k in range(len(table))])
    assert told(stated) == told(table)
    assert told(capacity(sweep).frame) == told(table)
    assert table.validity.str.contains("changes_side").sum() >= 2
    judged = [ran(case, tmp_path).verdict for case in (at_values(sweep, "mean"), *at_values(sweep).cases)]
    passes = (table.verdict == "pass").to_numpy()
    assert passes.sum() >= 4
    for verdict in judged:
        assert (verdict[passes] == "pass").all()
