"""Uncertain inputs, ``{mean: 38 deg, sd: 3 deg}`` in place of a value. Sampling is left to `sweep uncertainty`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.problems import Mistakes, Position, did_you_mean, shorten, wrong
from boulder_sweep.settings.tree import Mapping, Node, Scalar
from boulder_sweep.settings.values import RANGE_KEYS, Leaf, outside, read_leaf, read_quantity, read_single

T = TypeVar("T")
BOUNDED = ("uniform", "triangular", "beta")
"""Kinds that reach from one end to the other; others are truncated at theirs."""
KINDS = ("normal", "lognormal", *BOUNDED)
FRACTILE_5 = 1.6448536269514722
"""Distance of the 5 % fractile of a normal distribution below its mean, in standard deviations."""


@dataclass(frozen=True, slots=True)
class Distribution:
    """Spread of one input about its mean, in the unit of its column.

    The mean is not in here: it is the value of the constant or axis of the same name in the sweep, so a grid may have
    several means with one spread.

    Attributes
    ----------
    kind : str
        ``normal``, ``lognormal``, ``uniform``, ``triangular`` or ``beta``.
    sd : float or None
        Standard deviation; None where `cov` stands for it, or where the ends decide (uniform, triangular).
    cov : float or None
        Coefficient of variation, the standard deviation as a fraction of the mean.
    low, high : float
        Ends. Normal and lognormal distributions are truncated there, and their mean and standard deviation are those
        before truncation; the others reach from one end to the other. The admitted range where the file names none.
    mode : float or None
        Most likely value; triangular only.
    position : Position
        Where it stands in the file.
    """

    kind: str
    low: float
    high: float
    sd: float | None = None
    cov: float | None = None
    mode: float | None = None
    position: Position = field(default_factory=lambda: Position(""), compare=False)

    def deviation(self, mean: np.ndarray) -> np.ndarray:
        """Return the standard deviation (before truncation) for some means, in the unit of the column.

        Parameters
        ----------
        mean : ndarray of float64
            Means; uniform and triangular distributions have one of their own and do not look at it.
        """
        mean = np.asarray(mean, dtype=np.float64)
        if self.kind == "uniform":
            return np.full(mean.shape, (self.high - self.low) / math.sqrt(12.0))
        if self.kind == "triangular":
            a, b, c = self.low, self.high, self.own_mode
            return np.full(mean.shape, math.sqrt((a * a + b * b + c * c - a * b - a * c - b * c) / 18.0))
        return np.full(mean.shape, self.sd) if self.cov is None else self.cov * mean

    @property
    def own_mode(self) -> float:
        """The most likely value of a triangular distribution."""
        assert self.mode is not None
        return self.mode

    def words(self, unit: str, size: float = 1.0) -> str:
        """Return kind and spread in words, in a unit of which one is `size` in the unit of the column."""
        unit = "" if unit == "1" else f" {unit}"
        sd, mode = (None if value is None else f"{value / size:.6g}{unit}" for value in (self.sd, self.mode))
        spread = f"sd {sd}" if self.cov is None else f"cov {100.0 * self.cov:g} %"
        ends = f"{self.low / size:g} to {self.high / size:g}{unit}"
        return {
            "uniform": f"uniform, {ends}",
            "triangular": f"triangular, {ends}, most likely {mode}",
            "beta": f"beta, {spread}, {ends}",
        }.get(self.kind, f"{self.kind}, {spread}")

    def to_dict(self) -> dict[str, float | str]:
        """Return what is given as plain data."""
        named = {"kind": self.kind, "sd": self.sd, "cov": self.cov, "low": self.low, "high": self.high}
        return {name: value for name, value in {**named, "mode": self.mode}.items() if value is not None}


@dataclass(frozen=True, slots=True)
class SetDistributions:
    """Spread of one input of named soils or vehicles, each its own.

    Attributes
    ----------
    section : str
        ``soil`` or ``vehicle``; under this name a row carries the index of its set.
    each : tuple of Distribution or None
        In the order of the sets; None where a set gives a value.
    """

    section: str
    each: tuple[Distribution | None, ...]

    @property
    def position(self) -> Position:
        """Where the first of them stands in the file."""
        return next(spread.position for spread in self.each if spread is not None)

    def words(self, unit: str, size: float = 1.0) -> str:
        """Return kind and spread of each in words; see `Distribution.words`."""
        return "; ".join("certain" if spread is None else spread.words(unit, size) for spread in self.each)

    def to_dict(self) -> dict[str, Any]:
        """Return what is given as plain data."""
        return {"sets": [None if spread is None else spread.to_dict() for spread in self.each]}


@dataclass(frozen=True, eq=False)
class Input(Leaf):
    """Values of an input, and the spread about them.

    Attributes
    ----------
    distribution : Distribution, SetDistributions or None
        Spread about the values, which are its means; None where the values are certain.
    """

    distribution: Distribution | SetDistributions | None = None


_CENTRES = ("mean", "characteristic")
_SPREADS = ("sd", "cov")
NEEDED = {
    "normal": (_CENTRES, _SPREADS),
    "lognormal": (_CENTRES, _SPREADS),
    "uniform": (("low",), ("high",)),
    "triangular": (("low",), ("mode",), ("high",)),
    "beta": (("mean",), _SPREADS, ("low",), ("high",)),
}
"""For every kind what must be given, one of each group."""
_KEYS = ("distribution", *_CENTRES, *_SPREADS, "low", "high", "mode")
_WORDS = frozenset({*_KEYS, *KINDS})


def read_input(node: Node, field: Field) -> Input:
    """Return what an entry gives for an input: a value, a list, a range or a distribution.

    Raises
    ------
    LeafError
        With every mistake of this entry.
    """
    if isinstance(node, Mapping) and not set(RANGE_KEYS) & set(node.entries) and _WORDS & set(node.entries):
        return _read_distribution(node, field)
    certain = read_leaf(node, field)
    return Input(certain.values, certain.is_axis, certain.position, certain.written, certain.positions)


def _read_distribution(node: Mapping, field: Field) -> Input:
    """Return an uncertain input: its mean, or the axis of its means, and its distribution.

    It is ``{mean: 38 deg, sd: 3 deg}``, ``{distribution: lognormal, mean: [36, 38] deg, cov: 8 %}``,
    ``{characteristic: 36 deg, cov: 8 %}``, ``{distribution: uniform, low: 36 deg, high: 40 deg}`` and the like.
    """
    kind = _kind(node)
    _check_keys(node, kind)
    mistakes = Mistakes()

    def read(key: str | None, reader: Callable[[Node], T]) -> T | None:
        value = None if key is None else node.get(key)
        if value is not None:
            with mistakes:
                return reader(value)
        return None

    low, high, mode = (read(key, lambda value: read_single(value, field)) for key in ("low", "high", "mode"))
    sd = read("sd", lambda value: _positive(value, field.unit))
    cov = read("cov", lambda value: _positive(value, "1"))
    centre = next((key for key in _CENTRES if key in node.entries), None)
    given = read(centre, lambda value: read_leaf(value, field))
    mistakes.raise_if_any()
    bound = field.admitted
    assert bound is not None
    distribution = Distribution(
        kind,
        bound.low if low is None else low,
        bound.high if high is None else high,
        sd=sd,
        cov=cov,
        mode=mode,
        position=node.position,
    )
    if given is None:
        ends = (distribution.low, *(() if mode is None else (mode,)), distribution.high)
        values = np.array([sum(ends) / len(ends)])
    else:
        values = given.values if centre == "mean" else _means(node, kind, given.values, sd, cov)
    _check_values(node, values, distribution, field)
    if given is None:
        return Input(values, False, node.position, distribution=distribution)
    return Input(values, given.is_axis, node.position, given.written, given.positions, distribution)


def _kind(node: Mapping) -> str:
    """Return the kind of the distribution; normal where a mean is given and no kind."""
    value = node.get("distribution")
    if value is None:
        named = next((key for key in node.entries if key in KINDS), None)
        if named is not None:
            message = f"write the kind as an entry of its own: {{distribution: {named}, mean: ..., sd: ...}}"
            raise wrong(node.entries[named].position, message)
        return "normal"
    word = value.text.strip() if isinstance(value, Scalar) else ""
    if word not in KINDS:
        hint = did_you_mean(word, KINDS)
        raise wrong(value.position, f"'{shorten(word)}' is not a distribution: {', '.join(KINDS)}{hint}")
    return word


def _check_keys(node: Mapping, kind: str) -> None:
    """Report keys that are unknown, do not belong to this kind, are missing or exclude each other."""
    taken = {"distribution", "low", "high", *(key for group in NEEDED[kind] for key in group)}
    mistakes = Mistakes()
    for entry in node:
        if entry.key not in taken:
            hint = "" if entry.key in _KEYS else did_you_mean(entry.key, _KEYS)
            known = ", ".join(key for key in _KEYS if key in taken)
            message = f"'{shorten(entry.key)}' is not a key of a {kind} distribution ({known}){hint}"
            mistakes.add(entry.position, message)
    for group in NEEDED[kind]:
        given = [key for key in group if key in node.entries]
        if len(given) > 1:
            mistakes.add(node.entries[given[1]].position, f"give {' or '.join(group)}, not both")
        elif not given and not mistakes:
            mistakes.add(node.position, f"a {kind} distribution needs {' or '.join(group)}")
    if node.unit is not None:
        mistakes.add(node.unit.position, "write the unit behind each number of a distribution")
    mistakes.raise_if_any()


def _positive(node: Node, unit: str) -> float:
    value = float(read_quantity(node, unit).value)
    if not 0.0 < value < math.inf:
        raise wrong(node.position, "must be more than 0; for a value without doubt, write the value alone")
    return value


def _means(node: Mapping, kind: str, fractile: np.ndarray, sd: float | None, cov: float | None) -> np.ndarray:
    """Return the means of normal or lognormal distributions whose 5 % fractiles are given, their characteristic values.

    Normal: x_k = m - 1.645 s. Lognormal: x_k = m exp(-s_ln**2 / 2 - 1.645 s_ln) with s_ln**2 = ln(1 + cov**2).
    """
    if kind == "lognormal":
        if cov is None:
            raise wrong(node.position, "a characteristic value of a lognormal distribution needs cov")
        spread = math.sqrt(math.log1p(cov * cov))
        return fractile * math.exp(FRACTILE_5 * spread + 0.5 * spread * spread)
    if cov is None:
        assert sd is not None
        return fractile + FRACTILE_5 * sd
    if FRACTILE_5 * cov >= 1.0:
        message = "a normal distribution this wide has no positive 5 % fractile; use lognormal"
        raise wrong(node.entries["cov"].position, message)
    return fractile / (1.0 - FRACTILE_5 * cov)


def _check_values(node: Mapping, values: np.ndarray, distribution: Distribution, field: Field) -> None:
    """Report ends in the wrong order, and means and spreads that do not fit between them."""
    low, high, unit = distribution.low, distribution.high, "" if field.unit == "1" else f" {field.unit}"
    message = ""
    if not low < high:
        message = f"low ({low:g}{unit}) must be less than high ({high:g}{unit})"
    elif distribution.mode is not None and not low <= distribution.mode <= high:
        message = f"the mode must be between low and high ({low:g} to {high:g}{unit})"
    elif not (low < values.min() and values.max() < high):
        worst = values.min() if values.min() <= low else values.max()
        message = outside(float(worst), field) or f"the mean must be between low and high ({low:g} to {high:g}{unit})"
    elif distribution.kind == "beta":
        largest = np.sqrt((values - low) * (high - values))
        if np.any(distribution.deviation(values) >= largest):
            message = f"the standard deviation must be less than {largest.min():.4g}{unit} between these ends"
    if message:
        raise wrong(node.position, message)
