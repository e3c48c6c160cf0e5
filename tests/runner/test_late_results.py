"""Answers on a cluster whose worker dies between finishing a call and handing over its result."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from distributed import Future

from boulder_sweep.runner.dispatch import Dispatcher, TaskResult
from boulder_sweep.runner.pool import Pool, call, pool


@pytest.fixture(scope="module")
def workers() -> Iterator[Pool]:
    with pool(1, "dask") as found:
        yield found


def told(workers: Pool, change: Callable[[], None]) -> None:
    """Change what the client knows of a call, in the thread of its loop, where the scheduler's messages arrive."""

    async def tell() -> None:
        change()

    workers._cluster.client.sync(tell)


def test_a_result_that_does_not_come_is_asked_for_again(workers: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where its worker has just died, and the scheduler still tries to reach it."""
    result, waited = Future.result, []

    def comes_at_last(self: Future, timeout: float) -> int:
        waited.append(timeout)
        if len(waited) < 3:
            raise TimeoutError
        return result(self, None)

    monkeypatch.setattr(Future, "result", comes_at_last)
    assert list(workers([call(abs, -7)])) == [7]
    assert waited == [2.0, 4.0, 8.0]


@pytest.mark.parametrize("late", [True, False])
def test_a_result_that_is_nothing_is_asked_for_no_more_than_any(
    workers: Pool, monkeypatch: pytest.MonkeyPatch, late: bool
) -> None:
    result, waited = Future.result, []

    def comes(self: Future, timeout: float) -> int:
        waited.append(timeout)
        if late and len(waited) < 2:
            raise TimeoutError
        return result(self, None)

    monkeypatch.setattr(Future, "result", comes)
    assert list(workers([call(abs, 0)])) == [0]
    assert waited == ([2.0, 4.0] if late else [2.0])


def test_a_result_lost_with_its_worker_is_waited_for(workers: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loss is noticed before the result is fetched; another worker computes it anew."""
    receive, expect, seen = Dispatcher._received, Dispatcher._expect_lost, []

    def receive_late(self: Dispatcher[int], future: Future) -> TaskResult[int] | None:
        if not seen:
            told(workers, future._state.lose)
        seen.append(future.status)
        return receive(self, future)

    def expect_when_computed_again(self: Dispatcher[int]) -> None:
        for future in self._lost:
            told(workers, future._state.finish)
        expect(self)

    monkeypatch.setattr(Dispatcher, "_received", receive_late)
    monkeypatch.setattr(Dispatcher, "_expect_lost", expect_when_computed_again)
    assert list(workers([call(abs, -7)])) == [7]
    assert seen == ["lost", "finished"]
