"""Elementary functions of arrays give what the C library gives, one number after another."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from boulder_sweep import elementary

ROOT = Path(__file__).parents[1]
BITS = """
import hashlib
import numpy as np
from boulder_sweep import soils
from boulder_sweep.settings.model import RESISTANCES, Ground
from boulder_sweep.investigation import api_curve
from tests.kernels.samples import random_designs, table_of
one = table_of(random_designs(1, seed=11))
table = one._replace(**{name: np.repeat(column, 20_000) for name, column in one._asdict().items()})
table = table._replace(phi=np.radians(np.linspace(25.0, 50.0, 20_000)))
found = [soils.with_law(table, law).K_epsilon for law in RESISTANCES]
found += [api_curve(np.degrees(table.phi)), soils.with_soil(table, "broms", Ground(slope_deg=11.0)).K_epsilon]
wet = Ground(water_table_m=0.7, cohesion_kPa=3.0)
found += [soils.with_soil(table, law, wet).layers.ravel() for law in RESISTANCES]
print(hashlib.sha256(np.concatenate(found).tobytes()).hexdigest())
"""


@pytest.mark.parametrize("name", ["tan", "arctan", "exp"])
def test_numbers_are_those_of_the_library(name: str) -> None:
    """Of arrays of any shape, and of single numbers; NaN stays NaN."""
    function, known = getattr(elementary, name), getattr(math, name.replace("arc", "a"))
    angles = np.linspace(0.0, 1.2, 12).reshape(3, 4)
    assert function(angles).tolist() == [[known(angle) for angle in row] for row in angles.tolist()]
    assert function(angles).dtype == np.float64
    assert function(0.7) == known(0.7)
    assert math.isnan(function(np.array([math.nan]))[0])


def test_logarithms() -> None:
    values = np.array([0.5, 2.0, 3.7])
    assert elementary.log(values).tolist() == [math.log(value) for value in values.tolist()]
    assert len(elementary.tan(np.empty(0))) == 0


def test_soils_have_the_same_bits_with_vectors_of_any_width() -> None:
    """NumPy is told to leave its widest ones alone, in another process; one that does not know the names warns."""
    found = set()
    for disabled in ("", "X86_V4 AVX512_ICL AVX512_SPR", "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"):
        environment = os.environ | {"NPY_DISABLE_CPU_FEATURES": disabled}
        command = [sys.executable, "-W", "ignore", "-c", BITS]
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
        found.add(done.stdout)
    assert len(found) == 1
