"""The least-squares problem behind a fit: unknowns, residuals, where to start, standard errors."""

from __future__ import annotations

import math

import numpy as np

from boulder_sweep.crash_tests.fitting.pulse import RESPONSES, Pulse
from boulder_sweep.crash_tests.fitting.scatter import scatter_of, summed
from boulder_sweep.crash_tests.rigid_wall import RigidWall

RATIO_BOUNDS = (2e-3, 2e2)
"""Range of c/sqrt(k m) that is searched; at its ends one of the two elements is as good as rigid."""


class Problem:
    """The least-squares problem: unknowns log sqrt(k/m), log(c/sqrt(k m)) and, where not given, v_0."""

    least_share = 1e-14
    """Combinations of unknowns that move the response less than this, as a share of the most, are left out."""

    def __init__(self, pulse: Pulse, mass_kg: float, speed_m_s: float | None) -> None:
        self.pulse = pulse
        self.mass_kg = mass_kg
        self.speed_m_s = speed_m_s
        self.known = {name: np.isfinite(values) for name, values in pulse.signals.items()}

    def range(self, name: str) -> float:
        """Range of a signal, never zero."""
        values = self.pulse.signals[name][self.known[name]]
        return max(float(np.abs(values).max()), float(np.ptp(values)), 1e-12)

    def wall(self, unknowns: np.ndarray) -> RigidWall:
        """Vehicle that the unknowns stand for."""
        rate, ratio = math.exp(unknowns[0]), math.exp(unknowns[1])
        speed = float(unknowns[2]) if self.speed_m_s is None else self.speed_m_s
        return RigidWall(self.mass_kg, speed, self.mass_kg * rate**2, ratio * rate * self.mass_kg)

    def by_signal(self, unknowns: np.ndarray) -> dict[str, np.ndarray]:
        """Measured minus computed where there are values, in the units of the signals."""
        wall = self.wall(unknowns)
        return {
            name: (values - RESPONSES[name](wall, self.pulse.time_s))[self.known[name]]
            for name, values in self.pulse.signals.items()
        }

    def residuals(self, unknowns: np.ndarray, scales: dict[str, float]) -> np.ndarray:
        """Residuals of all signals as multiples of their scales."""
        return np.concatenate([values / scales[name] for name, values in self.by_signal(unknowns).items()])

    def start(self, scales: dict[str, float]) -> np.ndarray:
        """Best of a grid of vehicles; the response is proportional to the speed, which so follows from each."""
        last = float(self.pulse.time_s[-1])
        best, found = math.inf, np.zeros(3)
        for rate in np.geomspace(0.1, 200.0, 31) / last:
            for ratio in np.geomspace(*RATIO_BOUNDS, 21):
                unit = RigidWall(self.mass_kg, 1.0, self.mass_kg * rate**2, ratio * rate * self.mass_kg)
                shape, data = [], []
                for name, values in self.pulse.signals.items():
                    known = self.known[name]
                    shape.append(RESPONSES[name](unit, self.pulse.time_s)[known] / scales[name])
                    data.append(values[known] / scales[name])
                one, other = np.concatenate(shape), np.concatenate(data)
                speed = self.speed_m_s if self.speed_m_s is not None else max(float(one @ other / (one @ one)), 1e-6)
                misfit = float(np.sum((other - speed * one) ** 2))
                if misfit < best:
                    best, found = misfit, np.array([math.log(rate), math.log(ratio), speed])
        return found if self.speed_m_s is None else found[:2]

    def bounds(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Range of the unknowns."""
        last = float(self.pulse.time_s[-1])
        low = [math.log(0.01 / last), math.log(RATIO_BOUNDS[0]), 1e-9]
        high = [math.log(2000.0 / last), math.log(RATIO_BOUNDS[1]), 1e4]
        return np.array(low[: len(start)]), np.array(high[: len(start)])

    def covariance(self, unknowns: np.ndarray, scales: dict[str, float]) -> np.ndarray:
        """Covariance of the unknowns, shape (p, p).

        The sandwich of least squares, (JᵀJ)⁻¹ Jᵀ Σ J (JᵀJ)⁻¹, with the covariance Σ of the residuals of all signals as
        `boulder_sweep.crash_tests.fitting.scatter` finds it from them.
        """
        n = len(unknowns)
        steps = 1e-6 * np.maximum(np.abs(unknowns), 1.0)
        columns = []
        for k in range(n):
            ahead, behind = (unknowns + sign * steps * (np.arange(n) == k) for sign in (1.0, -1.0))
            up, down = self.by_signal(ahead), self.by_signal(behind)
            columns.append({name: (up[name] - down[name]) / (2.0 * steps[k]) / scales[name] for name in up})
        bread, scatters = np.zeros((n, n)), []
        for name, residuals in self.by_signal(unknowns).items():
            jacobian = np.stack([column[name] for column in columns], axis=1)
            bread += jacobian.T @ jacobian
            times = self.pulse.time_s[self.known[name]]
            scatters.append(scatter_of(name, times, residuals / scales[name], jacobian))
        masks = list(self.known.values())
        middle = summed(scatters, together=all(np.array_equal(mask, masks[0]) for mask in masks))
        inverse = np.linalg.pinv(bread, rcond=self.least_share, hermitian=True)
        return np.asarray(inverse @ middle @ inverse)

    def standard_errors(self, unknowns: np.ndarray, scales: dict[str, float]) -> tuple[float, float, float]:
        """Standard errors of spring [N/m], damper [N s/m] and speed [m/s]."""
        n, covariance, wall = len(unknowns), self.covariance(unknowns, scales), self.wall(unknowns)
        # k = m exp(2 u_0), c = m exp(u_0 + u_1)
        of_spring = np.eye(n)[0] * 2.0 * wall.spring_N_m
        of_damper = (np.eye(n)[0] + np.eye(n)[1]) * wall.damper_N_s_m
        of_speed = np.eye(3, n)[2]
        spring, damper, speed = (
            math.sqrt(max(float(g @ covariance @ g), 0.0)) for g in (of_spring, of_damper, of_speed)
        )
        return spring, damper, speed
