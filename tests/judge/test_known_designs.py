"""Designs of which independent integrators have told the truth, as files: what every command must say of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest

import boulder_sweep
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.settings.loader import SECOND_OPINION

KNOWN = Path(__file__).parent / "known"


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


def test_what_nobody_has_tested_is_flagged_and_not_robust(table) -> None:
    rows = table("beyond_the_study.csv", SECOND_OPINION).set_index("case_name")
    flags = rows.validity.str.split(";")
    assert len(rows) == 7
    for name, found in flags.items():
        assert ("soil" if name.startswith(("phi", "K_eps")) else "vehicle") in found, name
    assert not rows.robustness.isin(["robust"]).any()
    assert set(rows.verdict) <= {"pass", "undecided", "fail"}


@pytest.mark.parametrize(("accuracy", "within_deg"), [("balanced", 1e-3), ("fine", 2e-4)])
def test_a_boulder_that_the_blow_just_lifts(table, accuracy: str, within_deg: float) -> None:
    by = f"solver.accuracy={accuracy}"
    row = table("barely_lifted.yaml", by).iloc[0]
    assert row.max_rotation_deg == pytest.approx(0.11689, abs=within_deg)
    assert (
        simulate(boulder_sweep.load(KNOWN / "barely_lifted.yaml", [by])).row["max_rotation_deg"] == row.max_rotation_deg
    )
