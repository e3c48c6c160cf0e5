"""What the soil on the approach side is worth: designs that pass, with soil behind the boulder alone.

A plain integrator of its own, because the kernels know soil on both faces only: Runge-Kutta steps, sums over soil
elements, all designs side by side. With soil on both faces it is held against the kernels.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from boulder_kernels import Control, DesignTable, corrected, simulate_table
from boulder_kernels.design import Constants, constants_of, design_at
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import sampled_designs
from boulder_sweep.judge.judged import PASS
from boulder_sweep.settings import load

SAMPLE = 600
ELEMENTS = 40
STEP_S = 2.5e-4
SEATING_ANGLE = 1e-4
"""Rotation up to which the couple of the weight grows from nothing [rad], in place of a boulder that is seated."""


class Motion(NamedTuple):
    """State of n impacts; SI, rad."""

    x_b: np.ndarray
    v_b: np.ndarray
    theta: np.ndarray
    omega: np.ndarray
    x_v: np.ndarray
    v_v: np.ndarray


def rate(y: Motion, c: SimpleNamespace, *, both_faces: bool) -> Motion:
    """Rate of the motion (Eqs 10, 11, 17, 26, 28, 36, 37, 46 as corrected).

    Parameters
    ----------
    y
        The state.
    c
        The fields of `Constants`, arrays of shape (n,).
    both_faces
        Whether the soil on the approach side takes part: without it, no soil pulls.
    """
    sin, cos = np.sin(y.theta), np.cos(y.theta)
    force, moment = np.zeros_like(sin), np.zeros_like(sin)
    q = c.l_n * sin - c.z_0 * cos
    for n in range(ELEMENTS):
        part = (n + 0.5) / ELEMENTS
        alpha = part * c.d
        moved = y.x_b + c.l_n * (cos - 1.0) + c.z_0 * sin - sin * alpha
        speed = y.v_b - y.omega * (q + alpha * cos)
        spring = np.clip(moved, -c.x_yield if both_faces else 0.0, c.x_yield)
        pressure = (c.K_soil * part * spring + c.R_soil * speed * np.abs(speed)) / ELEMENTS
        force -= pressure
        moment += pressure * (alpha * cos + q)
    lever = c.h * cos + c.g_x * sin
    u = y.x_v - y.x_b - c.h * sin - c.g_x * (1.0 - cos) - c.tau_v * (c.v_0 - y.v_v)
    F_v = c.k_v * np.maximum(u, 0.0)
    seated = np.clip(y.theta / SEATING_ANGLE, -1.0, 1.0)
    weight = -seated * (c.C_cos * cos + c.C_sin * np.abs(sin))
    return Motion(
        y.v_b,
        (force + F_v) / c.m_eff,
        y.omega,
        (moment + F_v * lever + weight) / c.J_eff,
        y.v_v,
        -F_v * c.k_m / c.k_v,
    )


def largest_rotation(table: DesignTable, limit: float, horizon: float, *, both_faces: bool) -> np.ndarray:
    """Return the largest rotation of every design [rad], cut off a little beyond the limit [rad]."""
    rows = [constants_of(design_at(table, row), corrected(), 0) for row in range(table.L.size)]
    columns = (np.array(column) for column in zip(*rows, strict=True))
    c = SimpleNamespace(**dict(zip(Constants._fields, columns, strict=True)))
    still = np.zeros(table.L.size)
    y = Motion(still, still, still, still, still, c.v_0.copy())
    largest, h = still.copy(), STEP_S

    def ahead(y: Motion, k: Motion, step: float) -> Motion:
        return Motion(*(a + step * b for a, b in zip(y, k, strict=True)))

    for _ in range(round(horizon / h)):
        k_1 = rate(y, c, both_faces=both_faces)
        k_2 = rate(ahead(y, k_1, 0.5 * h), c, both_faces=both_faces)
        k_3 = rate(ahead(y, k_2, 0.5 * h), c, both_faces=both_faces)
        k_4 = rate(ahead(y, k_3, h), c, both_faces=both_faces)
        mean = Motion(*((a + 2.0 * b + 2.0 * d + e) / 6.0 for a, b, d, e in zip(k_1, k_2, k_3, k_4, strict=True)))
        # What has reached its limit stays there.
        going = largest < limit
        y = Motion(*(np.where(going, a, b) for a, b in zip(ahead(y, mean, h), y, strict=True)))
        largest = np.maximum(largest, np.abs(y.theta))
    return largest


def one_face_words(grid: Path) -> str:
    """Return what becomes of the passes of a grid with soil behind the boulder alone."""
    sweep = load(grid)
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    sample = sampled_designs(sweep, SAMPLE)
    standing = evaluation.judged(sample).verdict == PASS
    table = sample.rows(standing).table
    limit, horizon = evaluation.limits.rotation, evaluation.control.horizon
    known = simulate_table(table, corrected(), Control(5e-4, horizon, limit, 0, False)).theta_max
    both = largest_rotation(table, limit, horizon, both_faces=True)
    alone = largest_rotation(table, limit, horizon, both_faces=False)
    apart = np.degrees(np.abs(both - known).max())
    return (
        f"Of {len(known)} passes of a sample of `configs/{grid.name}`, {np.count_nonzero(alone >= limit)} overturn "
        f"with soil behind the boulder alone. (With soil on both faces, this study's integrator differs from the "
        f"model by at most {apart:.1g}°.)"
    )
