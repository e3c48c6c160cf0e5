"""The force of the ground under a boulder that turns: against the motion itself, and what it says of both tests."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boulder_kernels.design import G, boulder_mass
from boulder_sweep.impact.uplift import base_reaction
from tests.conftest import Trajectories


def test_it_is_weight_and_mass_times_the_acceleration_of_the_centre(trajectories: Trajectories) -> None:
    """The centre's height differentiated twice in time, but for samples at jumps of the force."""
    found = trajectories["rwg", "corrected"]
    design, dt = found.motion.design, found.time_s[1] - found.time_s[0]
    theta = found.rotation_rad
    height = 0.5 * design.L * np.sin(np.abs(theta)) + 0.5 * design.H * np.cos(theta)
    expected = boulder_mass(design) * (G + np.gradient(np.gradient(height, dt), dt))
    moving = slice(10, 500)
    gap = np.abs(base_reaction(found)[moving] - expected[moving]) / (boulder_mass(design) * G)
    assert np.median(gap) < 2e-3
    assert np.quantile(gap, 0.95) < 0.05


def test_the_boulder_that_held_stays_on_the_ground_and_the_other_leaves_it(trajectories: Trajectories) -> None:
    """The paper: the larger one rotated slightly, the smaller one flipped up and out of the ground."""
    held, thrown = trajectories["rwg", "corrected"], trajectories["abg", "corrected"]
    weight = boulder_mass(held.motion.design) * G
    assert base_reaction(held).min() / weight == pytest.approx(0.134, abs=2e-3)
    first = int(np.argmax(base_reaction(thrown) < 0.0))
    assert math.degrees(thrown.rotation_rad[first]) == pytest.approx(7.1, abs=0.1)
    assert thrown.time_s[first] < 0.05
