"""A whole impact: Eq 52 integrated by DOP853, or where it is stiff by Radau, each discontinuity located and stepped on.

The modes (`tests.oracle.dynamics.Modes`) are held while the integrator runs. After each step, everything that
can end a mode is looked at along the dense output; where something did, the step is cut at that instant, the
mode changes, and the integration starts anew.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, OdeSolution, Radau
from scipy.optimize import brentq

from .dynamics import Problem, contact_displacement, loads, problem, rate_under
from .energy import path_rates
from .events import Watch, first_modes, kinks, watches
from .inputs import Inputs, Readings
from .outcome import SAMPLES_PER_STEP, Event, Impact

Array = NDArray[np.float64]
Dense = Callable[[float], Array]

# Size of error tolerated per step near zero, for the states of Eq 52 and the path integrals [J].
_ABSOLUTE = np.array([1e-12, 1e-11, 1e-13, 1e-11, 1e-12, 1e-11, 1e-9, 1e-5, 1e-5, 1e-5, 1e-5])
_LONGEST_STEP = 2e-3  # [s]: keeps the samples within a step closer than any two events worth telling apart
_MOST_EVENTS = 20_000


@cache
def simulate(
    inputs: Inputs,
    readings: Readings,
    *,
    elements: int | None = None,
    horizon: float = 0.5,
    rotation_limit: float | None = None,
    rtol: float = 1e-10,
    land_on_kinks: bool = True,
    stiff: bool = False,
) -> Impact:
    """Simulate one impact; the same one again is not simulated again.

    Parameters
    ----------
    inputs : Inputs
        The impact.
    readings : Readings
        Reading of each doubtful formula.
    elements : int, optional
        Number N of soil elements, summed literally; without it, N -> infinity.
    horizon : float
        Time to simulate [s].
    rotation_limit : float, optional
        Stop where the absolute rotation reaches this [rad], located; without it, go on to the horizon.
    rtol : float
        Relative tolerance of DOP853; the absolute tolerances scale with it.
    land_on_kinks : bool
        Also land a step where the rates are not smooth (see `tests.oracle.events.kinks`).
    stiff : bool
        Integrate by Radau's implicit method.

    Returns
    -------
    Impact

    Raises
    ------
    RuntimeError
        If the integrator fails or the modes change without end.
    """
    impact = problem(inputs, readings, elements)
    runner = _Runner(impact, horizon, rotation_limit, rtol, land_on_kinks, Radau if stiff else DOP853)
    return runner.run()


class _Runner:
    """State of one integration between its segments."""

    def __init__(
        self,
        impact: Problem,
        horizon: float,
        rotation_limit: float | None,
        rtol: float,
        land_on_kinks: bool,
        method: type[DOP853] | type[Radau],
    ) -> None:
        self.method = method
        self.impact = impact
        self.horizon = horizon
        self.rotation_limit = rotation_limit
        self.rtol = rtol
        self.land_on_kinks = land_on_kinks
        self.modes = first_modes(impact)
        self.contact_at_release = 0.0
        self.t = 0.0
        self.y = np.concatenate((impact.start, np.zeros(4)))
        self.steps = [0.0]
        self.pieces: list[Dense] = []
        self.events = [Event(0.0, "first touch", self.modes)]

    def run(self) -> Impact:
        segments = 0
        while self.t < self.horizon and not self._beyond_limit(self.y):
            segments += 1
            if segments > _MOST_EVENTS:
                raise RuntimeError(f"more than {_MOST_EVENTS} changes of mode by {self.t} s")
            self._segment()
        solution = OdeSolution(np.array(self.steps), self.pieces)
        return Impact(self.impact, solution, np.array(self.steps), self.events)

    def _rate(self, _t: float, y: Array) -> Array:
        load = loads(self.impact, y, self.modes)
        return np.concatenate((rate_under(self.impact, y, self.modes, load), path_rates(self.impact, y, load)))

    def _beyond_limit(self, y: Array) -> bool:
        return self.rotation_limit is not None and abs(float(y[2])) >= self.rotation_limit

    def _segment(self) -> None:
        """Integrate from an event to the next one (or a kink, the limit, the horizon)."""
        watched = watches(self.impact, self.modes, self.contact_at_release)
        if self.rotation_limit is not None:
            watched.append(self._limit_watch(self.rotation_limit))
        kink_values = kinks(self.impact, self.modes)
        kink_signs = np.sign(kink_values(self.y)) if self.land_on_kinks else None
        solver = self.method(
            self._rate,
            self.t,
            self.y,
            self.horizon,
            rtol=self.rtol,
            atol=_ABSOLUTE * (self.rtol / 1e-10),
            max_step=_LONGEST_STEP,
        )
        while solver.status == "running":
            message = solver.step()
            if solver.status == "failed":
                raise RuntimeError(f"the integrator failed at {solver.t} s: {message}")
            dense = solver.dense_output()
            times = np.linspace(solver.t_old, solver.t, SAMPLES_PER_STEP + 1)
            for before, after in pairwise(times):
                crossed = [w for w in watched if w.value(dense(after)) < 0]
                turned = False
                if kink_signs is not None:
                    now = np.sign(kink_values(dense(after)))
                    turned = bool(np.any(now * kink_signs < 0))
                if crossed or turned:
                    self._land(dense, before, after, crossed, kink_values if turned else None, kink_signs)
                    return
                if kink_signs is not None:
                    kink_signs = np.where(now != 0, now, kink_signs)
            self._keep(solver.t, dense)
        self.y = solver.y

    def _limit_watch(self, limit: float) -> Watch:
        return Watch("rotation limit", lambda y: limit - abs(float(y[2])), lambda y: (self.modes, y))

    def _keep(self, t: float, dense: Dense) -> None:
        """Add the dense output up to `t`, unless that is nothing."""
        self.t = float(t)
        if self.t > self.steps[-1]:
            self.steps.append(self.t)
            self.pieces.append(dense)

    def _land(
        self,
        dense: Dense,
        before: float,
        after: float,
        crossed: list[Watch],
        kink_values: Callable[[Array], Array] | None,
        kink_signs: Array | None,
    ) -> None:
        """Cut the step at the first of the events between two samples and change the mode."""
        found: list[tuple[float, Watch | None]] = []
        for watch in crossed:
            found.append((_locate(_along(dense, watch.value), before, after), watch))
        if kink_values is not None and kink_signs is not None:
            turned = np.sign(kink_values(dense(after))) * kink_signs < 0
            for i in np.flatnonzero(turned):
                found.append((_locate(_along(dense, _component(kink_values, kink_signs, int(i))), before, after), None))
        time, first = min(found, key=lambda item: item[0])
        self._keep(time, dense)
        self.y = np.array(dense(time))
        if first is None:
            return
        modes, state = first.follow(self.y)
        self.y = state
        if modes.contact == "coasting" and self.modes.contact == "touching":
            self.contact_at_release = float(state[4]) - contact_displacement(self.impact, state)
        self.modes = modes
        self.events.append(Event(time, first.name, modes))


def _along(dense: Dense, value: Callable[[Array], float]) -> Callable[[float], float]:
    return lambda t: value(dense(t))


def _component(values: Callable[[Array], Array], signs: Array, i: int) -> Callable[[Array], float]:
    """One of several quantities, positive before it turns."""
    return lambda y: float(signs[i] * values(y)[i])


def _locate(value: Callable[[float], float], before: float, after: float) -> float:
    """The instant at which `value` turns negative, taken just behind the root, where the new mode holds."""
    # a segment may start on the very edge of its mode
    root = brentq(value, before, after, xtol=1e-15, rtol=1e-15) if value(before) > 0 else before
    behind = 1e-13  # [s]
    while root + behind < after and value(root + behind) >= 0:
        behind *= 4
    return float(min(root + behind, after))
