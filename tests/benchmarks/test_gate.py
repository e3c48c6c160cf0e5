"""The gate lets through what does no more than before and names what does; the tests hand in the times."""

import itertools
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from benchmarks import counts, earlier, findings, gate, timed, together


def nothing() -> None:
    """Work that takes as long as the clock of the test says."""


def reference() -> None:
    """What it is compared with."""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Callable[[], None]]]:
    """Let work take the times that a test gives, one after the other, and the reference one second."""

    def set_times(seconds: dict[Callable[[], None], list[float]]) -> list[Callable[[], None]]:
        in_turn = {work: itertools.cycle(times) for work, times in seconds.items()}
        asked: list[Callable[[], None]] = []

        def cpu_seconds(work: Callable[[], None]) -> float:
            asked.append(work)
            return next(in_turn[work]) if work in in_turn else 1.0

        for module in (gate, timed):
            monkeypatch.setattr(module, "cpu_seconds", cpu_seconds)
        monkeypatch.setattr(timed, "reference_loop", lambda: reference)
        return asked

    return set_times


def test_work_that_takes_half_as_long_again_fails_by_name(clock: Callable[..., object]) -> None:
    def lanes() -> None:
        """As fast as when the record was made."""

    clock({lanes: [4.5], nothing: [9.1]})
    found = gate.within({"lanes": lanes, "twice": nothing}, reference, {"lanes": 4.5, "twice": 6.0}, 1.5)
    assert [each.passes for each in found] == [True, False]
    message = findings.complaint(found)
    assert "time of twice (1.517 of the record, at most 1.500)" in message
    assert "lanes (" not in message
    assert "gate.toml" in message
    assert findings.complaint(found[:1]) == ""


def test_timing_ends_with_the_first_round_that_passes(clock: Callable[..., list[object]]) -> None:
    asked = clock({nothing: [9.0, 8.0, 5.9, 1.0]})
    (found,) = gate.within({"lanes": nothing}, reference, {"lanes": 4.0}, 1.5)
    assert found.passes
    assert found.ratio == pytest.approx(5.9 / 4.0)
    assert asked.count(nothing) == asked.count(reference) == 3


def test_timing_ends_with_the_ninth_round_that_fails(clock: Callable[..., list[object]]) -> None:
    asked = clock({nothing: [9.0, 8.0, 7.0]})
    (found,) = gate.within({"lanes": nothing}, reference, {"lanes": 4.0}, 1.5)
    assert not found.passes
    assert found.ratio == 7.0 / 4.0
    assert asked.count(nothing) == asked.count(reference) == 9


def test_what_disturbs_the_reference_excuses_nothing(clock: Callable[..., object]) -> None:
    """The least time of the reference counts, not that of the same round."""
    clock({nothing: [7.0], reference: [1.0, 40.0]})
    (found,) = gate.within({"lanes": nothing}, reference, {"lanes": 4.0}, 1.5)
    assert found.ratio == 7.0 / 4.0


def test_everything_timed_has_a_record_that_any_processor_finds() -> None:
    limits = findings.limits_of("time")
    assert limits["most"] == 1.5
    assert gate.ANY_PROCESSOR in limits["record"]
    assert all(set(record) == set(gate.lanes()) for record in limits["record"].values())
    assert all(value > 0.0 for record in limits["record"].values() for value in record.values())


@pytest.mark.parametrize(("known", "ratio"), [("this", 2.0), ("that", 4.0)])
def test_a_processor_has_its_own_record_or_that_of_any(
    clock: Callable[..., object], monkeypatch: pytest.MonkeyPatch, known: str, ratio: float
) -> None:
    clock({nothing: [8.0]})
    monkeypatch.setattr(gate, "lanes", lambda: {"fast": nothing})
    record = {known: {"fast": 4.0}, gate.ANY_PROCESSOR: {"fast": 2.0}}
    monkeypatch.setattr(gate, "limits_of", lambda section: {"time": {"most": 1.5, "record": record}}[section])
    monkeypatch.setattr(gate.llvmlite.binding, "get_host_cpu_name", lambda: "this")
    (found,) = gate.PARTS["time"]()
    assert found.ratio == ratio


def command(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["gate", *words])
    return gate.main()


