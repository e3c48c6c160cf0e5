"""The gate lets through what is fast enough and names what is not; with a clock of its own, so nothing is timed."""

import hashlib
import itertools
import re
import subprocess
import threading
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from benchmarks import counts, earlier, gate, together


def nothing() -> None:
    """A path that takes as long as the clock of the test says."""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Callable[[dict[Callable[[], None], float]], None]:
    """Let every path take a known time and the reference one second."""

    def set_times(seconds: dict[Callable[[], None], float]) -> None:
        monkeypatch.setattr(gate, "cpu_seconds", lambda work: seconds.get(work, 1.0))

    monkeypatch.setattr(gate, "reference_work", lambda x, times: None)
    return set_times


def test_a_path_made_slower_fails_by_name(clock: Callable[..., None]) -> None:
    def lanes() -> None:
        """As fast as when the threshold was set."""

    def slowed_lanes() -> None:
        """The same with a change that doubles its cost."""

    clock({lanes: 4.5, slowed_lanes: 9.0})
    thresholds = {"lanes": 7.0, "sums": 2.0}
    assert gate.complaint(gate.judged({"lanes": lanes, "sums": nothing}, thresholds, rounds=3)) == ""
    found = gate.judged({"lanes": slowed_lanes, "sums": nothing}, thresholds, rounds=3)
    assert [finding.passes for finding in found] == [False, True]
    message = gate.complaint(found)
    assert "lanes (9.000, at most 7.000)" in message
    assert "sums" not in message
    assert "gate.toml" in message


def test_one_disturbed_round_does_not_decide(clock: Callable[..., None], monkeypatch: pytest.MonkeyPatch) -> None:
    disturbed = itertools.cycle([4.0, 40.0, 4.0])
    monkeypatch.setattr(gate, "cpu_seconds", lambda work: next(disturbed) if work is nothing else 1.0)
    (finding,) = gate.judged({"path": nothing}, {"path": 5.0}, rounds=9)
    assert finding.ratio == 4.0
    assert finding.passes


def found_in_turn(*ratios: dict[str, float], counted: bool = False) -> Callable[[], list[gate.Finding]]:
    """A measurement that finds these ratios, of at most 1, one after the other; a further one is an error."""
    each = iter(ratios)
    return lambda: [gate.Finding(name, ratio, 1.0, counted=counted) for name, ratio in next(each).items()]


def test_what_is_too_slow_only_once_or_twice_passes(capsys: pytest.CaptureFixture[str]) -> None:
    first, second, third = {"a": 6.0, "b": 0.5}, {"a": 2.0, "b": 3.0}, {"a": 0.9, "b": 4.0}
    assert [finding.ratio for finding in gate.confirmed(found_in_turn(first, second, third))] == [0.9, 0.5]
    assert capsys.readouterr().out.splitlines() == [
        "too slow, so measured again: a (6.000, at most 1.000)",
        "too slow, so measured again: a (2.000, at most 1.000)",
    ]
    assert [finding.ratio for finding in gate.confirmed(found_in_turn(third, second, first))] == [0.9, 0.5]


@pytest.mark.parametrize("slow", [1.1, float("nan")])
def test_what_is_too_slow_each_time_fails(slow: float) -> None:
    measure = found_in_turn({"a": 0.5, "b": slow}, {"a": 0.5, "b": slow}, {"a": 2.0, "b": slow})
    assert [finding.passes for finding in gate.confirmed(measure)] == [True, False]


def test_counts_are_taken_once() -> None:
    assert "counts have changed: a" in gate.complaint(gate.confirmed(found_in_turn({"a": 1.1}, counted=True)))


def test_a_ratio_that_is_no_number_fails() -> None:
    assert not gate.Finding("path", float("nan"), 1.0).passes


def test_every_path_has_a_threshold_and_every_threshold_a_path(tmp_path: Path) -> None:
    assert set(gate.paths(tmp_path)) == set(gate.thresholds_of())
    with pytest.raises(ValueError, match="unknown"):
        gate.judged({"lanes": nothing}, {"lanes": 1.0, "unknown": 1.0})


