"""Notes on settings that are valid but deserve a second look. They never stop a run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep import elementary
from boulder_sweep.columns import BOULDER_MASS, WAY_OUT
from boulder_sweep.designs import LEAST_SOLIDITY, SIDES
from boulder_sweep.settings.fields import BY_NAME, Field
from boulder_sweep.settings.numbers import describe
from boulder_sweep.settings.problems import Position, Problem
from boulder_sweep.stones.rock import ROCK_KG_M3

if TYPE_CHECKING:
    from boulder_sweep.settings.model import Model
    from boulder_sweep.settings.sweep import Sweep

# Constant of horizontal subgrade reaction [MN/m^3] over friction angle [deg] of the two families in use.
API_ANGLES, _API = np.array([30.0, 43.0]), np.array([10.5, 110.0])
_TERZAGHI_ANGLES, _TERZAGHI = np.array([30.0, 35.0, 40.0]), np.array([2.2, 6.6, 17.6])

FAMILY_FACTOR = 2.0
"""How far a pair of soil constants may be off the nearer family of data."""

_FRONT = ("vehicle_mass_kg", "impact_speed_m_s", "vehicle_spring_N_m", "vehicle_damper_N_s_m")
LEAST_CRUSH, MOST_CRUSH = 0.5, 1.25
"""Crush at a rigid wall over the calibrated one, between which spring and damper are taken for those of the vehicle. A
boulder gives way and takes less of the front than a wall: hence more than 1."""
BEYOND_FRONT = (
    "against a rigid wall the front of this vehicle would be crushed by {crush}; its spring and damper are calibrated "
    "up to {calibrated} (vehicle.calibrated_crush): do they belong to a vehicle of this mass and speed?"
)
SHORT_OF_FRONT = (
    "against a rigid wall the front of this vehicle would be crushed by only {crush}; its spring and damper are "
    "calibrated up to {calibrated} (vehicle.calibrated_crush): do they belong to a vehicle of this mass and speed?"
)
"""Cautions where a vehicle is far from the one its spring and damper were fitted to; a report's page says the same."""


def notes_on(sweep: Sweep, positions: Mapping[str, Position]) -> Iterator[Problem]:
    """Yield a note for every unusual value and for data that do not belong together.

    Parameters
    ----------
    sweep : Sweep
        Valid settings.
    positions : mapping of str to Position
        Position of each quantity in the file.
    """
    values = {name: np.array([value]) for name, value in sweep.constants.items()}
    groups = [axis.columns for axis in sweep.axes] + ([] if sweep.table is None else [sweep.table.columns])
    for group in groups:
        values |= group
    for name, of_input in values.items():
        message = _unusual(name, of_input)
        if message:
            yield _note(positions[name], BY_NAME[name].path, message)
    for axis in sweep.axes:
        if len(set(axis.values.tolist())) < len(axis.values):
            yield _note(positions[axis.name], BY_NAME[axis.name].path, "contains a value more than once")
    if "embedment_depth_m" in values:
        depth, height = _pairs(values, groups, "embedment_depth_m", "boulder_height_m")
        ratio = depth / height
        off = _without_partner(_outside(ratio, BY_NAME["embedment_ratio"]))
        if off.any():
            message = _unusual("embedment_ratio", ratio[off])
            yield _note(positions["embedment_depth_m"], "site.embedment_depth", f"depth over height: {message}")
    message = _on_mass(values, groups, sweep.model)
    if message:
        yield _note(positions[BOULDER_MASS], "boulder.mass", message)
    message = _off_front(values, groups, sweep.model.calibrated_crush_m)
    if message:
        yield _note(positions["vehicle_spring_N_m"], "vehicle.spring", message)
    if not sweep.model.shape.stands_flat:
        message = (
            f"its foot is less than half as wide or long as the largest section: undecided (foot), {WAY_OUT['foot']}"
        )
        yield _note(Position(str(sweep.path)), "boulder", message)
    limit, usual = sweep.criterion.max_rotation_deg, BY_NAME["max_rotation_deg"].usual
    if usual is not None and limit > usual.high:
        yield _note(Position(str(sweep.path)), "criterion.max_rotation", f"{limit:g} deg is large: {usual.remark}")
    if sweep.partial_factor != 1.0:
        angles = values["friction_angle_deg"]
        ends = f"{angles.min():.4g}" if angles.min() == angles.max() else f"{angles.min():.4g} to {angles.max():.4g}"
        message = f"tan(friction angle) is divided by {sweep.partial_factor:g}: simulated and listed as {ends} deg"
        yield _note(Position(str(sweep.path)), "partial_factor.friction_angle", message)
    angle, reaction = _pairs(values, groups, "friction_angle_deg", "subgrade_reaction_MN_m3")
    message = _off_families(angle, reaction) or _mixed_families(angle, reaction)
    if message:
        yield _note(positions["subgrade_reaction_MN_m3"], "soil.subgrade_reaction", message)


