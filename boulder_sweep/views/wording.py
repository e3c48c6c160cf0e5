"""Titles and captions: what a picture shows, in a line."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from boulder_sweep.impact.trajectory import Trajectory

REASON_WORDS = {
    "no_contact": "the truck passes over it",
    "overturns": "it overturns",
    "penetration": "the truck gets too far",
    "horizon": "nothing proved at the end of the simulated time",
    "crush": "the truck would be inside the boulder",
    "override": "it hardly reaches the bumper",
    "error": "too near to a limit for the accuracy",
}


NOT_A_TEST = "Simulation, not a rating by test"


def verdict_line(trajectory: Trajectory) -> str:
    """Name, verdict, and what decides it: ``rwg: PASS, 13.8° of 20° allowed``."""
    limit = math.degrees(trajectory.motion.control.theta_limit)
    theta = math.degrees(trajectory.motion.outcome.maxima.theta)
    name = trajectory.name if trajectory.settings["n_designs"] == 1 else f"{trajectory.name} #{trajectory.design_id}"
    reason = trajectory.reason
    if reason == "overturns":
        detail = f"past {limit:g}° after {trajectory.motion.outcome.t_limit:.3f} s"
    else:
        detail = f"{theta:.1f}° of {limit:g}° allowed"
    words = f", {REASON_WORDS.get(reason, reason)}" if reason else ""
    return f"{name}: {trajectory.verdict.upper()}{words}, {detail}"


def terms_line(settings: Mapping[str, Any]) -> str:
    """Return what a pass means under the settings of a table: limits, readings, and that it is a simulation."""
    limits, readings = settings["criterion"], settings["model"]["preset"].replace("_", " ")
    return (
        f"Pass: rotation up to {limits['max_rotation_deg']:g}° and rating {limits['rating']} · readings {readings}. "
        f"{NOT_A_TEST}."
    )


def design_line(trajectory: Trajectory) -> str:
    """Boulder, soil, vehicle and readings in one line; below it, that this is a simulation."""
    value = trajectory.inputs
    size = " × ".join(f"{value[f'boulder_{side}_m']:.4g}" for side in ("length", "width", "height"))
    words = " · ".join(
        (
            f"boulder {size} m (L × W × H), {value['embedment_depth_m']:.4g} m deep",
            f"soil φ′ {value['friction_angle_deg']:.4g}°, β {value['subgrade_reaction_MN_m3']:.4g} MN/m³",
            f"vehicle {value['vehicle_mass_kg']:.5g} kg at {value['impact_speed_m_s']:.4g} m/s",
            f"readings {trajectory.settings['model']['preset'].replace('_', ' ')}",
        )
    )
    return f"{words}\n{NOT_A_TEST}"
