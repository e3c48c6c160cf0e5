"""How the residuals of a fit scatter together: what the standard errors are computed from.

A displacement or a velocity that was integrated from an accelerometer carries the integrals of its noise, which wander
off slowly and hardly change from one sample to the next; the residuals show the less of it, the better the fitted
response can follow. The noise of each signal is therefore taken as white noise plus, where that explains its residuals
better, white noise integrated once (velocity, displacement) or twice (displacement), and both variances are estimated
by restricted maximum likelihood (Patterson & Thompson 1971, Biometrika 58, 545-554), which allows for what the fit has
absorbed. Samples are first averaged over blocks, within which a filter may correlate them as it likes. What correlation
is left between neighbouring blocks counts as that of an autoregression of first order (prewhitening as by Andrews &
Monahan 1992, Econometrica 60, 953-966).

The signals may come from one instrument: what they have in common is summed over equal and neighbouring instants, as
Driscoll & Kraay (1998, Rev. Econ. Stat. 80, 549-560) do, with the weights of Newey & West (1987, Econometrica 55,
703-708).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

BLOCKS = 40
"""Most blocks that a signal is averaged over."""
INTEGRATED = {"displacement": (1, 2), "velocity": (1,), "acceleration": ()}
"""How often the noise of a signal may have been integrated."""
CLEARLY = 2.71
"""Twice the gain of the logarithm of the likelihood from which on noise counts as integrated: the 95 % point for a
variance that may not be negative (Self & Liang 1987, J. Am. Stat. Assoc. 82, 605-610)."""
RATIOS = np.geomspace(1e-6, 1e10, 129)
"""Variances of integrated over white noise that are tried, each relative to its mean over the blocks."""
LAGS = 3
"""Blocks by which the noise of one signal may lag behind that of another."""
MOST_CORRELATED = 0.9
"""Largest correlation of neighbouring blocks that is allowed for."""
TINY = 1e-30
"""No variance is smaller, in squares of the scale of a signal."""


class Scatter(NamedTuple):
    """Noise of one signal, decorrelated, over m blocks, and the weight of each unit of it."""

    noise: np.ndarray
    """Decorrelated residuals, shape (m,)."""
    weights: np.ndarray
    """What a unit of each adds to the gradient of the sum of squares, shape (m, p)."""


def scatter_of(name: str, times_s: np.ndarray, residuals: np.ndarray, jacobian: np.ndarray) -> Scatter:
    """Return the noise of a signal and how it moves the unknowns.

    Parameters
    ----------
    name
        Signal.
    times_s
        Times of its n samples [s], ascending, shape (n,).
    residuals, jacobian
        Of its samples, as multiples of its scale; shapes (n,) and (n, p).
    """
    parts = np.array_split(np.arange(len(residuals)), min(len(residuals), BLOCKS))
    counts = np.array([len(part) for part in parts], dtype=float)
    sums = np.array([jacobian[part].sum(axis=0) for part in parts])
    means = np.array([residuals[part].mean() for part in parts])
    middles = np.array([times_s[part].mean() for part in parts])
    widths = np.array([np.ptp(times_s[part]) for part in parts])
    slopes = sums / counts[:, None]
    best, covariance = _likeliest(means, slopes, counts, np.zeros((len(parts), len(parts))))
    bar = best - CLEARLY
    for times in INTEGRATED[name]:
        deviance, candidate = _likeliest(means, slopes, counts, integrate_noise(middles, widths, times))
        if deviance < min(best, bar):
            best, covariance = deviance, candidate
    root = np.linalg.cholesky(covariance)
    one, other = np.linalg.solve(root, slopes), np.linalg.solve(root, means)
    noise = other - one @ np.linalg.lstsq(one, other, rcond=1e-12)[0]
    size = max(float(noise @ noise), TINY)
    # The fit takes about p/m off the correlation of neighbours.
    r = float(noise[1:] @ noise[:-1]) / size + jacobian.shape[1] / len(parts)
    r = min(max(r, 0.0), MOST_CORRELATED)
    return Scatter(noise, np.sqrt((1.0 + r) / (1.0 - r)) * (root.T @ sums))


def integrate_noise(middles: np.ndarray, widths: np.ndarray, times: int) -> np.ndarray:
    """Covariance of white noise integrated once or twice from t = 0 on and averaged over blocks, shape (m, m).

    Parameters
    ----------
    middles, widths
        Of the blocks [s], ascending, shape (m,).
    times
        1 or 2.
    """
    order = np.minimum.outer(np.arange(len(middles)), np.arange(len(middles)))
    early, late, width = middles[order], np.maximum.outer(middles, middles), widths[order]
    if times == 1:  # min(s, t)
        return early - np.diag(widths / 6.0)
    # s^2 t/2 - s^3/6 for s < t
    square, cube = early**2 + width**2 / 12.0, early**3 + early * width**2 / 4.0
    return square * late / 2.0 - cube / 6.0 + np.diag(widths**3 / 120.0)


def _likeliest(
    means: np.ndarray, slopes: np.ndarray, counts: np.ndarray, drift: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return -2 times the restricted log-likelihood at its largest, and the covariance of the blocks there."""
    from scipy.linalg import eigh  # heavy, and only this function needs it

    white = np.diag(1.0 / counts)
    size = float(np.trace(drift) / np.trace(white))
    drift = drift / size if size > 0.0 else drift
    lengths = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    left, sizes, _ = np.linalg.svd(slopes / lengths)
    free = left[:, int((sizes > 1e-10 * sizes[0]).sum()) :]
    shares, vectors = eigh(free.T @ drift @ free, free.T @ white @ free)
    squares = (vectors.T @ (free.T @ means)) ** 2
    ratios = RATIOS if size > 0.0 else np.zeros(1)
    variances = 1.0 + np.outer(ratios, np.maximum(shares, 0.0))
    scales = np.maximum((squares / variances).mean(axis=1), TINY)
    deviances = len(squares) * np.log(scales) + np.log(variances).sum(axis=1)
    best = int(np.argmin(deviances))
    return float(deviances[best]), scales[best] * (white + ratios[best] * drift)


