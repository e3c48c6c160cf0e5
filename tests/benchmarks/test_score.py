"""The open benchmark: its file is what the oracle says, and a solver that is wrong is scored as wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from benchmarks import score as scoring
from benchmarks.boulders import FILE, REFERENCE
from benchmarks.boulders.__main__ import COUNTS, families, reference

TRUTH = pd.read_parquet(FILE)
README = (Path(scoring.__file__).parent / "README.md").read_text(encoding="utf-8")


def results(**changed: object) -> pd.DataFrame:
    return TRUTH[["design_id", *REFERENCE]].assign(**changed)


def test_the_designs_are_those_that_are_drawn() -> None:
    drawn = [(name, row) for name, rows in families() for row in rows]
    assert TRUTH.family.value_counts().to_dict() == {"crash test": 2, **COUNTS}
    assert [name for name, _ in drawn] == TRUTH.family.tolist()
    inputs = pd.DataFrame([row for _, row in drawn])
    pd.testing.assert_frame_equal(TRUTH[inputs.columns], inputs, rtol=1e-13)


@pytest.mark.parametrize("row", [0, 1, pytest.param(200, marks=pytest.mark.nightly), *(
    pytest.param(row, marks=pytest.mark.nightly) for row in range(10, 272, 17)
)])  # fmt: skip
def test_the_reference_is_that_of_the_oracle(row: int) -> None:
    inputs = {name: float(TRUTH[name][row]) for name in TRUTH if name not in ("design_id", "family", *REFERENCE)}
    found = np.array(reference(inputs, 1e-9))
    np.testing.assert_allclose(found, TRUTH.loc[row, list(REFERENCE)].to_numpy(dtype=float), rtol=1e-7)


def test_every_column_has_its_unit_and_the_file_says_what_it_is() -> None:
    schema = pq.read_schema(FILE)
    assert all({b"unit", b"meaning"} <= set(schema.field(name).metadata) for name in schema.names[2:])
    about = json.loads(schema.metadata[b"benchmark"])
    assert max(about["largest difference by a tolerance of 1e-9"].values()) < 1e-5


def test_the_reference_itself_is_without_fault() -> None:
    assert set(scoring.score(results(), TRUTH).values()) == {0.0}


def test_designs_on_the_wrong_side_are_counted() -> None:
    stands = TRUTH.time_to_limit_s.isna()
    time = TRUTH.time_to_limit_s.copy()
    time[[stands.idxmin(), stands.idxmax()]] = [np.nan, 0.1]
    scores = scoring.score(results(time_to_limit_s=time), TRUTH)
    assert (scores["unsafe"], scores["overcautious"], scores["missing"]) == (1, 1, 0)


def test_missing_designs_are_counted() -> None:
    rotation = TRUTH.max_rotation_deg.copy()
    rotation[3] = np.nan
    assert scoring.score(results(max_rotation_deg=rotation)[:-2], TRUTH)["missing"] == 3


def test_differences_are_those_of_the_worst_design() -> None:
    rotation, force = TRUTH.max_rotation_deg.copy(), TRUTH.peak_force_kN.copy()
    rotation[7] += 0.5
    force[7] *= 1.01
    scores = scoring.score(results(max_rotation_deg=rotation, peak_force_kN=force), TRUTH)
    assert scores["max_rotation_deg largest"] == pytest.approx(0.5)
    assert scores["peak_force_kN largest"] == pytest.approx(0.01)
    assert scores["max_displacement_m largest"] == 0.0


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (TRUTH[["max_rotation_deg"]], "no column design_id"),
        (TRUTH[["design_id", "max_rotation_deg"]], "no column time_to_limit_s"),
        (pd.concat([results(), results()[5:6]]), "design_id 5 occurs twice"),
    ],
)
def test_tables_that_cannot_be_scored_are_refused_in_words(table: pd.DataFrame, words: str) -> None:
    with pytest.raises(SystemExit, match=words):
        scoring.score(table, TRUTH)


def test_a_file_of_results_is_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results().to_parquet(tmp_path / "own.parquet")
    assert scoring.main([str(tmp_path / "own.parquet")]) == 0
    assert "| 0 | 0 | 0 | 0 / 0 | 0 / 0 | 0 / 0 | 0 / 0 | 0 / 0 |" in capsys.readouterr().out
    results(time_to_limit_s=0.1).to_parquet(tmp_path / "own.parquet")
    assert scoring.main([str(tmp_path / "own.parquet")]) == 1
    with pytest.raises(SystemExit, match="no such file"):
        scoring.main([str(tmp_path / "none.parquet")])


def test_the_scores_of_the_readme_are_those_of_the_default_accuracy() -> None:
    scores = scoring.score(scoring.own_results("balanced", TRUTH), TRUTH)
    (row,) = scoring.scores_table({"`balanced`": scores}).rows
    assert f"| {' | '.join(row)} |" in README
