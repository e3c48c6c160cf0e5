"""A distribution whose mean is searched: its ends move with the mean.

The value searched is the mean. The distribution keeps its shape: where it has a coefficient of variation, its ends keep
their ratio to the mean, otherwise their distance from it. The ends that a file does not name are those of the admitted
range, and stay.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.errors import QuestionError
from boulder_sweep.settings.distributions import Distribution, SetDistributions
from boulder_sweep.settings.fields import BY_NAME, EMBEDMENT

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.fields import Bound

TRUNCATED = ("normal", "lognormal")
"""Kinds that ends truncate; the others reach from one end to the other."""


class Moving:
    """The distribution of the input that is searched.

    Parameters
    ----------
    sweep
        The sweep.
    name
        Column (or ``embedment_ratio``) of the input; it has a distribution.

    Raises
    ------
    QuestionError
        It has several means but one pair of ends, so that their places about the mean are not known.
    """

    def __init__(self, sweep: Sweep, name: str) -> None:
        self.name = name
        self._admitted = _admitted(name)
        spread = sweep.distributions[name]
        columns = {own: values for axis in sweep.axes for own, values in axis.columns.items()}
        means = columns.get(name, np.array([sweep.constants.get(name, np.nan)]))
        if isinstance(spread, SetDistributions):
            self._each = [(own, mean) for own, mean in zip(spread.each, means, strict=True) if own is not None]
            return
        self._each = [(spread, means[0])]
        named = spread.kind not in TRUNCATED or (spread.low, spread.high) != self._admitted[:2]
        if len(means) > 1 and named:
            raise QuestionError(
                f"{BY_NAME[name].path} is asked for, and its low and high belong to several means; they would move "
                "with the mean that is searched, from one that is not known. Give one mean"
            )

    def ends(self, spread: Distribution, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends of a distribution that has moved.

        Parameters
        ----------
        spread
            The distribution of the file, or that of one of its sets.
        mean
            Means, in the unit of the column, shape (n,).

        Returns
        -------
        low, high : ndarray, shape (n,)
            Its ends, within the admitted range.
        """
        own = next(at for one, at in self._each if one is spread)
        low, high = (np.clip(_moved(spread, end, own, mean), *self._admitted[:2]) for end in (spread.low, spread.high))
        if spread.kind in TRUNCATED:
            low = np.where(spread.low == self._admitted.low, self._admitted.low, low)
            high = np.where(spread.high == self._admitted.high, self._admitted.high, high)
        return low, high

    def means(self, least: float) -> tuple[float, float]:
        """Return the smallest and the largest mean at which the distribution is within the admitted range.

        Parameters
        ----------
        least
            Smallest mean for which a spread that is a share of the mean makes sense, in the unit of the column.
        """
        first, last = self._admitted.low, self._admitted.high
        for spread, own in self._each:
            if spread.cov is not None or spread.kind == "lognormal":
                first = max(first, least)
            if spread.kind in TRUNCATED:
                continue
            if spread.cov is None:
                first = max(first, self._admitted.low + (own - spread.low))
                last = min(last, self._admitted.high - (spread.high - own))
            else:
                first = max(first, self._admitted.low * own / spread.low if spread.low > 0.0 else 0.0)
                last = min(last, self._admitted.high * own / spread.high)
        return first, last


def moving_of(sweep: Sweep, name: str) -> Moving | None:
    """Return the distribution of the input that is searched; None where it has none.

    Raises
    ------
    QuestionError
        As of `Moving`; or the embedment is searched as a depth and uncertain as a ratio, or the reverse.
    """
    other = next((own for own in EMBEDMENT if name in EMBEDMENT and own != name and own in sweep.distributions), None)
    if other is not None:
        raise QuestionError(
            f"{BY_NAME[name].path} is asked for, and {BY_NAME[other].path} has a distribution; ask for "
            f"{BY_NAME[other].key}, or give the distribution of {BY_NAME[name].key}"
        )
    return Moving(sweep, name) if name in sweep.distributions else None


def narrowed(
    sweep: Sweep, name: str, low: np.ndarray, high: np.ndarray, *, least: float, given: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of search ranges where the distribution of the input is within its admitted range.

    Parameters
    ----------
    sweep, name
        As of `Moving`; an input without a distribution keeps its ranges.
    low, high
        The ranges, in the unit of the column, shape (n,).
    least
        As of `Moving.means`.
    given
        Whether the user chose the range; it is then refused in place of being narrowed.

    Raises
    ------
    QuestionError
        Nothing is left of a range, or the range of the user would be narrowed.
    """
    moving = moving_of(sweep, name)
    if moving is None:
        return low, high
    first, last = moving.means(least)
    empty = (low <= high) & (np.maximum(low, first) > np.minimum(high, last))
    if empty.any() or (given and ((low < first) | (high > last)).any()):
        field, admitted = BY_NAME[name], _admitted(name)
        unit = "" if field.unit == "1" else f" {field.unit}"
        at = empty.argmax()
        raise QuestionError(
            f"the means of {field.path} to search are {low[at]:.10g} to {high[at]:.10g}{unit}, but its distribution is "
            f"admitted, from {admitted.low:g} to {admitted.high:g}{unit}, only for means from {first:.10g} to "
            f"{last:.10g}{unit}; give another range (--between) or a narrower distribution"
        )
    return np.maximum(low, first), np.minimum(high, last)


def _moved(spread: Distribution, end: float, own: float, mean: np.ndarray) -> np.ndarray:
    """Return where an end of the distribution with the mean `own` lies for other means."""
    return end + (mean - own) if spread.cov is None else end * (mean / own)


def _admitted(name: str) -> Bound:
    bound = BY_NAME[name].admitted
    assert bound is not None
    return bound
