"""Units: every unit a user may write, and its exact conversion.

The vocabulary is closed, so that a typing mistake is an error and not some exotic unit of the same name. Conversions
are exact fractions, so that 30 mph is 13.4112 m/s to the bit. (A units library would import half of the scientific
stack; checking a file must be instant.)
"""

from __future__ import annotations

import re
from collections import Counter, deque
from fractions import Fraction
from functools import cache, lru_cache
from typing import NamedTuple

from boulder_sweep.settings.problems import shorten

STANDARD_GRAVITY = Fraction("9.80665")
_GRAVITY_NAMES = ("g", "g's", "g’s", "gs", "g0", "gee", "gees")
"""In small letters; a unit of acceleration only, for g is a gram elsewhere."""

# Name = value = alias = alias ...; each line may use the lines above. Compound units follow from these.
_DEFINITIONS = """
metre = [length] = m = meter = metres = meters
millimetre = 0.001 metre = mm = millimeter
centimetre = 0.01 metre = cm = centimeter
kilometre = 1000 metre = km = kilometer
inch = 0.0254 metre = in = inches
foot = 0.3048 metre = ft = feet
yard = 0.9144 metre = yd = yards
mile = 1609.344 metre = mi = miles
second = [time] = s = sec = secs = seconds
millisecond = 0.001 second = ms = msec = msecs = milliseconds
microsecond = 0.000001 second = us = µs = usec = microseconds
minute = 60 second = min = mins = minutes
hour = 3600 second = h = hr = hrs = hours
kilogram = [mass] = kg = kgs = kilograms
gram = 0.001 kilogram = g = grams
tonne = 1000 kilogram = t = tonnes = metric_ton = Mg
pound = 0.45359237 kilogram = lb = lbs = lbm = pounds
short_ton = 907.18474 kilogram = short_tons
long_ton = 1016.0469088 kilogram = long_tons
slug = 14.593902937206364829 kilogram = slugs
newton = kilogram * metre / second ** 2 = N = newtons
kilonewton = 1000 newton = kN
meganewton = 1000000 newton = MN
newton_second = newton * second = Ns
kilonewton_second = 1000 newton * second = kNs
meganewton_second = 1000000 newton * second = MNs
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
tsf = 2 ksf
pci = pound_force / inch ** 3
pcf = pound_force / foot ** 3
kci = kip / inch ** 3
kcf = kip / foot ** 3
mph = mile / hour
kph = kilometre / hour = kmh = kmph
mps = metre / second
fps = foot / second
degree = [angle] = deg = ° = degrees
radian = 57.295779513082320876798154814105 degree = rad = radians
gradian = 0.9 degree = grad = gon
percent = 0.01 = %
"""


class QuantityKind(NamedTuple):
    """What a quantity in the file must be."""

    words: str
    examples: str
    sample: str
    """A value that a message suggests."""


# By the unit of the table (the unit of a bare number).
EXPECTED: dict[str, QuantityKind] = {
    "m": QuantityKind("a length", "m, cm, ft or in", "1.65 m"),
    "kg": QuantityKind("a mass", "kg, t, lb or short_ton", "6800 kg or 15000 lb"),
    "s": QuantityKind("a time", "s or ms", "1 s"),
    "m/s": QuantityKind("a speed", "m/s, km/h, mph or ft/s", "13.4 m/s or 30 mph"),
    "m/s^2": QuantityKind("an acceleration", "m/s^2, ft/s^2 or g", "1.5 m/s^2"),
    "deg": QuantityKind("an angle", "deg or rad", "36 deg"),
    "kg/m^3": QuantityKind("a density", "kg/m^3, t/m^3, pcf or kN/m^3", "2650 kg/m^3 or 116 pcf"),
    "MN/m^3": QuantityKind(
        "a subgrade reaction (pressure per length)", "MN/m^3, kN/m^3 or pci", "95 MN/m^3 or 350 pci"
    ),
    "kPa": QuantityKind("a pressure", "kPa, Pa or MPa", "5 kPa"),
    "MPa": QuantityKind("a pressure", "MPa, kPa or tsf", "14 MPa"),
    "N/m": QuantityKind("a stiffness", "kN/m, N/m or lb/in", "3103.3 kN/m"),
    "N*s/m": QuantityKind("a damping constant", "kN*s/m, N*s/m or lb*s/in", "138.91 kN*s/m"),
    "1": QuantityKind("a plain number", "no unit, or %", ""),
}

