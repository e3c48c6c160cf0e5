"""Spring and damper of a vehicle from a rigid-wall crash pulse (Eqs 49 to 51).

The measured displacement, velocity or acceleration, or several of them at once, is fitted by least squares with the
exact response of a Maxwell element (`boulder_sweep.crash_tests.rigid_wall`), under-damped or over-damped as the data
have it. What is fitted are the logarithms of sqrt(k/m) and of c/sqrt(k m), and the speed of impact unless it is given.
"""

from __future__ import annotations

import math

import numpy as np

from boulder_sweep.crash_tests.fitting.cautions import warnings_of
from boulder_sweep.crash_tests.fitting.problem import Problem
from boulder_sweep.crash_tests.fitting.pulse import Pulse
from boulder_sweep.crash_tests.fitting.result import SignalMisfit, VehicleFit
from boulder_sweep.errors import FitError

PASSES = 4
"""How often the weights of the signals are renewed from their own scatter."""
SMOOTHING_SHARE = 0.05
"""Part of the pulse over which noise is averaged out."""


def fit_pulse(pulse: Pulse, mass_kg: float, *, speed_m_s: float | None = None) -> VehicleFit:
    """Fit spring and damper of a Maxwell element to a rigid-wall crash pulse.

    Parameters
    ----------
    pulse
        One or more signals over time.
    mass_kg
        Mass of the vehicle.
    speed_m_s
        Speed of impact; fitted too where it is not given.

    Returns
    -------
    VehicleFit

    Raises
    ------
    FitError
        Mass or speed are not positive, or no vehicle comes near the pulse.
    """
    for name, value in (("mass", mass_kg), ("speed", speed_m_s)):
        if value is not None and not 0.0 < value < math.inf:
            raise FitError(f"the {name} of the vehicle must be positive, not {value:g}")
    problem = Problem(pulse, float(mass_kg), speed_m_s)
    from scipy.optimize import least_squares  # heavy, and only this function needs it

    scales = {name: problem.range(name) for name in pulse.signals}
    unknowns = problem.start(scales)
    bounds = problem.bounds(unknowns)
    for _ in range(PASSES):
        solved = least_squares(
            problem.residuals,
            np.clip(unknowns, *bounds),
            bounds=bounds,
            args=(scales,),
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        unknowns = solved.x
        residuals = problem.by_signal(unknowns)
        scales = {name: max(rms(values), 1e-9 * problem.range(name)) for name, values in residuals.items()}
    wall = problem.wall(unknowns)
    if not math.isfinite(solved.cost):
        raise FitError(f"{pulse.name}: no vehicle comes near this pulse")
    misfits = {name: misfit_of(values, problem.range(name)) for name, values in residuals.items()}
    spring_error, damper_error, speed_error = problem.standard_errors(unknowns, scales)
    return VehicleFit(
        pulse=pulse,
        wall=wall,
        spring_error_N_m=spring_error,
        damper_error_N_s_m=damper_error,
        speed_error_m_s=None if speed_m_s is not None else speed_error,
        misfits=misfits,
        warnings=warnings_of(wall, pulse, misfits, spring_error, damper_error),
    )


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def misfit_of(residuals: np.ndarray, span: float) -> SignalMisfit:
    """Describe the residuals of one signal."""
    window = max(1, round(SMOOTHING_SHARE * len(residuals)))
    smooth = np.convolve(residuals, np.full(window, 1.0 / window), mode="valid")
    scatter = float(residuals @ residuals)
    correlation = float(residuals[1:] @ residuals[:-1]) / scatter if scatter > 0.0 else 0.0
    size = rms(residuals)
    return SignalMisfit(size, size / span, float(np.abs(smooth).max()) / span, correlation)
