"""Entries that hold a distribution in place of a value: ``{mean: 38 deg, sd: 3 deg}``."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from boulder_sweep.settings.distributions import FRACTILE_5, KINDS, Distribution, mean_of_fractile
from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.leaf import Leaf, LeafError, Mistake, outside, read_leaf, read_single
from boulder_sweep.settings.numbers import NumberError, read_quantity
from boulder_sweep.settings.problems import did_you_mean, shorten
from boulder_sweep.settings.tree import Mapping, Node, Scalar

T = TypeVar("T")
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
_RANGE_KEYS = frozenset({"from", "to", "count", "step"})


def read_input(node: Node, field: Field) -> Leaf:
    """Return what an entry gives for an input: a value, a list, a range or a distribution.

    Raises
    ------
    LeafError
        With every mistake of this entry.
    """
    if isinstance(node, Mapping) and not _RANGE_KEYS & set(node.entries) and _WORDS & set(node.entries):
        return _read_distribution(node, field)
    return read_leaf(node, field)


def _read_distribution(node: Mapping, field: Field) -> Leaf:
    """Return an uncertain input: its mean, or the axis of its means, and its distribution.

    Parameters
    ----------
    node : Mapping
        ``{mean: 38 deg, sd: 3 deg}``, ``{distribution: lognormal, mean: [36, 38] deg, cov: 8 %}``,
        ``{characteristic: 36 deg, cov: 8 %}``, ``{distribution: uniform, low: 36 deg, high: 40 deg}`` and the like.
    field : Field
        What it is about.

    Raises
    ------
    LeafError
        With every mistake of this entry.
    """
    kind = _kind(node)
    _check_keys(node, kind)
    mistakes: list[Mistake] = []

    def read(key: str, reader: Callable[[Node], T]) -> T | None:
        value = node.get(key)
        if value is None:
            return None
        try:
            return reader(value)
        except LeafError as error:
            mistakes.extend(error.mistakes)
        except NumberError as error:
            mistakes.append(Mistake(value.position, str(error)))
        return None

    low, high, mode = (read(key, lambda value: read_single(value, field)) for key in ("low", "high", "mode"))
    sd = read("sd", lambda value: _positive(value, field.unit))
    cov = read("cov", lambda value: _positive(value, "1"))
    centre = next((key for key in _CENTRES if key in node.entries), None)
    given = None if centre is None else read(centre, lambda value: read_leaf(value, field))
    if mistakes:
        raise LeafError(mistakes)
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
        leaf = Leaf(np.array([sum(ends) / len(ends)]), False, node.position, distribution)
    else:
        values = given.values if centre == "mean" else _means(node, kind, given.values, sd, cov)
        leaf = Leaf(values, given.is_axis, node.position, distribution)
    _check_values(node, leaf, distribution, field)
    return leaf


def _kind(node: Mapping) -> str:
    """Return the kind of the distribution; normal where a mean is given and no kind."""
    value = node.get("distribution")
    if value is None:
        named = next((key for key in node.entries if key in KINDS), None)
        if named is not None:
            message = f"write the kind as an entry of its own: {{distribution: {named}, mean: ..., sd: ...}}"
            raise LeafError([Mistake(node.entries[named].position, message)])
        return "normal"
    word = value.text.strip() if isinstance(value, Scalar) else ""
    if word not in KINDS:
        hint = did_you_mean(word, KINDS)
        raise LeafError([Mistake(value.position, f"'{shorten(word)}' is not a distribution: {', '.join(KINDS)}{hint}")])
    return word


def _check_keys(node: Mapping, kind: str) -> None:
    """Report keys that are unknown, do not belong to this kind, are missing or exclude each other."""
    taken = {"distribution", "low", "high", *(key for group in NEEDED[kind] for key in group)}
    mistakes = []
    for entry in node:
        if entry.key not in taken:
            hint = "" if entry.key in _KEYS else did_you_mean(entry.key, _KEYS)
            known = ", ".join(key for key in _KEYS if key in taken)
            message = f"'{shorten(entry.key)}' is not a key of a {kind} distribution ({known}){hint}"
            mistakes.append(Mistake(entry.position, message))
    for group in NEEDED[kind]:
        given = [key for key in group if key in node.entries]
        if len(given) > 1:
            mistakes.append(Mistake(node.entries[given[1]].position, f"give {' or '.join(group)}, not both"))
        elif not given and not mistakes:
            mistakes.append(Mistake(node.position, f"a {kind} distribution needs {' or '.join(group)}"))
    if node.unit is not None:
        mistakes.append(Mistake(node.unit.position, "write the unit behind each number of a distribution"))
    if mistakes:
        raise LeafError(mistakes)


def _positive(node: Node, unit: str) -> float:
    value = float(read_quantity(node, unit).value)
    if not 0.0 < value < math.inf:
        raise NumberError("must be more than 0; for a value without doubt, write the value alone")
    return value


def _means(node: Mapping, kind: str, fractile: np.ndarray, sd: float | None, cov: float | None) -> np.ndarray:
    """Return the means that belong to characteristic values."""
    if kind == "lognormal" and cov is None:
        raise LeafError([Mistake(node.position, "a characteristic value of a lognormal distribution needs cov")])
    if kind == "normal" and cov is not None and FRACTILE_5 * cov >= 1.0:
        message = "a normal distribution this wide has no positive 5 % fractile; use lognormal"
        raise LeafError([Mistake(node.entries["cov"].position, message)])
    return mean_of_fractile(kind, fractile, sd, cov)


def _check_values(node: Mapping, leaf: Leaf, distribution: Distribution, field: Field) -> None:
    """Report ends in the wrong order, and means and spreads that do not fit between them."""
    low, high, unit = distribution.low, distribution.high, "" if field.unit == "1" else f" {field.unit}"
    message = ""
    if not low < high:
        message = f"low ({low:g}{unit}) must be less than high ({high:g}{unit})"
    elif distribution.mode is not None and not low <= distribution.mode <= high:
        message = f"the mode must be between low and high ({low:g} to {high:g}{unit})"
    elif not (low < leaf.values.min() and leaf.values.max() < high):
        worst = leaf.values.min() if leaf.values.min() <= low else leaf.values.max()
        message = outside(float(worst), field) or f"the mean must be between low and high ({low:g} to {high:g}{unit})"
    elif distribution.kind == "beta":
        largest = np.sqrt((leaf.values - low) * (high - leaf.values))
        if np.any(distribution.deviation(leaf.values) >= largest):
            message = f"the standard deviation must be less than {largest.min():.4g}{unit} between these ends"
    if message:
        raise LeafError([Mistake(node.position, message)])
