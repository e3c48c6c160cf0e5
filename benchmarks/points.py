"""Peaks of many designs compared with those of a reference, reduced to a few error measures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import boulder_kernels as bk

LIMIT = bk.Status.LIMIT.value


class Peaks(NamedTuple):
    """What is compared: arrays of shape (n,)."""

    theta: np.ndarray
    """Largest rotation [rad]."""
    x_b: np.ndarray
    """Largest displacement of the boulder [m]."""
    x_v: np.ndarray
    """Largest displacement of the truck [m]."""
    overturned: np.ndarray
    """Whether the rotation reached its limit."""

    @classmethod
    def of(cls, out: bk.OutcomeTable) -> Peaks:
        """Return the peaks of outcomes."""
        return cls(out.theta_max, out.x_b_max, out.x_v_max, out.status == LIMIT)


@dataclass
class Point:
    """Cost and errors of one way to simulate."""

    preset: str
    way: str
    step_ms: float
    cpu_us: float
    theta_max_deg: float
    theta_p99_deg: float
    theta_rms_deg: float
    x_max_mm: float
    x_p99_mm: float
    x_rms_mm: float
    flips: int
    coverage: float = float("nan")
    """Share of the rows whose estimated error is not below the true one."""


def point_of(preset: str, way: str, step_s: float, cpu_us: float, found: Peaks, known: Peaks) -> Point:
    """Compare peaks with those of the reference."""
    both = ~found.overturned & ~known.overturned
    theta = np.degrees(np.abs(found.theta - known.theta))[both]
    x = 1e3 * np.maximum(np.abs(found.x_b - known.x_b), np.abs(found.x_v - known.x_v))[both]

    def sizes(errors: np.ndarray) -> tuple[float, float, float]:
        return float(errors.max()), float(np.quantile(errors, 0.99)), float(np.sqrt(np.mean(errors**2)))

    flips = int(np.sum(found.overturned != known.overturned))
    return Point(preset, way, 1e3 * step_s, cpu_us, *sizes(theta), *sizes(x), flips)


def observed_order(points: list[Point], longest_ms: float, shortest_ms: float) -> float:
    """Slope of the rms error of the rotation over the step, both logarithmic."""
    chosen = [p for p in points if shortest_ms <= p.step_ms <= longest_ms]
    steps, errors = [p.step_ms for p in chosen], [p.theta_rms_deg for p in chosen]
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
