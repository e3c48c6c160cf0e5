"""The least-squares problem of fitting a vehicle to a rigid-wall pulse, and how sure its solution is.

The measured displacement, velocity or acceleration, or several of them at once, is compared with the exact response of
a Maxwell element (`boulder_sweep.crash_tests.rigid_wall`). The unknowns are the logarithms of sqrt(k/m) and of
c/sqrt(k m), and the speed of impact unless it is given. The standard errors follow from how the residuals scatter
together.

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

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from boulder_sweep.crash_tests.measured import Pulse
from boulder_sweep.crash_tests.rigid_wall import RigidWall, StiffeningWall

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

RESPONSES: dict[str, Callable[[RigidWall, np.ndarray], np.ndarray]] = {
    "displacement": RigidWall.displacement,
    "velocity": RigidWall.velocity,
    "acceleration": RigidWall.acceleration,
}
"""What a Maxwell element answers to each signal."""
RATIO_BOUNDS = (2e-3, 2e2)
"""Range of c/sqrt(k m) that is searched; at its ends one of the two elements is as good as rigid."""
SMOOTHING_SHARE = 0.05
"""Part of the pulse over which noise is averaged out."""


@dataclass(frozen=True)
class SignalMisfit:
    """How far the fitted response is from one signal.

    Attributes
    ----------
    rms : float
        Root mean square of the residuals, in the unit of the signal.
    share : float
        The same as a share of the signal's range.
    systematic_share : float
        Largest residual after the noise has been averaged out, as a share of the range.
    correlation : float
        Correlation of neighbouring residuals.
    """

    rms: float
    share: float
    systematic_share: float
    correlation: float


class FitProblem:
    """The least-squares problem: unknowns log sqrt(k/m), log(c/sqrt(k m)) and, where not given, v_0."""

    least_share = 1e-14
    """Combinations of unknowns that move the response less than this, as a share of the most, are left out."""

    def __init__(self, pulse: Pulse, mass_kg: float, speed_m_s: float | None) -> None:
        self.pulse = pulse
        self.mass_kg = mass_kg
        self.speed_m_s = speed_m_s
        self.known = {name: np.isfinite(values) for name, values in pulse.signals.items()}

    def range(self, name: str) -> float:
        """Range of a signal, never zero."""
        values = self.pulse.signals[name][self.known[name]]
        return max(float(np.abs(values).max()), float(np.ptp(values)), 1e-12)

    def wall(self, unknowns: np.ndarray) -> RigidWall:
        """Vehicle that the unknowns stand for."""
        rate, ratio = math.exp(unknowns[0]), math.exp(unknowns[1])
        speed = float(unknowns[2]) if self.speed_m_s is None else self.speed_m_s
        return RigidWall(self.mass_kg, speed, self.mass_kg * rate**2, ratio * rate * self.mass_kg)

    def by_signal(self, unknowns: np.ndarray) -> dict[str, np.ndarray]:
        """Measured minus computed where there are values, in the units of the signals."""
        wall = self.wall(unknowns)
        return {
            name: (values - RESPONSES[name](wall, self.pulse.time_s))[self.known[name]]
            for name, values in self.pulse.signals.items()
        }

    def residuals(self, unknowns: np.ndarray, scales: dict[str, float]) -> np.ndarray:
        """Residuals of all signals as multiples of their scales."""
        return np.concatenate([values / scales[name] for name, values in self.by_signal(unknowns).items()])

    def scatter(self, residuals: dict[str, np.ndarray]) -> dict[str, float]:
        """Return the scale of each signal by which its residuals are divided: their root mean square, never zero."""
        return {name: max(rms(values), 1e-9 * self.range(name)) for name, values in residuals.items()}

    def misfits(self, residuals: dict[str, np.ndarray]) -> dict[str, SignalMisfit]:
        """Describe the residuals of every signal."""
        return {name: misfit_of(values, self.range(name)) for name, values in residuals.items()}

    def start(self, scales: dict[str, float]) -> np.ndarray:
        """Best of a grid of vehicles; the response is proportional to the speed, which so follows from each."""
        last = float(self.pulse.time_s[-1])
        best, unknowns = math.inf, np.zeros(3)
        for rate in np.geomspace(0.1, 200.0, 31) / last:
            for ratio in np.geomspace(*RATIO_BOUNDS, 21):
                unit = RigidWall(self.mass_kg, 1.0, self.mass_kg * rate**2, ratio * rate * self.mass_kg)
                shape, data = [], []
                for name, values in self.pulse.signals.items():
                    known = self.known[name]
                    shape.append(RESPONSES[name](unit, self.pulse.time_s)[known] / scales[name])
                    data.append(values[known] / scales[name])
                one, other = np.concatenate(shape), np.concatenate(data)
                speed = self.speed_m_s if self.speed_m_s is not None else max(float(one @ other / (one @ one)), 1e-6)
                misfit = float(np.sum((other - speed * one) ** 2))
                if misfit < best:
                    best, unknowns = misfit, np.array([math.log(rate), math.log(ratio), speed])
        return unknowns if self.speed_m_s is None else unknowns[:2]

    def bounds(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Range of the unknowns."""
        last = float(self.pulse.time_s[-1])
        low = [math.log(0.01 / last), math.log(RATIO_BOUNDS[0]), 1e-9]
        high = [math.log(2000.0 / last), math.log(RATIO_BOUNDS[1]), 1e4]
        return np.array(low[: len(start)]), np.array(high[: len(start)])

    def solved(
        self, start: np.ndarray, scales: dict[str, float], bounds: tuple[np.ndarray, np.ndarray], tolerance: float
    ) -> OptimizeResult:
        """Solve from a start within bounds."""
        from scipy.optimize import least_squares  # heavy, and only fits need it

        tight = {"xtol": tolerance, "ftol": tolerance, "gtol": tolerance}
        return least_squares(self.residuals, np.clip(start, *bounds), bounds=bounds, args=(scales,), **tight)

    def covariance(self, unknowns: np.ndarray, scales: dict[str, float]) -> np.ndarray:
        """Covariance of the unknowns, shape (p, p).

        The sandwich of least squares, (JᵀJ)⁻¹ Jᵀ Σ J (JᵀJ)⁻¹, with the covariance Σ of the residuals of all signals as
        `scatter_of` and `sum_scatters` find it from them.
        """
        n = len(unknowns)
        steps = 1e-6 * np.maximum(np.abs(unknowns), 1.0)
        columns = []
        for k in range(n):
            ahead, behind = (unknowns + sign * steps * (np.arange(n) == k) for sign in (1.0, -1.0))
            up, down = self.by_signal(ahead), self.by_signal(behind)
            columns.append({name: (up[name] - down[name]) / (2.0 * steps[k]) / scales[name] for name in up})
        bread, scatters = np.zeros((n, n)), []
        for name, residuals in self.by_signal(unknowns).items():
            jacobian = np.stack([column[name] for column in columns], axis=1)
            bread += jacobian.T @ jacobian
            times = self.pulse.time_s[self.known[name]]
            scatters.append(scatter_of(name, times, residuals / scales[name], jacobian))
        masks = list(self.known.values())
        middle = sum_scatters(scatters, together=all(np.array_equal(mask, masks[0]) for mask in masks))
        inverse = np.linalg.pinv(bread, rcond=self.least_share, hermitian=True)
        return np.asarray(inverse @ middle @ inverse)

    def standard_errors(self, unknowns: np.ndarray, scales: dict[str, float]) -> tuple[float, float, float]:
        """Standard errors of spring [N/m], damper [N s/m] and speed [m/s]."""
        n, covariance, wall = len(unknowns), self.covariance(unknowns, scales), self.wall(unknowns)
        # k = m exp(2 u_0), c = m exp(u_0 + u_1)
        of_spring = np.eye(n)[0] * 2.0 * wall.spring_N_m
        of_damper = (np.eye(n)[0] + np.eye(n)[1]) * wall.damper_N_s_m
        of_speed = np.eye(3, n)[2]
        spring, damper, speed = (
            math.sqrt(max(float(g @ covariance @ g), 0.0)) for g in (of_spring, of_damper, of_speed)
        )
        return spring, damper, speed


