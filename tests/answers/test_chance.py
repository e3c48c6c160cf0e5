"""Chances against cases of which the answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from boulder_sweep.answers.chance import FIRST, SCRAMBLINGS, Points, chance, interval


def linear(z: np.ndarray) -> np.ndarray:
    return z.sum(axis=1) / np.sqrt(z.shape[1])


@pytest.mark.parametrize("beta", [-3.0, -0.5, 0.0, 1.0, 2.5])
def test_chance_of_a_linear_limit_state(beta: float) -> None:
    found = chance(lambda _, z: linear(z) <= beta, 1, Points(3, 1), half_width=2e-3, confidence=0.999, most=1 << 18)
    assert found.low[0] <= ndtr(beta) <= found.high[0]
    assert found.high[0] - found.low[0] <= 4e-3
    assert abs(found.estimate[0] - ndtr(beta)) < 2e-3


def test_rows_stop_when_they_are_sure_enough() -> None:
    edges = np.array([-9.0, 0.3, 9.0])
    found = chance(lambda index, z: linear(z) <= edges[index], 3, Points(2, 1), half_width=5e-3)
    assert found.points.tolist()[::2] == [FIRST * SCRAMBLINGS] * 2
    assert found.points[1] > FIRST * SCRAMBLINGS
    assert (found.estimate[0], found.low[0], found.estimate[2], found.high[2]) == (0.0, 0.0, 1.0, 1.0)
    assert 0.0 < found.high[0] < 0.01
    assert 0.99 < found.low[2] < 1.0


def test_no_more_points_than_allowed() -> None:
    found = chance(lambda _, z: linear(z) <= 0.3, 1, Points(2, 1), half_width=1e-6, most=2048)
    assert found.points[0] == 2048
    assert found.high[0] - found.low[0] > 2e-6


def test_what_is_not_known_widens_the_interval_and_has_its_commonest_cause() -> None:
    """Of one row half passes and a sixth is not known for two causes; of the other nothing is known."""

    def event(row: np.ndarray, z: np.ndarray) -> np.ndarray:
        share = ndtr(linear(z))
        some = np.where(share < 0.5, 1, np.where(share < 0.6, -3, np.where(share < 2.0 / 3.0, -5, 0)))
        return np.where(row == 0, some, -9)

    found = chance(event, 2, Points(2, 1), half_width=0.01)
    assert found.estimate == pytest.approx([0.5, 0.0], abs=5e-3)
    assert found.unknown == pytest.approx([1.0 / 6.0, 1.0], abs=5e-3)
    assert found.cause.tolist() == [3, 9]
    assert found.low == pytest.approx([0.5, 0.0], abs=0.011)
    assert found.high == pytest.approx([2.0 / 3.0, 1.0], abs=0.011)
    assert found.low[0] < 0.5 < 2.0 / 3.0 < found.high[0]
    assert chance(lambda _, z: linear(z) < 0.3, 1, Points(2, 1), half_width=0.01).unknown[0] == 0.0


def test_the_same_seed_gives_the_same() -> None:
    one, two, other = (chance(lambda _, z: linear(z) <= 0.3, 1, Points(2, seed), half_width=0.01) for seed in (1, 1, 2))
    assert one.estimate[0] == two.estimate[0] != other.estimate[0]


@pytest.mark.parametrize("edge", [0.4, 2.0])
def test_stated_intervals_hold_at_their_rate(edge: float) -> None:
    held = 0
    for seed in range(200):
        found = chance(lambda _, z: linear(z) <= edge, 1, Points(3, seed), half_width=0.01)
        held += int(found.low[0] <= ndtr(edge) <= found.high[0])
    assert held >= 182, "95 % of 200 are 190, less three standard deviations"


@pytest.mark.parametrize("weights", [(1.0,), (0.95, 0.3122), (1.0, 1.0, 1.0)])
def test_stated_intervals_hold_for_whatever_number_of_inputs_decides(weights: tuple[float, ...]) -> None:
    """If one input decides, all scramblings often count the same; their spread alone held 85 % of the time."""
    direction = np.array(weights) / np.linalg.norm(weights)
    exact = np.random.default_rng(0).uniform(0.02, 0.98, 200)
    edges, held, widths = ndtri(exact), [], []
    for seed in range(10):
        points = Points(len(weights), seed)
        found = chance(lambda row, z: z @ direction <= edges[row], len(exact), points, half_width=0.01)
        held.append((found.low <= exact) & (exact <= found.high))
        widths.append(found.high - found.low)
    assert np.mean(held) >= 0.95
    assert np.min(widths) > 0.0
    assert np.max(widths) <= 0.02 + 1e-12


def test_scramblings_that_agree_are_not_certain() -> None:
    low, high = interval(np.full((1, SCRAMBLINGS), 16.0), 32, 0.95)
    assert (high - low)[0] == pytest.approx(2.0 * (1.0 - 0.05 ** (1 / 16)) / 32)
