"""The force of the ground under a boulder that turns about its lower corner, which the planar model leaves out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from boulder_kernels.design import G, boulder_mass

if TYPE_CHECKING:
    from boulder_sweep.impact.trajectory import Trajectory


def base_reaction(trajectory: Trajectory) -> np.ndarray:
    """Return the upward force of the ground that the planar motion takes for granted [N], shape (n,) (Eq 104).

    The centre of a box that turns about a lower corner stands at f = L/2 sin|theta| + H/2 cos(theta) over it, so the
    ground must push with N = m_b (g + f''), f'' = (L/2 cos - H/2 sin|theta|) alpha - (L/2 sin|theta| + H/2 cos) omega^2
    with alpha counted away from theta = 0. Where N is negative it would have to pull: the boulder leaves the ground,
    and a third degree of freedom is needed.

    Parameters
    ----------
    trajectory
        A time history of n samples.
    """
    design, c = trajectory.motion.design, trajectory.motion.constants
    theta, omega = trajectory.rotation_rad, trajectory.angular_velocity_rad_s
    moment = trajectory.contact_moment_N_m + trajectory.soil_moment_N_m + trajectory.restoring_moment_N_m
    outward = np.where(theta < 0.0, -1.0, 1.0) * moment / c.J_eff
    along, up = 0.5 * design.L * np.cos(theta), 0.5 * design.H * np.sin(np.abs(theta))
    across, over = 0.5 * design.L * np.sin(np.abs(theta)), 0.5 * design.H * np.cos(theta)
    return boulder_mass(design) * (G + (along - up) * outward - (across + over) * omega**2)
