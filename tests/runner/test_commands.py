"""The commands that repeat or resume a run."""

from __future__ import annotations

import shlex
from pathlib import Path

import boulder_sweep
from boulder_sweep.runner.running import repeat_command, resume_command
from tests.runner.grids import grid

RWG = Path(__file__).parents[2] / "configs" / "rwg.yaml"


def test_what_replaced_entries_of_the_file_is_repeated() -> None:
    sweep = boulder_sweep.load(RWG, ["vehicle.speed=50 mph", "--accuracy=fine"])
    expected = ["sweep", "run", "rwg.yaml", "--set", "vehicle.speed=50 mph", "--accuracy", "fine"]
    assert shlex.split(repeat_command(sweep)) == expected
    resume = resume_command(sweep, Path("out"), None, "threading", None)
    assert "--set 'vehicle.speed=50 mph' --accuracy fine --resume" in resume


def test_a_file_alone_needs_no_options() -> None:
    assert repeat_command(boulder_sweep.load(RWG)) == "sweep run rwg.yaml"
    assert repeat_command(grid()) == "sweep run test.yaml"