def test_command_fails_with_a_message(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(gate.PARTS, "counts", lambda: [findings.Finding("steps", 1.0, 1.02, 0.98)])
    ratios = iter([1.2, 1.7, 1.3])
    monkeypatch.setitem(gate.PARTS, "time", lambda: [findings.Finding("time of fast", next(ratios), 1.5)])
    assert command(monkeypatch) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert re.search(r"^steps .* ok\ntime of fast .* ok\npassed 1 of 1$", printed.out, re.MULTILINE)
    assert command(monkeypatch, "--only", "time", "--times", "2") == 1
    printed = capsys.readouterr()
    assert "steps" not in printed.out
    assert "passed 1 of 2" in printed.out
    assert printed.err.startswith("benchmark gate: time of fast (1.700 of the record, at most 1.500).")


def test_what_only_a_quiet_machine_tells_is_timed_when_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done: list[str] = []
    for parts in (gate.PARTS, timed.PARTS):
        for name in parts:
            monkeypatch.setitem(parts, name, lambda name=name: done.append(name) or [])
    assert command(monkeypatch) == 0
    assert done == ["counts", "time"]
    done.clear()
    assert command(monkeypatch, "--timed") == 0
    assert done == ["paths", "threads", "waiting", "earlier"]
    assert capsys.readouterr().err == ""


def test_a_ratio_that_is_no_number_fails() -> None:
    assert not findings.Finding("path", float("nan"), 1.0).passes


def test_a_count_may_change_by_two_per_cent_and_none_may_come_or_go() -> None:
    recorded = counts.Recorded(counts.compiler(), {"kept": 1000, "grown": 1000, "shrunk": 1000, "gone": 10})
    found = {"kept": 1019, "grown": 1021, "shrunk": 979, "new": 5}
    change = findings.limits_of("counts")["largest_change"]
    complaint = findings.complaint(gate.compared(found, recorded, change))
    assert re.findall(r"(\w+) \(", complaint) == ["grown", "shrunk", "gone", "new"]
    assert "python -m benchmarks.gate --record" in complaint
    assert findings.complaint(gate.compared(dict(recorded.counts), recorded, change)) == ""


def test_another_compiler_is_named_beside_its_counts() -> None:
    (finding,) = gate.compared({"steps": 10}, counts.Recorded("numba 0.1", {"steps": 10}), 0.02)
    assert "of the record with numba 0.1" in str(finding)
    assert finding.passes


def test_the_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    written = {"flops of a step, machine code": 1158, "calls of all, lanes": 7}
    counts.write(written, tmp_path / "counts.toml")
    assert counts.read(tmp_path / "counts.toml") == counts.Recorded(counts.compiler(), written)


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


def test_a_slower_path_fails_by_name_and_one_disturbed_round_does_not(clock: Callable[..., object]) -> None:
    def sums() -> None:
        """Disturbed in one of three rounds."""

    clock({nothing: [9.0], sums: [4.0, 40.0, 4.0]})
    found = timed.judged({"lanes": nothing, "sums": sums}, {"lanes": 7.0, "sums": 5.0})
    assert [(each.ratio, each.passes) for each in found] == [(9.0, False), (4.0, True)]
    assert "lanes (9.000 of the reference, at most 7.000)" in findings.complaint(found)


def test_every_path_has_a_limit_and_every_limit_a_path(tmp_path: Path) -> None:
    assert set(timed.paths(tmp_path)) == set(findings.limits_of("paths"))
    with pytest.raises(ValueError, match="unknown"):
        timed.judged({"lanes": nothing}, {"lanes": 1.0, "unknown": 1.0})


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

    def of_threads(work: Callable[[], None], count: int) -> together.Timed:
        seconds = (1.0 if count == 1 else together_s[work]) * next(disturbed)
        return together.Timed(seconds, float(count > 1 and work is wait_for_each_other))

    monkeypatch.setattr(together, "timed", of_threads)
    assert together.gain_over(work, share_nothing, rounds=9) == pytest.approx(gain)


LOOKS = [([1, 2], [], 6), ([1], [2], 3), ([], [1, 2], 1)]
"""Threads awake, threads asleep, and how often both were found so."""


def test_shares_of_time_are_those_of_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    program = f"import sys\nprint('begun', flush=True)\nsys.stdin.read()\nprint({json.dumps(LOOKS)!r})"
    monkeypatch.setattr(together, "_LOOKING", program)
    with together.Looking() as looking:
        pass
    assert looking.idle == pytest.approx(0.1)
    assert [looking.asleep(thread) for thread in (1, 2, 3)] == pytest.approx([0.1, 0.4, 0.0])
    assert looking.one_asleep([1, 2]) == pytest.approx(0.4)
    assert looking.one_asleep([1, 3]) == 0.0
