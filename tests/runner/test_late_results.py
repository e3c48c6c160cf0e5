"""Answers on a cluster whose worker dies between finishing a call and handing over its result."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from distributed import Future

from boulder_sweep.errors import ClusterLostError
from boulder_sweep.runner.pool import Pool, pool


@pytest.fixture(scope="module")
def workers() -> Iterator[Pool]:
    with pool(1, "dask") as found:
        yield found


def finished(workers: Pool, number: int) -> Future:
    """Return a call that is finished; its result is not fetched yet."""
    future = workers._cluster.client.submit(abs, -number, pure=False)
    assert future.exception(timeout=600) is None  # hang guard
    return future


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

    patient = Pool(1, workers._cluster)
    monkeypatch.setattr(Future, "result", comes_at_last)
    assert patient._result(patient._cluster, finished(workers, 7)) == 7
    assert waited == [2.0, 4.0, 8.0]
    assert patient._result(patient._cluster, finished(workers, 8)) == 8
    assert waited[3:] == [8.0], "a slow connection is not found out again for every result"


def test_a_result_lost_with_its_worker_is_waited_for(workers: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loss is noticed before the result is fetched; another worker computes it anew."""
    result, asked = Future.result, []
    future = finished(workers, 7)
    told(workers, future._state.lose)
    assert future.status == "lost"

    def computed_meanwhile(self: Future, timeout: float) -> int:
        asked.append((timeout, self.status))
        if len(asked) == 2:
            told(workers, self._state.finish)
        return result(self, timeout)

    patient = Pool(1, workers._cluster)
    patient._fetch_s = 0.05
    monkeypatch.setattr(Future, "result", computed_meanwhile)
    assert patient._result(patient._cluster, future) == 7
    assert asked[:2] == [(0.05, "lost"), (0.05, "lost")], "waiting for a call is no sign of a slow connection"


def test_a_result_that_nobody_is_left_to_compute_anew_ends_the_waiting() -> None:
    looked = []

    class Lost:
        status = "lost"

        def done(self) -> bool:
            return False

        def result(self, timeout: float) -> None:
            looked.append(timeout)
            raise TimeoutError

    class Deserted:
        def threads(self) -> dict[str, int]:
            return {}

        def lost_text(self) -> str:
            return "the connection was lost"

    with pytest.raises(ClusterLostError, match=r"the connection was lost: no worker is left"):
        Pool(1)._result(Deserted(), Lost())
    assert looked == [2.0] * 5, "a worker that starts again has ten seconds"
