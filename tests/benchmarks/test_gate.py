"""The gate lets through what is fast enough and names what is not; with a clock of its own, so nothing is timed."""

import itertools
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks import gate


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
    monkeypatch.setattr("sys.argv", ["gate", "--thresholds", str(too_low)])
    assert gate.main() == 1
    printed = capsys.readouterr()
    assert re.search(r"lanes_fast .*TOO SLOW", printed.out)
    assert printed.err.startswith("benchmark gate: too slow: lanes_fast (0.500, at most 0.100)")
    too_low.write_text("[largest_ratio]\nlanes_fast = 0.6\n")
    assert gate.main() == 0
    assert capsys.readouterr().err == ""


def test_thresholds_are_committed_as_numbers() -> None:
    with gate.THRESHOLDS.open("rb") as stream:
        values = tomllib.load(stream)["largest_ratio"].values()
    assert all(value > 0.0 for value in values)