def test_command_fails_with_a_message(
    clock: Callable[..., None],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The whole command on thresholds that nothing can keep; the committed ones would pass at this speed."""
    clock({nothing: 0.5})
    monkeypatch.setattr(gate, "paths", lambda folder: {"lanes_fast": nothing})
    too_low = tmp_path / "low.toml"
    too_low.write_text("[largest_ratio]\nlanes_fast = 0.1\n")
    monkeypatch.setattr("sys.argv", ["gate", "--only", "reference", "--thresholds", str(too_low)])
    assert gate.main() == 1
    printed = capsys.readouterr()
    assert re.search(r"lanes_fast .*TOO SLOW", printed.out)
    assert printed.err.startswith("benchmark gate: too slow: lanes_fast (0.500, at most 0.100)")
    too_low.write_text("[largest_ratio]\nlanes_fast = 0.6\n")
    assert gate.main() == 0
    assert capsys.readouterr().err == ""


def test_thresholds_are_committed_as_numbers() -> None:
    with gate.THRESHOLDS.open("rb") as stream:
        sections = tomllib.load(stream)
    assert all(value > 0.0 for values in sections.values() for value in values.values())


def test_a_count_may_change_by_two_per_cent_and_none_may_come_or_go() -> None:
    recorded = counts.Recorded(counts.compiler(), {"kept": 1000, "grown": 1000, "shrunk": 1000, "gone": 10})
    found = {"kept": 1019, "grown": 1021, "shrunk": 979, "new": 5}
    complaint = gate.complaint(gate.counted(found, recorded, 0.02))
    assert re.findall(r"(\w+) \(", complaint) == ["grown", "shrunk", "gone", "new"]
    assert "python -m benchmarks.gate --record" in complaint
    assert gate.complaint(gate.counted(dict(recorded.counts), recorded, 0.02)) == ""


def test_another_compiler_is_named_beside_its_counts() -> None:
    (finding,) = gate.counted({"steps": 10}, counts.Recorded("numba 0.1", {"steps": 10}), 0.02)
    assert "of the record with numba 0.1" in str(finding)
    assert finding.passes


def test_the_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    written = {"flops of a step, machine code": 1158, "calls of all, lanes": 7}
    counts.write(written, tmp_path / "counts.toml")
    assert counts.read(tmp_path / "counts.toml") == counts.Recorded(counts.compiler(), written)
    assert "flops of a step, machine code" in counts.read().counts


def test_instructions_are_those_of_kernels_without_their_wrappers() -> None:
    assembly = """
\t.globl\t_ZN15boulder_kernels4soilE
_ZN15boulder_kernels4soilE:
\t.cfi_startproc
\tvmovupd\t(%rax), %zmm0
.LBB0_1:
\tvaddpd\t%zmm0, %zmm1, %zmm0
\tretq
_ZN7cpython15boulder_kernels4soilE:
\tpushq\t%rbp
NRT_decref:
\tretq
"""
    assert counts.instructions(assembly) == 3


def git(folder: Path, *words: str) -> str:
    settings = ("-c", "user.name=n", "-c", "user.email=e", "-c", "commit.gpgsign=false")
    command = ["git", *settings, *words]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


def test_the_kernels_compared_with_are_those_before_the_last_change(tmp_path: Path) -> None:
    kernels = tmp_path / earlier.SOURCES
    kernels.mkdir(parents=True)
    git(tmp_path, "init", "-q")
    commits = []
    for name, text in ((kernels / "step.py", "1"), (kernels / "step.py", "2"), (tmp_path / "README", "3")):
        name.write_text(text)
        git(tmp_path, "add", "-A")
        git(tmp_path, "commit", "-q", "-m", text)
        commits.append(git(tmp_path, "rev-parse", "HEAD"))
    assert earlier.commit_before(tmp_path) == commits[0]
    (kernels / "step.py").write_text("4")
    assert earlier.commit_before(tmp_path) == commits[2]


def test_without_a_history_nothing_is_compared(tmp_path: Path) -> None:
    assert earlier.commit_before(tmp_path) is None


def test_costs_of_steps_and_of_events_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels whose step costs three times as much as before, and whose events cost the same."""

    def simulation(kernels: object, designs: object, step_s: float) -> Timed:
        return Timed(3.0 if kernels is earlier.bk else 1.0, step_s)

    monkeypatch.setattr(earlier, "_simulation", simulation)
    monkeypatch.setattr(earlier, "cpu_seconds", lambda work: 5.0 + work.step_cost * 0.01 / work.step_s)
    found = earlier.ratios_to("before", rounds=3)
    assert found.step == pytest.approx(3.0)
    assert found.events == pytest.approx(1.0)
    assert 1.0 < found.design < 3.0


class Timed(NamedTuple):
    """A simulation that takes as long as it says."""

    step_cost: float
    step_s: float

    def __call__(self) -> None:
        """Do nothing."""


def compute() -> None:
    """Compute for a while, as the clock of the thread tells."""
    until = time.thread_time() + 0.05
    while time.thread_time() < until:
        hashlib.sha256(b"0" * 1_000_000)  # without the lock of the interpreter


def share_nothing() -> None:
    """Work of a thread that needs nothing another one has."""


def wait_for_each_other() -> None:
    """Work that one thread at a time does."""


def slowed_by_each_other() -> None:
    """Work of which each thread takes longer while another does it."""


@pytest.mark.parametrize(
    ("work", "gain"), [(share_nothing, 1.0), (wait_for_each_other, 0.5), (slowed_by_each_other, 0.25)]
)
@pytest.mark.parametrize("host", [1.1, 2.0])
def test_the_gain_of_two_threads_is_that_over_work_that_shares_nothing(
    monkeypatch: pytest.MonkeyPatch, work: Callable[[], None], gain: float, host: float
) -> None:
    """Also on a host that gives two processors the time of one."""
    disturbed = itertools.cycle([40.0, *[1.0] * 11])  # of three rounds with four times each, one
    together_s = {share_nothing: host, wait_for_each_other: 2.0, slowed_by_each_other: 4.0 * host}

    def timed(work: Callable[[], None], count: int) -> together.Timed:
        seconds = (1.0 if count == 1 else together_s[work]) * next(disturbed)
        return together.Timed(seconds, float(count > 1 and work is wait_for_each_other))

    monkeypatch.setattr(together, "timed", timed)
    assert together.gain_over(work, share_nothing, rounds=9) == pytest.approx(gain)


@pytest.mark.nightly
def test_work_that_sleeps_is_told_from_work_that_computes() -> None:
    assert together.idle_share(lambda: time.sleep(0.05), rounds=3) > 0.8
    assert together.idle_share(compute, rounds=3) < 0.2


@pytest.mark.nightly
def test_threads_that_wait_for_each_other_gain_nothing() -> None:
    lock = threading.Lock()

    def alone() -> None:
        with lock:
            compute()

    assert together.gain_over(alone, compute) < 0.7
    assert together.gain_over(compute, compute) > 0.7
