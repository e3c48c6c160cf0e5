"""The solver in plain C solves the same problem as the kernels."""

import pytest

from benchmarks import peers
from benchmarks.designs import sample


@pytest.mark.nightly
@pytest.mark.compiled
def test_plain_c_turns_every_design_as_far_as_the_kernels_do():
    problem = peers.problem_of(sample(60))  # not a multiple of the lanes
    theta = peers.plain_c(problem)(1e-4)
    assert theta.shape == (60,)
    assert problem.largest_error_deg(theta) < 0.005
