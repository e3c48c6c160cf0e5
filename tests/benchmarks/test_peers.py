"""The solver in plain C solves the same problem as the kernels."""

import pytest

from benchmarks.designs import sample
from benchmarks.peers import c_solver
from benchmarks.peers.problem import problem_of


@pytest.mark.nightly
@pytest.mark.compiled
def test_plain_c_turns_every_design_as_far_as_the_kernels_do():
    problem = problem_of(sample(60))  # not a multiple of the lanes
    (solver,) = c_solver.SOLVERS
    theta = solver.prepare(problem)(1e-4)
    assert theta.shape == (60,)
    assert problem.largest_error_deg(theta) < 0.005
