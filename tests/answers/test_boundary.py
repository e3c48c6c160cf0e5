"""A map from few designs against the whole grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from boulder_sweep.answers.boundary import boundary
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.pilot import accuracy_of
from boulder_sweep.settings import Sweep, load
from tests.answers.designs import random_designs, site

M30 = Path(__file__).parents[2] / "configs" / "m30_sizing.yaml"


def whole(sweep: Sweep) -> tuple[np.ndarray, np.ndarray]:
    """Judge every design of a grid."""
    evaluate = evaluation_of(sweep, accuracy_of(sweep))
    pieces = [evaluate(sweep.block(at, min(at + 8192, sweep.n_designs))) for at in range(0, sweep.n_designs, 8192)]
    return np.concatenate([own.verdict for own in pieces]), np.concatenate([own.reason for own in pieces])


def test_m30_cell_for_cell_from_a_seventh_of_its_designs() -> None:
    """With 19 designs a line, the pair at the change of every line alone is up to a tenth of them."""
    sweep = load(M30)
    found = boundary(sweep)
    verdict, reason = whole(sweep)
    assert np.array_equal(found.verdict, verdict)
    assert np.array_equal(found.reason, reason)
    assert found.share <= 0.14
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


def test_every_change_lies_between_two_simulated_designs() -> None:
    """Where the interpolated change is off by more than its estimated error, the design beside it was only inferred."""
    sweep = site(
        width="{from: 0.8 m, to: 2.4 m, count: 9}",
        height="{from: 2 m, to: 3.8 m, count: 10}",
        site="embedment_ratio: {from: 0.35, to: 0.85, count: 26}",
        friction="40 deg",
    )
    found = boundary(sweep)
    # Two of those beside it were said to pass and overturn.
    assert np.array_equal(found.verdict, whole(sweep)[0])
    passes, simulated = (values.reshape(-1, 26) for values in (found.verdict == PASS, found.simulated))
    begins = passes[:, 1:] & ~passes[:, :-1]
    assert begins.sum() > 20
    assert (simulated[:, 1:] & simulated[:, :-1])[begins].all()
    assert found.share < 0.2


def axis(low: float, high: float, count: int, unit: str = "") -> str:
    return f"{{from: {low:.3f}{unit}, to: {high:.3f}{unit}, count: {count}}}"


def random_grid(kind: str, rng: np.random.Generator) -> dict[str, str]:
    """Return a grid whose longest axis is of some kind."""
    many, few = int(rng.integers(22, 42)), int(rng.integers(5, 10))
    height = (rng.uniform(1.8, 2.4), rng.uniform(3.0, 4.0))
    friction = (rng.uniform(29.0, 36.0), rng.uniform(40.0, 47.0))
    width = axis(0.8, rng.uniform(1.6, 2.5), few, " m")
    if kind == "ratio":
        ratio = axis(rng.uniform(0.35, 0.5), rng.uniform(0.7, 0.85), many)
        own = {"height": axis(*height, few, " m"), "width": width, "site": f"embedment_ratio: {ratio}"}
        return own | {"friction": axis(*friction, 2, " deg"), "length": f"{rng.uniform(0.8, 1.8):.2f} m"}
    if kind == "depth":
        depth = axis(rng.uniform(0.8, 1.2), 1.69, many, " m")
        return {"height": axis(2.2, 3.8, few, " m"), "width": width, "site": f"embedment_depth: {depth}"}
    if kind == "height":
        ratio = axis(rng.uniform(0.4, 0.5), rng.uniform(0.6, 0.8), 6)
        own = {"height": axis(*height, many, " m"), "width": width, "site": f"embedment_ratio: {ratio}"}
        return own | {"friction": axis(*friction, 5, " deg")}
    own = {
        "height": axis(2.6, 3.8, 8, " m"),
        "subgrade": axis(rng.uniform(10, 30), rng.uniform(60, 110), few, " MN/m^3"),
    }
    return own | {"friction": axis(*friction, many, " deg"), "site": "embedment_ratio: [0.5, 0.6, 0.7, 0.75]"}


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["ratio", "depth", "height", "friction"])
def test_of_random_grids_no_design_is_said_to_pass_that_does_not(kind: str) -> None:
    rng = np.random.default_rng(7)
    for _ in range(7):
        sweep = site(**random_grid(kind, rng))
        found = boundary(sweep)
        verdict, _ = whole(sweep)
        assert not ((found.verdict == PASS) & (verdict != PASS)).any()
        assert (found.verdict != verdict).mean() < 0.002
        assert found.share < 0.5


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
