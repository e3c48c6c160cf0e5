"""A map from few designs against the whole grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from boulder_sweep.answers.boundary import boundary
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.pilot import accuracy_of
from boulder_sweep.settings import Sweep, load
from tests.answers.designs import random_designs, site

M30 = Path(__file__).parents[2] / "configs" / "m30_sizing.yaml"


def whole(sweep: Sweep) -> tuple[np.ndarray, np.ndarray]:
    """Judge every design of a grid."""
    evaluate = evaluation_of(sweep, accuracy_of(sweep))
    pieces = [evaluate(sweep.block(at, min(at + 8192, sweep.n_designs))) for at in range(0, sweep.n_designs, 8192)]
    return np.concatenate([own.verdict for own in pieces]), np.concatenate([own.reason for own in pieces])


def test_m30_cell_for_cell_from_a_tenth_of_its_designs() -> None:
    sweep = load(M30)
    found = boundary(sweep)
    verdict, reason = whole(sweep)
    assert np.array_equal(found.verdict, verdict)
    assert np.array_equal(found.reason, reason)
    assert found.share <= 0.10
    assert found.simulations >= found.simulated.sum()
    assert sum(found.counts().values()) == sweep.n_designs


@pytest.mark.parametrize(
    "changes",
    [
        {
            "height": "{from: 2.4 m, to: 3.6 m, count: 7}",
            "site": "embedment_depth: {from: 1.5 m, to: 2.3 m, count: 33}",
        },
        {"height": "{from: 2.4 m, to: 3.6 m, count: 25}", "site": "embedment_ratio: [0.5, 0.6, 0.7]"},
        {"height": "3 m", "friction": "{from: 34 deg, to: 44 deg, count: 41}"},
        {"height": "3 m", "friction": "40 deg", "subgrade": "{from: 20 MN/m^3, to: 100 MN/m^3, count: 17}"},
    ],
)
def test_other_grids_cell_for_cell(changes: dict[str, str]) -> None:
    sweep = site(**changes)
    found = boundary(sweep)
    assert np.array_equal(found.verdict, whole(sweep)[0])
    assert found.simulated.sum() < sweep.n_designs


def test_threads_do_not_matter() -> None:
    sweep = site(height="{from: 2.4 m, to: 3.6 m, count: 25}", site="embedment_ratio: [0.5, 0.6, 0.7]")
    one, two = (boundary(sweep, jobs=jobs) for jobs in (1, 2))
    assert np.array_equal(one.verdict, two.verdict)
    assert np.array_equal(one.simulated, two.simulated)


def test_table_and_picture(tmp_path: Path) -> None:
    sweep = site(height="{from: 2.4 m, to: 3.6 m, count: 25}", site="embedment_ratio: [0.5, 0.6, 0.7]")
    found = boundary(sweep)
    frame = pd.read_parquet(found.write(tmp_path / "map.parquet"))
    assert len(frame) == sweep.n_designs
    assert (frame.verdict == "pass").sum() == found.counts()["pass"]
    found.plot(tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_lists_have_no_map() -> None:
    with pytest.raises(QuestionError, match="needs a grid"):
        boundary(random_designs(5))
    with pytest.raises(QuestionError, match="cannot be computed"):
        boundary(site(height="[1.5, 2.6, 3.0] m"))
