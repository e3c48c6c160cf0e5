"""Units at the edge: every unit a user may write, its conversion, and what does not fit.

The vocabulary is closed: pint knows exactly the units below and nothing else, so that a slip of the pen is
an error and not some exotic unit of the same name. Conversions are exact decimal fractions.
"""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction
from functools import cache, lru_cache
from typing import TYPE_CHECKING, NamedTuple

from boulder_sweep.settings.problems import did_you_mean, shorten

if TYPE_CHECKING:
    from pint import UnitRegistry
    from pint.util import UnitsContainer

STANDARD_GRAVITY = Fraction("9.80665")

# Name = value = alias = alias ...; compound units follow from these (kN*s/m, lb/ft^3).
_DEFINITIONS = """
metre = [length] = m = meter = metres = meters
millimetre = 0.001 metre = mm = millimeter
centimetre = 0.01 metre = cm = centimeter
kilometre = 1000 metre = km = kilometer
inch = 0.0254 metre = in = inches
foot = 0.3048 metre = ft = feet
yard = 0.9144 metre = yd = yards
mile = 1609.344 metre = mi = miles
second = [time] = s = sec = seconds
millisecond = 0.001 second = ms = milliseconds
microsecond = 0.000001 second = us = µs
minute = 60 second = min = minutes
hour = 3600 second = h = hr = hour = hours
kilogram = [mass] = kg = kilograms
gram = 0.001 kilogram = g = grams
tonne = 1000 kilogram = t = tonnes = metric_ton = Mg
pound = 0.45359237 kilogram = lb = lbs = lbm = pounds
short_ton = 907.18474 kilogram = short_tons
long_ton = 1016.0469088 kilogram = long_tons
slug = 14.593902937206364829 kilogram = slugs
newton = kilogram * metre / second ** 2 = N = newtons
kilonewton = 1000 newton = kN
meganewton = 1000000 newton = MN
kilogram_force = 9.80665 newton = kgf
pound_force = 4.4482216152605 newton = lbf
kip = 4448.2216152605 newton = kips
pascal = newton / metre ** 2 = Pa
kilopascal = 1000 pascal = kPa
megapascal = 1000000 pascal = MPa
psi = pound_force / inch ** 2
ksi = kip / inch ** 2
psf = pound_force / foot ** 2
ksf = kip / foot ** 2
pci = pound_force / inch ** 3
pcf = pound_force / foot ** 3
kci = kip / inch ** 3
kcf = kip / foot ** 3
mph = mile / hour
kph = kilometre / hour = kmh
fps = foot / second
degree = [angle] = deg = ° = degrees
radian = 57.295779513082320876798154814105 degree = rad = radians
gradian = 0.9 degree = grad = gon
percent = 0.01 = %
"""


class Expected(NamedTuple):
    """What a quantity in the file must be."""

    words: str
    examples: str


# By the unit of the contract (the unit of a bare number).
EXPECTED: dict[str, Expected] = {
    "m": Expected("a length", "m, cm, ft or in"),
    "kg": Expected("a mass", "kg, t, lb or short_ton"),
    "s": Expected("a time", "s or ms"),
    "m/s": Expected("a speed", "m/s, km/h, mph or ft/s"),
    "deg": Expected("an angle", "deg or rad"),
    "kg/m^3": Expected("a density", "kg/m^3, t/m^3, pcf or kN/m^3"),
    "MN/m^3": Expected("a subgrade reaction (pressure per length)", "MN/m^3, kN/m^3 or pci"),
    "N/m": Expected("a stiffness", "kN/m, N/m or lb/in"),
    "N*s/m": Expected("a damping constant", "kN*s/m, N*s/m or lb*s/in"),
    "1": Expected("a plain number", "no unit, or %"),
}

_KINDS = (
    ("m^2", "an area"),
    ("m^3", "a volume"),
    ("N", "a force"),
    ("Pa", "a pressure"),
    ("m/s^2", "an acceleration"),
    ("1/s", "a frequency"),
    ("N*m", "a moment"),
)
_POUNDS = frozenset({"pound"})
_TRANSLATION = str.maketrans(
    {
        "·": "*",
        "⋅": "*",
        "×": "*",
        "∙": "*",
        "•": "*",
        "−": "-",
        "–": "-",
        "²": "^2",
        "³": "^3",
        "º": "°",
        "μ": "µ",
    }
)
_TOKEN = re.compile(r"\s*(?:(?P<name>[A-Za-zµ_]+|[%°])\.?|(?P<power>(?:\^|\*\*)?\s*-?\d)|(?P<sign>[*/()\-]))")
MAX_LENGTH = 60


class UnitError(ValueError):
    """A unit that is unknown, malformed or of the wrong kind; the message says what is allowed."""


