"""The record of impacts: of the present sources, complete, and what the oracle computes again."""

from __future__ import annotations

import shutil
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.oracle import AS_PRINTED, CORRECTED, RWG, records, simulate
from tests.oracle.dynamics import contact_displacement
from tests.oracle.inputs import Ground, Layer
from tests.oracle.outcome import Impact, Peak
from tests.oracle.records import COMMAND, arguments_of, case_of, key_of, on_a_knife_edge, recorded_impact
from tests.oracle.summary import Summary, summary_of

HERE = Path(__file__).parent
ENTRIES = records.read()[1]
PARTS = 20


def kind(case: dict[str, Any]) -> tuple[str, ...]:
    """What tells impacts apart beside their numbers."""
    given, readings, options = (case[name] for name in ("inputs", "readings", "options"))
    soil = given["ground"] is not None
    return (readings["restoring"], readings["contact"], str(soil), *map(str, options.values()))


def chosen(count: int) -> list[dict[str, Any]]:
    """Return recorded impacts, one of each kind in turn; no long sums and nothing stiff, which take too long."""
    kinds: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for entry in ENTRIES:
        options = entry["case"]["options"]
        if (options["elements"] or 0) <= 100 and not options["stiff"]:
            kinds.setdefault(kind(entry["case"]), []).append(entry)
    turns = zip_longest(*(kinds[name] for name in sorted(kinds)))
    return [entry for turn in turns for entry in turn if entry is not None][:count]


def differences(again: Impact, known: Summary, *, over_kinks: bool) -> dict[str, tuple[object, object]]:
    """What is not the same on any processor: values to a part in 10^9, instants of flat maxima to a microsecond.

    The last digits of sines and sums depend on a processor's libraries, and decide where steps lie. Where steps go
    over kinks, which costs accuracy, the values of two processors differ by up to 10^-5. Of equal maxima of the crush,
    where a stiff vehicle rings, they decide which one is found: then the impact has the known value at that
    instant as well.
    """
    value, instant = (3e-5, 1e-5) if over_kinks else (1e-9, 1e-6)
    found = summary_of(again)

    def close(a: Any, b: Any) -> bool:
        return np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=value, atol=0.01 * value)

    def same(name: str, a: Any, b: Any) -> bool:
        if not isinstance(a, Peak):
            return close(a, b)
        same_instant = abs(a.time - b.time) <= instant or (name == "max_crush" and close(crush(again, b.time), b.value))
        return close(a.value, b.value) and same_instant

    pairs = {name: (getattr(found, name), getattr(known, name)) for name in Summary.__dataclass_fields__}
    return {name: pair for name, pair in pairs.items() if not same(name, *pair)}


def crush(impact: Impact, t: float) -> float:
    """Displacement of the vehicle less the displacement of the point struck [m] at a time [s]."""
    y = impact.states(t)[:, 0]
    return float(y[4]) - contact_displacement(impact.problem, y)


def computed_again(entry: dict[str, Any]) -> dict[str, tuple[object, object]]:
    """Differences between an entry and the impact integrated anew."""
    inputs, readings, options = arguments_of(entry["case"])
    again = simulate.__wrapped__(inputs, readings, **options)
    over_kinks = not (options["land_on_kinks"] or options["stiff"])
    return differences(again, records.summary_from(entry["found"]), over_kinks=over_kinks)


@pytest.mark.parametrize(("over_kinks", "share", "seconds"), [(False, 1e-8, 2e-6), (True, 1e-4, 2e-5)])
def test_another_value_or_instant_is_a_difference(over_kinks: bool, share: float, seconds: float) -> None:
    """Of the crush an instant of less crush, so not one beside its flat maximum."""
    again = simulate(RWG, CORRECTED, horizon=0.3)
    known = summary_of(again)
    assert differences(again, known, over_kinks=over_kinks) == {}
    for name, earlier in (("max_rotation", seconds), ("max_crush", 0.01)):
        peak = getattr(known, name)
        for other in (replace(peak, value=peak.value * (1.0 + share)), replace(peak, time=peak.time - earlier)):
            found = differences(again, replace(known, **{name: other}), over_kinks=over_kinks)
            assert found == {name: (peak, other)}


def test_record_is_of_the_present_sources() -> None:
    assert records.read()[0].get("sources") == records.source_hash(), f"the oracle has changed; run: {COMMAND}"


