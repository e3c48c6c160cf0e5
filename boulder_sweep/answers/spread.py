"""Uncertain inputs: from independent standard normal numbers to values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantiles import values_of
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import Distribution, SetDistributions

if TYPE_CHECKING:
    from boulder_sweep.answers.trials import InputRows
    from boulder_sweep.settings import Sweep

PAIR = ("friction_angle_deg", "subgrade_reaction_MN_m3")
"""The inputs that may be correlated."""


class Spread:
    """The uncertain inputs of a sweep; a `QuestionError` where no input has a distribution.

    Friction angle and subgrade reaction are correlated by a Gaussian copula: the normal of the second is ``rho z_1 +
    sqrt(1 - rho^2) z_2``.
    """

    def __init__(self, sweep: Sweep) -> None:
        if not sweep.distributions:
            raise QuestionError(
                f"{sweep.name}: no input has a distribution; write one, for example "
                "soil: {friction_angle: {mean: 38 deg, sd: 3 deg}}"
            )
        self.distributions = dict(sorted(sweep.distributions.items(), key=lambda item: item[0] == PAIR[1]))
        self.correlation = sweep.correlation if set(PAIR) <= set(self.distributions) else 0.0

    @property
    def names(self) -> list[str]:
        """Columns (or ``embedment_ratio``) of the uncertain inputs, in the order of their normals."""
        return list(self.distributions)

    @property
    def words(self) -> list[str]:
        """Dotted keys of the uncertain inputs."""
        return [BY_NAME[name].path for name in self.names]

    def filled(self, given: InputRows, z: np.ndarray) -> InputRows:
        """Return designs with sampled inputs, from their means and standard normals, shape (n, uncertain inputs)."""
        inputs = dict(given)
        for column, (name, spread) in enumerate(self.distributions.items()):
            normal = z[:, column]
            if name == PAIR[1] and self.correlation:
                other = z[:, self.names.index(PAIR[0])]
                normal = self.correlation * other + math.sqrt(1.0 - self.correlation**2) * normal
            inputs[name] = _draw_values(spread, given, np.asarray(given[name], dtype=float), normal)
        return inputs


def _draw_values(
    spread: Distribution | SetDistributions, given: InputRows, mean: np.ndarray, z: np.ndarray
) -> np.ndarray:
    """Return the values of an input at standard normal numbers; of named sets each from its own distribution."""
    if not isinstance(spread, SetDistributions):
        return values_of(spread, mean, z)
    values = mean.copy()
    for code, distribution in enumerate(spread.each):
        rows = given[spread.section] == code
        if distribution is not None and rows.any():
            values[rows] = values_of(distribution, mean[rows], z[rows])
    return values
