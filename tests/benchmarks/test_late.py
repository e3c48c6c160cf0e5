"""Shallow boulders against an independent integration: what is drawn, and how it is counted."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from benchmarks import late


def table(*rows: tuple[str, str]) -> pd.DataFrame:
    return pd.DataFrame({"verdict": [v for v, _ in rows], "reason": [r for _, r in rows], "end_time_s": 2.0})


def test_wrong_verdicts_are_counted() -> None:
    limit = math.radians(20.0)
    rotations = np.array([[limit, limit], [0.1, 0.1], [limit, 0.1], [0.1, 0.1]])
    found = late.compared(table(("pass", ""), ("fail", "overturns"), ("pass", ""), ("undecided", "error")), rotations)
    assert found["passes that overturn"] == 1
    assert found["fails that stand"] == 1
    assert found["set aside"] == 1
    assert found["undecided"] == 1


def test_designs_are_shallow_and_are_hit() -> None:
    drawn = late.shallow(500, 1)
    ratio = drawn.embedment_depth_m / drawn.boulder_height_m
    assert len(drawn) == 500
    assert ratio.between(0.02, 0.35).all()
    assert (drawn.boulder_height_m - drawn.embedment_depth_m > drawn.bumper_height_m).all()
