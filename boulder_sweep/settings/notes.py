"""Notes on settings that are valid but deserve a second look. They never stop a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.numbers import describe
from boulder_sweep.settings.problems import Place, Problem

if TYPE_CHECKING:
    from boulder_sweep.settings.sweep import Sweep

# Constant of horizontal subgrade reaction [MN/m^3] over friction angle [deg] of the two families in use.
_API_ANGLES, _API = np.array([30.0, 43.0]), np.array([10.5, 110.0])
_TERZAGHI_ANGLES, _TERZAGHI = np.array([30.0, 35.0, 40.0]), np.array([2.2, 6.6, 17.6])


def notes_on(sweep: Sweep, places: Mapping[str, Place]) -> Iterator[Problem]:
    """Yield a note for every unusual value and for data that do not belong together.

    Parameters
    ----------
    sweep : Sweep
        Valid settings.
    places : mapping of str to Place
        Where each quantity stands in the file.
    """
    values = {name: np.array([value]) for name, value in sweep.constants.items()}
    values |= {axis.name: axis.values for axis in sweep.axes}
    if sweep.table is not None:
        values |= sweep.table.columns
    for name, found in values.items():
        message = _unrealistic(name, found)
        if message:
            yield _note(places[name], BY_NAME[name].path, message)
    for axis in sweep.axes:
        if len(np.unique(axis.values)) < len(axis.values):
            yield _note(places[axis.name], BY_NAME[axis.name].path, "contains a value more than once")
    limit, usual = sweep.criterion.max_rotation_deg, BY_NAME["max_rotation_deg"].usual
    if usual is not None and limit > usual.high:
        remark = usual.remark
        yield _note(Place(str(sweep.path)), "criterion.max_rotation", f"{limit:g} deg is large: {remark}")
    if sweep.partial_factor != 1.0:
        angles = values["friction_angle_deg"]
        ends = f"{angles.min():.4g}" if angles.min() == angles.max() else f"{angles.min():.4g} to {angles.max():.4g}"
        message = f"tan(friction angle) is divided by {sweep.partial_factor:g}: simulated and listed as {ends} deg"
        yield _note(Place(str(sweep.path)), "partial_factor.friction_angle", message)
    message = _mixed_families(sweep, values["friction_angle_deg"], values["subgrade_reaction_MN_m3"])
    if message:
        yield _note(places["subgrade_reaction_MN_m3"], "soil.subgrade_reaction", message)


def _note(place: Place, key: str, message: str) -> Problem:
    return Problem(place.file, place.line, place.column, key, message)


def _unrealistic(name: str, values: np.ndarray) -> str:
    """Return a note if a value lies outside the range met in practice."""
    usual, unit = BY_NAME[name].usual, BY_NAME[name].unit
    if usual is None:
        return ""
    low, high = float(values.min()), float(values.max())
    slack = 1e-9 * usual.high
    if low >= usual.low - slack and high <= usual.high + slack:
        return ""
    found = describe(low, unit) if low == high else f"{low:.6g} to {describe(high, unit)}"
    ends = f"{usual.low:g} to {describe(usual.high, unit)}"
    return f"{found} is outside the usual range of {ends} ({usual.remark}); computed as given"


def _mixed_families(sweep: Sweep, angle: np.ndarray, reaction: np.ndarray) -> str:
    """Return a note if some soils follow Terzaghi's values and others the API curve."""
    if sweep.table is not None and len(angle) > 1 and len(reaction) > 1:
        pairs = angle, reaction
    else:
        angles, reactions = np.meshgrid(_thinned(angle), _thinned(reaction))
        pairs = angles.ravel(), reactions.ravel()
    near_api = np.abs(np.log(pairs[1] / _api(pairs[0]))) < np.abs(np.log(pairs[1] / _terzaghi(pairs[0])))
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


def _api(angle: np.ndarray) -> np.ndarray:
    return _log_line(angle, _API_ANGLES, _API)


def _terzaghi(angle: np.ndarray) -> np.ndarray:
    return _log_line(angle, _TERZAGHI_ANGLES, _TERZAGHI)


def _log_line(angle: np.ndarray, angles: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.exp(np.interp(angle, angles, np.log(values)))
