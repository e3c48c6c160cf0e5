"""Uncertain inputs: from independent standard normal numbers to values of the inputs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import betainccinv, betaincinv, ndtr, ndtri

from boulder_sweep.answers.moving import moving_of
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings.distributions import SetDistributions
from boulder_sweep.settings.fields import BY_NAME

if TYPE_CHECKING:
    from boulder_sweep.answers.moving import Moving
    from boulder_sweep.answers.trials import Rows
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.distributions import Distribution

PAIR = ("friction_angle_deg", "subgrade_reaction_MN_m3")
"""The inputs that may be correlated."""


class Spread:
    """The uncertain inputs of a sweep.

    Parameters
    ----------
    sweep
        The sweep.
    searched
        Column (or ``embedment_ratio``) of the input whose mean is searched, if any.

    Raises
    ------
    QuestionError
        No input has a distribution, or it is not known how that of the input searched moves with its mean.

    Notes
    -----
    Friction angle and subgrade reaction are correlated by a Gaussian copula: the normal of the second is ``rho z_1 +
    sqrt(1 - rho^2) z_2``.
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

    def filled(self, given: Rows, z: np.ndarray) -> Rows:
        """Return designs with sampled inputs.

        Parameters
        ----------
        given
            Inputs of n designs, with means for the uncertain ones.
        z
            Independent standard normal numbers, shape (n, number of uncertain inputs).
        """
        found = dict(given)
        for place, (name, spread) in enumerate(self.distributions.items()):
            own = z[:, place]
            if name == PAIR[1] and self.correlation:
                other = z[:, self.names.index(PAIR[0])]
                own = self.correlation * other + math.sqrt(1.0 - self.correlation**2) * own
            moving = self._moving if self._moving is not None and self._moving.name == name else None
            found[name] = _drawn(spread, given, np.asarray(given[name], dtype=float), own, moving)
        return found


def _drawn(
    spread: Distribution | SetDistributions, given: Rows, mean: np.ndarray, z: np.ndarray, moving: Moving | None
) -> np.ndarray:
    """Return the values of an input at standard normal numbers; of named sets each from its own distribution."""

    def drawn(one: Distribution, mean: np.ndarray, z: np.ndarray) -> np.ndarray:
        return values_of(one, mean, z, None if moving is None else moving.ends(one, mean))

    if not isinstance(spread, SetDistributions):
        return drawn(spread, mean, z)
    found = mean.copy()
    for place, own in enumerate(spread.each):
        rows = given[spread.section] == place
        if own is not None and rows.any():
            found[rows] = drawn(own, mean[rows], z[rows])
    return found


def values_of(
    spread: Distribution, mean: np.ndarray, z: np.ndarray, ends: tuple[np.ndarray, np.ndarray] | None = None
) -> np.ndarray:
    """Return the quantiles of a distribution at standard normal numbers.

    Parameters
    ----------
    spread
        The distribution.
    mean
        Means, before truncation where that is possible, shape (n,).
    z
        Standard normal numbers, shape (n,).
    ends
        Ends in place of its own, shape (n,) each, of a distribution that has moved; see `moving`.
    """
    low, high = (np.broadcast_to(end, mean.shape) for end in ends or (spread.low, spread.high))
    if spread.kind == "normal":
        return _truncated(mean, spread.deviation(mean), low, high, z)
    if spread.kind == "lognormal":
        variance = np.log1p((spread.deviation(mean) / mean) ** 2)
        with np.errstate(divide="ignore"):
            low, high = np.log(low), np.log(high)
        return np.exp(_truncated(np.log(mean) - 0.5 * variance, np.sqrt(variance), low, high, z))
    width = high - low
    if spread.kind == "uniform":
        return low + width * ndtr(z)
    if spread.kind == "triangular":
        share = (spread.own_mode - spread.low) / (spread.high - spread.low)
        rising, falling = np.sqrt(share * ndtr(z)), 1.0 - np.sqrt((1.0 - share) * ndtr(-z))
        return low + width * np.where(ndtr(z) < share, rising, falling)
    at, deviation = (mean - low) / width, spread.deviation(mean) / width
    total = at * (1.0 - at) / deviation**2 - 1.0
    a, b = at * total, (1.0 - at) * total
    return low + width * np.where(z < 0.0, betaincinv(a, b, ndtr(z)), betainccinv(a, b, ndtr(-z)))


def _truncated(mean: np.ndarray, deviation: np.ndarray, low: np.ndarray, high: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Truncated normal distribution; each half is computed from its own tail, so that no digits are lost."""
    below, above = (low - mean) / deviation, (high - mean) / deviation
    lower = ndtri(ndtr(below) + ndtr(z) * (ndtr(above) - ndtr(below)))
    upper = -ndtri(ndtr(-above) + ndtr(-z) * (ndtr(-below) - ndtr(-above)))
    return np.clip(mean + deviation * np.where(z < 0.0, lower, upper), low, high)
