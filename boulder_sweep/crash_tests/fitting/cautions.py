"""Where a Maxwell element cannot fit a crash pulse, or the pulse does not determine it, in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from boulder_sweep.crash_tests.fitting.problem import RATIO_BOUNDS

if TYPE_CHECKING:
    from boulder_sweep.crash_tests.fitting.pulse import Pulse
    from boulder_sweep.crash_tests.fitting.result import SignalMisfit
    from boulder_sweep.crash_tests.rigid_wall import RigidWall

SYSTEMATIC_SHARE = 0.02
"""A misfit left after the noise has been averaged out, as a share of the signal's range, from which on the vehicle
cannot be called a Maxwell element, provided that neighbouring residuals go together:"""
GO_TOGETHER = 0.5
UNSURE = 0.25
"""Standard error of a constant as a share of it, from which on the pulse does not determine it."""


def warnings_of(
    wall: RigidWall,
    pulse: Pulse,
    misfits: dict[str, SignalMisfit],
    spring_error_N_m: float,
    damper_error_N_s_m: float,
) -> tuple[str, ...]:
    """Return what the user of a fit should know before trusting it.

    Parameters
    ----------
    wall
        The fitted vehicle.
    pulse
        What it was fitted to.
    misfits
        How far it is off, by signal.
    spring_error_N_m, damper_error_N_s_m
        Standard errors.
    """
    found: list[str] = []
    for name, misfit in misfits.items():
        if misfit.systematic_share > SYSTEMATIC_SHARE and misfit.correlation > GO_TOGETHER:
            found.append(
                f"the {name} is off by {misfit.systematic_share:.0%} of its range even with the noise averaged out: "
                f"this front is not a spring and a damper in series (it may stiffen as it is crushed); "
                f"use the constants only for impacts that crush it about as far"
            )
    ratio = wall.damper_N_s_m / math.sqrt(wall.spring_N_m * wall.mass_kg)
    rigid_damper, rigid_spring = ratio > 0.5 * RATIO_BOUNDS[1], ratio < 2.0 * RATIO_BOUNDS[0]
    if rigid_damper:
        found.append("the pulse shows no lasting crush: a spring alone fits as well, and the damper is not determined")
    if rigid_spring:
        found.append("the pulse shows no spring: a damper alone fits as well, and the spring is not determined")
    unsure = (
        ("spring", spring_error_N_m / wall.spring_N_m, rigid_spring),
        ("damper", damper_error_N_s_m / wall.damper_N_s_m, rigid_damper),
    )
    for name, share, said in unsure:
        if share > UNSURE and not said:
            found.append(f"the pulse does not determine the {name}: its standard error is {share:.0%} of it")
    last = float(pulse.time_s[-1])
    if last < wall.peak_force_time_s:
        found.append(
            f"the pulse ends at {last:.3f} s, before the force peaks ({wall.peak_force_time_s:.3f} s by this fit)"
        )
    elif last < wall.max_displacement_time_s < math.inf:
        found.append(
            f"the pulse ends at {last:.3f} s, before the vehicle stops "
            f"({wall.max_displacement_time_s:.3f} s by this fit)"
        )
    return tuple(found)
