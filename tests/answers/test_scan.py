"""What the scan leaves out: nothing passes between two values at which a design turns over early."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from boulder_sweep.answers.keys import Ends, key_of, range_of
from boulder_sweep.answers.questions import Question
from boulder_sweep.answers.search import CELLS, FAILS, FAR, HOLDS, search
from boulder_sweep.answers.trials import judges_of
from boulder_sweep.settings import Sweep
from boulder_sweep.settings.model import Model, ReadingChoice
from tests.answers.designs import random_designs, site

SHALLOW = ("0.05 m", "1.2 m")
KEYS = ("embedment_depth", "height", "width", "friction_angle", "speed", "vehicle.mass")


def compared(sweep: Sweep, word: str, between: Ends = None) -> tuple[int, int]:
    """Scan at fewer places and at all of them: the answers are the same; return how often each tried a design."""
    key = key_of(word, most=word in ("speed", "vehicle.mass"))
    asked = Question(sweep, key, between, judges_of(sweep))
    rows = asked.open.rows(0, asked.count)
    trials = asked.trial(rows), asked.trial(rows)
    first, last = asked.lattice(*range_of(sweep, key, rows, between))

    def thorough(index: np.ndarray, places: np.ndarray) -> np.ndarray:
        codes = trials[1].coarse(index, places)
        return np.where(codes == FAR, FAILS, codes)

    fewer, every = search(trials[0].coarse, first, last), search(thorough, first, last)
    for name in ("kind", "fails", "holds", "has_fails", "has_holds", "shown"):
        assert np.array_equal(getattr(fewer, name), getattr(every, name)), name
    assert fewer.changes == every.changes
    return trials[0].simulated, trials[1].simulated


def as_printed(sweep: Sweep) -> Sweep:
    return replace(sweep, model=Model(ReadingChoice.of_preset("as_printed")))


@pytest.mark.parametrize("word", KEYS)
def test_the_answers_are_those_of_a_scan_that_leaves_nothing_out(word: str) -> None:
    fewer, every = compared(random_designs(150), word)
    assert fewer < every


def test_shallow_boulders_that_slide_are_found_as_well() -> None:
    fewer, every = compared(random_designs(300), "embedment_depth", SHALLOW)
    assert fewer < every


@pytest.mark.parametrize(
    ("readings", "between"),
    [
        ("corrected", None),
        pytest.param("corrected", SHALLOW, marks=pytest.mark.nightly),
        pytest.param("as_printed", None, marks=pytest.mark.nightly),
        ("as_printed", SHALLOW),
    ],
)
def test_the_same_for_many_designs_and_both_readings(readings: str, between: Ends) -> None:
    corrected = readings == "corrected"
    sweep = random_designs(10_000 if corrected else 1000, seed=5)
    compared(sweep if corrected else as_printed(sweep), "embedment_depth", between)


@pytest.mark.parametrize(
    ("ratio", "speed", "slides"), [(0.35, 9.0, True), (0.35, 11.0, False), (0.44, 3.0, False), (0.46, 6.0, False)]
)
def test_a_shallow_boulder_that_passes_by_sliding_is_searched_by_smaller_steps(ratio, speed, slides) -> None:
    """Not one that overturns, moves by 0.07 m, or is deeper."""
    sweep = site(length="3 m", width="0.8 m", height="2 m", friction="40 deg", site=f"embedment_ratio: {ratio}")
    key = key_of("speed", most=True)
    asked = Question(sweep, key, None, judges_of(sweep))
    trial = asked.trial(asked.open.rows(0, 1))
    trial.coarse(np.array([0]), np.array([round(speed / key.step)]))
    assert trial.slides.tolist() == [slides]


def test_only_what_lies_between_two_far_places_is_left_out() -> None:
    tried: list[int] = []

    def predicate(index: np.ndarray, places: np.ndarray) -> np.ndarray:
        tried.extend(places.tolist())
        return np.where(places >= 10, HOLDS, np.where(places <= 4, FAR, FAILS))

    found = search(predicate, np.array([0]), np.array([CELLS]))
    assert (found.fails[0], found.holds[0]) == (9, 10)
    assert sorted(tried) == [0, 4, *range(5, CELLS + 1)]
