"""Both crash tests over time, simulated once for all tests."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.impact.trajectory import Trajectory
from boulder_sweep.settings.model import PRESETS

Trajectories = dict[tuple[str, str], Trajectory]
Command = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="session")
def trajectories() -> Trajectories:
    """Both tests under both presets."""
    return {(test, preset): simulate(crash_test(test), readings=preset) for test in NAMES for preset in PRESETS}


@pytest.fixture
def sweep(capsys: pytest.CaptureFixture[str]) -> Command:
    """Return a function that runs a command in this process and returns exit code, stdout, stderr."""
    from boulder_sweep.cli.main import execute

    def run(*words: object) -> tuple[int, str, str]:
        code = execute([str(word) for word in words])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run