def _on_mass(values: Mapping[str, np.ndarray], groups: list[dict[str, np.ndarray]], model: Model) -> str:
    """Return what is assumed of boulders that were weighed, and whether no box stands for them."""
    if BOULDER_MASS not in values:
        return ""
    names = (BOULDER_MASS, "boulder_density_kg_m3", *SIDES)
    listed = next((group for group in groups if len(group) > 1 and BOULDER_MASS in group), {})
    if all(name in listed or len(values[name]) == 1 for name in names):
        mass, rock, *sides = (values[name] for name in names)
        solidity = mass / (rock * np.prod(np.broadcast_arrays(*sides), axis=0))
    else:
        ends = [(float(values[name].min()), float(values[name].max())) for name in names]
        solidity = np.array([ends[0][i] / math.prod(end[1 - i] for end in ends[1:]) for i in range(2)])
    fills = describe_share(solidity.min(), solidity.max())
    words = [f"by its mass a boulder fills {fills} of the box of its length, width and height"]
    if model.rock_assumed:
        words[0] += f" if its rock has {ROCK_KG_M3:g} kg/m^3, which is assumed: give boulder.density. No pass is robust"
    if solidity.min() < LEAST_SOLIDITY and model.shape.is_box:
        words.append(f"below {LEAST_SOLIDITY:.0%} designs are undecided (shape): {WAY_OUT['shape']}")
    return "; ".join(words) if len(words) > 1 or model.rock_assumed else ""


