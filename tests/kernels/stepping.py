"""Motions of a few milliseconds from any state and mode, to measure the order of the integrator on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import boulder_kernels as bk
from boulder_kernels.dormand_prince import step
from boulder_kernels.dynamics import Modes, State, rate_of
from boulder_kernels.impact import RUNNING, Clock, Impact, Pace, enter_modes, follow, go_on
from boulder_kernels.outcomes import compression_at, no_maxima
from boulder_kernels.settling import NO_PROOF

from .samples import compression, control

SCALE = np.array([1.0, 30.0, 1.0, 30.0, 1.0, 30.0])
"""What an error in each component of the state is measured against: [m], [m/s], [rad], [rad/s], [m], [m/s]."""
NO_LIMIT = 9.0


class Start(NamedTuple):
    """Where a motion begins."""

    constants: bk.Constants
    readings: bk.Readings
    state: State
    modes: Modes


def with_compression(y: State, u: float, c: bk.Constants) -> State:
    """State with the truck moved to where its spring is compressed by u [m], or off the boulder where negative."""
    y = y._replace(x_v=0.0)
    return y._replace(x_v=u - compression(y, c))


def advance(begin: Start, T: float, steps: int, locate_yield: bool = False) -> tuple[np.ndarray, list[int]]:
    """Follow a motion for T [s] by equal steps, cut at events; return its last state and the events met."""
    c, readings, y, modes = begin
    h = T / steps
    how = control(h, T, NO_LIMIT, stop_at_limit=True)._replace(locate_yield=locate_yield)
    switches, factors = enter_modes(modes, readings, NO_LIMIT, locate_yield, how.event_tolerance, c)
    clock = Clock(0.0, h, h, 0.0, NO_PROOF, T, 0.0, 0.0)
    k, front = rate_of(y, switches, c), compression_at(y, switches, c)
    i = Impact(Pace(h, h, 1e6), y, k, front, no_maxima(), clock, modes, switches, factors)
    status, met = RUNNING, []
    while status == RUNNING:
        y_end, k_end, error = step(i.y, i.k, i.clock.h, i.switches, c)
        plain, after = go_on(i, y_end, k_end, error, c)
        if not plain:
            followed = follow(i, y_end, k_end, error, c, readings, how)
            status, after = followed.status, followed.impact
            met += [followed.event] if followed.event >= 0 else []
        i = after
    return np.array(i.y), met


def errors(
    start: Start, T: float, steps: Sequence[int], fine: int, locate_yield: bool = False, phases: int = 6
) -> tuple[np.ndarray, set[tuple[int, ...]]]:
    """Error at the end of a motion against one by ``fine`` steps, and the sequences of events met.

    The error is the geometric mean over a few lengths of the motion from T to 3T/2, because at one length alone it
    depends on where in a step a kink happens to fall.
    """
    logs, met = [], set()
    for phase in range(phases):
        length = T * (1.0 + 0.5 * phase / phases)
        exact, events = advance(start, length, fine, locate_yield)
        met.add(tuple(events))
        coarse = [advance(start, length, n, locate_yield)[0] for n in steps]
        logs.append([np.log(np.linalg.norm((y - exact) / SCALE)) for y in coarse])
    return np.exp(np.mean(logs, axis=0)), met


def order(steps: Sequence[int], found: np.ndarray) -> float:
    """Order of convergence: the slope of error over step."""
    return -float(np.polyfit(np.log(steps), np.log(found), 1)[0])