def sum_scatters(scatters: list[Scatter], *, together: bool) -> np.ndarray:
    """Covariance of the gradient of the sum of squares, over all signals, shape (p, p).

    Parameters
    ----------
    scatters
        By signal.
    together
        Whether the signals have their samples at the same instants. If not, what they have in common is not known, and
        they count as fully correlated, which is the safe side.
    """
    if not together:
        return len(scatters) * sum((part.weights.T @ part.weights for part in scatters), np.zeros(()))
    rows = [[_in_common(one, other) for other in scatters] for one in scatters]
    correlation, weights = np.block(rows), np.vstack([part.weights for part in scatters])
    least = float(np.linalg.eigvalsh(correlation)[0])
    if least < 0.0:  # noise in the estimate: shrunk until it is a correlation
        correlation = (correlation - least * np.eye(len(correlation))) / (1.0 - least)
    return np.asarray(weights.T @ correlation @ weights)


def _in_common(one: Scatter, other: Scatter) -> np.ndarray:
    """Correlation of the noise of two signals, shape (m, m)."""
    m = len(one.noise)
    if one is other:
        return np.eye(m)
    size = max(float(np.linalg.norm(one.noise) * np.linalg.norm(other.noise)), TINY)
    correlation = np.zeros((m, m))
    for lag in range(-min(LAGS, m - 1), min(LAGS, m - 1) + 1):
        shared = float(one.noise[max(lag, 0) : m + min(lag, 0)] @ other.noise[max(-lag, 0) : m - max(lag, 0)])
        correlation += (1.0 - abs(lag) / (LAGS + 1)) * shared / size * np.eye(m, k=-lag)
    return correlation
