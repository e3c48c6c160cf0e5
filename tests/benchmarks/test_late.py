"""The independent integration of `benchmarks.late` against the oracle, and how it is counted."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from benchmarks import late
from tests.oracle.dynamics import Modes, problem, rate
from tests.oracle.inputs import Inputs, Readings


def compiled_inputs() -> late.Inputs:
    return late.Inputs(1.5, 1.2, 2.4, 2600.0, 0.6, 0.9, 1900.0, 0.65, 45e6, 1.1, 5000.0, 9.0, 2.5e6, 1.6e5)


@pytest.mark.parametrize("turning", [late.HELD, late.CLOCKWISE, late.ANTICLOCKWISE])
@pytest.mark.parametrize("touching", [True, False])
def test_its_rates_are_those_of_the_oracle(turning: int, touching: bool) -> None:
    i = compiled_inputs()
    oracle = problem(
        Inputs(**{**i._asdict(), "beta": i.beta / 1e6}),
        Readings(),
    )
    rng = np.random.default_rng(3)
    words = {late.HELD: "held", late.CLOCKWISE: "clockwise", late.ANTICLOCKWISE: "anticlockwise"}
    modes = Modes(words[turning], "touching" if touching else "coasting")
    for _ in range(20):
        y = rng.normal(size=7) * [0.02, 1.0, 0.05, 1.0, 0.3, 3.0, 30.0]
        y[6] = -abs(y[6])
        expected = rate(oracle, y, modes)
        found, _ = late.rate.py_func(late.State(*y), turning, touching, i, late.body_of.py_func(i))
        assert np.allclose(found, expected, rtol=1e-9, atol=1e-9)


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
