"""What a terminal shows, and what happens when the reader of the output goes away."""

import os
import pty
import re
import signal
import subprocess
import sys

import pytest

from tests.waiting import HANG_GUARD_S

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
    """The words stand beside a bar that moves while the kernels compile, and give way to those of the work."""
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