@lru_cache(maxsize=1024)
def factor(text: str, target: str) -> Fraction:
    """Return the factor from a unit as written to the unit of the contract.

    Parameters
    ----------
    text : str
        Unit as the user wrote it, for example ``kN·s/m``.
    target : str
        Unit of the contract, a key of `EXPECTED`.

    Returns
    -------
    Fraction
        Value in `target` of one `text`.

    Raises
    ------
    UnitError
        Unknown unit, malformed unit, or another kind of quantity.

    Notes
    -----
    Weights stand for masses where a mass or a density is asked (116 pcf, 18.2 kN/m^3, 15 kip), and a pound
    is a force where a force is asked (350 lb/in^3), with standard gravity in between.
    """
    units = _read(text)
    scale, dimension = _base(units)
    target_scale, target_dimension = _base(_read(target))
    ratio = scale / target_scale
    if dimension == target_dimension:
        return ratio
    acceleration = _base(_read("m/s^2"))[1]
    if target in ("kg", "kg/m^3") and dimension == target_dimension * acceleration:
        return ratio / STANDARD_GRAVITY
    if _POUNDS & set(units) and dimension * acceleration == target_dimension:
        return ratio * STANDARD_GRAVITY
    kind = _kind(dimension)
    expected = EXPECTED[target]
    raise UnitError(f"'{shorten(text)}' is {kind}; {expected.words} is needed ({expected.examples})")


@cache
def _registry() -> UnitRegistry[Decimal]:
    # pint takes as long to import as everything else of `sweep check`: only files with units pay for it.
    from pint import UnitRegistry

    registry: UnitRegistry[Decimal] = UnitRegistry(None, non_int_type=Decimal)
    registry.load_definitions(_DEFINITIONS.strip().splitlines())
    return registry


def _base(units: dict[str, int]) -> tuple[Fraction, UnitsContainer]:
    """Return the value of one such unit in m, kg, s and degrees, and its dimension."""
    registry = _registry()
    scale = Fraction(1)
    dimension = registry.UnitsContainer()
    for name, power in units.items():
        magnitude, _ = registry.get_base_units(name)
        scale *= Fraction(str(magnitude)) ** power
        dimension = dimension * registry.get_dimensionality(name) ** power
    return scale, dimension


def _kind(dimension: UnitsContainer) -> str:
    """Return the kind of quantity in words, for a message."""
    for unit, expected in EXPECTED.items():
        if _base(_read(unit))[1] == dimension:
            return expected.words
    for unit, words in _KINDS:
        if _base(_read(unit))[1] == dimension:
            return words
    return "another kind of quantity"


def _read(text: str) -> dict[str, int]:
    """Return the powers of the units in a product such as ``kN*s/m``, ``lb/ft3`` or ``kN-s/m``."""
    if text == "1":
        return {}
    if len(text) > MAX_LENGTH:
        raise UnitError(f"'{shorten(text)}' is too long for a unit")
    plain = re.sub(r"\bper\b", "/", text.translate(_TRANSLATION))
    if plain.startswith("1/"):
        plain = plain[1:]
    tokens: list[tuple[str, str]] = []
    position = 0
    while position < len(plain.rstrip()):
        match = _TOKEN.match(plain, position)
        if match is None:
            raise UnitError(f"'{shorten(text)}' is not a unit")
        kind = str(match.lastgroup)
        tokens.append((kind, match[kind]))
        position = match.end()
    powers: dict[str, int] = {}
    if _product(tokens, 0, 1, powers, text) != len(tokens):
        raise UnitError(f"'{shorten(text)}' is not a unit")
    if any(abs(power) > 9 for power in powers.values()):
        raise UnitError(f"'{shorten(text)}' is not a unit")
    return {name: power for name, power in powers.items() if power}


def _product(tokens: list[tuple[str, str]], start: int, sign: int, powers: dict[str, int], text: str) -> int:
    """Read a product of units from token `start` on into `powers`; return the token it ended at."""
    index, side, wants_unit = start, sign, True
    if index < len(tokens) and tokens[index][1] == "/":
        index, side = index + 1, -sign
    while index < len(tokens) and tokens[index][1] != ")":
        kind, value = tokens[index]
        if kind == "sign" and value != "(":
            if wants_unit:
                break
            side = -sign if value == "/" else sign
            index, wants_unit = index + 1, True
            continue
        factor_powers: dict[str, int] = {}
        if value == "(":
            index = _product(tokens, index + 1, 1, factor_powers, text)
            if index >= len(tokens):
                break
        elif kind == "name":
            factor_powers[_known(value)] = 1
        else:
            break
        index += 1
        power = 1
        if index < len(tokens) and tokens[index][0] == "power":
            power = int(tokens[index][1].lstrip("^* "))
            index += 1
        for name, inner in factor_powers.items():
            powers[name] = powers.get(name, 0) + side * power * inner
        side, wants_unit = sign, False
    if wants_unit or (index < len(tokens) and tokens[index][1] != ")"):
        raise UnitError(f"'{shorten(text)}' is not a unit")
    return index


def _known(name: str) -> str:
    """Return the full name of a unit."""
    if name.lower() in ("ton", "tons"):
        raise UnitError(f"'{name}' may be one of three; say short_ton, long_ton or tonne")
    names = _names()
    if name not in names:
        raise UnitError(f"'{shorten(name)}' is not a known unit{did_you_mean(name, names)}")
    return names[name]


@cache
def _names() -> dict[str, str]:
    """Return every accepted spelling with the full name of its unit."""
    names = {}
    for line in _DEFINITIONS.strip().splitlines():
        full, _, *aliases = (part.strip() for part in line.split(" = "))
        names.update(dict.fromkeys([full, *aliases], full))
    return names
