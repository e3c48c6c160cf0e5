"""Sweeps that questions are put to, and how their answers are judged again."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from boulder_sweep.answers.need import Need, need
from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.settings import Sweep, load_text
from boulder_sweep.settings.sweep import DesignList

DEPTH = "embedment_depth_m"
bare_need = partial(need, margin=0.0, robust=False)
"""Asks for the bare least value that passes."""
SITE = """
name: site
boulder:  {{length: {length}, width: {width}, height: {height}, density: 2600 kg/m^3}}
site:     {{{site}}}
soil:     {{density: 1860 kg/m^3, friction_angle: {friction}, subgrade_reaction: {subgrade}}}
vehicle:  {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
criterion: {{max_rotation: 20 deg, rating: P1}}
model:    {{readings: {readings}}}
solver:   {{accuracy: {accuracy}}}
"""
DEFAULTS = {
    "length": "1.65 m",
    "width": "1.68 m",
    "height": "[2.6, 3.0, 3.4] m",
    "site": "embedment_depth: 2 m",
    "friction": "[36, 40] deg",
    "subgrade": "60 MN/m^3",
    "readings": "corrected",
    "accuracy": "balanced",
}


UNCERTAIN_FRICTION = {"friction": "{mean: 38 deg, sd: 2 deg}"}


def site(**changes: str) -> Sweep:
    """Return a sweep of 6 designs, 3 heights by 2 friction angles, or another."""
    return load_text(SITE.format(**{**DEFAULTS, **changes}), Path("site.yaml"))


def random_designs(count: int, seed: int = 1) -> Sweep:
    """Return a list of designs drawn from the usual ranges, before trucks of 6 to 18 m/s."""
    rng = np.random.default_rng(seed)
    ends = {
        "boulder_length_m": (0.6, 2.0),
        "boulder_width_m": (0.8, 2.5),
        "boulder_height_m": (1.8, 4.0),
        "boulder_density_kg_m3": (2400.0, 3074.0),
        "embedment_depth_m": (0.8, 1.2),
        "soil_density_kg_m3": (1520.0, 2240.0),
        "friction_angle_deg": (27.0, 49.0),
        "subgrade_reaction_MN_m3": (2.0, 110.0),
        "strain_rate_factor": (1.0, 1.2),
        "vehicle_mass_kg": (5000.0, 9000.0),
        "impact_speed_m_s": (6.0, 18.0),
        "vehicle_spring_N_m": (2e6, 5e6),
        "vehicle_damper_N_s_m": (0.7e5, 2.5e5),
    }
    columns = {name: rng.uniform(*pair, count) for name, pair in ends.items()}
    constants = {"bumper_height_m": 0.5, "hood_height_m": 1.4, "bed_offset_m": 2.9}
    return Sweep("random", None, (), constants, DesignList("random.csv", columns))


def passes(found: Need, frame: pd.DataFrame, values: pd.Series, column: str) -> np.ndarray:
    """Judge the designs of some answers with a value in a column, as `sweep run` judges a list of designs."""
    listed = {name: frame[name].to_numpy(dtype=float) for name in INPUT_COLUMNS if name != "impact_height_m"}
    listed[column] = values.to_numpy(dtype=float)
    asked = found.sweep
    sweep = Sweep("again", None, (), {}, DesignList("again.csv", listed), model=asked.model, solver=asked.solver)
    return evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, sweep.n_designs)).verdict == PASS
