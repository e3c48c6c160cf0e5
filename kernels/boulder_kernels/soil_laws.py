"""The laws of the soil in one table: the functions that the motion asks of each, and which design gets which.

A law is one `SoilLaw`. Which one holds follows from the type of the constants of a design: plain `Constants` stand
for a uniform soil beside a box, `SoilConstants` carry the record of their soil. Inside kernels the function is chosen
when they are compiled, so a uniform soil has the code it would have if there were no other.

To add a law: write its record and functions next to `boulder_kernels.pieces`, and a line in `LAWS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ._jit import exact_inlined, inlined, is_none, kernel, overload, plain
from .design import Constants, Design, Readings, constants_of
from .outline import body_with
from .pieces import (
    FewPieces,
    LumpedSoil,
    ManyPieces,
    Piece,
    SoilConstants,
    SoilElements,
    SoilProfile,
    SoilSums,
    constants_in_soil,
    fill_elements,
    fill_pieces,
    pieces_count,
    potential_of_elements,
    potential_of_pieces,
    power_of_elements,
    power_of_pieces,
    reaction_of_elements,
    reaction_of_pieces,
    times,
)
from .soil import Kinematics, Potential, Reaction, uniform_drag_power, uniform_potential, uniform_reaction


class SoilLaw(NamedTuple):
    """A law of the soil; its functions take the record of the soil, and in a uniform soil its `Constants`."""

    reaction: Callable[..., Reaction]
    """Force and moment, of `Kinematics`."""
    potential: Callable[..., Potential]
    """Elastic energy and its slopes, convex in the displacement at the soil line and its decrease over the depth."""
    drag_power: Callable[..., float]
    """Power that the drag takes out of the motion [W], of `Kinematics`."""
    fill: Callable[[Design, np.ndarray, np.ndarray, Any], LumpedSoil] | None = None
    """Works out the record from layers and outline of a design, and returns what follows from them."""


UNIFORM = SoilLaw(uniform_reaction, uniform_potential, uniform_drag_power)
LAWS: dict[type, SoilLaw] = {
    FewPieces: SoilLaw(reaction_of_pieces, potential_of_pieces, power_of_pieces),
    ManyPieces: SoilLaw(reaction_of_pieces, potential_of_pieces, power_of_pieces, fill_pieces),
    SoilElements: SoilLaw(reaction_of_elements, potential_of_elements, power_of_elements, fill_elements),
}
"""The law of each record of a soil."""


def type_of(value: Any) -> type:
    """Return the type of a named tuple, which may be a value or, inside kernels, its Numba type."""
    kind: type = getattr(value, "instance_class", type(value))
    return kind


def soil_of(c: Any) -> Any:
    """Return the record of the soil of `SoilConstants`, their last field, or its Numba type; anything else itself."""
    return c[-1] if type_of(c) is SoilConstants else c


def law_of(c: Any) -> SoilLaw:
    """Return the law of the soil of constants, or of the record of a soil."""
    return LAWS.get(type_of(soil_of(c)), UNIFORM)


def soil_reaction(k: Kinematics, c: Any) -> Reaction:
    """Force and moment of soil and leaning weight at lines ``k`` of displacement, velocity and lever (Eqs 19, 20, 144).

    A boulder whose centre does not lie over the middle of its foot has the moment -D cos(theta) of its weight with it:
    the restoring couple of a box has equal arms either way, and D is half of what differs.
    """
    found = law_of(c).reaction(k, soil_of(c))
    return leaning(found, k, c.lean) if type(c) is SoilConstants else found


@overload(soil_reaction)
def _soil_reaction(k: Any, c: Any) -> Callable[..., Reaction]:
    reaction = law_of(c).reaction
    if type_of(c) is SoilConstants:
        return lambda k, c: leaning(reaction(k, c.soil), k, c.lean)
    return lambda k, c: reaction(k, c)


@inlined
def leaning(reaction: Reaction, k: Kinematics, lean: float) -> Reaction:
    """Add the moment -D cos(theta) of the weight (Eq 144)."""
    return Reaction(reaction.F, reaction.M - times(lean, k.lever_d))


def soil_potential(A: float, slope_x: float, c: Any) -> Potential:
    """Elastic energy of the soil by the same representation as the forces, a convex function of both lengths [m]."""
    return law_of(c).potential(A, slope_x, soil_of(c))


@overload(soil_potential)
def _soil_potential(A: Any, slope_x: Any, c: Any) -> Callable[..., Potential]:
    potential = law_of(c).potential
    if type_of(c) is SoilConstants:
        return lambda A, slope_x, c: potential(A, slope_x, c.soil)
    return lambda A, slope_x, c: potential(A, slope_x, c)


def drag_power(k: Kinematics, c: Any) -> float:
    """Power that the drag takes out of the motion [W], by the same representation as the forces (Eqs 34-36)."""
    return law_of(c).drag_power(k, soil_of(c))


@overload(drag_power)
def _drag_power(k: Any, c: Any) -> Callable[..., float]:
    power = law_of(c).drag_power
    return (lambda k, c: power(k, c.soil)) if type_of(c) is SoilConstants else (lambda k, c: power(k, c))


def fill_soil(design: Design, profile: SoilProfile) -> LumpedSoil:
    """Work out the record of a profile, and return what follows from it."""
    fill: Any = LAWS[type(profile.soil)].fill
    lumped: LumpedSoil = fill(design, *profile)
    return lumped


@overload(fill_soil)
def _fill_soil(design: Any, profile: Any) -> Callable[..., LumpedSoil]:
    fill: Any = law_of(profile[-1]).fill
    return lambda design, profile: fill(design, profile.layers, profile.outline, profile.soil)


@kernel
def soil_energy(k: Kinematics, c: Constants) -> float:
    """Elastic energy stored in the springs of the soil [J], by the same representation as the forces."""
    V: float = soil_potential(k.A, k.slope_x, c).V
    return V


@exact_inlined
def constants_in_profile(design: Design, readings: Readings, profile: SoilProfile) -> Any:
    """Constants of the motion of one design in a profile; see `constants_in`."""
    lumped = fill_soil(design, profile)
    return constants_in_soil(design, readings, body_with(design, profile.outline), lumped, profile.soil)


def constants_in(design: Design, readings: Readings, elements: int, profile: SoilProfile | None) -> Any:
    """Constants of the motion of one design in its soil.

    Parameters
    ----------
    design
        The design, SI; layers replace density, friction angle and subgrade reaction of its soil.
    readings
        Which formulas are read as printed.
    elements
        Number N of elements of a uniform soil, or 0 for the closed form.
    profile
        Its `SoilProfile`, whose record the constants keep; None for the uniform soil of a box.

    Returns
    -------
    Constants or SoilConstants
        Non-finite or non-positive where the design is impossible, see `boulder_kernels.design.is_computable`.
    """
    if profile is None:
        return constants_of(design, readings, elements)
    return plain(constants_in_profile)(design, readings, profile)  # what it calls is compiled


@overload(constants_in)
def _constants_in(design: Any, readings: Any, elements: Any, profile: Any) -> Callable[..., Any]:
    if is_none(profile):
        return lambda design, readings, elements, profile: constants_of(design, readings, elements)
    return lambda design, readings, elements, profile: constants_in_profile(design, readings, profile)


def empty_soil(layers: int, points: int, elements: int) -> Any:
    """Return a soil to fill: N elements, or where N is 0 the pieces of so many layers and points of an outline."""
    if elements > 0:
        return SoilElements(*np.empty((len(SoilElements._fields), elements)))
    pieces = np.empty((pieces_count(layers, points), len(Piece._fields)))
    return ManyPieces(np.empty(len(SoilSums._fields)), pieces)


BOX = np.empty((0, 4))
"""The outline of a box: no points."""


def profile_of(layers: np.ndarray, elements: int, outline: np.ndarray = BOX) -> SoilProfile:
    """Return a soil in layers beside an outline, by N elements or, where N is 0, exactly."""
    return SoilProfile(layers, outline, empty_soil(len(layers), len(outline), elements))
