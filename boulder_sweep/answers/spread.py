"""Uncertain inputs: from independent standard normal numbers to values of the inputs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.moving import moving_of
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantiles import values_of
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
