"""A crash pulse, the Maxwell element fitted to it, and the residuals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.crash_tests.pulse import RESPONSES, UNITS
from boulder_sweep.crash_tests.rigid_wall import StiffeningWall
from boulder_sweep.views import figures
from boulder_sweep.views.figures import BLACK, GREY, ORANGE

if TYPE_CHECKING:
    from boulder_sweep.crash_tests.pulse import VehicleFit

ORDER = ("displacement", "velocity", "acceleration")
POINTS = 400


def draw_fit(fit: VehicleFit, path: str | Path) -> None:
    """Draw every signal of a pulse with the fitted response, and the residuals below it.

    Parameters
    ----------
    fit
        The fit.
    path
        Picture to write (.png, .svg, .pdf).

    Raises
    ------
    PictureError
        The picture cannot be written, or matplotlib is not installed.
    """
    names = [name for name in ORDER if name in fit.pulse.signals]
    residuals = fit.residuals
    fine = np.linspace(0.0, float(fit.pulse.time_s[-1]), POINTS)
    with figures.figure(path, max(3.4 * len(names), 5.6), 4.9) as fig:
        grid = fig.subplots(2, len(names), sharex=True, squeeze=False, height_ratios=(2.4, 1.0))
        for (above, below), name in zip(grid.T, names, strict=True):
            unit = UNITS[name].replace("^2", "²")
            above.plot(fit.pulse.time_s, fit.pulse.signals[name], ".", color=GREY, markersize=3.0, label="measured")
            above.plot(fine, RESPONSES[name](fit.wall, fine), color=ORANGE, label="Maxwell element")
            above.set_title(name.capitalize())
            above.set_ylabel(f"{name} [{unit}]")
            below.plot(fit.pulse.time_s, residuals[name], ".", color=GREY, markersize=3.0)
            below.axhline(0.0, color=BLACK, linewidth=0.8)
            reach = 1.15 * float(np.nanmax(np.abs(residuals[name])))
            below.set_ylim(-reach or -1.0, reach or 1.0)
            below.set_ylabel(f"residual [{unit}]")
            below.set_xlabel("time since first touch [s]")
            below.set_xlim(0.0, float(fine[-1]))
            below.locator_params(axis="x", nbins=5)  # more numbers run into one another
        grid[0, 0].legend(loc="best")
        fig.suptitle(fit_line(fit), x=0.01, ha="left", fontsize=10.5, fontweight="bold")
        if fit.warnings:
            first = "Caution: " + fit.warnings[0].split(":")[0]
            fig.supxlabel(first, x=0.01, ha="left", fontsize=8.5, color=ORANGE)


def fit_line(fit: VehicleFit) -> str:
    """Spring and damper with their standard errors on one line."""
    spring = f"spring {fit.wall.spring_N_m / 1e3:.1f} ± {fit.spring_error_N_m / 1e3:.1f} kN/m"
    damper = f"damper {fit.wall.damper_N_s_m / 1e3:.2f} ± {fit.damper_error_N_s_m / 1e3:.2f} kN·s/m"
    wall = fit.wall
    if isinstance(wall, StiffeningWall):
        spring += f", {wall.second_spring_N_m / 1e3:.1f} kN/m from {wall.second_spring_from_m:.3f} m"
    return f"{spring}, {damper}"
