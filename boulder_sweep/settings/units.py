"""Units: every unit a user may write, its exact conversion, and the units in which people read a result.

The vocabulary is closed, so that a typing mistake is an error and not some exotic unit of the same name. Conversions
are exact fractions, so that 30 mph is 13.4112 m/s to the bit. (A units library would import half of the scientific
stack; checking a file must be instant.) A result is shown in SI as the table has it, or in US customary units.
"""

from __future__ import annotations

import re
from collections import Counter, deque
from collections.abc import Mapping
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.columns import BY_NAME, column_spec
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
    sample: str  # a value that a message suggests


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

_KINDS = (("m^2", "an area"), ("m^3", "a volume"), ("N", "a force"), ("1/s", "a frequency"), ("N*m", "a moment"))
_TRANSLATION = str.maketrans("·⋅×∙•−–ºμ", "*****--°µ") | str.maketrans({"²": "^2", "³": "^3"})
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
    """Return the value of one unit as written, ``kN·s/m``, in a unit of the table, a key of `EXPECTED`.

    Weights stand for masses where a mass or a density is asked (116 pcf, 18.2 kN/m^3, 15 kip), and a pound is a force
    where a force is asked (350 lb/in^3), with standard gravity in between. Raises UnitError for an unknown or malformed
    unit, and for another kind of quantity.
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
    or is a long word that begins like it. Where the slip may be one of size, M for m, the size is said.
    """
    from difflib import get_close_matches  # takes a few milliseconds to import: for mistakes only

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
    """Return the unit at the end of a name (``ft``, ``kN_m3``, ``lb_s_in``) as it is written; empty if it is none."""
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

    name: str
    unit: str
    size: float  # one of its unit in the unit of the result
    meaning: str


def check_system(system: str) -> None:
    """Raise ValueError for units that are neither ``si`` nor ``us``."""
    if system not in SYSTEMS:
        raise ValueError(f"units must be {' or '.join(SYSTEMS)}, not {system!r}")


def shown_unit(unit: str, system: str) -> ShownUnit:
    """Return the unit in which values of a column in a unit, or in ``J`` or ``N``, are shown in one of `SYSTEMS`."""
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

    They are given in a `unit` of the table, in which they stay for ``si``; 1 is not written.
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
        return ShownColumn(stored, unit, 1.0, meaning)
    other, size = shown_unit(unit, units)
    name = stored if size == 1.0 else stored.removesuffix(name_suffix(unit)) + name_suffix(other)
    return ShownColumn(name, other, size, meaning)


def shown_settings(settings: Mapping[str, Any], units: str) -> dict[str, Any]:
    """Return resolved settings or a row in the units asked for: numbers, and names that end in a unit."""
    if units == "si":
        return dict(settings)
    shown_by_name = {}
    for name, value in settings.items():
        if name == "order" and isinstance(value, list):
            shown_by_name[name] = [shown_column(one, units).name if one in BY_NAME else one for one in value]
            continue
        unit = max((unit for unit in (*_SHOWN, *_FORCES) if name.endswith(name_suffix(unit))), key=len, default="")
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


def rounded(value: float, digits: int = 4) -> str:
    """Return a number in a few digits, without an exponent where it has at most six."""
    return f"{float(f'{value:.{digits}g}'):g}"


def describe(value: float, unit: str, written: str = "", digits: int = 6) -> str:
    """Return a value of a unit of the table, for messages: in the unit in which it was written, if any."""
    if written:
        value, unit = value / float(factor(written, unit)), written
    return rounded(value, digits) if unit == "1" else f"{rounded(value, digits)} {unit}"


def range_words(low: float, high: float, unit: str, written: str = "", digits: int = 6) -> str:
    """Return a range, or the one value that both its ends are; other arguments: see `describe`."""
    ends = describe(low, unit, written, digits), describe(high, unit, written, digits)
    return ends[1] if low == high else f"{ends[0].split()[0]} to {ends[1]}"


def needed(unit: str, sample: str = "") -> str:
    """Return what an entry takes whose bare numbers are in a unit of the table, with an example."""
    expected = EXPECTED[unit]
    return "a number is needed" if unit == "1" else f"{expected.words} is needed, such as {sample or expected.sample}"
