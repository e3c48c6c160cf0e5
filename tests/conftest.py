"""Which tests belong to the quick layer, and both crash tests over time, simulated once for all tests."""

from __future__ import annotations

import importlib
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hypothesis
import pytest

if TYPE_CHECKING:
    from boulder_sweep.impact.trajectory import Trajectory

# Two workers on two processors: further threads for linear algebra would be in the way. NumPy and SciPy read this once,
# when they are imported. It does not stay set: processes that tests start have the environment of a user.
with pytest.MonkeyPatch.context() as while_importing:
    while_importing.setenv("OPENBLAS_NUM_THREADS", "1")
    importlib.import_module("scipy.linalg")

# Where CI is set, pytest writes out every line in which two values differ: for lists of all rows it takes more than an
# hour to find them, and shows what nobody reads.
if os.environ.pop("CI", ""):
    os.environ["TESTS_NEED_CHROMIUM"] = "1"

# A busy machine is no reason to fail, and every run tries the same examples unless others are asked for.
hypothesis.settings.register_profile(
    "patient", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow], derandomize=True
)
hypothesis.settings.register_profile("random", hypothesis.settings.get_profile("patient"), derandomize=False)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "patient"))

QUICK = (
    "accuracy/test_same_bits.py",
    "accuracy/test_stability.py",
    "cli/test_check.py",
    "cli/test_run.py",
    "docs/test_documentation.py",
    "docs/test_drift.py",
    "docs/test_register.py",
    "docs/test_words.py",
    "impact/test_error_of_a_design.py",
    "judge/",
    "kernels/test_check_values.py",
    "kernels/test_constants.py",
    "kernels/test_dense_output.py",
    "kernels/test_lanes.py",
    "kernels/test_numerics.py",
    "kernels/test_rigid_wall.py",
    "kernels/test_soil.py",
    "kernels/test_table.py",
    "kernels/test_tableau.py",
    "kernels/test_vehicle.py",
    "oracle/test_constants.py",
    "oracle/test_soil.py",
    "oracle/test_vehicle.py",
    "settings/",
    "store/test_folder.py",
    "store/test_part.py",
    "store/test_provenance.py",
    "test_rooms.py",
)
"""Folders and files whose tests are marked ``quick``: together well under a minute, something of every room."""
NOT_QUICK = ("soils/test_ground.py", "settings/test_fuzz.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the quick layer; what is nightly in it stays out."""
    folder = Path(__file__).parent
    for item in items:
        place = item.path.relative_to(folder).as_posix()
        if place.startswith(QUICK) and not place.startswith(NOT_QUICK) and "nightly" not in item.keywords:
            item.add_marker("quick")


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
NO_NETWORK = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
"""Arguments that keep a browser from asking anybody for anything."""

Trajectories = dict[tuple[str, str], "Trajectory"]
Command = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="session")
def trajectories() -> Trajectories:
    """Both tests under both presets."""
    from boulder_sweep.crash_tests.cases import NAMES, crash_test
    from boulder_sweep.impact.simulation import simulate
    from boulder_sweep.settings.model import PRESETS

    return {(test, preset): simulate(crash_test(test), readings=preset) for test in NAMES for preset in PRESETS}


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """Give a headless browser, one for all tests; without one they are skipped, but not in CI."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        missing = "opens pages in Chromium, which is not installed: apt-get install chromium"
        pytest.fail(missing) if os.environ.get("TESTS_NEED_CHROMIUM") else pytest.skip(missing)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=NO_NETWORK)
        yield browser
        browser.close()


@pytest.fixture
def sweep(capsys: pytest.CaptureFixture[str]) -> Command:
    """Return a function that runs a command in this process and returns exit code, stdout, stderr."""
    from boulder_sweep.cli.main import execute

    def run(*words: object) -> tuple[int, str, str]:
        code = execute([str(word) for word in words])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run
