"""Plastic soil elements: their memory, force, least work and plastic work, with and without a gap (Eqs 121 to 123).

The paper's soil is elastic: it gives back all that its springs took up. Here each spring is in series with a slider
that gives way at the ultimate resistance, and what the slider has moved stays. An element then presses by

    F = k clip(u - u_f, 0, y) - k clip(u_b - u, 0, y),    y = F_u / k

where u_f is the displacement at which its front comes to bear and u_b that at which its back does. Without a gap the
soil sticks to the boulder on both sides, and both are the same, the plastic displacement u_p. With a gap each side
keeps its own: u_f >= 0 grows with the largest displacement, u_b <= 0 with the least, and between them there is no soil
force at all.

What an element remembers changes with the motion, so it is held in arrays that are written as the simulation goes on.
A step is integrated with what was remembered at its start: as long as an element moves one way, its force is that of
an elastic one that starts there.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import inlined, kernel, overload
from .design import Constants
from .layered import SoilElements
from .layered_soil import power_of_elements
from .numerics import WIDTH, add, field, partial_sums, total
from .soil import Kinematics, Potential, Reaction

ELASTIC, PLASTIC, PLASTIC_WITH_GAP = range(3)
"""How the soil unloads, see `boulder_kernels.impact.Control`."""


def is_plastic(unloading: int) -> bool:
    """Whether soil that unloads in this way is plastic: it keeps a memory, and boulders in it come to rest."""
    return unloading in (PLASTIC, PLASTIC_WITH_GAP)


@overload(is_plastic)
def _is_plastic(unloading: Any) -> Callable[..., bool]:
    return is_plastic


class Memory(NamedTuple):
    """What N soil elements remember, and what is kept of the motion because of it."""

    front: np.ndarray
    """Displacement u_f beyond which the front of each element is pressed [m], shape (N,)."""
    back: np.ndarray
    """Displacement u_b below which its back is pressed [m], shape (N,); never more than u_f."""
    gap: bool
    """Whether a gap opens, else both are the same."""
    so_far: np.ndarray
    """Plastic work [J], rotation of largest modulus [rad], swing back from it [rad], and the state at the end of the
    last step in the order of `State`; shape (9,)."""
    samples: np.ndarray
    """u_f, u_b and the plastic work at each sample of a record, shape (n, 2 N + 1)."""


WORK, PEAK, SWING, LAST = range(4)
"""Indices of `Memory.so_far`; from LAST on, the state."""

_record: Any = namedtuple
PlasticConstants = _record("PlasticConstants", (*Constants._fields, "soil", "memory"))
"""The fields of `boulder_kernels.layered.LayeredConstants`, and ``memory``, the `Memory`."""


def memory_of(c: Any) -> Memory | None:
    """Return what the soil of constants remembers; None for elastic soil."""
    return c.memory if isinstance(c, PlasticConstants) else None


@overload(memory_of)
def _memory_of(c: Any) -> Callable[..., Any]:
    return (lambda c: c.memory) if c.instance_class is PlasticConstants else (lambda c: None)


def empty_memory(elements: int, gap: bool, samples: int = 0) -> Memory:
    """Return the memory of N elements that have not been pushed.

    Parameters
    ----------
    elements
        Number N of elements.
    gap
        Whether a gap opens behind the boulder.
    samples
        Number of samples of the record that goes with it.
    """
    n = elements
    return Memory(np.zeros(n), np.zeros(n), gap, np.zeros(LAST + 6), np.zeros((samples, 2 * n + 1)))


def at_sample(c: Any, sample: int) -> Any:
    """Return constants with what their soil remembered at a sample of the record; elastic ones as they are."""
    if not isinstance(c, PlasticConstants):
        return c
    memory, n = c.memory, c.soil.ratio.size
    row = memory.samples[sample]
    so_far = memory.so_far.copy()
    so_far[WORK] = row[-1]
    return c._replace(memory=memory._replace(front=row[:n].copy(), back=row[n:-1].copy(), so_far=so_far))


@kernel
def push(n: int, u: float, y: float, memory: Memory) -> float:
    """Push element n to a displacement, and return by how much its sliders have moved [m].

    Parameters
    ----------
    n
        Index of the element.
    u
        Displacement [m], reached from the last one without turning back in between.
    y
        Displacement at which its spring reaches the ultimate resistance [m].
    memory
        What the elements remember; changed.
    """
    front, back = memory.front[n], memory.back[n]
    if memory.gap:
        memory.front[n] = max(front, u - y)
        memory.back[n] = min(back, u + y)
        return memory.front[n] - front + back - memory.back[n]
    memory.front[n] = memory.back[n] = min(max(front, u - y), u + y)
    return abs(memory.front[n] - front)


@inlined
def add_plastic_element(
    sums: np.ndarray, j: int, first: int, k: Kinematics, soil: SoilElements, memory: Memory
) -> None:
    """Add force and moment of element first + j to the partial sums j."""
    ratio, stiffness, ultimate = (
        field(soil.ratio, first, j),
        field(soil.stiffness, first, j),
        field(soil.ultimate, first, j),
    )
    displacement, velocity = k.A - k.slope_x * ratio, k.B - k.slope_v * ratio
    ahead = min(max(stiffness * (displacement - field(memory.front, first, j)), 0.0), ultimate)
    behind = min(max(stiffness * (field(memory.back, first, j) - displacement), 0.0), ultimate)
    F_n = behind - ahead - field(soil.drag, first, j) * velocity * abs(velocity)
    add(sums, j, F_n, -F_n * (k.lever_d * ratio + k.q))


@kernel
def reaction_of_plastic_elements(k: Kinematics, soil: SoilElements, memory: Memory) -> Reaction:
    """Sum force and moment over plastic elements (Eqs 19, 20, 36, 121, 122)."""
    sums = partial_sums()
    whole = soil.ratio.size - soil.ratio.size % WIDTH
    for first in range(0, whole, WIDTH):
        for j in range(WIDTH):
            add_plastic_element(sums, j, first, k, soil, memory)
    for j in range(soil.ratio.size - whole):
        add_plastic_element(sums, j, whole, k, soil, memory)
    return Reaction(total(sums, 0), total(sums, WIDTH))


@kernel
def potential_of_plastic_elements(A: float, slope_x: float, soil: SoilElements, memory: Memory) -> Potential:
    """Least work that pushes elements to a displacement from where they would rest, given what they remember.

    It is what their springs hold and what their sliders would take; see `closed_potential`, and `slider_energy` for
    the second part alone. A sum of convex functions of the displacement, as without memory.
    """
    V = V_A = V_X = 0.0
    for n in range(soil.ratio.size):
        ratio, stiffness, ultimate = soil.ratio[n], soil.stiffness[n], soil.ultimate[n]
        displacement = A - slope_x * ratio
        ahead, behind = max(displacement - memory.front[n], 0.0), max(memory.back[n] - displacement, 0.0)
        pressed = ahead - behind
        over = max(ahead + behind - ultimate / stiffness, 0.0)
        force = min(max(stiffness * pressed, -ultimate), ultimate)
        V += 0.5 * stiffness * (pressed * pressed - over * over)
        V_A += force
        V_X -= ratio * force
    return Potential(V, V_A, V_X, V)


@kernel
def power_of_plastic_elements(k: Kinematics, soil: SoilElements, memory: Memory) -> float:
    """Power that the drag of plastic elements takes out of the motion [W]: that of elastic ones."""
    return power_of_elements(k, soil)


@kernel
def slider_energy(k: Kinematics, soil: SoilElements, memory: Memory) -> float:
    """Part of `potential_of_plastic_elements` that the sliders take since the memory was written: plastic work [J]."""
    work = 0.0
    for n in range(soil.ratio.size):
        displacement = k.A - k.slope_x * soil.ratio[n]
        pressed = max(displacement - memory.front[n], 0.0) + max(memory.back[n] - displacement, 0.0)
        work += soil.ultimate[n] * max(pressed - soil.ultimate[n] / soil.stiffness[n], 0.0)
    return work
