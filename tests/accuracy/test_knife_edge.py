"""The printed restoring moment has an edge; the couple of the weight has none."""

from __future__ import annotations

import numpy as np
import pytest

from boulder_kernels import as_printed
from docs.studies.knife_edge import knife_edge, rotations_deg


def test_the_rotation_jumps_over_the_speed() -> None:
    found = knife_edge()
    assert abs(found.below_deg - found.above_deg) > 3.0
    assert found.width_m_s < 1e-8
    assert found.above_deg < found.below_deg


def test_the_corrected_couple_has_no_jump() -> None:
    found = knife_edge(as_printed()._replace(restoring_gravity=True))
    assert np.abs(np.diff(found.rotations_deg)).max() < 0.05


@pytest.mark.parametrize("step_s", [1e-3, 5e-4])
def test_shorter_steps_find_the_same_edge(step_s: float) -> None:
    """Away from the edge by a thousandth, either side is found whatever the step."""
    edge = knife_edge().edge_m_s
    sides = np.array([edge * (1 - 1e-3), edge * (1 + 1e-3)])
    assert rotations_deg(sides, as_printed(), step_s) == pytest.approx(rotations_deg(sides, as_printed()), abs=1e-2)