def test_record_is_of_this_scipy() -> None:
    recorded, present = records.read()[0].get("scipy"), records.versions()["scipy"]
    if recorded != present:
        pytest.skip(
            f"recorded with SciPy {recorded}, this is {present}: all impacts are integrated, which takes minutes"
        )


def test_entries_are_found_by_what_they_were_asked_with() -> None:
    for entry in ENTRIES:
        inputs, readings, options = arguments_of(entry["case"])
        assert key_of(case_of(inputs, readings, **options)) == key_of(entry["case"])
    assert len({key_of(entry["case"]) for entry in ENTRIES}) == len(ENTRIES) > 1000


@pytest.mark.parametrize("entry", chosen(20), ids=lambda entry: key_of(entry["case"])[:8])
def test_some_are_computed_again(entry: dict[str, Any]) -> None:
    assert computed_again(entry) == {}


@pytest.mark.nightly
@pytest.mark.parametrize("part", range(PARTS))
def test_all_are_computed_again(part: int) -> None:
    """On a knife edge the last digits of another processor may turn the motion."""
    for entry in ENTRIES[part::PARTS]:
        wrong = computed_again(entry)
        inputs, readings, options = arguments_of(entry["case"])
        assert not wrong or on_a_knife_edge(inputs, readings, **options), wrong


def test_every_number_counts_to_twelve_digits() -> None:
    layered = replace(RWG, ground=Ground((Layer(0.0, 1700.0, 0.6, 20.0),)))
    usual = key_of(case_of(layered, CORRECTED))
    deeper = replace(RWG, ground=Ground((Layer(0.1, 1700.0, 0.6, 20.0),)))
    others = [
        case_of(deeper, CORRECTED),
        case_of(replace(layered, v_0=layered.v_0 * (1.0 + 1e-9)), CORRECTED),
        case_of(layered, AS_PRINTED),
        case_of(layered, CORRECTED, elements=8),
        case_of(layered, CORRECTED, rtol=1e-9),
    ]
    assert len({usual, *map(key_of, others)}) == 6
    assert key_of(case_of(replace(layered, v_0=layered.v_0 * (1.0 + 1e-15)), CORRECTED)) == usual
    assert key_of(case_of(layered, CORRECTED, horizon=np.float64(0.5), elements=None)) == usual


def test_what_is_not_recorded_is_integrated_and_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(records, "integrated", [])
    monkeypatch.delenv(records.FOLDER, raising=False)
    monkeypatch.setattr(records, "is_current", lambda: True)
    monkeypatch.setattr(records, "_recorded", dict)
    for may_be_new in (True, False):
        found = recorded_impact(RWG, CORRECTED, horizon=0.02, may_be_new=may_be_new)
        assert found == summary_of(simulate(RWG, CORRECTED, horizon=0.02))
        assert len(records.integrated) == (not may_be_new)
    monkeypatch.setattr(records, "is_current", lambda: False)
    recorded_impact(RWG, CORRECTED, horizon=0.02)
    assert len(records.integrated) == 1


def test_any_source_that_simulates_makes_another_record(tmp_path: Path) -> None:
    for file in HERE.glob("*.py"):
        shutil.copy(file, tmp_path)
    assert records.source_hash(tmp_path) == records.source_hash()
    with (tmp_path / "test_soil.py").open("a") as tests:
        tests.write("# more\n")
    assert records.source_hash(tmp_path) == records.source_hash()
    with (tmp_path / "soil.py").open("a") as source:
        source.write("# more\n")
    assert records.source_hash(tmp_path) != records.source_hash()


def test_a_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    case = case_of(RWG, CORRECTED, elements=3, horizon=0.01)
    inputs, readings, options = arguments_of(case)
    found = summary_of(simulate(inputs, readings, **options))
    entry = {"case": case, "found": records.asdict(found)}
    for name in ("once.jsonl.gz", "again.jsonl.gz"):
        records.write([entry, entry], tmp_path / name)
    assert (tmp_path / "once.jsonl.gz").read_bytes() == (tmp_path / "again.jsonl.gz").read_bytes()
    header, entries = records.read(tmp_path / "once.jsonl.gz")
    assert header == records.versions()
    assert [records.summary_from(one["found"]) for one in entries] == [found]
    assert arguments_of(entries[0]["case"]) == (inputs, readings, options)


def test_the_command_runs_what_asks() -> None:
    assert HERE.parent / "kernels" / "test_whole_impacts.py" in records.askers()
