"""What a terminal shows: bars, signals and words; and when the reader of the output goes away."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest
from rich.progress import Progress as Bars

from boulder_kernels import _jit
from boulder_sweep import signals, simulate
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.errors import Interrupted
from boulder_sweep.judge.accuracy import Accuracy, Steps
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.runner.run import resuming
from tests.conftest import Command
from tests.waiting import HANG_GUARD_S, wait_until

COMMAND = [sys.executable, "-m", "boulder_sweep"]


def _on_a_terminal(words, command=COMMAND, watch=lambda received: None, **environment):
    """Run a command with a terminal as stderr; return exit code, stdout and what the terminal received.

    What it has received is passed to `watch` whenever there is more.
    """
    ours, theirs = pty.openpty()
    env = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    env |= {"TERM": "xterm-256color", "COLUMNS": "120"} | environment
    process = subprocess.Popen([*command, *words], stdout=subprocess.PIPE, stderr=theirs, env=env, text=True)
    os.close(theirs)
    received = bytearray()
    while True:
        try:
            data = os.read(ours, 65536)
        except OSError:  # Linux ends a terminal without readers this way
            break
        if not data:
            break
        received += data
        watch(received.decode(errors="replace"))
    os.close(ours)
    out, _ = process.communicate()
    return process.returncode, out, received.decode()


GRID_OF_THOUSANDS = ["--set", "boulder.length={from: 1 m, to: 2 m, count: 3000}"]


def test_a_terminal_gets_a_bar_with_the_time_left(possible_grid):
    code, out, shown = _on_a_terminal(["run", "grid.yaml", *GRID_OF_THOUSANDS])
    assert code == 0
    assert "54,000 designs" in out
    assert "\x1b" not in out
    assert "simulating" in shown
    assert re.search(r"[\d,]+ of 54,000, [\d,]+/s left: [^\s]*\d+:\d\d:\d\d", shown)
    assert re.search(r"\x1b\[[0-9;]*38;5", shown)


COLD_START = """
import sys
from pathlib import Path
from boulder_kernels import _jit
from boulder_sweep.cli import main
from boulder_sweep.judge.evaluation import Evaluation
from tests.waiting import wait_until
enough = Path(sys.argv[1])
def warm_up(evaluation):
    with _jit.announce("lanes-run_lanes-0"):
        wait_until(enough.exists, "the bar has moved")
Evaluation.warm_up = warm_up
main.main(sys.argv[2:])
"""


def test_a_cold_start_shows_a_bar_with_what_it_waits_for(possible_grid, tmp_path):
    """The words stand beside a bar that moves while the kernels compile, and give way to the words of the work."""
    enough = tmp_path / "enough"

    def watch(shown):
        pictures = re.findall(r"compiling kernels; later commands load them.*?\x1b\[2K", shown, re.S)
        if len(set(pictures)) >= 3:
            enough.touch()

    ended, _, shown = _on_a_terminal(
        ["run", "grid.yaml", *GRID_OF_THOUSANDS],
        command=[sys.executable, "-c", COLD_START, str(enough)],
        watch=watch,
        PYTHONPATH=os.pathsep.join(sys.path),
    )
    assert ended == 0
    assert enough.exists()
    assert "simulating" in shown


def test_no_color_holds(possible_grid):
    code, _, shown = _on_a_terminal(["run", "grid.yaml", *GRID_OF_THOUSANDS], NO_COLOR="1")
    assert code == 0
    assert "simulating" in shown
    assert not re.search(r"\x1b\[[0-9;]*3[0-9][;m]", shown)


def test_quiet_holds_on_a_terminal(possible_grid):
    code, _, shown = _on_a_terminal(["run", "grid.yaml", "--quiet"])
    assert (code, shown) == (0, "")


@pytest.mark.parametrize("words", [["--help"], ["check", "grid.yaml"], ["run", "grid.yaml", "-q", "--dry-run"]])
def test_a_reader_that_goes_away_is_no_error(grid, words):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as stdout:
        done = subprocess.run([*COMMAND, *words], stdout=stdout, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 0
    assert done.stderr == ""


TALKATIVE = """
import sys
from boulder_sweep.cli import main, output
output.PLAIN_EVERY_S = -1.0
main.main(sys.argv[1:])
"""


@pytest.mark.faults
@pytest.mark.parametrize(("signum", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_run_with_their_code_and_the_command_to_go_on(possible_grid, signum, code):
    words = ["run", "grid.yaml", "--set", "boulder.length={from: 1 m, to: 2 m, count: 1000000}"]
    command = [sys.executable, "-c", TALKATIVE, *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert any(re.search(r"[1-9][\d,]* of 18,000,000 designs", line) for line in process.stderr)
    process.send_signal(signum)
    out, err = process.communicate(timeout=HANG_GUARD_S)  # hang guard
    assert process.returncode == code
    assert out == ""
    assert "Traceback" not in err
    assert (
        "sweep run grid.yaml -o small-grid.sweep --set 'boulder.length={from: 1 m, to: 2 m, count: 1000000}' --resume"
        in err
    )


WORDS = (
    "interrupted by SIGINT; 5 of 18 rows are safe. Resume with:",
    "  sweep run grid.yaml -o small-grid.sweep --resume",
)
"""What is said, line by line: the bar is drawn between them."""


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
    assert all(line in before[0] for line in WORDS)


def test_it_is_said_where_the_bar_takes_its_time(
    sweep: Command, closing: Callable[[Callable[[], None]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread that waits for the command looks for signals meanwhile."""
    looks, waited = list[None](), list[bool]()

    class CountingThread(threading.Thread):
        def is_alive(self) -> bool:
            looks.append(None)
            return super().is_alive()

    functions = {name: getattr(threading, name) for name in ("current_thread", "main_thread")}
    monkeypatch.setattr(signals, "threading", SimpleNamespace(Thread=CountingThread, **functions))

    def several_looks() -> None:
        enough = len(looks) + 3
        wait_until(lambda: len(looks) >= enough or signals._installed is None, "the waiting thread looked thrice")
        waited.append(len(looks) >= enough)

    closing(several_looks)
    code, out, err = sweep("run", "grid.yaml")
    assert (code, out) == (130, "")
    assert waited == [True]
    assert err.count("interrupted by SIGINT") == 1
    assert all(line in err for line in WORDS)


