"""Spring and damper of a vehicle from a rigid-wall crash pulse (Eqs 49 to 51), and a second spring (Eq 111)."""

from boulder_sweep.crash_tests.fitting.fit import StagedFit, fit_pulse, fit_stages
from boulder_sweep.crash_tests.fitting.pulse import Pulse, SignalMisfit, VehicleFit, pulse_of, read_pulse
from boulder_sweep.errors import FitError

__all__ = [
    "FitError",
    "Pulse",
    "SignalMisfit",
    "StagedFit",
    "VehicleFit",
    "fit_pulse",
    "fit_stages",
    "pulse_of",
    "read_pulse",
]