class StagedProblem(FitProblem):
    """The least-squares problem with two springs: log(k_2/k_v) and s_2 come after the unknowns of `FitProblem`."""

    least_share = 0.0
    """None is left out: where the force peaks as the second spring begins, its beginning hardly shows."""

    def wall(self, unknowns: np.ndarray) -> StiffeningWall:
        """Vehicle that the unknowns stand for."""
        one = super().wall(unknowns[:-2])
        second = one.spring_N_m * math.exp(unknowns[-2])
        return StiffeningWall(one.mass_kg, one.speed_m_s, one.spring_N_m, one.damper_N_s_m, second, float(unknowns[-1]))


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def misfit_of(residuals: np.ndarray, span: float) -> SignalMisfit:
    """Describe the residuals of one signal."""
    window = max(1, round(SMOOTHING_SHARE * len(residuals)))
    smooth = np.convolve(residuals, np.full(window, 1.0 / window), mode="valid")
    scatter = float(residuals @ residuals)
    correlation = float(residuals[1:] @ residuals[:-1]) / scatter if scatter > 0.0 else 0.0
    size = rms(residuals)
    return SignalMisfit(size, size / span, float(np.abs(smooth).max()) / span, correlation)


BLOCKS = 40
"""Most blocks that a signal is averaged over."""
INTEGRATED = {"displacement": (1, 2), "velocity": (1,), "acceleration": ()}
"""How often the noise of a signal may have been integrated."""
CLEARLY = 2.71
"""Twice the gain of the logarithm of the likelihood from which on noise counts as integrated: the 95 % point for a
variance that may not be negative (Self & Liang 1987, J. Am. Stat. Assoc. 82, 605-610)."""
DRIFTS = np.geomspace(1e-6, 1e10, 129)
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
    ratios = DRIFTS if size > 0.0 else np.zeros(1)
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
