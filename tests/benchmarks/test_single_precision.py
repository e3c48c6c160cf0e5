"""The kernels in single precision, which the benchmarks compile to see whether it would pay."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import boulder_kernels as bk
from benchmarks.accuracy import control
from benchmarks.designs import sample
from benchmarks.single_precision import load_single_precision, simulated, single_control
from boulder_kernels import lanes as double_lanes

ROOT = Path(__file__).parents[2]


def test_the_kernels_are_all_read_in_single_precision() -> None:
    """Without compiling them, in a process of its own: which modules there are is not written down a second time."""
    script = "from benchmarks.single_precision import load_single_precision as load; print(load().__name__)"
    found = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout == "boulder_kernels_single.lanes\n"


@pytest.mark.nightly
@pytest.mark.compiled
def test_same_outcomes_up_to_rounding_and_nothing_left_in_double() -> None:
    designs = sample(200)
    single = load_single_precision()
    found = simulated(single, designs, single_control(8.0))
    known = simulated(double_lanes, designs, control(0.008))
    alike = found.status == known.status
    assert alike.mean() > 0.97
    standing = alike & (known.status != bk.Status.LIMIT)
    assert standing.sum() > 10
    difference = np.abs(found.theta_max - known.theta_max)[standing]
    assert 0.0 < difference.max() < np.radians(1e-3)
    code = "".join(single.attempt_steps.inspect_asm().values())
    assert not re.findall(r"\bv\w+pd\s", code)
