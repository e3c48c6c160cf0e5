"""Errors are told rightly, and the steps behind the names keep their accuracy."""

import numpy as np
import pytest

import boulder_kernels as bk
from benchmarks.accuracy import LIMIT, errors_of, named_control, reference_of, wrong_verdicts
from benchmarks.designs import sample
from boulder_sweep.judge.accuracy import STEPS


def outcomes(theta: list[float], x_v: list[float], overturned: list[bool]) -> bk.OutcomeTable:
    columns = {name: np.zeros(len(theta)) for name in bk.OutcomeTable._fields}
    columns |= {"theta_max": np.array(theta), "x_v_max": np.array(x_v), "status": np.where(overturned, LIMIT, -1)}
    return bk.OutcomeTable(**columns)


def test_errors_are_taken_where_neither_overturned() -> None:
    known = outcomes([0.1, 0.2, 0.35], [1.0, 1.0, 1.0], [False, False, True])
    found = outcomes([0.101, 0.35, 0.1], [1.002, 2.0, 3.0], [False, True, False])
    degrees, millimetres = errors_of(found, known)
    assert degrees == pytest.approx([np.degrees(0.001)])
    assert millimetres == pytest.approx([2.0])


def test_steps_behind_the_names_keep_their_accuracy() -> None:
    """On fewer designs than the benchmark has; 0.01 deg and 0.1 mm would do for the first two."""
    designs = sample(512)
    reference = reference_of(designs, bk.corrected())
    for name, degrees, millimetres in (("fast", 0.01, 0.1), ("balanced", 5e-4, 0.02), ("fine", 1e-5, 1e-3)):
        found = bk.simulate_table(designs, bk.corrected(), named_control(name, STEPS[name]))
        rotation, displacement = (errors.max() for errors in errors_of(found, reference))
        assert rotation < degrees
        assert displacement < millimetres
        assert wrong_verdicts(found, reference) <= (name == "fast")
