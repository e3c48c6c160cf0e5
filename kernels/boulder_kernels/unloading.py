"""A motion in plastic soil: what the soil remembers after a step, and where the boulder rests (Eqs 121 to 124).

**Steps.** A step is integrated with the memory at its start, which is exact as long as an element moves one way. Where
one turns back within a step, the memory is written with the displacement at which it turned, by the cubic through both
ends of the step; from there to the end of the step its force was that of an element that goes on, an error of third
order, as of a kink that no step lands on.

**Rest.** With the drag as the only damping, which falls with the square of the speed, a boulder rings for a long time.
But from what the soil remembers now, the least work that brings it to another displacement is that of the straight way
there (`boulder_kernels.plastic.potential_of_plastic_elements`): to push an element to and fro takes more. So the energy
argument of `boulder_kernels.settling` holds with the potential about the present memory, at any time. The boulder
will come to rest where this potential with its weight is least, and until then it stays between the two angles that its
energy does not suffice to pass. The half that is farther away is the doubt of where it will rest. A simulation goes
on until that is less than REST, or its longest time is over; then the doubt that is left is reported.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ._jit import inlined, kernel, unless_none
from .after_step import RUNNING, Decided, Ending
from .dynamics import Acceleration, State, Switches, rate_of
from .numerics import sine_versine
from .outcomes import Status, highest
from .plastic import LAST, PEAK, SWING, WORK, Memory, push, slider_energy
from .settling import boulder_energy, least_plastic_energy
from .soil import soil_kinematics

REST = math.radians(0.1)
"""A boulder is at rest that provably stays this close to where it will be in the end [rad]."""
FIRST_STEP = 1e-4
"""First angle at which the search for what the energy does not suffice to pass looks [rad]."""
HALVINGS = 16
"""Steps of that search once it has passed it."""
SECTIONS = 50
"""Sections of the search for the least energy; each leaves 0.618 of the interval."""
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


class Rest(NamedTuple):
    """Where a boulder comes to rest."""

    theta: float
    """Rotation of least energy [rad]."""
    doubt: float
    """How far from it the boulder may still get [rad]."""


@kernel
def clear(memory: Memory) -> None:
    """Make the soil forget everything."""
    for n in range(memory.front.size):
        memory.front[n] = memory.back[n] = 0.0
    for i in range(memory.so_far.size):
        memory.so_far[i] = 0.0


@kernel
def write_memory(y: State, y_end: State, h: float, c: Any, memory: Memory) -> None:
    """Write what the soil remembers after a step.

    Parameters
    ----------
    y, y_end
        States at the ends of what is kept of it.
    h
        Length of that [s].
    c
        Constants of the design.
    memory
        What the soil remembers; written.
    """
    soil = c.soil
    sin, versin = sine_versine(y.theta_b)
    k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
    sin, versin = sine_versine(y_end.theta_b)
    k_end = soil_kinematics(y_end.x_b, y_end.v_b, y_end.omega_b, sin, versin, c)
    work = 0.0
    for n in range(soil.ratio.size):
        ratio, limit = soil.ratio[n], soil.ultimate[n] / soil.stiffness[n]
        end = k_end.A - k_end.slope_x * ratio
        turn = turned_at(k.A - k.slope_x * ratio, k.B - k.slope_v * ratio, end, k_end.B - k_end.slope_v * ratio, h)
        work += soil.ultimate[n] * (push(n, turn, limit, memory) + push(n, end, limit, memory))
    so_far = memory.so_far
    so_far[WORK] += work
    swing(turned_at(y.theta_b, y.omega_b, y_end.theta_b, y_end.omega_b, h), so_far)
    swing(y_end.theta_b, so_far)
    for i in range(6):
        so_far[LAST + i] = y_end[i]


@kernel
def work_of_sliders(y: State, c: Any, memory: Memory) -> tuple[float, float]:
    """Plastic work of the soil [J] (Eq 123): up to the start of the step that a state is in, and since then."""
    sin, versin = sine_versine(y.theta_b)
    k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
    return memory.so_far[WORK], slider_energy(k, c.soil, memory)


plastic_work = unless_none("y c memory", work_of_sliders, "(0.0, 0.0)")
"""Plastic work of the soil [J] (Eq 123): up to the start of the step that a state is in, and since then."""


@kernel
def turned_at(x: float, rate: float, x_end: float, rate_end: float, h: float) -> float:
    """Displacement at which a motion turned back within a step of length h [s], or that at its end."""
    way = 1.0 if rate > 0.0 else -1.0
    farthest, _ = highest(way * x, way * rate, way * x_end, way * rate_end, h)
    return way * farthest


@kernel
def swing(theta: float, so_far: Any) -> None:
    """Note a rotation: the largest so far, or how far back from it."""
    peak = so_far[PEAK]
    if abs(theta) > abs(peak):
        so_far[PEAK], so_far[SWING] = theta, 0.0
    else:
        back = peak - theta if peak > 0.0 else theta - peak
        so_far[SWING] = max(so_far[SWING], back)


@kernel
def keep_sample(sample: int, memory: Memory) -> None:
    """Keep what the soil remembers beside a sample of the record."""
    n = memory.front.size
    row = memory.samples[sample]
    for i in range(n):
        row[i], row[n + i] = memory.front[i], memory.back[i]
    row[2 * n] = memory.so_far[WORK]


@kernel
def recall_sample(sample: int, memory: Memory) -> None:
    """Let the soil remember what it did at a sample of the record."""
    n = memory.front.size
    row = memory.samples[sample]
    for i in range(n):
        memory.front[i], memory.back[i] = row[i], row[n + i]
    memory.so_far[WORK] = row[2 * n]


recall = unless_none("sample memory", recall_sample, "None")
"""The same of any soil; elastic soil remembers nothing."""


@kernel
def resting_energy(theta: float, c: Any) -> float:
    """Lower bound of the potential energy at a rotation, wherever x_b, given what the soil remembers [J]."""
    sin, versin = sine_versine(theta)
    return c.C_cos * abs(sin) + c.C_sin * versin + least_plastic_energy(c.d * sin, c)


@kernel
def not_passed(theta: float, side: float, E: float, theta_limit: float, c: Any) -> float:
    """Rotation to one side of theta that an energy E [J] does not suffice to pass [rad]; at most the limit."""
    inside, ahead = theta, FIRST_STEP
    outside = theta + side * ahead
    while side * outside < theta_limit and resting_energy(outside, c) <= E:
        ahead *= 2.0
        inside, outside = outside, theta + side * ahead
    if side * outside >= theta_limit:
        return side * theta_limit
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if resting_energy(middle, c) <= E:
            inside = middle
        else:
            outside = middle
    return outside


@kernel
def rest_of(y: State, theta_limit: float, c: Any) -> Rest:
    """Where a boulder comes to rest that a state leaves in plastic soil.

    Parameters
    ----------
    y
        The state; the truck must not move forward any more.
    theta_limit
        Limit of rotation [rad].
    c
        `PlasticConstants` of a design whose readings allow a proof, see `boulder_kernels.settling`.
    """
    E = boulder_energy(y, c)
    first, last = not_passed(y.theta_b, -1.0, E, theta_limit, c), not_passed(y.theta_b, 1.0, E, theta_limit, c)
    low, high = first, last
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_a, at_b = resting_energy(a, c), resting_energy(b, c)
    for _ in range(SECTIONS):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - GOLDEN * (high - low)
            at_a = resting_energy(a, c)
        else:
            low, a, at_a = a, b, at_b
            b = low + GOLDEN * (high - low)
            at_b = resting_energy(b, c)
    theta = 0.5 * (low + high)
    return Rest(theta, max(theta - first, last - theta))


@inlined
def rate_with_memory(k_end: Acceleration, y: State, switches: Switches, c: Any, memory: Memory) -> Acceleration:
    """Acceleration at the start of a step in plastic soil, by what it remembers now."""
    return rate_of(y, switches, c)


@kernel
def go_on_until_rest(decided: Decided, y: State, ending: Ending, c: Any, memory: Memory) -> Decided:
    """Go on with a motion that is decided but not at rest."""
    if decided.status != Status.BELOW_LIMIT.value or decided.t >= ending.longest:
        return decided
    if rest_of(y, ending.theta_limit, c).doubt < REST:
        return decided
    return Decided(RUNNING, decided.t, decided.barrier, min(decided.horizon + ending.extension, ending.longest))


# What a simulation calls about its steps; nothing at all where the memory is None, as for elastic soil.

forget = unless_none("memory", clear, "None")
"""Begin anew: plastic soil forgets what was."""
remember = unless_none("y y_end h c memory", write_memory, "None")
"""Write what the soil remembers after a step."""
note = unless_none("sample memory", keep_sample, "None")
"""Keep what the soil remembers beside a sample of the record."""
rate_after = unless_none("k_end y switches c memory", rate_with_memory, "k_end")
"""Acceleration at the start of the next step: that at the end of the last one, unless the soil remembers it."""
until_rest = unless_none("decided y ending c memory", go_on_until_rest, "decided")
"""Where the soil is plastic, go on with a motion that is decided until the boulder is at rest."""
