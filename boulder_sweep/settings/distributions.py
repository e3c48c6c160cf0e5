"""Uncertain inputs: what a file says about the spread of a value. Sampling is left to `sweep uncertainty`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from boulder_sweep.settings.problems import Position

KINDS = ("normal", "lognormal", "uniform", "triangular", "beta")
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

    def words(self, unit: str) -> str:
        """Return kind and spread in words, for messages; `unit` is that of the column."""
        unit = "" if unit == "1" else f" {unit}"
        spread = f"sd {self.sd}{unit}" if self.cov is None else f"cov {100.0 * self.cov:g} %"
        ends = f"{self.low:g} to {self.high:g}{unit}"
        return {
            "uniform": f"uniform, {ends}",
            "triangular": f"triangular, {ends}, most likely {self.mode}{unit}",
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
        ``soil`` or ``vehicle``; under this name a row carries the place of its set.
    each : tuple of Distribution or None
        In the order of the sets; None where a set gives a value.
    """

    section: str
    each: tuple[Distribution | None, ...]

    @property
    def position(self) -> Position:
        """Where the first of them stands in the file."""
        return next(own.position for own in self.each if own is not None)

    def words(self, unit: str) -> str:
        """Return kind and spread of each in words; `unit` is that of the column."""
        return "; ".join("certain" if own is None else own.words(unit) for own in self.each)

    def to_dict(self) -> dict[str, Any]:
        """Return what is given as plain data."""
        return {"sets": [None if own is None else own.to_dict() for own in self.each]}


def mean_of_fractile(kind: str, fractile: np.ndarray, sd: float | None, cov: float | None) -> np.ndarray:
    """Return the means of normal or lognormal distributions whose 5 % fractiles are given.

    Parameters
    ----------
    kind : str
        ``normal``, or ``lognormal`` (which needs `cov`).
    fractile : ndarray of float64
        Values that 5 % fall short of.
    sd, cov : float or None
        Standard deviation, or coefficient of variation.

    Notes
    -----
    Normal: x_k = m - 1.645 s. Lognormal: x_k = m exp(-s_ln**2 / 2 - 1.645 s_ln) with s_ln**2 = ln(1 + cov**2).
    """
    if kind == "lognormal":
        assert cov is not None
        spread = math.sqrt(math.log1p(cov * cov))
        return fractile * math.exp(FRACTILE_5 * spread + 0.5 * spread * spread)
    if cov is not None:
        return fractile / (1.0 - FRACTILE_5 * cov)
    assert sd is not None
    return fractile + FRACTILE_5 * sd
