"""An open benchmark: 272 impacts with reference solutions, to which any solver of the model can be held.

``python -m benchmarks.boulders`` draws the designs and integrates them by the oracle of the tests, which is written
from the paper in NumPy and SciPy and shares no code with the kernels; ``python -m benchmarks.score`` scores results.
"""

from __future__ import annotations

from pathlib import Path

FILE = Path(__file__).parent / "boulders.parquet"
REFERENCE = ("max_rotation_deg", "max_displacement_m", "max_vehicle_displacement_m", "peak_force_kN", "time_to_limit_s")
"""Columns of the reference, named as in a table of results."""
