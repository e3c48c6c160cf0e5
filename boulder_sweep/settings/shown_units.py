"""In which units people read a result: SI as the table has it, rounded to what is usual, or US customary."""

from __future__ import annotations

from typing import NamedTuple

from boulder_sweep.settings.units import factor

SYSTEMS = ("si", "us")

_SHOWN: dict[str, tuple[str, str]] = {
    "m": ("m", "ft"),
    "kg": ("kg", "lb"),
    "kg/m^3": ("kg/m^3", "pcf"),
    "MN/m^3": ("MN/m^3", "pci"),
    "m/s": ("m/s", "mph"),
    "N/m": ("kN/m", "lb/in"),
    "N*s/m": ("kN*s/m", "lb*s/in"),
}
_FORCES = {"kN": ("kN", "kip"), "N": ("kN", "kip"), "J": ("kJ", "kip*ft")}
_OF_FORCE = {"kN": 1.0, "N": 1e-3, "J": 1e-3}
KILONEWTONS_PER_KIP = 4.4482216152605
KILOJOULES_PER_FOOT_KIP = KILONEWTONS_PER_KIP * 0.3048


class ShownUnit(NamedTuple):
    """A unit to show a quantity in, and its value in the unit of the table."""

    unit: str
    size: float


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
    place = SYSTEMS.index(system)
    if unit in _FORCES:
        us_size = KILOJOULES_PER_FOOT_KIP if unit == "J" else KILONEWTONS_PER_KIP
        return ShownUnit(_FORCES[unit][place], (us_size if system == "us" else 1.0) / _OF_FORCE[unit])
    if unit not in _SHOWN:
        return ShownUnit(unit, 1.0)
    shown = _SHOWN[unit][place]
    return ShownUnit(shown, float(factor(shown, unit)))
