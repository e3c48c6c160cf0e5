"""Standard errors of a fit: as large as fits to the noise of one accelerometer scatter, integrated or filtered."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from boulder_sweep.crash_tests.cases import rigid_wall_test
from boulder_sweep.crash_tests.fit_problem import Scatter, integrate_noise, scatter_of, sum_scatters
from boulder_sweep.crash_tests.fitting import fit_pulse
from boulder_sweep.crash_tests.measured import Pulse

PAPER = rigid_wall_test()
TIMES = np.arange(200) * 1e-3
FINE = np.arange(400) * 5e-4
FITS = 16
ALL = ["acceleration", "velocity", "displacement"]


def of_one_accelerometer(
    signals: list[str], rng: np.random.Generator, times: np.ndarray = TIMES, cutoff_Hz: float | None = None
) -> Pulse:
    """Exact signals, with the noise of an accelerometer and its integrals on them."""
    n, step = len(times), float(times[1])
    noise = rng.normal(0.0, 8.0, 3 * n)
    if cutoff_Hz is not None:
        noise = filtfilt(*butter(2, 2.0 * cutoff_Hz * step), noise)
    noise = noise[n : 2 * n]
    once = summed_up(noise, step)
    made = {
        "acceleration": PAPER.acceleration(times) + noise,
        "velocity": PAPER.velocity(times) + once,
        "displacement": PAPER.displacement(times) + summed_up(once, step),
    }
    return Pulse("made up", times, {name: made[name] for name in signals})


def summed_up(values: np.ndarray, step: float) -> np.ndarray:
    """Integral by trapezoids."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * step)])


@pytest.mark.parametrize(
    ("signals", "times", "cutoff_Hz"),
    [
        (["acceleration"], TIMES, None),
        pytest.param(["velocity"], TIMES, None, marks=pytest.mark.nightly),
        pytest.param(["displacement"], TIMES, None, marks=pytest.mark.nightly),
        pytest.param(ALL, TIMES, None, marks=pytest.mark.nightly),
        (["acceleration"], FINE, 100.0),
    ],
    ids=["acceleration", "velocity", "displacement", "all", "filtered"],
)
def test_noise_of_one_accelerometer_is_covered(signals: list[str], times: np.ndarray, cutoff_Hz: float | None) -> None:
    rng = np.random.default_rng(5)
    offsets = np.empty((FITS, 3))
    for row in range(FITS):
        fit = fit_pulse(of_one_accelerometer(signals, rng, times, cutoff_Hz), PAPER.mass_kg)
        assert fit.speed_error_m_s is not None
        offsets[row] = (
            (fit.wall.spring_N_m - PAPER.spring_N_m) / fit.spring_error_N_m,
            (fit.wall.damper_N_s_m - PAPER.damper_N_s_m) / fit.damper_error_N_s_m,
            (fit.wall.speed_m_s - PAPER.speed_m_s) / fit.speed_error_m_s,
        )
    scatter = np.sqrt((offsets**2).mean(axis=0))
    assert np.all(scatter > 0.5), scatter
    assert np.all(scatter < 1.5), scatter
    assert np.all((np.abs(offsets) < 2.0).mean(axis=0) >= 0.8)


@pytest.mark.parametrize("times", [1, 2])
def test_covariance_of_integrated_noise(times: int) -> None:
    """Of the means over blocks, against sums over many fine steps."""
    fine, blocks = 4000, 8
    at = (np.arange(fine) + 0.5) / fine
    weights = np.where(at[:, None] >= at, (at[:, None] - at) ** (times - 1), 0.0)
    means = weights.reshape(blocks, -1, fine).mean(axis=1)
    middles, widths = at.reshape(blocks, -1).mean(axis=1), np.full(blocks, 1.0 / blocks)
    found = integrate_noise(middles, widths, times)
    assert found == pytest.approx(means @ means.T / fine, rel=1e-2, abs=1e-3 * found.max())
    # What sets neighbouring blocks apart is small beside what they share.
    last = np.diff(np.eye(blocks), n=times, axis=0)[-1]
    assert last @ found @ last == pytest.approx(np.sum((last @ means) ** 2) / fine, rel=0.02)


def test_signals_at_other_instants_count_as_fully_correlated() -> None:
    rng = np.random.default_rng(1)
    noise, weights = rng.normal(size=40), rng.normal(size=(40, 2))
    same = [Scatter(noise, weights)] * 2
    bound = sum_scatters(same, together=False)
    assert bound == pytest.approx(4.0 * weights.T @ weights)
    other = [Scatter(noise, weights), Scatter(noise, rng.normal(size=(40, 2)))]
    least = np.linalg.eigvalsh(sum_scatters(other, together=False) - sum_scatters(other, together=True))[0]
    assert least > 0.0


def test_a_signal_in_only_some_rows() -> None:
    """A displacement from every tenth picture beside an accelerometer."""
    pulse = of_one_accelerometer(["acceleration", "displacement"], np.random.default_rng(2))
    every = fit_pulse(pulse, PAPER.mass_kg)
    pulse.signals["displacement"][np.arange(len(TIMES)) % 10 != 0] = np.nan
    some = fit_pulse(pulse, PAPER.mass_kg)
    assert abs(some.wall.spring_N_m - PAPER.spring_N_m) < 3.0 * some.spring_error_N_m
    assert every.spring_error_N_m < some.spring_error_N_m < 4.0 * every.spring_error_N_m


def test_residuals_without_scatter() -> None:
    found = scatter_of("displacement", TIMES, np.zeros(len(TIMES)), np.ones((len(TIMES), 1)))
    assert np.all(np.isfinite(found.weights))
    assert np.abs(found.weights).max() < 1e-10