_KINDS = (
    ("m^2", "an area"),
    ("m^3", "a volume"),
    ("N", "a force"),
    ("1/s", "a frequency"),
    ("N*m", "a moment"),
)
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
MAX_POWER = 9
_LONG_WORD = 5
"""Letters of a unit that is written out."""


class UnitError(ValueError):
    """A unit that is unknown, malformed or of the wrong kind; the message says what is allowed."""


class _UnknownUnitError(UnitError):
    """A word that is no unit."""

    def __init__(self, word: str) -> None:
        super().__init__(f"'{shorten(word)}' is not a known unit")
        self.word = word


@lru_cache(maxsize=1024)
def factor(text: str, target: str) -> Fraction:
    """Return the factor from a unit as written to the unit of the table.

    Parameters
    ----------
    text : str
        Unit as the user wrote it, for example ``kN·s/m``.
    target : str
        Unit of the table, a key of `EXPECTED`.

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
    if target == "m/s^2" and text.strip().lower() in _GRAVITY_NAMES:
        return STANDARD_GRAVITY
    try:
        names = _read(text)
    except _UnknownUnitError as unknown:
        meant = _meant(unknown.word, text, target)
        raise UnitError(f"{unknown}; " + (f"did you mean {meant}?" if meant else _needed(target))) from None
    ratio = _ratio(names, target)
    if ratio is None:
        raise UnitError(f"'{shorten(text)}' is {_kind(_product(names).dimension)}; {_needed(target)}")
    return ratio


def _needed(target: str) -> str:
    """Return what a unit of the table stands for, and units in which it may be written."""
    expected = EXPECTED[target]
    return f"{expected.words} is needed ({expected.examples})"


def _ratio(names: dict[str, int], target: str) -> Fraction | None:
    """Return the factor from a product of units to the unit of the table, None for another kind of quantity."""
    unit, wanted = _product(names), _product(_read(target))
    ratio = unit.scale / wanted.scale
    if unit.dimension == wanted.dimension:
        return ratio
    if target in ("kg", "kg/m^3") and unit.dimension == _times(wanted.dimension, _ACCELERATION):
        return ratio / STANDARD_GRAVITY
    if "pound" in names and _times(unit.dimension, _ACCELERATION) == wanted.dimension:
        return ratio * STANDARD_GRAVITY
    return None


def _meant(word: str, text: str, target: str) -> str:
    """Return the unit that a misspelled word in a unit stands for, empty where that is not certain.

    A unit differs from others by one letter, so a word counts as misspelled only where it has the letters of the unit,
    or is a long word that begins like it. What it makes of the text must be of the kind that is needed. Where the slip
    may be one of size, M for m, the size is said.
    """
    # difflib takes a few milliseconds to import and is needed for mistakes only.
    from difflib import get_close_matches

    known = _vocabulary()
    spellings = {name.lower(): name for name in known}
    lower = word.lower()[:MAX_LENGTH]
    near = [name for name in spellings if sorted(name) == sorted(lower)]
    if len(lower) >= _LONG_WORD:
        near += [name for name in get_close_matches(lower, spellings, cutoff=0.85) if name[0] == lower[0]]
    for name in (spellings[one] for one in near):
        try:
            fits = _ratio(_read(text, known | {word: known[name]}), target) is not None
        except UnitError:
            continue
        if fits:
            full = known[name][0]
            is_size_open = word[0] != name[0] and word[0] in "mM" and full != name
            return f"{name} ({full})" if is_size_open else name
    return ""


def suffix_unit(suffix: str, unit: str) -> str:
    """Return the unit at the end of a name (``ft``, ``kN_m3``, ``lb_s_in``) as it is written, empty if it is none.

    Parameters
    ----------
    suffix : str
        The end of the name, without the underline before it.
    unit : str
        Unit of the table that it must fit.
    """
    parts = suffix.split("_")
    products = [suffix, *("*".join(parts[:k]) + "/" + "/".join(parts[k:]) for k in range(1, len(parts)))]
    for text in products:
        try:
            factor(text, unit)
        except UnitError:
            continue
        return text
    return ""


def name_suffix(unit: str) -> str:
    """Return the end of the name of a column in a unit: ``_kg_m3`` for kg/m^3, nothing for a plain number."""
    return "" if unit == "1" else "_" + unit.replace("^", "").replace("*", "_").replace("/", "_")


Dimension = tuple[int, ...]


class Unit(NamedTuple):
    """A unit: its value in m, kg, s and degrees, and its powers of these."""

    scale: Fraction
    dimension: Dimension


_BASE = ("[length]", "[mass]", "[time]", "[angle]")
_ACCELERATION: Dimension = (1, 0, -2, 0)


@cache
def _vocabulary() -> dict[str, tuple[str, Unit]]:
    """Return every accepted spelling with the full name of its unit and the unit."""
    known: dict[str, tuple[str, Unit]] = {}
    for line in _DEFINITIONS.strip().splitlines():
        full, value, *aliases = (part.strip() for part in line.split(" = "))
        if value in _BASE:
            unit = Unit(Fraction(1), tuple(int(value == base) for base in _BASE))
        else:
            number, _, rest = value.partition(" ") if value[0].isdigit() else ("1", "", value)
            unit = _product(_read(rest, known), known)
            unit = Unit(Fraction(number) * unit.scale, unit.dimension)
        known |= dict.fromkeys([full, *aliases], (full, unit))
    return known


def _product(powers: dict[str, int], known: dict[str, tuple[str, Unit]] | None = None) -> Unit:
    """Return the unit that a product of units makes."""
    known = _vocabulary() if known is None else known
    scale, dimension = Fraction(1), (0,) * len(_BASE)
    for name, power in powers.items():
        unit = known[name][1]
        scale *= unit.scale**power
        dimension = _times(dimension, tuple(power * exponent for exponent in unit.dimension))
    return Unit(scale, dimension)


def _times(one: Dimension, other: Dimension) -> Dimension:
    return tuple(a + b for a, b in zip(one, other, strict=True))


def _kind(dimension: Dimension) -> str:
    """Return the kind of quantity in words, for a message."""
    kinds = (*((unit, expected.words) for unit, expected in EXPECTED.items()), *_KINDS)
    return next(
        (words for unit, words in kinds if _product(_read(unit)).dimension == dimension), "another kind of quantity"
    )


def _read(text: str, known: dict[str, tuple[str, Unit]] | None = None) -> dict[str, int]:
    """Return the powers of the units in a product such as ``kN*s/m``, ``lb/ft3`` or ``kN-s/m``."""
    if text in ("1", ""):
        return {}
    if len(text) > MAX_LENGTH:
        raise UnitError(f"'{shorten(text)}' is too long for a unit")
    malformed = UnitError(f"'{shorten(text)}' is not a unit")
    plain = re.sub(r"\bper\b", "/", text.translate(_TRANSLATION))
    if plain.startswith("1/"):
        plain = plain[1:]
    tokens: deque[tuple[str, str]] = deque()
    position = 0
    while position < len(plain.rstrip()):
        match = _TOKEN.match(plain, position)
        if match is None:
            raise malformed
        kind = str(match.lastgroup)
        tokens.append((kind, match[kind]))
        position = match.end()
    powers = _product_of(tokens, _vocabulary() if known is None else known)
    if powers is None or tokens or any(abs(power) > MAX_POWER for power in powers.values()):
        raise malformed
    return {name: power for name, power in powers.items() if power}


def _product_of(tokens: deque[tuple[str, str]], known: dict[str, tuple[str, Unit]]) -> dict[str, int] | None:
    """Take ``a * b / (c d)^2 ...`` from the tokens, up to a closing bracket; None if it is not well formed."""
    powers: Counter[str] = Counter()
    signs: tuple[str, ...] = ("/",)  # 1/s
    while True:
        side = 1
        if tokens and tokens[0][1] in signs:
            side = -1 if tokens.popleft()[1] == "/" else 1
        kind, word = tokens.popleft() if tokens else ("", "")
        inner: dict[str, int] | None = None
        if word == "(":
            inner = _product_of(tokens, known)
            if not tokens or tokens.popleft()[1] != ")":
                return None
        elif kind == "name":
            inner = {_full_name(word, known): 1}
        if inner is None:
            return None
        power = int(tokens.popleft()[1].lstrip("^* ")) if tokens and tokens[0][0] == "power" else 1
        for name, exponent in inner.items():
            powers[name] += side * power * exponent
        if not tokens or tokens[0][1] == ")":
            return powers
        signs = ("*", "-", "/")


def _full_name(name: str, known: dict[str, tuple[str, Unit]]) -> str:
    if name.lower() in ("ton", "tons"):
        raise UnitError(f"'{name}' is ambiguous; use short_ton, long_ton or tonne")
    if name not in known:
        raise _UnknownUnitError(name)
    return known[name][0]
