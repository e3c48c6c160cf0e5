"""Files with uncertain inputs where one value of each is needed: every row is judged at both ends and at the mean.

A design that passes with its uncertain inputs at their unfavourable ends need not pass at their means: shallow boulders
pass by sliding in weak soil and overturn in better. So the rows of a file with uncertain inputs are judged with all of
them at their unfavourable quantiles, at their means and at their favourable quantiles, and have the worst of the
verdicts (`boulder_sweep.judge.judged.worst_of`). Which end is the unfavourable one is a fixed table, `WEAK`; an input
without a sense, such as the damper of the vehicle, is taken at both ends in turn.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.errors import QuestionError
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import SetDistributions
from boulder_sweep.settings.units import quantity_text

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.model import Distribution

MEAN, UNFAVOURABLE = "mean", "p5"
"""The word that ``--at`` takes besides quantiles, and its default quantile."""
LOW, HIGH = "low", "high"
WEAK = {
    "boulder_length_m": LOW,
    "boulder_width_m": LOW,
    "boulder_density_kg_m3": LOW,
    "boulder_mass_kg": LOW,
    "embedment_depth_m": LOW,
    "embedment_ratio": LOW,
    "impact_height_m": HIGH,
    "soil_density_kg_m3": LOW,
    "friction_angle_deg": LOW,
    "subgrade_reaction_MN_m3": LOW,
    "strain_rate_factor": LOW,
    "vehicle_mass_kg": HIGH,
    "impact_speed_m_s": HIGH,
    "bumper_height_m": HIGH,
    "hood_height_m": HIGH,
    "bed_offset_m": LOW,
}
"""The unfavourable end of each input: weak soil, a light boulder, a heavy and fast vehicle that strikes high. Others,
such as spring and damper of the vehicle and the height of the boulder, have no sense."""


def at_values(sweep: Sweep, at: str | None = None) -> Sweep:
    """Return a sweep in which every uncertain input has one value; one without such inputs as it is.

    Parameters
    ----------
    sweep
        The sweep.
    at
        ``p5``, the default: the quantile of 5 % on the unfavourable side of each input, see `WEAK`; ``p10`` and so on
        up to ``p50``; or ``mean``, the means of the file alone.

    Returns
    -------
    Sweep
        With `Sweep.taken_at`, which says for each input what was taken, and but for ``mean`` with `Sweep.cases`: the
        means, the other ends, and the ends of inputs without a sense. Each input has quantiles of its own: a
        correlation has no part in them.

    Raises
    ------
    QuestionError
        `at` is none of these, or is given and no input has a distribution.
    """
    if not sweep.distributions:
        if at is not None:
            raise QuestionError(f"{sweep.name}: no input has a distribution, so there is nothing to take at {at}")
        return sweep
    at = UNFAVOURABLE if at is None else at
    means = _with_quantiles(sweep, {}, dict.fromkeys(sweep.distributions, MEAN))
    if at == MEAN:
        return means
    base, *ends = (_at_ends(sweep, sides, at) for sides in _sides(tuple(sweep.distributions)))
    return dataclasses.replace(base, cases=(means, *ends))


def _sides(names: tuple[str, ...]) -> Iterator[dict[str, str]]:
    """Yield at which end each input is taken: all unfavourable first, then all favourable."""
    aimless = [name for name in names if name not in WEAK]
    for favourable in (False, True):
        aimed = {name: WEAK[name] for name in names if name in WEAK}
        if favourable:
            aimed = {name: HIGH if side == LOW else LOW for name, side in aimed.items()}
        if favourable and not aimed:
            return  # nothing differs from before
        for ends in itertools.product((LOW, HIGH), repeat=len(aimless)):
            yield aimed | dict(zip(aimless, ends, strict=True))


def _at_ends(sweep: Sweep, sides: dict[str, str], at: str) -> Sweep:
    """Return a sweep with each uncertain input at one end; ``p5 high`` is the quantile that 5 % exceed."""
    normals = {name: _normal(_share(at), side) for name, side in sides.items()}
    return _with_quantiles(sweep, normals, {name: f"{at} {side}" for name, side in sides.items()})


def _share(at: str) -> float:
    """Read ``p5`` as 0.05."""
    match = re.fullmatch(r"p(\d{1,2}(?:\.\d+)?)", at)
    if match is None or not 0.0 < float(match[1]) <= 50.0:
        raise QuestionError(f"'{at[:40]}' is not mean, p5 or another quantile from above p0 to p50")
    return float(match[1]) / 100.0


def _normal(share: float, side: str) -> float:
    """Return the standard normal number of a quantile."""
    from scipy.special import ndtri  # a quarter of a second, which files without distributions need not wait

    return float(ndtri(share)) if side == LOW else -float(ndtri(share))


def _with_quantiles(sweep: Sweep, normals: dict[str, float], taken_at: dict[str, str]) -> Sweep:
    """Return a sweep with inputs at the quantiles of standard normal numbers, the others at their means."""

    def at(name: str, means: np.ndarray) -> np.ndarray:
        spread = sweep.distributions.get(name)
        if spread is None or name not in normals:
            return means
        if not isinstance(spread, SetDistributions):
            return values_of(spread, means, np.full(len(means), normals[name]))
        z = np.array([normals[name]])
        each = zip(spread.each, means[:, None], strict=True)
        return np.concatenate([mean if one is None else values_of(one, mean, z) for one, mean in each])

    constants = {name: float(at(name, np.array([value]))[0]) for name, value in sweep.constants.items()}
    axes = []
    for axis in sweep.axes:
        if axis.sets:
            axes.append(dataclasses.replace(axis, sets={name: at(name, values) for name, values in axis.sets.items()}))
        else:
            axes.append(dataclasses.replace(axis, values=at(axis.name, axis.values)))
    return dataclasses.replace(
        sweep, constants=constants, axes=tuple(axes), distributions={}, correlation=0.0, taken_at=taken_at
    )


def words_of(sweep: Sweep, units: str = "si") -> str:
    """Return the values that uncertain inputs were taken at, in words; empty where there were none."""
    columns, parts = sweep.values, []
    for name, how in sweep.taken_at.items():
        ends, field = (np.min(columns[name]), np.max(columns[name])), BY_NAME[name]
        parts.append(f"{field.path} {quantity_text(field.unit, units, *ends)} ({how})")
    if not parts:
        return ""
    judged = "; every design is judged at the means and at the other ends, too, and has the worst verdict"
    return f"uncertain inputs taken at {', '.join(parts)}{judged if sweep.cases else ''}"


def values_of(spread: Distribution, mean: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the quantiles of a distribution at standard normal numbers, shape (n,), by its means, shape (n,).

    The means are those before truncation where that is possible.
    """
    from scipy.special import betainccinv, betaincinv, ndtr

    low, high = (np.broadcast_to(end, mean.shape) for end in (spread.low, spread.high))
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
    from scipy.special import ndtr, ndtri

    below, above = (low - mean) / deviation, (high - mean) / deviation
    lower = ndtri(ndtr(below) + ndtr(z) * (ndtr(above) - ndtr(below)))
    upper = -ndtri(ndtr(-above) + ndtr(-z) * (ndtr(-below) - ndtr(-above)))
    return np.clip(mean + deviation * np.where(z < 0.0, lower, upper), low, high)
