"""Scan and bisection against what is known of made-up rows."""

from __future__ import annotations

import numpy as np
import pytest

from boulder_sweep.answers.search import (
    ALWAYS,
    BEYOND,
    BLOCKED,
    FAILS,
    FOUND,
    HOLDS,
    NEVER,
    NOT_MONOTONE,
    Predicate,
    search,
    settled,
    steady,
)


def stretches(*rows: list[tuple[int, int, int]]) -> Predicate:
    """Return a predicate that gives the code of the first stretch [from, to, code] that holds a place; FAILS else."""

    def predicate(index: np.ndarray, places: np.ndarray) -> np.ndarray:
        found = np.full(len(index), FAILS)
        for k, (row, place) in enumerate(zip(index, places, strict=True)):
            for low, high, code in rows[row]:
                if low <= place <= high:
                    found[k] = code
                    break
        return found

    return predicate


def one(*stretch: tuple[int, int, int], first: int = 0, last: int = 1000, cells: int = 16):
    return search(stretches(list(stretch)), np.array([first]), np.array([last]), cells)


@pytest.mark.parametrize("begins", [1, 2, 62, 63, 64, 500, 999, 1000])
@pytest.mark.parametrize("cells", [1, 7, 16])
def test_the_first_place_is_found_exactly(begins: int, cells: int) -> None:
    found = one((begins, 1000, HOLDS), cells=cells)
    assert (found.kind[0], found.fails[0], found.holds[0], found.shown[0]) == (FOUND, begins - 1, begins, begins)


def test_random_rows_together_as_alone() -> None:
    rng = np.random.default_rng(5)
    first = rng.integers(-500, 500, 200)
    last = first + rng.integers(0, 2000, 200)
    begins = rng.integers(-600, 2600, 200)

    def predicate(index: np.ndarray, places: np.ndarray) -> np.ndarray:
        return np.where(places >= begins[index], HOLDS, FAILS)

    found = search(predicate, first, last)
    for row in range(200):
        kind = ALWAYS if begins[row] <= first[row] else NEVER if begins[row] > last[row] else FOUND
        assert found.kind[row] == kind
        if kind == FOUND:
            assert (found.fails[row], found.holds[row]) == (begins[row] - 1, begins[row])
        assert found.has_fails[row] == (kind != ALWAYS)
        assert found.has_holds[row] == (kind != NEVER)


@pytest.mark.parametrize(
    ("stretch", "ends", "kind", "fails", "holds"),
    [
        *(([(0, end, HOLDS)], (1000, 0), FOUND, end + 1, end) for end in (0, 1, 437, 998)),  # downwards
        ([(0, 1000, HOLDS)], (0, 1000), ALWAYS, None, 0),
        ([], (0, 1000), NEVER, 1000, None),
        ([(5, 5, HOLDS)], (5, 5), ALWAYS, None, 5),
        ([], (5, 5), NEVER, 5, None),
        ([(777, 1000, BEYOND)], (0, 1000), BLOCKED, 776, None),
        ([(0, 1000, BEYOND)], (0, 1000), BLOCKED, None, None),
        ([(770, 776, HOLDS), (777, 1000, BEYOND)], (0, 1000), FOUND, 769, 770),
        ([(0, 300, BEYOND), (350, 1000, HOLDS)], (0, 1000), FOUND, 349, 350),
        ([(0, 300, BEYOND), (301, 1000, HOLDS)], (0, 1000), FOUND, 300, 301),
    ],
)
def test_one_change_or_none(stretch, ends, kind, fails, holds) -> None:
    found = one(*stretch, first=ends[0], last=ends[1])
    assert (found.kind[0], found.has_holds[0]) == (kind, holds is not None)
    assert fails is None or found.fails[0] == fails
    assert holds is None or found.holds[0] == holds
    assert kind not in (NEVER, BLOCKED) or fails is None or found.shown[0] == fails
    assert kind != ALWAYS or not found.has_fails[0]


def test_no_rows() -> None:
    nothing = np.zeros(0, dtype=np.int64)
    assert len(search(stretches(), nothing, nothing).kind) == 0


