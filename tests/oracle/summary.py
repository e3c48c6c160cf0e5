"""What tests compare of an impact, a few numbers in place of its whole trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .dynamics import REMEMBERED
from .outcome import Impact, Peak

_LOOKED_AT = 4001  # instants after the largest rotation


@dataclass(frozen=True)
class Summary:
    """The largest values of an impact and its ends, named as in `tests.oracle.outcome.Impact`.

    Attributes
    ----------
    max_rotation, max_displacement, max_vehicle_displacement, max_crush, peak_force : Peak
        Largest absolute rotation [rad], x_b [m], x_v [m], crush [m] and F_v [N], with their times [s].
    t_end : float
        Simulated time [s].
    swing_back : float
        Largest absolute rotation less the least rotation after it [rad].
    left : tuple of float
        What the soil remembers at the end: how far the sliders of fronts and backs have moved [m], if they do.
    """

    max_rotation: Peak
    max_displacement: Peak
    max_vehicle_displacement: Peak
    max_crush: Peak
    peak_force: Peak
    t_end: float
    swing_back: float
    left: tuple[float, ...]


def summary_of(impact: Impact) -> Summary:
    """Return what is compared of an impact."""
    turned = impact.max_rotation
    after = np.linspace(turned.time, impact.t_end, _LOOKED_AT)
    return Summary(
        max_rotation=turned,
        max_displacement=impact.max_displacement,
        max_vehicle_displacement=impact.max_vehicle_displacement,
        max_crush=impact.max_crush,
        peak_force=impact.peak_force,
        t_end=impact.t_end,
        swing_back=turned.value - float(impact.states(after)[2].min()),
        left=tuple(float(x) for x in np.asarray(impact.solution(impact.t_end))[REMEMBERED:]),
    )
