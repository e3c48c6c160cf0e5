"""What the pictures are drawn of."""

from __future__ import annotations

import itertools

import pandas as pd
import pytest
from matplotlib.figure import Figure

from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.impact.trajectory import Trajectory


@pytest.fixture(scope="session")
def held() -> Trajectory:
    """The boulder that held."""
    return simulate(crash_test("rwg"))


@pytest.fixture(scope="session")
def overturned() -> Trajectory:
    """The boulder that overturned."""
    return simulate(crash_test("abg"))


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Figures in the order in which they are finished."""
    figures: list[Figure] = []
    monkeypatch.setattr("boulder_sweep.views.pictures.save", lambda fig, target: figures.append(fig))
    return figures


@pytest.fixture(scope="session")
def table() -> pd.DataFrame:
    """A made-up result: 3 heights, 4 ratios, 2 friction angles, 5 stiffnesses, 3 widths; tall and deep ones pass."""
    axes = {
        "boulder_height_m": (1.6, 2.4, 3.2),
        "embedment_ratio": (0.4, 0.5, 0.6, 0.7),
        "friction_angle_deg": (36.0, 42.0),
        "subgrade_reaction_MN_m3": (20.0, 40.0, 60.0, 80.0, 100.0),
        "boulder_width_m": (1.0, 1.5, 2.0),
    }
    rows = pd.DataFrame(list(itertools.product(*axes.values())), columns=list(axes))
    rows["embedment_depth_m"] = rows.pop("embedment_ratio") * rows.boulder_height_m
    for name in INPUT_COLUMNS:
        if name not in rows:
            rows[name] = 1.0
    rows["impact_height_m"] = (rows.boulder_height_m - rows.embedment_depth_m + 0.5) / 2
    passes = rows.boulder_height_m * rows.embedment_depth_m / rows.boulder_height_m > 1.4
    rows["verdict"] = pd.Categorical(["pass" if p else "fail" for p in passes])
    rows["reason"] = pd.Categorical(["" if p else "overturns" for p in passes])
    rows["validity"] = pd.Categorical([""] * len(rows))
    low = rows.boulder_height_m - rows.embedment_depth_m < 0.5
    rows.loc[low & ~passes, "reason"] = "overturns"
    return rows
