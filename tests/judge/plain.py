"""Plain designs for tests of the verdict."""

from __future__ import annotations

import numpy as np

from boulder_sweep.judge.evaluation import PLAIN_DESIGN
from boulder_sweep.judge.inputs import Designs


def plain_designs(n: int = 1, *, bed_offset: float = 2.9, **changes: float) -> Designs:
    """Return a usual design n times, with other values where they are given by the kernels' names."""
    one = PLAIN_DESIGN._replace(**{name: np.array([value]) for name, value in changes.items()})
    return Designs(one, bed_offset=np.array([bed_offset])).rows(np.zeros(n, dtype=int))
