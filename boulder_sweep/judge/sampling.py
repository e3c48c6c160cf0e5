"""A deterministic sample of a sweep: its corners, and rows spread over every axis."""

from __future__ import annotations

import math
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

MOST_CORNERS = 64


def sampled_rows(sweep: Sweep, count: int) -> np.ndarray:
    """Choose rows of a sweep.

    Parameters
    ----------
    sweep
        The sweep.
    count
        Approximate number of rows; all rows if the sweep has no more.

    Returns
    -------
    ndarray of int64, shape (n,)
        Row numbers, ascending, each once: the corners of the grid, and rows along a sequence that fills all axes
        evenly at once (every axis is cut into as many strata as it has values). A list of designs has one axis.
    """
    lengths = sweep.plan.lengths
    if sweep.n_designs <= count:
        return np.arange(sweep.n_designs)
    places = _corners(lengths, min(count, MOST_CORNERS))
    spread = _spread(lengths, count - len(places))
    rows = np.concatenate([np.array(places, dtype=np.int64).reshape(-1, len(lengths)), spread]) @ np.array(
        sweep.plan.strides, dtype=np.int64
    )
    return np.unique(rows)


def _corners(lengths: tuple[int, ...], most: int) -> list[tuple[int, ...]]:
    """Places of the corners; if there are too many, both ends and their neighbours along one axis."""
    ends = [(0, length - 1) if length > 1 else (0,) for length in lengths]
    if math.prod(len(pair) for pair in ends) <= most:
        return list(product(*ends))
    first, last = tuple(pair[0] for pair in ends), tuple(pair[-1] for pair in ends)
    found = [first, last]
    for axis in range(len(ends)):
        found.append((*first[:axis], last[axis], *first[axis + 1 :]))
        found.append((*last[:axis], first[axis], *last[axis + 1 :]))
    return found[:most]


def _spread(lengths: tuple[int, ...], count: int) -> np.ndarray:
    """Places along Roberts' sequence, whose steps are powers of the root of x^(k+1) = x + 1, shape (count, k)."""
    k = len(lengths)
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (k + 1))
    steps = root ** -np.arange(1.0, k + 1.0)
    along = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    sizes = np.array(lengths, dtype=np.int64)
    return np.minimum((along * sizes).astype(np.int64), sizes - 1)