COMPILING = "compiling kernels"
KERNEL = "a_kernel"
CONFIGS = Path(__file__).parents[2] / "configs"
SITE = CONFIGS / "site.yaml"
ONE = ("--set", "boulder.height=3.4 m", "--set", "soil.friction_angle=40 deg", "--set", "site.embedment_depth=1.9 m")


def after_compiling(kernel):
    """Return what calls kernels, the first one after it has been compiled."""
    call, begun = _jit.Kernel.__call__, []

    def cold(*given, **named):
        if not begun:
            begun.append(kernel)
            with _jit.announce(kernel):
                pass
        return call(*given, **named)

    return cold


@pytest.fixture(scope="module")
def compiled():
    """Compile all kernels, where that was not done before."""
    evaluation_of(crash_test("rwg"), Accuracy("", Steps(0.01), error_estimate=False)).warm_up()
    simulate(crash_test("rwg"))


@pytest.mark.parametrize(
    "words",
    [
        ("run", SITE, *ONE),
        ("simulate", SITE, *ONE),
        ("need", SITE, *ONE),
        ("capacity", SITE, *ONE),
        ("uncertainty", SITE, *ONE, "--half-width", "0.2", "--set", "vehicle.speed={mean: 30 mph, cov: 5 %}"),
        ("tradeoff", SITE, *ONE, "--seconds", "0"),
    ],
)
@pytest.mark.parametrize("kept", [True, False])
def test_every_command_that_compiles_says_so_first(compiled, sweep, words, kept, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("boulder_kernels._jit.CACHE_FOLDER", str(tmp_path) if kept else None)
    again = ["--overwrite"] if words[0] == "run" else []
    sweep(*words)
    assert COMPILING not in sweep(*words, *again)[2]
    monkeypatch.setattr(_jit.Kernel, "__call__", after_compiling(KERNEL))
    code, _, err = sweep(*words, *again)
    assert code == 0
    assert err.count(COMPILING) == 1
    assert ("later commands load them" in err) == kept


def test_values_are_shown_in_us_units_where_asked(sweep, possible_grid):
    metric = json.loads(sweep("simulate", possible_grid, "--design", 1, "--json", "-q")[1])
    code, out, _ = sweep("simulate", possible_grid, "--design", 1, "--json", "-q", "--units", "us")
    us = json.loads(out)
    assert code == 0
    assert us["max_displacement_ft"] == pytest.approx(metric["max_displacement_m"] / 0.3048, rel=1e-13)
    assert us["peak_force_kip"] == pytest.approx(metric["peak_force_kN"] / 4.4482216152605, rel=1e-13)
    assert us["max_rotation_deg"] == metric["max_rotation_deg"]
    assert us["verdict"] == metric["verdict"]
    sweep("run", possible_grid, "-q")
    assert "\nimpact_speed_mph" in sweep("simulate", "small-grid.sweep", "--all", "--units", "us")[1]
    metric = json.loads(sweep("simulate", "small-grid.sweep", "--json")[1])
    us = json.loads(sweep("simulate", "small-grid.sweep", "--json", "--units", "us")[1])
    assert us["impact_speed_mph"] == pytest.approx(30.0)
    assert us["max_displacement_ft"] == pytest.approx(metric["max_displacement_m"] / 0.3048, rel=1e-13)
    assert "max_displacement_m" not in us
