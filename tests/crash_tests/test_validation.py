"""`sweep validate`: the statements of the paper, and the files it writes."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from boulder_sweep.crash_tests.cases import convergence, statements
from boulder_sweep.crash_tests.validation import Validation
from tests.conftest import Command


def test_every_statement_of_the_paper_holds_or_cannot_be_checked(found: Validation) -> None:
    assert found.holds
    assert [statement.holds for statement in found.statements].count(True) == 8
    assert [statement.holds for statement in found.statements].count(None) == 3
    assert {statement.section for statement in found.statements} == {"3.1", "3.2", "3.3", "3.4", "4"}


def test_a_contradiction_is_seen(found: Validation) -> None:
    swapped = {
        ("abg" if test == "rwg" else "rwg", preset): trajectory
        for (test, preset), trajectory in found.trajectories.items()
    }
    wrong = statements(swapped, found.convergence, found.wall)
    assert [statement.holds for statement in wrong].count(False) >= 5
    assert not dataclasses.replace(found, statements=wrong).holds


def test_table_shows_both_tests_under_both_presets(found: Validation) -> None:
    table = found.table()
    assert [(row[0], row[1]) for row in table.rows] == [
        ("American Black Granite", "as printed"),
        ("American Black Granite", "corrected"),
        ("Rockville White Granite", "as printed"),
        ("Rockville White Granite", "corrected"),
    ]
    assert "3.5016 *" in found.text()
    assert "* still moving" in found.text()
    json.dumps(found.to_dict(), allow_nan=False)


def test_element_sums_approach_the_closed_form(found: Validation) -> None:
    study = found.convergence
    assert study.order("rwg", "as_printed") == pytest.approx(1.0, abs=0.05)
    assert study.order("rwg", "corrected") == pytest.approx(2.0, abs=0.1)
    assert study.rotation_deg["rwg", "as_printed", 5000] == pytest.approx(7.6963, abs=6e-5)
    assert study.rotation_deg["rwg", "as_printed", 2000] == pytest.approx(7.6997, abs=6e-5)
    assert study.rotation_deg["rwg", "as_printed", 0] == pytest.approx(7.6940, abs=6e-5)
    assert convergence([50]).elements == (50,)


@pytest.mark.nightly
def test_command_writes_pictures_and_tables(sweep: Command, tmp_path: Path) -> None:
    code, out, err = sweep("validate", "-o", tmp_path / "v")
    assert (code, err) == (0, "")
    assert "measured curves of the paper are in its figures, not in its text" in out
    names = sorted(path.name for path in (tmp_path / "v").iterdir())
    assert names == [
        "convergence.parquet",
        "convergence.png",
        "crash_tests.parquet",
        "figure_10_rigid_wall.png",
        "figures_12_to_14_abg.png",
        "figures_16_to_18_rwg.png",
        "statements.parquet",
        "trajectories.parquet",
    ]
    histories = pd.read_parquet(tmp_path / "v" / "trajectories.parquet")
    assert len(histories) == 4 * 1001
    peak = histories.groupby(["test", "preset"], observed=True).rotation_rad.max()
    assert np.degrees(peak["rwg", "corrected"]) == pytest.approx(13.761, abs=1e-3)
    rows = pd.read_parquet(tmp_path / "v" / "crash_tests.parquet")
    assert list(rows.verdict) == ["fail", "fail", "undecided", "pass"]


@pytest.mark.usefixtures("known_study")
def test_command_without_a_folder_writes_nothing(
    sweep: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, _ = sweep("validate", "--json")
    assert code == 0
    assert json.loads(out)["files"] == []
    assert list(tmp_path.iterdir()) == []
