"""Whole rows, from design to verdict, of designs that once passed and should not, or stated senseless numbers."""

from __future__ import annotations

import math

import numpy as np

from boulder_kernels import Control, as_printed, corrected
from boulder_sweep.judge.evaluation import Evaluation, by_kernels
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import HORIZON, PASS, UNDECIDED
from boulder_sweep.judge.verdict import Limits
from docs.studies.coverage import random_table
from docs.studies.extremes import box_designs

CONTROL = Control(0.008, 1.0, math.radians(20.0), 0, True, longest_horizon=10.0)
LIMITS = Limits(CONTROL.theta_limit, "P1")


def test_as_printed_nothing_passes_and_what_stands_is_undecided() -> None:
    table = random_table(150, 7)
    designs = Designs(table, bed_offset=np.full(table.L.size, 2.9))
    found = Evaluation(as_printed(), CONTROL._replace(h=0.004), LIMITS).judged(designs)
    stands = found.reason == HORIZON
    assert np.count_nonzero(stands) > 10
    assert not np.any(found.verdict == PASS)
    assert np.all(found.verdict[stands] == UNDECIDED)
    assert np.all(found["end_time_s"][stands] == 10.0)
    assert np.all(np.isnan(found["margin"][stands]))


def test_a_boulder_that_does_not_turn_states_no_error_of_degrees() -> None:
    """However small it is, so that an error of the truck over its size would be an angle of many degrees."""
    found = by_kernels(box_designs(1500, 3).table, corrected(), CONTROL)
    still = np.isfinite(found.theta_max) & (found.theta_max < 1e-6)
    assert np.count_nonzero(still) > 20
    assert np.degrees(np.max(found.theta_error[still])) < 0.1
