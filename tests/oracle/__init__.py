"""Reference implementation of the vehicle-boulder-soil impact, written from the paper.

The paper is Brown et al., *Low-order modeling of vehicle impacts upon boulders embedded in cohesionless
soil*; equation numbers are those of the paper. Everything here is plain NumPy and SciPy, literal rather than
fast, and shares no code with the compiled kernels, so that agreement between the two means something.

Start at :func:`tests.oracle.impact.simulate`.
"""

from .cases import ABG, RWG
from .constants import Constants, constants
from .dynamics import Modes, Problem, loads, problem, rate, state_modes
from .impact import simulate
from .inputs import AS_PRINTED, CORRECTED, GRAVITY, Inputs, Readings
from .outcome import Impact, Peak

__all__ = [
    "ABG",
    "AS_PRINTED",
    "CORRECTED",
    "GRAVITY",
    "RWG",
    "Constants",
    "Impact",
    "Inputs",
    "Modes",
    "Peak",
    "Problem",
    "Readings",
    "constants",
    "loads",
    "problem",
    "rate",
    "simulate",
    "state_modes",
]
