"""A system that starts no more threads."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from multiprocessing.dummy import DummyProcess

import pytest


@pytest.fixture
def no_more_threads(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Return a function after which pools can start only so many threads."""

    start = DummyProcess.start

    def allow(most: int) -> None:
        count = itertools.count()

        def refuse(process: DummyProcess) -> None:
            if next(count) >= most:
                raise RuntimeError("can't start new thread")
            start(process)

        monkeypatch.setattr(DummyProcess, "start", refuse)

    return allow
