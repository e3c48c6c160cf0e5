"""The chance of passing, and what decides it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from scipy.special import ndtr

from boulder_sweep.answers.chance import FIRST, Points
from boulder_sweep.answers.printing import uncertainty_lines
from boulder_sweep.answers.uncertainty import drivers, uncertainty
from boulder_sweep.errors import PictureError, QuestionError
from tests.answers.designs import bare_need, site

UNCERTAIN = {"height": "3.2 m", "site": "embedment_depth: 2.2 m", "friction": "{mean: 38 deg, sd: 3 deg}"}


def test_chance_follows_from_the_least_friction_angle() -> None:
    """With one uncertain input the design passes from its least friction angle on, and the chance is known."""
    least = bare_need(site(**UNCERTAIN | {"friction": "38 deg"}), "friction_angle").frame.passes_at[0]
    exact = ndtr((38.0 - least) / 3.0)
    found = uncertainty(site(**UNCERTAIN), half_width=0.002, confidence=0.99).frame.iloc[0]
    assert found.p_pass_low - 5e-4 <= exact <= found.p_pass_high + 5e-4  # 0.01 deg of the lattice is 0.1 %
    assert found.verdict == "pass"
    assert found.p_pass_driver == "soil.friction_angle"


def test_every_row_has_its_chance() -> None:
    sweep = site(**UNCERTAIN | {"height": "[3.1, 3.3, 3.5] m", "friction": "{mean: [34, 38, 42] deg, sd: 3 deg}"})
    frame = uncertainty(sweep).frame
    assert len(frame) == 9
    assert (frame.p_pass_high - frame.p_pass_low <= 0.02).all()
    assert frame.p_pass.between(frame.p_pass_low, frame.p_pass_high).all()
    by_angle = frame.p_pass.to_numpy().reshape(3, 3)
    assert (np.diff(by_angle, axis=1) > 0.0).all(), "the last axis of the file is the friction angle"


def test_does_not_depend_on_threads() -> None:
    one, two = (uncertainty(site(**UNCERTAIN), jobs=jobs) for jobs in (1, 2))
    assert one.arrow.equals(two.arrow)
    assert one.samples.equals(two.samples)
    assert not uncertainty(site(**UNCERTAIN), seed=1).arrow.equals(one.arrow)


def test_margin_lowers_the_chance() -> None:
    plain, more = (uncertainty(site(**UNCERTAIN), margin=margin).frame.p_pass[0] for margin in (0.0, "25 %"))
    assert more < plain - 0.1


def test_a_varying_input_is_named_that_decides() -> None:
    sweep = site(**UNCERTAIN | {"subgrade": "{distribution: lognormal, mean: 60 MN/m^3, cov: 40 %}"})
    found = uncertainty(sweep)
    assert found.frame.p_pass_driver[0] == "soil.friction_angle"
    assert any("soil.friction_angle" in line for line in uncertainty_lines(found))
    assert all(len(line) <= 80 for line in uncertainty_lines(found))


def test_driver_is_the_input_that_decides() -> None:
    z = Points(3, 0).upto(FIRST).reshape(-1, 3)
    outputs = np.stack([z[:, 0] + 0.3 * z[:, 1], z[:, 2] ** 3 - z[:, 0], (z[:, 1] > 0.5).astype(float)])
    assert drivers(z, outputs).tolist() == [0, 2, 1]


def test_what_does_not_vary_has_no_driver() -> None:
    assert drivers(np.random.default_rng(1).standard_normal((512, 2)), np.ones((1, 512))).tolist() == [-1]


def test_depth_for_a_probability() -> None:
    sweep = site(**UNCERTAIN)
    row = bare_need(sweep, "embedment_depth", probability="95 %").frame.iloc[0]
    assert row.found == "found"
    assert row.p_pass >= 0.95 > row.p_pass_low
    depth = f"embedment_depth: {row.passes_at} m"
    there = uncertainty(site(**UNCERTAIN | {"site": depth}), half_width=0.003, seed=7).frame.iloc[0]
    assert there.p_pass == pytest.approx(0.95, abs=0.006)
    certain = bare_need(site(**UNCERTAIN | {"friction": "38 deg"})).frame.passes_at[0]
    assert row.passes_at > certain


def test_files(tmp_path: Path) -> None:
    found = uncertainty(site(**UNCERTAIN))
    files = found.write(tmp_path / "chance.parquet")
    assert [file.name for file in files] == ["chance.parquet", "chance.samples.parquet"]
    frame = pd.read_parquet(files[0])
    assert frame.attrs["meanings"]["p_pass"].startswith("chance")
    assert json.loads(pq.read_schema(files[0]).metadata[b"boulder_sweep.question"])["seed"] == 0
    samples = pd.read_parquet(files[1])
    assert (samples.distance > 0).mean() == pytest.approx(frame.p_pass[0], abs=0.02)


def test_picture(tmp_path: Path) -> None:
    found = uncertainty(site(**UNCERTAIN))
    found.plot(tmp_path / "chance.png")
    assert (tmp_path / "chance.png").stat().st_size > 10_000
    with pytest.raises(PictureError, match="no samples of design 3"):
        found.plot(tmp_path / "none.png", 3)


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ({"half_width": "0"}, "must be between"),
        ({"confidence": "101 %"}, "less than 100 %"),
        ({"margin": "a"}, "is not a number"),
        ({"seed": -1}, "--seed -1: must not be negative"),
    ],
)
def test_wrong_numbers_are_refused(question: dict[str, str | int], message: str) -> None:
    with pytest.raises(QuestionError, match=message):
        uncertainty(site(**UNCERTAIN), **question)
