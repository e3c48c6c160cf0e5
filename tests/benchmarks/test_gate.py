"""The gate lets through what does no more than before and names what does; the tests hand in the times."""

import itertools
import re
import sys
from collections.abc import Callable

import pytest

from benchmarks import gate
from benchmarks.gate import Finding


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

        monkeypatch.setattr(gate, "cpu_seconds", cpu_seconds)
        monkeypatch.setattr(gate, "reference_loop", lambda: reference)
        return asked

    return set_times


def test_work_that_takes_half_as_long_again_fails_by_name(clock: Callable[..., object]) -> None:
    def lanes() -> None:
        """Lanes as fast as when the record was made."""

    clock({lanes: [4.5], nothing: [9.1]})
    found = gate.within({"lanes": lanes, "twice": nothing}, reference, {"lanes": 4.5, "twice": 6.0}, 1.5)
    assert [each.passes for each in found] == [True, False]
    message = gate.complaint(found)
    assert re.search(r"time of twice +1\.517 of the record, at most 1\.500", message)
    assert "time of lanes" not in message
    assert "gate.toml" in message
    assert gate.complaint(found[:1]) == ""


@pytest.mark.parametrize(
    ("times", "ratio", "rounds"), [([9.0, 8.0, 5.9, 1.0], 5.9 / 4.0, 3), ([9.0, 8.0, 7.0], 7.0 / 4.0, 9)]
)
def test_timing_ends_with_the_first_round_that_passes_or_the_ninth(
    clock: Callable[..., list[object]], times: list[float], ratio: float, rounds: int
) -> None:
    asked = clock({nothing: times})
    (found,) = gate.within({"lanes": nothing}, reference, {"lanes": 4.0}, 1.5)
    assert found.ratio == pytest.approx(ratio)
    assert asked.count(nothing) == asked.count(reference) == rounds


def test_what_disturbs_the_reference_excuses_nothing(clock: Callable[..., object]) -> None:
    """The least time of the reference counts, not its time in the same round."""
    clock({nothing: [7.0], reference: [1.0, 40.0]})
    (found,) = gate.within({"lanes": nothing}, reference, {"lanes": 4.0}, 1.5)
    assert found.ratio == 7.0 / 4.0


def test_everything_timed_has_a_record_that_any_processor_finds() -> None:
    limits = gate.limits()["time"]
    assert limits["most"] == 1.5
    assert gate.ANY_PROCESSOR in limits["record"]
    assert all(set(record) == set(gate.lanes()) for record in limits["record"].values())
    assert all(value > 0.0 for record in limits["record"].values() for value in record.values())


def test_a_count_may_change_by_two_per_cent_and_none_may_come_or_go() -> None:
    recorded = {"kept": 1000, "grown": 1000, "shrunk": 1000, "gone": 10}
    found = {"kept": 1019, "grown": 1021, "shrunk": 979, "new": 5}
    change = gate.limits()["largest_change"]
    failing = [each.name for each in gate.compared(found, recorded, change) if not each.passes]
    assert failing == ["grown", "shrunk", "gone", "new"]
    assert gate.complaint(gate.compared(recorded, recorded, change)) == ""


@pytest.mark.parametrize(("known", "ratio"), [("this", 2.0), ("that", 4.0)])
def test_the_command_takes_the_record_of_the_processor_or_of_any_and_fails_with_a_message(
    clock: Callable[..., object],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    known: str,
    ratio: float,
) -> None:
    clock({nothing: [8.0]})
    monkeypatch.setattr(gate, "lanes", lambda: {"fast": nothing})
    monkeypatch.setattr(gate, "counts", lambda: {"calls": 101})
    record = {known: {"fast": 4.0}, gate.ANY_PROCESSOR: {"fast": 2.0}}
    limits = {"largest_change": 0.02, "counts": {"calls": 100}, "time": {"most": 2.5, "record": record}}
    monkeypatch.setattr(gate, "limits", lambda: limits)
    monkeypatch.setattr(gate.llvmlite.binding, "get_host_cpu_name", lambda: "this")
    monkeypatch.setattr(sys, "argv", ["gate"])
    assert gate.main() == (ratio > 2.5)
    printed = capsys.readouterr()
    assert re.search(rf"^calls +1\.010 .* ok\ntime of fast +{ratio:.3f} ", printed.out, re.MULTILINE)
    assert printed.err.startswith("benchmark gate: time of fast") == (ratio > 2.5)


def test_a_ratio_that_is_no_number_fails() -> None:
    assert not Finding("calls", float("nan"), 1.0).passes


def test_the_record_is_of_this_code() -> None:
    limits = gate.limits()
    assert gate.complaint(gate.compared(gate.counts(), limits["counts"], limits["largest_change"])) == ""
