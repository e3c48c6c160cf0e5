"""Events: when a mode ends and which one follows; and the kinks worth landing a step on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .constants import impact_lever
from .dynamics import Modes, Problem, Rotation, contact_displacement, loads, motion_of
from .restoring import gravity_hold, printed_limit, printed_sign

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Watch:
    """A quantity that stays >= 0 while a mode holds.

    Attributes
    ----------
    name : str
        What happens where it turns negative.
    value : callable
        The quantity as a function of the state.
    follow : callable
        State at the event -> modes after it and the state from which to go on.
    """

    name: str
    value: Callable[[Array], float]
    follow: Callable[[Array], tuple[Modes, Array]]


def first_modes(impact: Problem) -> Modes:
    """Modes at the first touch: held, unless the printed rule lets go of a boulder struck below its centre (Eq 38)."""
    struck_below = impact_lever(impact.constants, 0.0) < 0
    free = impact.readings.restoring == "printed" and struck_below
    return Modes("backward" if free else "held", "touching", printed_sign(impact.constants, 0.0))


def rest_modes(impact: Problem, y: Array, modes: Modes) -> Modes:
    """Modes of a boulder that has come to omega = 0 under the printed rule.

    It comes from omega > 0 or stays beside it, where Eqs 37 and 39 make the restoring moment equal and opposite to the
    sum of all others until its maximum is reached: what is within the maximum, either way, cannot move the boulder.
    What is left over moves it on; what points back beyond the maximum turns it back, and Eq 38 lets it go. With the
    corner left of the centre (sign < 0) the moment of Eq 39 has the sign of the net moment and holds nothing.
    """
    theta = float(y[2])
    sign = printed_sign(impact.constants, theta)
    net = loads(impact, y, replace(modes, rotation="backward")).net
    limit = printed_limit(impact.constants, theta)
    rotation: Rotation
    if sign > 0 and abs(net) <= limit:
        rotation = "held"
    else:
        rotation = "forward" if net >= 0 else "backward"
    return replace(modes, rotation=rotation, sign=sign)


def watches(impact: Problem, modes: Modes, contact_at_release: float) -> list[Watch]:
    """All that can end the present modes.

    `contact_at_release` is x_v less the displacement of the point struck [m] at the last release.
    """
    if impact.readings.restoring == "gravity":
        rotation = _gravity_watches(impact, modes)
    else:
        rotation = _printed_watches(impact, modes)
    return [*rotation, _contact_watch(impact, modes, contact_at_release)]


def _gravity_watches(impact: Problem, modes: Modes) -> list[Watch]:
    if modes.rotation == "held":
        hold = gravity_hold(impact.inputs, impact.constants)

        def release(y: Array) -> tuple[Modes, Array]:
            clockwise = loads(impact, y, modes).net > 0
            return replace(modes, rotation="clockwise" if clockwise else "anticlockwise"), y

        return [Watch("release", lambda y: hold - abs(loads(impact, y, modes).net), release)]
    side = 1.0 if modes.rotation == "clockwise" else -1.0
    other = replace(modes, rotation="anticlockwise" if side > 0 else "clockwise")
    # Passing theta = 0 it goes on to the other side: to stay it would need omega = 0 too, which never happens
    # at once by itself.
    return [Watch("upright", lambda y: side * float(y[2]), lambda y: (other, y))]


def _printed_watches(impact: Problem, modes: Modes) -> list[Watch]:
    def at_rest(y: Array) -> tuple[Modes, Array]:
        stopped = y.copy()
        stopped[3] = 0.0
        return rest_modes(impact, stopped, modes), stopped

    def released(y: Array) -> tuple[Modes, Array]:
        return replace(modes, rotation="forward" if net(y) > 0 else "backward"), y

    def net(y: Array) -> float:
        return loads(impact, y, modes).net

    def limit(y: Array) -> float:
        return printed_limit(impact.constants, float(y[2]))

    if modes.rotation == "backward":
        return [Watch("stop", lambda y: -float(y[3]), at_rest)]
    if modes.rotation == "held":
        return [
            Watch("release backward", lambda y: limit(y) + net(y), released),
            Watch("release forward", lambda y: limit(y) - net(y), released),
        ]

    def sign_now(y: Array) -> float:
        return printed_sign(impact.constants, float(y[2]))

    return [
        Watch("stop", lambda y: float(y[3]), at_rest),
        Watch(
            "restoring moment turns round",
            lambda y: modes.sign * float(np.sin(impact.constants.gamma_N + y[2])),
            lambda y: (replace(modes, sign=sign_now(y)), y),
        ),
    ]


def _contact_watch(impact: Problem, modes: Modes, contact_at_release: float) -> Watch:
    def unloaded(y: Array) -> Array:
        y = y.copy()
        y[6] = 0.0
        return y

    touching = replace(modes, contact="touching")
    if modes.contact == "coasting":
        return Watch(
            "contact regained",
            lambda y: contact_at_release - (float(y[4]) - contact_displacement(impact, y)),
            lambda y: (touching, unloaded(y)),
        )
    if modes.contact == "clipped":
        return Watch("force returns", lambda y: float(y[6]), lambda y: (touching, y))
    if impact.readings.separation == "printed":
        return Watch("force clipped", lambda y: -float(y[6]), lambda y: (replace(modes, contact="clipped"), y))
    coasting = replace(modes, contact="coasting")
    return Watch("contact lost", lambda y: -float(y[6]), lambda y: (coasting, unloaded(y)))


def kinks(impact: Problem, modes: Modes) -> Callable[[Array], Array]:
    """Quantities through whose zeros the rates are continuous but not smooth.

    At either end of the soil: the cap reached either way, the drag turning. For the printed rule also the
    restoring moment reaching its limit either way. Between the ends of the soil, a sum over many elements is
    close to an integral, and that is smooth.
    """
    forward = modes.rotation == "forward"

    def values(y: Array) -> Array:
        motion = motion_of(y)
        dx, v = impact.soil.end_stretch(motion), impact.soil.end_velocity(motion)
        found = [dx - impact.soil.dx_yield, dx + impact.soil.dx_yield, v]
        if forward:
            net = loads(impact, y, modes).net
            limit = printed_limit(impact.constants, motion.theta)
            found.append(np.array([net - limit, net + limit]))
        return np.concatenate(found)

    return values
