"""What an impact comes to: its trajectory, its maxima and the instants that matter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import OdeSolution
from scipy.optimize import brentq, minimize_scalar

from .dynamics import Modes, Problem, contact_displacement
from .energy import Ledger, ledger

Array = NDArray[np.float64]

# Instants at which each step of the integrator is looked at; its steps are short beside any oscillation.
SAMPLES_PER_STEP = 8


@dataclass(frozen=True)
class Peak:
    """A largest value and its time [s]."""

    value: float
    time: float


@dataclass(frozen=True)
class Event:
    """A located change of mode."""

    time: float
    name: str
    modes: Modes


@dataclass
class Impact:
    """An impact that has been simulated.

    Attributes
    ----------
    problem : Problem
        What was simulated.
    solution : scipy.integrate.OdeSolution
        Dense output: time [s] -> seven states of Eq 52, then path integrals of `tests.oracle.energy`.
    steps : ndarray
        Ends of the integrator's steps [s], events included.
    events : list of Event
        The first modes and every change.
    """

    problem: Problem
    solution: OdeSolution
    steps: Array
    events: list[Event] = field(default_factory=list)

    @property
    def t_end(self) -> float:
        """Simulated time [s]."""
        return float(self.steps[-1])

    def states(self, t: ArrayLike) -> Array:
        """The seven states of Eq 52 at times `t` [s], shape (7, n)."""
        return np.asarray(self.solution(np.atleast_1d(t)))[:7]

    def force(self, t: ArrayLike) -> Array:
        """Force F_v on the boulder [N] at times `t` [s] (Eq 47; the vehicle cannot pull)."""
        return np.maximum(-self.problem.inputs.m_v * self.states(t)[6], 0.0)

    def energy(self, t: ArrayLike) -> Ledger:
        """Energy ledger at times `t` [s]."""
        return ledger(self.problem, np.asarray(self.solution(np.atleast_1d(t))))

    @property
    def samples(self) -> Array:
        """Instants [s] close enough to find extremes and crossings between."""
        inside = np.linspace(0.0, 1.0, SAMPLES_PER_STEP, endpoint=False)
        starts, lengths = self.steps[:-1], np.diff(self.steps)
        return np.append((starts[:, None] + lengths[:, None] * inside).ravel(), self.steps[-1])

    @property
    def max_rotation(self) -> Peak:
        """Largest absolute rotation [rad]."""
        return self._peak(lambda t: np.abs(self.states(t)[2]))

    @property
    def max_displacement(self) -> Peak:
        """Largest x_b [m]."""
        return self._peak(lambda t: self.states(t)[0])

    @property
    def max_vehicle_displacement(self) -> Peak:
        """Largest x_v [m]."""
        return self._peak(lambda t: self.states(t)[4])

    @property
    def max_crush(self) -> Peak:
        """Largest x_v less the displacement of the point struck [m] while the vehicle drives forward."""

        def crush(t: float) -> float:
            y = self.states(t)[:, 0]
            return float(y[4]) - contact_displacement(self.problem, y)

        def speed(t: float) -> float:
            return float(self.states(t)[5, 0])

        samples = self.samples
        forward = np.flatnonzero(self.states(samples)[5] > 0)
        if forward.size == 0:
            return Peak(0.0, 0.0)
        best = int(forward[np.argmax([crush(float(t)) for t in samples[forward]])])
        low, high = samples[max(best - 1, 0)], samples[min(best + 1, samples.size - 1)]
        if speed(high) < 0:
            high = brentq(speed, samples[best], high, xtol=1e-14)
        inside = minimize_scalar(lambda t: -crush(t), bounds=(low, high), method="bounded", options={"xatol": 1e-10})
        time = max((float(samples[best]), float(high), float(inside.x)), key=crush)
        return Peak(crush(time), time)

    @property
    def peak_force(self) -> Peak:
        """Largest F_v [N]."""
        return self._peak(self.force)

    def time_of_rotation(self, theta: float) -> float:
        """First time [s] at which the absolute rotation reaches `theta` [rad]; NaN where it never does."""

        def excess(t: ArrayLike) -> Array:
            return np.abs(self.states(t)[2]) - theta

        samples = self.samples
        beyond = np.flatnonzero(excess(samples) >= 0)
        if beyond.size == 0:
            return nan
        first = beyond[0]
        if first == 0:
            return float(samples[0])
        return float(brentq(lambda t: float(excess(t)[0]), samples[first - 1], samples[first], xtol=1e-15))

    def _peak(self, quantity: Callable[[ArrayLike], Array]) -> Peak:
        samples = self.samples
        values = quantity(samples)
        best = int(np.argmax(values))
        low, high = samples[max(best - 1, 0)], samples[min(best + 1, samples.size - 1)]
        refined = minimize_scalar(
            lambda t: -float(quantity(t)[0]), bounds=(low, high), method="bounded", options={"xatol": 1e-10}
        )
        if -refined.fun > values[best]:
            return Peak(float(-refined.fun), float(refined.x))
        return Peak(float(values[best]), float(samples[best]))
