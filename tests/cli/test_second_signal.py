"""The command that resumes a run is said whatever happens while the bar closes, once."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest
from rich.progress import Progress as Bars

from boulder_sweep import signals
from boulder_sweep.errors import Interrupted
from boulder_sweep.runner.run import resuming
from tests.conftest import Command
from tests.waiting import wait_until

LINE = "interrupted by SIGINT; 5 of 18 rows are safe. Resume with: sweep run grid.yaml -o small-grid.sweep --resume"


@pytest.fixture
def closing(grid: object, monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], None]], None]:
    """Interrupt a run that shows a bar; return a function that sets what happens while the bar closes."""

    def run(settings: Any, out: Any, *, jobs: Any, backend: Any, scheduler: Any, **_: object) -> NoReturn:
        noted = signals.install()
        noted.defer()
        signal.raise_signal(signal.SIGINT)
        wait_until(lambda: noted.caught == signal.SIGINT, "the signal was noted")
        raise Interrupted(signal.SIGINT, 5, 18, resuming(settings, out, jobs, backend, scheduler))

    monkeypatch.setattr("boulder_sweep.runner.run.run", run)
    monkeypatch.setenv("COLUMNS", "200")
    stop = Bars.stop

    def while_closing(happens: Callable[[], None]) -> None:
        def stopped(bars: Bars) -> None:
            try:
                happens()
            finally:
                stop(bars)

        monkeypatch.setattr(Bars, "stop", stopped)
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True)

    return while_closing


def test_it_is_said_before_a_second_signal_can_end_the_process(
    sweep: Command, closing: Callable[[Callable[[], None]], None], capsys: pytest.CaptureFixture[str]
) -> None:
    before = []

    def second_signal() -> NoReturn:
        before.append(capsys.readouterr().err)
        raise KeyboardInterrupt

    closing(second_signal)
    code, out, _ = sweep("run", "grid.yaml")
    assert (code, out) == (130, "")
    assert len(before) == 1
    assert LINE in before[0]


def test_it_is_said_where_the_bar_takes_its_time(
    sweep: Command, closing: Callable[[Callable[[], None]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread that waits for the command looks for signals meanwhile."""
    looks, waited = list[None](), list[bool]()

    class Watched(threading.Thread):
        def is_alive(self) -> bool:
            looks.append(None)
            return super().is_alive()

    functions = {name: getattr(threading, name) for name in ("current_thread", "main_thread")}
    monkeypatch.setattr(signals, "threading", SimpleNamespace(Thread=Watched, **functions))

    def several_looks() -> None:
        enough = len(looks) + 3
        wait_until(lambda: len(looks) >= enough or signals._installed is None, "the waiting thread looked thrice")
        waited.append(len(looks) >= enough)

    closing(several_looks)
    code, out, err = sweep("run", "grid.yaml")
    assert (code, out) == (130, "")
    assert waited == [True]
    assert err.count("interrupted by SIGINT") == 1
    assert LINE in err
