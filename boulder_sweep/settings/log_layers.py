"""A log of blow counts or of a cone becomes layers of sand.

The model weighs soil by its depth: the subgrade reaction and the passive pressure both grow in proportion to it. So the
mean of a layer is weighted by depth, and layers are parted where their means differ by more than the scatter of the
correlation. Where there is a choice, the weaker soil is taken.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.settings.problems import Position

CONE = "q_c"
WINDOW_M = 0.25
"""Thickness over which a cone is averaged: a boulder of a metre or two does not feel a thinner seam."""
TEST_M = 0.45
"""What a test with blow counts drives the sampler."""
CORRELATION_LENGTH_M = 1.0
"""Depth within which readings tell of the same soil, so that a layer has one independent reading a metre."""
FEWEST = 3
"""Readings from which a mean and a scatter are taken; of fewer the weakest counts."""
THINNEST_M = 0.3
"""A reading that stands for less is no layer of its own."""
MOST_LAYERS = 8
"""Up to so many layers are simulated many designs side by side."""


class LogReading(NamedTuple):
    """One reading of a file; its text is empty where there is none, and a plain number [MPa] for a cone."""

    position: Position
    depth_m: float
    text: str
    energy_ratio: str

    @property
    def is_whole(self) -> bool:
        """Whether it has a depth and a value."""
        return bool(self.text) and math.isfinite(self.depth_m)


class Log(NamedTuple):
    """The readings of a hole, from the top down.

    Attributes
    ----------
    key : str
        What they are by the keys of a reading: ``n``, ``n60``, ``n1_60`` or ``q_c``.
    readings : tuple of LogReading
        All with a depth and a value.
    file, hole : str
        The file as it is named in the settings, and the hole in it.
    remarks : tuple of str
        What of the file was not used.
    may_be_layered : bool
        Whether the soil may have layers: it is no named one, and the file gives no constant that is not one value.
    """

    key: str
    readings: tuple[LogReading, ...]
    file: str
    hole: str
    remarks: tuple[str, ...]
    may_be_layered: bool = True

    def averaged(self, topsoil_m: float) -> tuple[LogReading, ...]:
        """Return one reading for each `WINDOW_M` below the topsoil: the lower of mean and median of the cone."""
        windows: dict[int, list[LogReading]] = {}
        for one in self.readings:
            windows.setdefault(math.floor((one.depth_m - topsoil_m) / WINDOW_M + 1e-9), []).append(one)
        return tuple(_average(window) for window in windows.values())


def _average(window: list[LogReading]) -> LogReading:
    values = [float(one.text) for one in window]
    value = max(0.0, min(float(np.mean(values)), float(np.median(values))))
    return window[0]._replace(depth_m=float(np.mean([one.depth_m for one in window])), text=repr(value))


class LogLayer(NamedTuple):
    """Readings that belong to one layer.

    Attributes
    ----------
    from_m, to_m : float
        Its boundaries [m].
    readings : int
        Their number.
    angles : dict of str to float
        Friction angles [deg] by the sources of the correlations.
    scatter_deg : float
        Standard deviation of their mean [deg]; 0 for fewer than `FEWEST` readings.
    """

    from_m: float
    to_m: float
    readings: int
    angles: dict[str, float]
    scatter_deg: float


def layers_of(readings: list[dict[str, Any]], foot_m: float, scatter_deg: float, *, is_cone: bool) -> list[LogLayer]:
    """Return the layers of a log, from the ground down.

    Parameters
    ----------
    readings
        What counts, with depths and friction angles, see `boulder_sweep.settings.soil_readings`.
    foot_m
        The deepest foot [m]; the last reading stands for the soil down to it. One below it counts in full where it is
        weaker than the one above, else for its share of the soil down to the foot.
    scatter_deg
        Standard deviation of the correlation [deg]: means that differ by more belong to two layers.
    is_cone
        Whether a reading is the mean of `WINDOW_M`; a boundary then lies at its end, else at the depth of the stronger
        reading of the two.
    """
    by_depth = sorted(readings, key=lambda one: (one["depth_m"], -one["friction_angle_deg"]))
    readings = list({round(one["depth_m"], 3): one for one in by_depth}.values())  # of one depth the weakest
    depths = np.array([reading["depth_m"] for reading in readings])
    angles = np.array([reading["friction_angle_deg"] for reading in readings])
    reach = 0.5 * WINDOW_M if is_cone else 0.0
    last = max(foot_m if math.isfinite(foot_m) else 0.0, depths[-1] + (reach or TEST_M))
    edges = np.concatenate([[0.0], 0.5 * (depths[1:] + depths[:-1]), [last]])
    adds_strength = len(depths) > 1 and depths[-1] > foot_m and angles[-1] >= angles[-2]
    ends = np.append(edges[:-1], max(foot_m, edges[-2])) if adds_strength else edges
    weights = 0.5 * np.diff(ends**2)
    cuts = _cuts(angles, edges, scatter_deg)
    groups = [slice(*ends) for ends in pairwise([0, *cuts, len(readings)])]
    means = [float(np.average(angles[group], weights=np.diff(edges**2)[group])) for group in groups]
    bounds = [0.0]
    for (upper, below), cut in zip(pairwise(means), cuts, strict=True):
        bounds.append(depths[cut - 1] + reach if upper > below else max(0.0, depths[cut] - reach))
    bounds.append(last)
    spans = list(pairwise(bounds))
    firm = [group for group, (top, bottom) in zip(groups, spans, strict=True) if bottom - top >= 0.5 * WINDOW_M]
    if firm and len(firm) < len(groups):  # without what is strong alone between weaker ones
        kept = [reading for group in firm for reading in readings[group]]
        return layers_of(kept, foot_m, scatter_deg, is_cone=is_cone)
    each = zip(groups, spans, strict=True)
    return [_layer(readings[group], weights[group], float(top), float(bottom)) for group, (top, bottom) in each]


def _cuts(angles: np.ndarray, edges: np.ndarray, scatter_deg: float) -> list[int]:
    """Return before which readings a layer begins.

    From one layer a reading, neighbours whose means do not differ by more than the scatter become one, those first that
    add the least to the squared deviations; and so do layers that are too thin, and the most alike of too many.
    """
    cuts = list(range(1, len(angles)))
    while cuts:
        ends = np.array([0, *cuts, len(angles)])
        weights = 0.5 * np.diff(edges[ends] ** 2)
        thick = np.diff(edges[ends])
        sums = np.add.reduceat(0.5 * np.diff(edges**2) * angles, ends[:-1])
        apart = np.abs(np.diff(sums / weights))
        added = weights[1:] * weights[:-1] / (weights[1:] + weights[:-1]) * apart**2
        alike = (apart <= scatter_deg) | (np.minimum(thick[1:], thick[:-1]) < THINNEST_M) | (len(cuts) >= MOST_LAYERS)
        if not alike.any():
            break
        del cuts[int(np.argmin(np.where(alike, added, np.inf)))]
    return cuts


def _layer(readings: list[dict[str, Any]], weights: np.ndarray, top: float, bottom: float) -> LogLayer:
    """Return a layer by its readings and their weights."""
    n = len(readings)
    if n < FEWEST:
        weakest = min(readings, key=lambda reading: reading["friction_angle_deg"])
        return LogLayer(top, bottom, n, weakest["friction_angles_deg"], 0.0)
    share = weights / weights.sum()
    values = {
        source: np.array([reading["friction_angles_deg"][source] for reading in readings])
        for source in readings[0]["friction_angles_deg"]
    }
    angles = {source: float(share @ one) for source, one in values.items()}
    lowest = min(angles, key=angles.__getitem__)
    variance = float(share @ (values[lowest] - angles[lowest]) ** 2) * n / (n - 1)
    independent = min(float(n), max(1.0, (bottom - top) / CORRELATION_LENGTH_M))
    return LogLayer(top, bottom, n, angles, math.sqrt(variance / independent))