def describe_share(low: float, high: float) -> str:
    """Return a range of shares in per cent."""
    ends = f"{low:.0%}", f"{high:.0%}"
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def _pairs(
    values: Mapping[str, np.ndarray], groups: list[dict[str, np.ndarray]], one: str, other: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of two inputs that occur, shape (n,) where they are listed together, (n, m) where crossed."""
    for group in groups:
        if one in group and other in group:
            return group[one], group[other]
    ones, others = np.meshgrid(_thinned(values[one]), _thinned(values[other]))
    return ones, others


def wall_crush(mass: np.ndarray, speed: np.ndarray, spring: np.ndarray, damper: np.ndarray) -> np.ndarray:
    """Return by how much the front of a vehicle is crushed against a rigid wall (Eqs 49 to 51) [m].

    Parameters
    ----------
    mass, speed, spring, damper : ndarray
        Of vehicles, in SI units, in shapes that broadcast against each other.
    """
    by_damper = mass * speed / damper
    decay, squared = -0.5 * spring / damper, spring / mass - (0.5 * spring / damper) ** 2
    b = np.sqrt(np.maximum(squared, 0.0))
    # An over-damped vehicle only comes to rest with its spring released.
    stops = np.arctan2(b, decay)
    by_spring = speed * np.exp(decay * stops / np.where(b > 0.0, b, np.inf)) * np.sin(stops)
    return by_damper + np.where(b > 0.0, by_spring / np.where(b > 0.0, b, 1.0), 0.0)


def _off_front(values: Mapping[str, np.ndarray], groups: list[dict[str, np.ndarray]], calibrated: float) -> str:
    """Return a caution if a vehicle's front would be crushed far from what spring and damper were fitted to.

    The crush grows with mass and speed, and falls with spring and damper, so the ends of axes suffice.
    """
    if "vehicle_second_spring_N_m" in values:
        return ""  # its front is no single spring and damper
    listed = [group for group in groups if len(group) > 1 and set(group) & set(_FRONT)]
    front = []
    for name in _FRONT:
        index = next((k for k, group in enumerate(listed) if name in group), None)
        ends = values[name] if index is not None else np.array([values[name].min(), values[name].max()])
        dimension = _FRONT.index(name) if index is None else len(_FRONT) + index
        front.append(ends.reshape([-1 if k == dimension else 1 for k in range(len(_FRONT) + len(listed))]))
    crush = wall_crush(*front)
    largest, words = float(crush.max()), BEYOND_FRONT
    up_to = "" if crush.min() == largest else "up to "
    if largest <= MOST_CRUSH * calibrated:
        largest, words, up_to = float(crush.min()), SHORT_OF_FRONT, ""
        if largest >= LEAST_CRUSH * calibrated:
            return ""
    return words.format(crush=f"{up_to}{largest:.3g} m", calibrated=f"{calibrated:g} m")


def _without_partner(off: np.ndarray) -> np.ndarray:
    """Return which pairs are off; of crossed axes, which make pairs nobody means, those with a value always off."""
    return off if off.ndim == 1 else off & (off.all(axis=0, keepdims=True) | off.all(axis=1, keepdims=True))


def _note(position: Position, key: str, message: str) -> Problem:
    return Problem(position.file, position.line, position.column, key, message)


def _outside(values: np.ndarray, field: Field) -> np.ndarray:
    """Return which values lie outside the range met in practice, bool."""
    if field.usual is None:
        return np.zeros(values.shape, dtype=bool)
    slack = 1e-9 * field.usual.high
    return (values < field.usual.low - slack) | (values > field.usual.high + slack)


def _unusual(name: str, values: np.ndarray) -> str:
    """Return a note if a value lies outside the range met in practice."""
    usual, unit = BY_NAME[name].usual, BY_NAME[name].unit
    if usual is None or not _outside(values, BY_NAME[name]).any():
        return ""
    low, high = float(values.min()), float(values.max())
    given = describe(low, unit) if low == high else f"{low:.6g} to {describe(high, unit)}"
    ends = f"{usual.low:g} to {describe(usual.high, unit)}"
    return f"{given} is outside the usual range of {ends} ({usual.remark}); {_outcome(name, low, high)}"


def _outcome(name: str, low: float, high: float) -> str:
    """Return what becomes of designs with unusual values."""
    if name != "embedment_ratio" or high < 1.0:
        return "computed as given"
    if low < 1.0:
        return "designs of 1 or more cannot be computed, since the depth must be less than the boulder's height"
    return "cannot be computed, since the depth must be less than the boulder's height"


def off_families(angle: np.ndarray, reaction: np.ndarray) -> np.ndarray:
    """Return which pairs of soil constants belong to neither family of data, bool.

    Parameters
    ----------
    angle, reaction : ndarray
        Friction angles [deg] and constants of horizontal subgrade reaction [MN/m^3].
    """
    least, most = family_bounds(angle)
    return (reaction < least) | (reaction > most)


def family_bounds(angle: np.ndarray) -> np.ndarray:
    """Return least and largest constant of subgrade reaction [MN/m^3] that go with friction angles [deg], (2, n)."""
    return np.stack([terzaghi_curve(angle) / FAMILY_FACTOR, FAMILY_FACTOR * api_curve(angle)])


def _off_families(angle: np.ndarray, reaction: np.ndarray) -> str:
    """Return a note if some soil constants belong to neither family of data."""
    off = _without_partner(off_families(angle, reaction))
    if not off.any():
        return ""
    phi, beta = angle[off][0], reaction[off][0]
    curves = f"Terzaghi's values give {terzaghi_curve(phi):.2g}, the API curve {api_curve(phi):.2g}"
    return f"{beta:g} MN/m^3 does not go with {phi:g} deg: {curves} MN/m^3; take both soil constants from one source"


def _mixed_families(angle: np.ndarray, reaction: np.ndarray) -> str:
    """Return a note if some soils follow Terzaghi's values and others the API curve."""
    pairs = angle.ravel(), reaction.ravel()
    near_api = np.abs(np.log(pairs[1] / api_curve(pairs[0]))) < np.abs(np.log(pairs[1] / terzaghi_curve(pairs[0])))
    if near_api.all() or not near_api.any():
        return ""
    one, other = np.flatnonzero(near_api)[-1], np.flatnonzero(~near_api)[0]
    return (
        "two families of data are mixed: "
        f"{pairs[1][one]:g} MN/m^3 at {pairs[0][one]:g} deg lies near the API curve, "
        f"{pairs[1][other]:g} MN/m^3 at {pairs[0][other]:g} deg near Terzaghi's values, which are "
        "several times smaller for the same soil; take both soil constants from one source"
    )


def _thinned(values: np.ndarray) -> np.ndarray:
    """Return at most 200 values, ends included."""
    return values if len(values) <= 200 else values[np.linspace(0, len(values) - 1, 200).astype(int)]


def api_curve(angle: np.ndarray) -> np.ndarray:
    """Constant of horizontal subgrade reaction [MN/m^3] by the API curve, over the friction angle [deg]."""
    return _log_line(angle, API_ANGLES, _API)


def terzaghi_curve(angle: np.ndarray) -> np.ndarray:
    """The same by Terzaghi's values."""
    return _log_line(angle, _TERZAGHI_ANGLES, _TERZAGHI)


def _log_line(angle: np.ndarray, angles: np.ndarray, values: np.ndarray) -> np.ndarray:
    return elementary.exp(np.interp(angle, angles, elementary.log(values)))
