"""In which units people read a result: SI as the table has it, rounded to what is usual, or US customary."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.columns import BY_NAME, column_spec
from boulder_sweep.settings.units import factor, name_suffix

SYSTEMS = ("si", "us")

_SHOWN: dict[str, tuple[str, str]] = {
    "m": ("m", "ft"),
    "m^3": ("m^3", "yd^3"),
    "kg": ("kg", "lb"),
    "kg/m^3": ("kg/m^3", "pcf"),
    "MN/m^3": ("MN/m^3", "pci"),
    "m/s": ("m/s", "mph"),
    "N/m": ("kN/m", "lb/in"),
    "N*s/m": ("kN*s/m", "lb*s/in"),
    "kPa": ("kPa", "psf"),
    "MPa": ("MPa", "tsf"),
    "m/s^2": ("m/s^2", "ft/s^2"),
}
KILONEWTONS_PER_KIP = 4.4482216152605


_INCH_M = Fraction(254, 10_000)


def system_of(length_m: Fraction | float) -> str:
    """Return the system of a unit of length by its size [m]: whole inches are US customary."""
    return SYSTEMS[Fraction(length_m) % _INCH_M == 0]


class ShownUnit(NamedTuple):
    """A unit to show a quantity in, and its value in the unit of the table."""

    unit: str
    size: float


_FORCES = {
    "kN": (ShownUnit("kN", 1.0), ShownUnit("kip", KILONEWTONS_PER_KIP)),
    "N": (ShownUnit("kN", 1e3), ShownUnit("kip", KILONEWTONS_PER_KIP / 1e-3)),
    "J": (ShownUnit("kJ", 1e3), ShownUnit("kip*ft", KILONEWTONS_PER_KIP * 0.3048 / 1e-3)),
}


class ShownColumn(NamedTuple):
    """A column of a result as it is shown."""

    stored: str
    """Name of the column in the result."""
    name: str
    unit: str
    size: float
    """One of its unit in the unit of the result."""
    meaning: str


def check_system(system: str) -> None:
    """Refuse units that are neither ``si`` nor ``us``.

    Raises
    ------
    ValueError
        They are neither.
    """
    if system not in SYSTEMS:
        raise ValueError(f"units must be {' or '.join(SYSTEMS)}, not {system!r}")


def shown_unit(unit: str, system: str) -> ShownUnit:
    """Return the unit in which values of a unit of the table are shown.

    Parameters
    ----------
    unit
        Unit of a column, as in `boulder_sweep.columns`; ``J`` and ``N`` beside.
    system
        ``si`` or ``us``.

    Returns
    -------
    ShownUnit
        A value of the table divided by ``size`` is in ``unit``. A unit that both systems share stays as it is.
    """
    check_system(system)
    position = SYSTEMS.index(system)
    if unit in _FORCES:
        return _FORCES[unit][position]
    if unit not in _SHOWN:
        return ShownUnit(unit, 1.0)
    shown = _SHOWN[unit][position]
    return ShownUnit(shown, float(factor(shown, unit)))


def in_unit(values: np.ndarray, size: float) -> np.ndarray:
    """Return values of the table in a unit of that size, to fourteen digits: 9 ft, not 8.999999999999998."""
    shown = np.asarray(values, dtype=np.float64) / size
    with np.errstate(divide="ignore", invalid="ignore"):
        places = 13.0 - np.floor(np.log10(np.abs(shown)))
    scale = 10.0 ** np.clip(np.nan_to_num(places, nan=0.0, posinf=0.0, neginf=0.0), 0.0, 22.0)  # exact powers of ten
    return np.round(shown * scale) / scale


def number_text(value: float, units: str) -> str:
    """Return an input in five digits; below 10,000 in four in US units, in which few values are round."""
    return f"{value:.{4 if units == 'us' and abs(value) < 1e4 else 5}g}"


def quantity_text(unit: str, units: str, *ends: float, digits: str = ".4g") -> str:
    """Return a value or a range in the units asked for: ``3.2 m``, ``3.2 to 3.6 m``.

    Parameters
    ----------
    unit
        Unit of the table in which the values are given; 1 is not written.
    units
        ``si`` for that unit, ``us`` for the one that stands for it.
    *ends
        The value, or both ends of the range.
    digits
        Format of the numbers.
    """
    shown, size = (unit, 1.0) if units == "si" else shown_unit(unit, units)
    numbers = " to ".join(dict.fromkeys(f"{end / size:{digits}}" for end in ends))
    return numbers if shown == "1" else f"{numbers} {shown}"


def shown_column(stored: str, units: str) -> ShownColumn:
    """Return how a column of the result is shown: its name ends in the unit."""
    spec = column_spec(stored)
    return shown_as(stored, spec.unit, spec.meaning, units)


def shown_as(stored: str, unit: str, meaning: str, units: str) -> ShownColumn:
    """Return how a column of a unit and a meaning is shown."""
    if units == "si" or not unit:
        return ShownColumn(stored, stored, unit, 1.0, meaning)
    other, size = shown_unit(unit, units)
    name = stored if size == 1.0 else stored.removesuffix(name_suffix(unit)) + name_suffix(other)
    return ShownColumn(stored, name, other, size, meaning)


def shown_values(values: Mapping[str, Any], units: str) -> dict[str, Any]:
    """Return values by names of columns in the units asked for; what is no column stays as it is."""
    shown_by_name = {}
    for name, value in values.items():
        if name not in BY_NAME:
            shown_by_name[name] = value
            continue
        column = shown_column(name, units)
        is_other = isinstance(value, float) and column.size != 1.0
        shown_by_name[column.name] = float(in_unit(np.array(value), column.size)) if is_other else value
    return shown_by_name


def shown_settings(settings: Mapping[str, Any], units: str) -> dict[str, Any]:
    """Return the resolved settings in the units asked for: numbers under a name that ends in a unit, and its name.

    Parameters
    ----------
    settings
        See `boulder_sweep.settings.Sweep.resolved`, or a part of it.
    units
        ``si`` or ``us``.
    """
    if units == "si":
        return dict(settings)
    shown_by_name = {}
    for name, value in settings.items():
        if name == "order" and isinstance(value, list):
            shown_by_name[name] = [shown_column(one, units).name if one in BY_NAME else one for one in value]
            continue
        unit = max((unit for unit in _SHOWN if name.endswith(name_suffix(unit))), key=len, default="")
        shown = shown_as(name, unit, "", units)
        shown_by_name[shown.name] = _shown_setting(value, shown.size, units)
    return shown_by_name


def _shown_setting(value: Any, size: float, units: str) -> Any:
    """Return a value, or all values of a list, a distribution or a long axis, divided by the size of the unit."""
    if isinstance(value, Mapping):
        if size == 1.0:
            return shown_settings(value, units)
        plain = ("cov", "count")  # have no unit
        return {name: one if name in plain else _shown_setting(one, size, units) for name, one in value.items()}
    if isinstance(value, list):
        return [_shown_setting(one, size, units) for one in value]
    return float(in_unit(np.array(value), size)) if isinstance(value, float) and size != 1.0 else value
