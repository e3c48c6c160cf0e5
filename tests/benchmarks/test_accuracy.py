"""Errors are told rightly, and the steps behind the names keep their accuracy."""

from dataclasses import replace

import numpy as np
import pytest

import boulder_kernels as bk
from benchmarks.accuracy import Peaks, Point, named_control, observed_order, point_of, reference_of, wrong_verdicts
from benchmarks.designs import sample
from boulder_sweep.judge.accuracy import STEPS


def peaks(theta: list[float], overturned: list[bool]) -> Peaks:
    return Peaks(np.array(theta), np.zeros(3), np.zeros(3), np.array(overturned))


def test_errors_are_taken_where_neither_overturned() -> None:
    known = peaks([0.1, 0.2, 0.35], [False, False, True])
    found = peaks([0.1, 0.35, 0.34], [False, True, True])
    point = point_of("corrected", "way", 0.01, 1.0, found, known)
    assert point.theta_max_deg == 0.0
    assert point.flips == 1
    assert point_of("corrected", "way", 0.01, 1.0, peaks([0.101, 0.2, 0.3], [False] * 3), known).flips == 1


def test_observed_order_is_the_slope() -> None:
    point = Point("corrected", "way", 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0)
    points = [replace(point, step_ms=h, theta_rms_deg=2.0 * h**3) for h in (1.0, 2.0, 4.0, 8.0)]
    assert observed_order(points, 8.0, 1.0) == pytest.approx(3.0)


def test_steps_behind_the_names_keep_their_accuracy() -> None:
    """On fewer designs than the benchmark has; 0.01 deg and 0.1 mm would do for the first two."""
    designs = sample(512)
    reference = reference_of(designs, bk.corrected())
    known = Peaks.of(reference)
    for name, degrees, millimetres in (("fast", 0.01, 0.1), ("balanced", 5e-4, 0.02), ("fine", 1e-5, 1e-3)):
        found = bk.simulate_table(designs, bk.corrected(), named_control(name, STEPS[name]))
        point = point_of("corrected", name, STEPS[name].step_s, 0.0, Peaks.of(found), known)
        assert point.theta_max_deg < degrees
        assert point.x_max_mm < millimetres
        assert wrong_verdicts(found, reference) <= (name == "fast")
