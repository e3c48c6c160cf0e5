"""Uncertain inputs: from independent standard normal numbers to values.

Where the mean of a distribution is searched, its ends move with it. The distribution keeps its shape: where it has a
coefficient of variation, its ends keep their ratio to the mean, otherwise their distance from it. Ends that a file
does not name are the ends of the admitted range, and stay.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantiles import values_of
from boulder_sweep.settings.fields import BY_NAME, EMBEDMENT
from boulder_sweep.settings.model import Distribution, SetDistributions

if TYPE_CHECKING:
    from boulder_sweep.answers.trials import InputRows
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.fields import Bound

PAIR = ("friction_angle_deg", "subgrade_reaction_MN_m3")
"""The inputs that may be correlated."""
TRUNCATED = ("normal", "lognormal")
"""Kinds that ends truncate; the others reach from one end to the other."""


class Spread:
    """The uncertain inputs of a sweep, one of whose means may be searched.

    Friction angle and subgrade reaction are correlated by a Gaussian copula: the normal of the second is ``rho z_1 +
    sqrt(1 - rho^2) z_2``.

    Raises
    ------
    QuestionError
        No input has a distribution, or the one of the input searched moves with its mean in a way that is not known.
    """

    def __init__(self, sweep: Sweep, searched: str | None = None) -> None:
        if not sweep.distributions:
            raise QuestionError(
                f"{sweep.name}: no input has a distribution; write one, for example "
                "soil: {friction_angle: {mean: 38 deg, sd: 3 deg}}"
            )
        self.distributions = dict(sorted(sweep.distributions.items(), key=lambda item: item[0] == PAIR[1]))
        self.correlation = sweep.correlation if set(PAIR) <= set(self.distributions) else 0.0
        self._moving = None if searched is None else moving_of(sweep, searched)

    @property
    def names(self) -> list[str]:
        """Columns (or ``embedment_ratio``) of the uncertain inputs, in the order of their normals."""
        return list(self.distributions)

    @property
    def words(self) -> list[str]:
        """Dotted keys of the uncertain inputs."""
        return [BY_NAME[name].path for name in self.names]

    def filled(self, given: InputRows, z: np.ndarray) -> InputRows:
        """Return designs with sampled inputs.

        Parameters
        ----------
        given
            Inputs of n designs, with means for the uncertain ones.
        z
            Independent standard normal numbers, shape (n, number of uncertain inputs).
        """
        inputs = dict(given)
        for column, (name, spread) in enumerate(self.distributions.items()):
            normal = z[:, column]
            if name == PAIR[1] and self.correlation:
                other = z[:, self.names.index(PAIR[0])]
                normal = self.correlation * other + math.sqrt(1.0 - self.correlation**2) * normal
            moving = self._moving if self._moving is not None and self._moving.name == name else None
            inputs[name] = _draw_values(spread, given, np.asarray(given[name], dtype=float), normal, moving)
        return inputs


def _draw_values(
    spread: Distribution | SetDistributions, given: InputRows, mean: np.ndarray, z: np.ndarray, moving: Moving | None
) -> np.ndarray:
    """Return the values of an input at standard normal numbers; of named sets each from its own distribution."""

    def drawn(one: Distribution, mean: np.ndarray, z: np.ndarray) -> np.ndarray:
        return values_of(one, mean, z, None if moving is None else moving.ends(one, mean))

    if not isinstance(spread, SetDistributions):
        return drawn(spread, mean, z)
    values = mean.copy()
    for code, distribution in enumerate(spread.each):
        rows = given[spread.section] == code
        if distribution is not None and rows.any():
            values[rows] = drawn(distribution, mean[rows], z[rows])
    return values


class Moving:
    """The distribution of the input that is searched, named by its column (or ``embedment_ratio``).

    Raises
    ------
    QuestionError
        It has several means but one pair of ends, so that it is not known where they lie about the mean.
    """

    def __init__(self, sweep: Sweep, name: str) -> None:
        self.name = name
        self._admitted = _admitted(name)
        spread = sweep.distributions[name]
        means = sweep.values.get(name, np.array([np.nan]))
        if isinstance(spread, SetDistributions):
            self._each = [(one, mean) for one, mean in zip(spread.each, means, strict=True) if one is not None]
            return
        self._each = [(spread, means[0])]
        named = spread.kind not in TRUNCATED or (spread.low, spread.high) != self._admitted[:2]
        if len(means) > 1 and named:
            raise QuestionError(
                f"{BY_NAME[name].path} is asked for, and its low and high belong to several means; they would move "
                "with the mean that is searched, from one that is not known. Give one mean"
            )

    def ends(self, spread: Distribution, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends of a distribution of the file with other means, within the admitted range, shape (n,)."""
        old = next(at for one, at in self._each if one is spread)
        moved = (end + (mean - old) if spread.cov is None else end * (mean / old) for end in (spread.low, spread.high))
        low, high = (np.clip(end, *self._admitted[:2]) for end in moved)
        if spread.kind in TRUNCATED:
            low = np.where(spread.low == self._admitted.low, self._admitted.low, low)
            high = np.where(spread.high == self._admitted.high, self._admitted.high, high)
        return low, high

    def means(self, least: float) -> tuple[float, float]:
        """Return the smallest and the largest mean at which the distribution is within the admitted range.

        A spread that is a share of the mean makes sense from a mean of `least` on, in the unit of the column.
        """
        first, last = self._admitted.low, self._admitted.high
        for spread, mean in self._each:
            if spread.cov is not None or spread.kind == "lognormal":
                first = max(first, least)
            if spread.kind in TRUNCATED:
                continue
            if spread.cov is None:
                first = max(first, self._admitted.low + (mean - spread.low))
                last = min(last, self._admitted.high - (spread.high - mean))
            else:
                first = max(first, self._admitted.low * mean / spread.low if spread.low > 0.0 else 0.0)
                last = min(last, self._admitted.high * mean / spread.high)
        return first, last


def moving_of(sweep: Sweep, name: str) -> Moving | None:
    """Return the distribution of the input that is searched; None where it has none.

    Raises
    ------
    QuestionError
        `Moving` refuses; or the embedment is searched as a depth and uncertain as a ratio, or the reverse.
    """
    other = next((one for one in EMBEDMENT if name in EMBEDMENT and one != name and one in sweep.distributions), None)
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
    name
        Column (or ``embedment_ratio``) of the input; without a distribution it keeps its ranges.
    low, high
        The ranges, in the unit of the column, shape (n,).
    least
        See `Moving.means`.
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


def _admitted(name: str) -> Bound:
    bound = BY_NAME[name].admitted
    assert bound is not None
    return bound
