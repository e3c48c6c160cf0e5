"""The command that resumes a run."""

from __future__ import annotations

from pathlib import Path

import pytest

import boulder_sweep
from boulder_sweep.runner.run import resuming
from tests.runner.grids import grid

RWG = Path(__file__).parents[2] / "configs" / "rwg.yaml"


@pytest.mark.parametrize(
    ("replaced", "how", "words"),
    [
        ([], (None, "threading", None), "-o out --resume"),
        ([], (3, "dask", "tcp://x:1"), "-o out --jobs 3 --backend dask --scheduler tcp://x:1 --resume"),
        (
            ["vehicle.speed=50 mph", "--accuracy=fine"],
            (None, "threading", None),
            "-o out --set 'vehicle.speed=50 mph' --accuracy fine --resume",
        ),
    ],
)
def test_a_run_is_resumed_as_it_was_started(replaced, how, words) -> None:
    assert resuming(boulder_sweep.load(RWG, replaced), Path("out"), *how) == f"sweep run {RWG} {words}"


def test_a_file_that_is_none_has_its_name() -> None:
    assert resuming(grid(), Path("out"), None, "threading", None) == "sweep run test.yaml -o out --resume"