def test_rows_that_are_not_monotone_tell_every_change() -> None:
    found = one((200, 400, HOLDS), (700, 1000, HOLDS))
    assert (found.kind[0], found.fails[0], found.holds[0]) == (NOT_MONOTONE, 199, 200)
    assert found.changes == {0: [(199, 200, True), (400, 401, False), (699, 700, True)]}
    first = one((0, 400, HOLDS))
    assert (first.kind[0], first.has_fails[0], first.changes[0]) == (NOT_MONOTONE, False, [(400, 401, False)])


@pytest.mark.parametrize(
    ("stretch", "fails", "holds", "shown"),
    [
        ([(200, 400, HOLDS), (700, 1000, HOLDS)], 699, 700, 700),
        ([(0, 100, HOLDS), (300, 400, HOLDS), (700, 1000, HOLDS)], 699, 700, 700),
        ([(200, 400, HOLDS), (700, 800, HOLDS), (801, 1000, BEYOND)], 699, 700, 700),
        ([(200, 400, HOLDS), (700, 800, HOLDS)], 801, None, 801),
        ([(0, 400, HOLDS)], 401, None, 401),
    ],
)
def test_a_steady_answer_holds_at_all_further_places(
    stretch: list[tuple[int, int, int]], fails: int, holds: int | None, shown: int
) -> None:
    found = steady(one(*stretch))
    assert (found.kind[0], found.has_fails[0], found.fails[0], found.shown[0]) == (NOT_MONOTONE, True, fails, shown)
    assert found.has_holds[0] == (holds is not None)
    assert holds is None or found.holds[0] == holds


def test_an_answer_that_is_monotone_is_steady() -> None:
    for found in (one((200, 1000, HOLDS)), one((0, 1000, HOLDS)), one()):
        again = steady(found)
        for name in ("kind", "fails", "holds", "has_fails", "has_holds", "shown"):
            assert np.array_equal(getattr(found, name), getattr(again, name))


def test_a_change_is_moved_to_where_a_predicate_changes_that_is_nearly_the_same() -> None:
    """Upwards and downwards, by little or much; what does not change up to an end of its range is left."""
    rng = np.random.default_rng(9)
    first, last = np.tile([0, 1000], 150), np.tile([1000, 0], 150)
    roughly, begins = rng.integers(200, 800, 300), np.empty(300, dtype=np.int64)
    begins[:] = roughly + rng.integers(-1, 2, 300) * 2 ** rng.integers(0, 7, 300)
    begins[:4] = 5000, -5000, -5000, 5000  # never holds, always, and the same downwards
    roughly[4:6], begins[4:6] = (256, 745), (1, 1000)  # the 256th place from where it was, the first of its range

    def predicate(at: np.ndarray) -> Predicate:
        return lambda rows, places: np.where((places >= at[rows]) ^ (first[rows] > last[rows]), HOLDS, FAILS)

    rough, exact = (search(predicate(at), first, last) for at in (roughly, begins))
    found = settled(predicate(begins), rough, first, last)
    for name in ("fails", "holds", "shown"):
        assert np.array_equal(getattr(found, name)[4:], getattr(exact, name)[4:])
        assert np.array_equal(getattr(found, name)[:4], getattr(rough, name)[:4])
    again = search(predicate(roughly), first, last, closer=predicate(begins))
    near = np.abs(begins - roughly) <= 1
    assert near.sum() > 20
    assert np.mean(again.holds[near] == exact.holds[near]) > 0.9


def test_between_two_places_that_hold_only_the_other_predicate_is_asked() -> None:
    asked: list[int] = []

    def holds_from_500(index: np.ndarray, places: np.ndarray) -> np.ndarray:
        asked.extend(places.tolist())
        return np.where(places >= 500, HOLDS, FAILS)

    gap = stretches([(0, 690, HOLDS), (700, 1000, HOLDS)])
    ends = np.array([0]), np.array([1000])
    found = search(holds_from_500, *ends, between=gap)
    assert (found.kind[0], found.fails[0], found.holds[0]) == (FOUND, 499, 500)
    assert not [place for place in asked if place > 500 and place % 250]
    found = search(holds_from_500, *ends, between=stretches([(0, 686, HOLDS), (690, 1000, HOLDS)]))
    assert found.kind[0] == NOT_MONOTONE, "at 688 it fails"
