"""Designs of which independent integrators have told the truth, as files: what every command must say of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest

import boulder_sweep
from boulder_sweep.answers.placing import boulder_block, placed
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.settings.loader import SECOND_OPINION
from boulder_sweep.stones.weighing import scanned
from tests.conftest import Command

KNOWN = Path(__file__).parent / "known"
ROCK = Path(__file__).parents[2] / "docs" / "examples" / "rock.ply"


@pytest.fixture
def table(tmp_path: Path):
    """Return a function that runs a file of known designs, or a list of them, and returns its rows."""

    def table(name: str, *overrides: str, accuracy: str = "balanced") -> pd.DataFrame:
        file = KNOWN / name
        if file.suffix == ".csv":
            shutil.copy(file, tmp_path)
            (tmp_path / "list.yaml").write_text(f"table: {name}\nsolver: {{accuracy: {accuracy}}}\n")
            file = tmp_path / "list.yaml"
        sweep = boulder_sweep.load(file, overrides)
        boulder_sweep.run(sweep, tmp_path / "table", overwrite=True)
        return boulder_sweep.read(tmp_path / "table")

    return table


@pytest.fixture
def rock_beside(tmp_path: Path):
    """Return a function that copies a file beside the scan that it names."""

    def rock_beside(name: str) -> Path:
        (tmp_path / "examples").mkdir(exist_ok=True)
        shutil.copy(ROCK, tmp_path / "examples")
        return Path(shutil.copy(KNOWN / name, tmp_path))

    return rock_beside


@pytest.mark.parametrize(("name", "chance"), [("broad.yaml", 0.086), ("wide.yaml", 0.61)])
def test_a_pass_in_weak_soil_that_overturns_in_better_is_no_pass(table, name: str, chance: float) -> None:
    row = table(name).iloc[0]
    assert (row.verdict, row.reason) == ("fail", "overturns")
    assert "changes_side" in row.validity.split(";")
    stated = simulate(KNOWN / name)
    assert (stated.verdict, stated.row["time_to_limit_s"]) == ("fail", row.time_to_limit_s)
    drawn = boulder_sweep.uncertainty(boulder_sweep.load(KNOWN / name)).frame.iloc[0]
    # What is undecided, and what a slower truck overturns, counted as no pass.
    assert drawn.p_pass <= chance + 0.015
    assert drawn.p_pass + drawn.p_undecided >= chance - 0.05


def test_a_slower_truck_overturns_a_boulder_that_slides(table) -> None:
    row = table("slides.yaml").iloc[0]
    assert (row.verdict, row.reason) == ("fail", "slower_truck")
    slower = table("slides.yaml", "vehicle.speed=12.6 m/s").iloc[0]
    assert slower.reason == "overturns"
    assert slower.time_to_limit_s == pytest.approx(3.5564, abs=2e-3)


def test_what_nobody_has_tested_is_flagged_and_not_robust(table) -> None:
    rows = table("beyond_the_study.csv", SECOND_OPINION).set_index("case_name")
    flags = rows.validity.str.split(";")
    assert len(rows) == 7
    for name, found in flags.items():
        assert ("soil" if name.startswith(("phi", "K_eps")) else "vehicle") in found, name
    assert not rows.robustness.isin(["robust"]).any()
    assert set(rows.verdict) <= {"pass", "undecided", "fail"}


def test_fast_leaves_open_what_overturns_late(table) -> None:
    fast = table("nearly_20_deg.csv", accuracy="fast").iloc[0]
    assert (fast.verdict, fast.reason) == ("undecided", "horizon")
    late = table("nearly_20_deg.csv").iloc[0]
    assert (late.verdict, late.reason) == ("fail", "overturns")
    assert late.time_to_limit_s == pytest.approx(3.8137, abs=2e-3)


def test_a_history_goes_on_as_long_as_its_row(table) -> None:
    row = table("moves_on.csv").iloc[0]
    assert row.max_rotation_deg == pytest.approx(15.562, abs=1e-3)
    stated = simulate(row.dropna().to_dict())
    assert stated.row["max_rotation_deg"] == row.max_rotation_deg
    assert stated.time_s[-1] >= row.end_time_s > 1.0


@pytest.mark.parametrize(("accuracy", "within_deg"), [("balanced", 1e-3), ("fine", 2e-4)])
def test_a_boulder_that_the_blow_just_lifts(table, accuracy: str, within_deg: float) -> None:
    by = f"solver.accuracy={accuracy}"
    row = table("barely_lifted.yaml", by).iloc[0]
    assert row.max_rotation_deg == pytest.approx(0.11689, abs=within_deg)
    assert (
        simulate(boulder_sweep.load(KNOWN / "barely_lifted.yaml", [by])).row["max_rotation_deg"] == row.max_rotation_deg
    )


def test_an_island_is_told_alike_and_never_recommended(tmp_path: Path) -> None:
    site = KNOWN / "lying_stone.yaml"
    sweep = boulder_sweep.load(site, ["soil.friction_angle=40 deg"])
    boulder_sweep.run(sweep, tmp_path / "table")
    row = boulder_sweep.read(tmp_path / "table").iloc[0]
    stated = simulate(sweep)
    assert row.max_rotation_deg == stated.row["max_rotation_deg"] == pytest.approx(9.13, abs=0.01)
    assert row.verdict == stated.verdict != "pass"
    deeper = simulate(boulder_sweep.load(site, ["soil.friction_angle=40 deg", "site.embedment_depth=0.8 m"]))
    assert (deeper.verdict, deeper.reason) == ("fail", "overturns")


def test_a_stone_of_no_known_shape_is_undecided_and_not_hopeless() -> None:
    slip = "boulder.density=6500 kg/m^3"  # by which it would fill less than 40 % of its sizes
    weighed = boulder_sweep.load(KNOWN / "weighed.yaml", ["site.embedment_depth=2.4 m", slip])
    drawn = boulder_sweep.uncertainty(weighed).frame.iloc[0]
    assert (drawn.p_undecided, drawn.p_undecided_reason) == (1.0, "shape")
    assert drawn.p_pass_high == 1.0
    dense = boulder_sweep.load(KNOWN / "weighed.yaml", ["site.embedment_depth=2.4 m", "boulder.density=2485 kg/m^3"])
    assert boulder_sweep.uncertainty(dense).frame.iloc[0].p_pass == pytest.approx(1.0, abs=1e-3)


def test_what_stone_recommends_passes_where_it_is_pasted(rock_beside) -> None:
    site = rock_beside("weighed.yaml")
    found = scanned(site.parent / "examples" / "rock.ply", mass_kg=23_500.0)

    def with_boulder(block: str) -> boulder_sweep.Sweep:
        return boulder_sweep.load(site, [block])

    ways = placed(found, with_boulder, found.standings[:4]).passing
    assert ways
    for way in ways:
        depth = f"site.embedment_depth={way.depth_m} m"
        pasted = boulder_sweep.load(site, [boulder_block(found, way.standing), depth])
        assert simulate(pasted).verdict == "pass"


def test_an_answer_for_a_probability_has_no_grade_of_the_mean_soil(sweep: Command) -> None:
    file = KNOWN / "embassy_gate.yaml"
    likely = boulder_sweep.need(boulder_sweep.load(file), probability="95%").frame
    assert likely.robustness.isna().all()
    code, out, _ = sweep("need", file, "--probability", "95%", "--units", "us")
    assert code == 0
    assert "robust" not in out
