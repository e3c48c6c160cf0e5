"""What tests compare of an impact, a few numbers in place of its whole trajectory."""

from __future__ import annotations

from dataclasses import dataclass

from .outcome import Impact, Peak


@dataclass(frozen=True)
class Summary:
    """The largest values of an impact and its ends, named as in `tests.oracle.outcome.Impact`.

    Attributes
    ----------
    max_rotation, max_displacement, max_vehicle_displacement, max_crush, peak_force : Peak
        Largest absolute rotation [rad], x_b [m], x_v [m], crush [m] and F_v [N], with their times [s].
    t_end : float
        Simulated time [s].
    """

    max_rotation: Peak
    max_displacement: Peak
    max_vehicle_displacement: Peak
    max_crush: Peak
    peak_force: Peak
    t_end: float


def summary_of(impact: Impact) -> Summary:
    """Return what is compared of an impact."""
    return Summary(
        max_rotation=impact.max_rotation,
        max_displacement=impact.max_displacement,
        max_vehicle_displacement=impact.max_vehicle_displacement,
        max_crush=impact.max_crush,
        peak_force=impact.peak_force,
        t_end=impact.t_end,
    )
