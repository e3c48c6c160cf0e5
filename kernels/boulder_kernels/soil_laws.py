"""The laws of the soil in one table: the functions that the motion asks of each, and which design gets which.

A law is one `SoilLaw`. Which one holds follows from the type of the constants of a design: plain `Constants` are those
of a uniform soil, others carry the record of their soil. Inside kernels the function is chosen when they are compiled,
so a uniform soil has the code it would have if there were no other.

To add a law: write its record and functions in a module beside `boulder_kernels.layered_soil`, and a line in `LAWS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_inlined, is_none, kernel, overload, plain
from .design import Body, Constants, Design, Readings, constants_of, constants_with
from .layered import (
    FewLayers,
    LayeredConstants,
    Lumped,
    SoilElements,
    SoilLayers,
    SoilSums,
    fill_elements,
    fill_layers,
    with_record,
)
from .layered_soil import (
    potential_of_elements,
    potential_of_layers,
    power_of_elements,
    power_of_layers,
    reaction_of_elements,
    reaction_of_layers,
)
from .outlined import (
    FewPieces,
    OutlinedElements,
    OutlinedPieces,
    TaperedSoil,
    body_beside,
    empty_outlined,
    fill_outlined_elements,
    fill_outlined_pieces,
    is_outlined,
    lean_with,
)
from .outlined_soil import (
    potential_of_outlined_elements,
    potential_of_pieces,
    potential_of_taper,
    power_of_outlined_elements,
    power_of_pieces,
    power_of_taper,
    reaction_of_outlined_elements,
    reaction_of_pieces,
    reaction_of_taper,
)
from .soil import Kinematics, Potential, Reaction, uniform_drag_power, uniform_potential, uniform_reaction


class SoilLaw(NamedTuple):
    """A law of the soil; its functions take the records of the soil, those of a uniform soil its `Constants`."""

    reaction: Callable[..., Reaction]
    """Force and moment, of `Kinematics`."""
    potential: Callable[..., Potential]
    """Elastic energy and its slopes, convex in the displacement at the soil line and its decrease over the depth."""
    drag_power: Callable[..., float]
    """Power that the drag takes out of the motion [W], of `Kinematics`."""
    fill: Callable[[Design, np.ndarray, Any], Lumped] | None = None
    """Works out the record from the layers of a design, and returns what follows from them."""


UNIFORM = SoilLaw(uniform_reaction, uniform_potential, uniform_drag_power)
LAWS: dict[type, SoilLaw] = {
    SoilElements: SoilLaw(reaction_of_elements, potential_of_elements, power_of_elements, fill_elements),
    SoilLayers: SoilLaw(reaction_of_layers, potential_of_layers, power_of_layers, fill_layers),
    FewLayers: SoilLaw(reaction_of_layers, potential_of_layers, power_of_layers),
    OutlinedElements: SoilLaw(
        reaction_of_outlined_elements,
        potential_of_outlined_elements,
        power_of_outlined_elements,
        fill_outlined_elements,
    ),
    OutlinedPieces: SoilLaw(reaction_of_pieces, potential_of_pieces, power_of_pieces, fill_outlined_pieces),
    FewPieces: SoilLaw(reaction_of_pieces, potential_of_pieces, power_of_pieces),
    TaperedSoil: SoilLaw(reaction_of_taper, potential_of_taper, power_of_taper),
}
"""The law of each record of a soil."""


def type_of(record: Any) -> type:
    """Return the type of a record, which may be a value or, inside kernels, its Numba type."""
    kind: type = getattr(record, "instance_class", type(record))
    return kind


def law_of(c: Any) -> SoilLaw:
    """Return the law of the soil of constants, or of the record of a soil."""
    return LAWS.get(type_of(c[-1] if type_of(c) is LayeredConstants else c), UNIFORM)


def by_law(field: str) -> Callable[..., Any]:
    """Return a function that calls a field of `SoilLaw` of the law of its last argument, for Python and for kernels.

    The last argument is constants, whose record is passed on in their place, or a record.
    """

    def call(*arguments: Any) -> Any:
        """Call the function of the law of these arguments."""
        c = arguments[-1]
        if type(c) is Constants:
            return uniform(*arguments)
        return getattr(law_of(c), field)(*arguments[:-1], c.soil if type(c) is LayeredConstants else c)

    def choose(*arguments: Any) -> Callable[..., Any]:
        """Return the call for arguments of these Numba types."""
        of_law = getattr(law_of(arguments[-1]), field)
        if type_of(arguments[-1]) is not LayeredConstants:
            return (lambda a, c: of_law(a, c)) if len(arguments) == 2 else (lambda a, b, c: of_law(a, b, c))
        return (lambda a, c: of_law(a, c.soil)) if len(arguments) == 2 else (lambda a, b, c: of_law(a, b, c.soil))

    uniform = getattr(UNIFORM, field)
    overload(call)(choose)
    return call


soil_reaction = by_law("reaction")
"""Force and moment of the soil at lines ``k`` of displacement, velocity and lever (Eqs 19, 20)."""
soil_potential = by_law("potential")
"""Elastic energy of the soil by the same representation as the forces, a convex function of both displacements [m]."""
drag_power = by_law("drag_power")
"""Power that the drag takes out of the motion [W], by the same representation as the forces (Eqs 34-36)."""
fill_soil = by_law("fill")
"""Work out a record from the layers of a design, shape (M, 6), and return what follows from them, `Lumped`."""


@kernel
def soil_energy(k: Kinematics, c: Constants) -> float:
    """Elastic energy stored in the springs of the soil [J], by the same representation as the forces."""
    V: float = soil_potential(k.A, k.slope_x, c).V
    return V


class SoilProfile(NamedTuple):
    """The soil of one design where it is not that of its `Design` all the way down."""

    layers: np.ndarray
    """Layers from the top down, shape (M, 6), see `boulder_kernels.layered`."""
    soil: Any
    """`SoilElements` or `SoilLayers`, worked out from the layers by whoever computes the constants."""


def keep_lean(body: Body, design: Design, gravity: bool, soil: Any) -> None:
    """Keep what the weight adds beside the soil."""
    if is_outlined(soil):
        soil.lean[0] = lean_with(body, design, gravity)


@overload(keep_lean)
def _keep_lean(body: Any, design: Any, gravity: Any, soil: Any) -> Callable[..., None]:
    if not is_outlined(soil):
        return lambda body, design, gravity, soil: None

    def keep(body: Body, design: Design, gravity: bool, soil: Any) -> None:
        """Keep it."""
        soil.lean[0] = lean_with(body, design, gravity)

    return keep


@exact_inlined
def constants_in_profile(design: Design, readings: Readings, elements: int, profile: SoilProfile) -> Any:
    """Constants of the motion of one design in layers of soil; see `constants_in`."""
    lumped = fill_soil(design, profile.layers, profile.soil)
    b, body = lumped.bounds, body_beside(design, profile.soil)
    keep_lean(body, design, readings.restoring_gravity, profile.soil)
    c = constants_with(design, body, readings, b.elements, lumped.mass, b.K_soil, b.R_soil, b.x_yield)
    return with_record(c, profile.soil)


def constants_in(design: Design, readings: Readings, elements: int, profile: SoilProfile | None) -> Any:
    """Constants of the motion of one design in its soil.

    Parameters
    ----------
    design
        The design, SI; density, friction angle and subgrade reaction of a soil in layers are those of the layers.
    readings
        Which formulas are read as printed.
    elements
        Number N of elements of a uniform soil, or 0 for the closed form.
    profile
        Its `SoilProfile`, whose record the constants keep; None for the uniform soil of the design.

    Returns
    -------
    Constants or LayeredConstants
        Non-finite or non-positive where the design is impossible, see `boulder_kernels.design.is_computable`.
    """
    if profile is None:
        return constants_of(design, readings, elements)
    return plain(constants_in_profile)(design, readings, elements, profile)  # what it calls is compiled


@overload(constants_in)
def _constants_in(design: Any, readings: Any, elements: Any, profile: Any) -> Callable[..., Any]:
    if is_none(profile):
        return lambda design, readings, elements, profile: constants_of(design, readings, elements)
    return lambda design, readings, elements, profile: constants_in_profile(design, readings, elements, profile)


def empty_soil(layers: int, elements: int, outline: np.ndarray | None = None) -> Any:
    """Return a soil to fill: N elements, or where N is 0 as many layers as there are, for which it is exact.

    Beside an outline, shape (P, 4), each of its points may cut a layer in two.
    """
    if outline is not None:
        return empty_outlined(layers + len(outline) - 2, elements, outline)
    if elements > 0:
        return SoilElements(*np.empty((len(SoilElements._fields), elements)))
    to, K, inverse_K, P_0, P_1, R = np.empty((6, layers))
    return SoilLayers(to, K, inverse_K, P_0, P_1, R, np.empty(len(SoilSums._fields)))


def profile_of(layers: np.ndarray, elements: int, outline: np.ndarray | None = None) -> SoilProfile:
    """Return a soil in layers, by N elements or, where N is 0, exactly; beside an outline if the boulder has one."""
    return SoilProfile(layers, empty_soil(len(layers), elements, outline))
