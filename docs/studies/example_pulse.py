"""The synthetic crash pulse of the documentation: the paper's truck against a rigid wall, with made-up noise.

It is no measurement. Displacement and acceleration follow from the Maxwell element exactly and normally distributed
noise is added, so it is known what a fit has to find.
"""

from __future__ import annotations

import random
from statistics import NormalDist

import numpy as np

from boulder_sweep.crash_tests.cases import rigid_wall_test

END_S, STEP_S = 0.16, 0.002
NOISE_MM, NOISE_G = 5.0, 0.8
"""Standard deviations of the noise."""
GRAVITY_M_S2 = 9.80665
SEED = 1
HEADER = """\
# Synthetic crash pulse, no measurement: 6800 kg against a rigid wall at 13.4 m/s, spring 3103.3 kN/m, damper
# 138.91 kN*s/m, with noise of 5 mm and 0.8 g (standard deviation). Written by python -m docs.studies
time [ms],displacement [mm],acceleration [g]
"""


def example_pulse() -> str:
    """Return the file, the same on every machine."""
    wall = rigid_wall_test()
    time = np.arange(0.0, END_S + 0.5 * STEP_S, STEP_S)
    x, _, acceleration = wall.response(time)
    draw, normal = random.Random(SEED), NormalDist()

    def noise() -> float:
        return normal.inv_cdf(min(max(draw.random(), 1e-12), 1.0 - 1e-12))

    lines = [
        f"{1e3 * t:.0f},{1e3 * u + NOISE_MM * noise():.1f},{a / GRAVITY_M_S2 + NOISE_G * noise():.2f}"
        for t, u, a in zip(time, x, acceleration, strict=True)
    ]
    return HEADER + "\n".join(lines) + "\n"
