"""Long sums: all elements once, and the same bits on every processor."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import llvmlite.binding
import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.dynamics import fill_soil, profile_of
from boulder_kernels.numerics import WIDTH
from boulder_kernels.pieces import reaction_of_elements, uniform_layers
from boulder_kernels.soil import Kinematics, element_sums

from .samples import random_designs

ROOT = Path(__file__).parents[2]
_FEATURES = llvmlite.binding.get_host_cpu_features()
LEVELS = [
    level for level, feature in {"x86-64-v4": "avx512vl", "x86-64-v3": "fma"}.items() if _FEATURES.get(feature, False)
]
"""Targets whose code this processor runs."""
COUNTS = (1, WIDTH - 1, WIDTH, WIDTH + 1, 100, 5 * WIDTH)
LINES = Kinematics(A=0.012, slope_x=0.03, B=0.4, slope_v=0.9, q=-1.1, lever_d=1.7)
BITS = """
from tests.kernels import test_flat
print(*(value.hex() for count in test_flat.COUNTS for value in test_flat.sums(count)))
"""
TABLE = """
import numpy as np
import boulder_kernels as bk
from tests.kernels.samples import control, random_designs, table_of
table = table_of(random_designs(40, seed=7))
for elements in (0, 50):
    how = control(4e-3, 0.5, np.radians(20.0), stop_at_limit=True)._replace(elements=elements)
    for readings in (bk.corrected(), bk.as_printed()):
        for column in bk.simulate_table(table, readings, how):
            print(*(float(value).hex() for value in column))
"""


def sums(count: int) -> tuple[float, ...]:
    """Return force and moment of one design by so many elements, of a uniform soil and of a soil in layers."""
    design = random_designs(1, seed=31)[0]
    profile = profile_of(uniform_layers(design), count)
    fill_soil(design, profile)
    uniform = element_sums(LINES, constants_of(design, bk.corrected(), count))
    return (*uniform, *reaction_of_elements(LINES, profile.soil))


def on(target: str, script: str) -> str:
    """Run a script whose kernels are compiled for a target."""
    features = {"x86-64-v4": "-prefer-256-bit"}.get(target, "")
    environment = os.environ | {"NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": features}
    command = [sys.executable, "-c", script]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("count", COUNTS)
def test_every_element_counts_once(count: int) -> None:
    """Both soils are the same one, whose elements are added up here by themselves."""
    design = random_designs(1, seed=31)[0]
    c = constants_of(design, bk.corrected(), count)
    ratio = (np.arange(count) + 0.5) / count
    limited = np.clip(LINES.A - LINES.slope_x * ratio, -c.x_yield, c.x_yield)
    v = LINES.B - LINES.slope_v * ratio
    F = -(c.K_soil * ratio * limited + c.R_soil * v * abs(v)) / count
    M = -F * (LINES.lever_d * ratio + LINES.q)
    assert sums(count) == pytest.approx([F.sum(), M.sum()] * 2, rel=1e-12)


@pytest.mark.compiled
@pytest.mark.skipif(len(LEVELS) < 2, reason="this processor runs the code of one target only")
def test_sums_have_the_same_bits_on_every_processor() -> None:
    """With vectors of four numbers and of eight."""
    assert len({on(target, BITS) for target in LEVELS}) == 1


@pytest.mark.compiled
@pytest.mark.nightly
@pytest.mark.skipif(len(LEVELS) < 2, reason="this processor runs the code of one target only")
def test_tables_have_the_same_bits_on_every_processor() -> None:
    """In lanes and by element sums: what a table says of its target holds."""
    assert len({on(target, TABLE) for target in LEVELS}) == 1
