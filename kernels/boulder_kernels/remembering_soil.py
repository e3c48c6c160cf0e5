"""Force, least work and plastic work of soil elements that remember how far they were pushed (Eqs 121 to 123).

The elements and their memory are those of `boulder_kernels.layered` and `boulder_kernels.memory`.
"""

from __future__ import annotations

from ._jit import kernel, summing_kernel
from .layered import SoilElements
from .memory import Memory
from .soil_records import Kinematics, Potential, Reaction


@summing_kernel
def reaction_of_remembering(k: Kinematics, soil: SoilElements, memory: Memory) -> Reaction:
    """Sum force and moment over elements that remember how far they have been pushed (Eqs 19, 20, 36, 121, 122)."""
    F = M = 0.0
    for n in range(soil.ratio.size):
        ratio, stiffness, ultimate = soil.ratio[n], soil.stiffness[n], soil.ultimate[n]
        displacement = k.A - k.slope_x * ratio
        velocity = k.B - k.slope_v * ratio
        ahead = min(max(stiffness * (displacement - memory.front[n]), 0.0), ultimate)
        behind = min(max(stiffness * (memory.back[n] - displacement), 0.0), ultimate)
        F_n = behind - ahead - soil.drag[n] * velocity * abs(velocity)
        F += F_n
        M -= F_n * (k.lever_d * ratio + k.q)
    return Reaction(F, M)


@kernel
def potential_of_remembering(A: float, slope_x: float, soil: SoilElements, memory: Memory) -> Potential:
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
    return Potential(V, V_A, V_X)


@kernel
def slider_energy(k: Kinematics, soil: SoilElements, memory: Memory) -> float:
    """Part of `potential_of_remembering` that the sliders take since the memory was written: plastic work [J]."""
    work = 0.0
    for n in range(soil.ratio.size):
        displacement = k.A - k.slope_x * soil.ratio[n]
        pressed = max(displacement - memory.front[n], 0.0) + max(memory.back[n] - displacement, 0.0)
        work += soil.ultimate[n] * max(pressed - soil.ultimate[n] / soil.stiffness[n], 0.0)
    return work
