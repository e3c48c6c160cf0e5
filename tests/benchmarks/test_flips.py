"""Frozen verdicts: the same designs every time, every change counted, and on which side."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from benchmarks import flips
from benchmarks.flips import CASES, CONFIGS, RANGES, Case, compared, drawn, is_at_edge, is_held, recorded, report

STANDS = ("pass", "", "robust", "paper;broms", 12.0)
LEANS = ("pass", "", "sensitive", "paper", 12.0)
UNASKED = ("pass", "", "open", "", 12.0)
FALLS = ("fail", "overturns", "", "", 20.0)
NEARLY = ("pass", "", "open", "", 19.9995)
DOUBTED = ("undecided", "error", "", "", 12.0)
LATE = ("undecided", "horizon", "", "", 12.0)
REFUSED = ("error", "hood is lower than the bumper", "", "", None)


def turned(row, by_deg):
    return (*row[:4], row[4] + by_deg)


def rows(*given, at_edge=False, error_deg=1e-6):
    frame = pd.DataFrame([row[:4] for row in given], columns=flips.SETTLED_BY)
    units = [None if row[4] is None else round(row[4] / flips.DEGREES_PER_UNIT) for row in given]
    frame["max_rotation"] = pd.array(units, dtype="Int32")
    return frame.assign(row=np.arange(len(frame)), at_edge=at_edge, error_deg=error_deg)


@pytest.mark.parametrize(
    ("before", "now", "at_edge", "counts"),
    [
        (STANDS, STANDS, False, {}),
        (REFUSED, REFUSED, False, {}),
        (STANDS, turned(STANDS, 9e-4), False, {}),
        (STANDS, turned(STANDS, 1e-3), False, {"rotations": 1}),
        (STANDS, turned(STANDS, -1e-3), True, {"rotations": 1}),
        (FALLS, (*FALLS[:4], None), False, {"rotations": 1}),
        (STANDS, FALLS, False, {"verdicts": 1, "rotations": 1}),
        (FALLS, STANDS, False, {"verdicts": 1, "rotations": 1, "unsafe": 1}),
        (DOUBTED, UNASKED, False, {"verdicts": 1, "unsafe": 1}),
        (UNASKED, DOUBTED, False, {"verdicts": 1}),
        (DOUBTED, LATE, False, {"reasons": 1}),
        (LEANS, STANDS, False, {"grades": 1, "unsafe": 1}),
        (LEANS, UNASKED, False, {"grades": 1, "unsafe": 1}),
        (UNASKED, STANDS, False, {"grades": 1, "unsafe": 1}),
        (STANDS, LEANS, False, {"grades": 1}),
        (STANDS, (*STANDS[:3], "paper", 12.0), False, {"grades": 1}),
        (DOUBTED, UNASKED, True, {"rounded": 1}),
        (DOUBTED, LATE, True, {"rounded": 1}),
        (NEARLY, FALLS, True, {"rounded": 1}),
        (FALLS, STANDS, True, {"verdicts": 1, "rotations": 1, "unsafe": 1}),
        (LEANS, STANDS, True, {"grades": 1, "unsafe": 1}),
    ],
)
def test_a_change_is_counted_for_what_it_is(before, now, at_edge, counts):
    changes = compared("one", rows(UNASKED, before, at_edge=at_edge), rows(UNASKED, now))
    none = dict.fromkeys(("verdicts", "reasons", "grades", "unsafe", "rotations", "unsettled", "rounded"), 0)
    assert {name: getattr(changes, name) for name in none} == none | counts
    assert is_held([changes]) is not bool(counts.keys() - {"rounded"})
    assert list(changes.flips["row"]) == ([1] if counts.keys() - {"rotations"} else [])


def test_rounding_excuses_one_design_or_one_in_ten_thousand():
    def rounded(some, of):
        return compared("", rows(*[DOUBTED] * of), rows(*[UNASKED] * some, *[DOUBTED] * (of - some), at_edge=True))

    assert is_held([rounded(1, 5), rounded(0, 5)])
    assert not is_held([rounded(1, 5), rounded(1, 5)])
    assert is_held([rounded(2, 20_000)])
    assert not is_held([rounded(3, 20_000)])


def test_a_rotation_may_move_within_its_error_in_one_design_of_a_thousand():
    def moved(by_deg, error_deg, of):
        now = rows(turned(STANDS, by_deg), *[STANDS] * (of - 1), error_deg=error_deg)
        return compared("", rows(*[STANDS] * of), now)

    assert (moved(0.05, 0.06, 1000).rotations, moved(0.05, 0.06, 1000).unsettled) == (0, 1)
    assert is_held([moved(0.05, 0.06, 1000)])
    assert not is_held([moved(0.05, 0.06, 999)])
    assert not is_held([moved(0.05, 0.04, 1000)])
    assert not is_held([moved(0.05, np.nan, 1000)])


def test_some_rows_are_compared_with_theirs():
    record = rows(STANDS, LEANS, UNASKED, FALLS, DOUBTED)
    some = record.iloc[::2]
    assert is_held([compared("some", record, some)])
    other = record.assign(row=record["row"] + 1).iloc[::2]
    with pytest.raises(ValueError, match="design 5 is not among the 5 of the record"):
        compared("some", record, other)


def test_unsafe_changes_are_named_first():
    words = report([compared("one", rows(FALLS, UNASKED), rows(UNASKED, DOUBTED))])
    unsafe, others = words.split("other changes")
    assert "one, row 0: fail, overturns -> pass, open, 20.0000 -> 12.0000 deg" in unsafe
    assert "one, row 1: pass, open -> undecided, error" in others


@pytest.mark.parametrize(
    ("rotation", "error", "penetration", "displacement_error", "crush", "is_near"),
    [
        (12.0, 0.1, -1.0, 0.01, 0.5, False),
        (19.9995, 0.1, -1.0, 0.01, 0.5, True),
        (19.9, 0.1, -1.0, 0.01, 0.5, True),
        (19.9, 0.11, -1.0, 0.01, 0.5, False),
        (20.0, np.nan, -1.0, 0.01, 0.5, False),
        (20.000000000000004, np.nan, -1.0, 0.01, 0.5, False),
        (20.0, np.inf, -1.0, 0.01, 0.5, False),
        (12.0, 0.1, 0.999995, 0.001, 0.5, True),
        (12.0, 0.1, 0.98, 0.02, 0.5, True),
        (12.0, 0.1, -1.0, 0.01, 2.899995, True),
        (12.0, np.inf, -1.0, np.inf, 0.5, False),
        (np.nan, np.nan, np.nan, np.nan, np.nan, False),
    ],
)
def test_an_edge_is_within_rounding_of_a_limit(rotation, error, penetration, displacement_error, crush, is_near):
    sweep = SimpleNamespace(criterion=SimpleNamespace(max_rotation_deg=20.0, rating="P1"))
    row = {
        "max_rotation_deg": rotation,
        "rotation_error_deg": error,
        "penetration_m": penetration,
        "displacement_error_m": displacement_error,
        "vehicle_crush_m": crush,
        "bed_offset_m": 2.9,
    }
    assert is_at_edge(pd.DataFrame([row]), sweep).tolist() == [is_near]


@pytest.mark.parametrize("name", ["corrected, balanced", "shallow", "profile"])
def test_the_same_designs_every_time_and_every_tenth_of_them(name):
    case = CASES[name]
    whole = drawn(name, case)
    assert len(whole) == case.designs
    pd.testing.assert_frame_equal(whole, drawn(name, case))
    pd.testing.assert_frame_equal(whole.iloc[::10], drawn(name, case, 10))
    for column, values in whole.items():
        low, high = case.ranges.get(column, RANGES[column])
        assert low <= values.min() < values.max() <= high
    assert ("boulder_width_m" in whole) is (name != "profile")


def test_the_record_holds_every_case_whole():
    record = recorded(flips.RECORD)
    assert record.keys() == {*CASES, *(f"configs/{name}.yaml" for name in CONFIGS)}
    assert {name: len(record[name]) for name in CASES} == {name: case.designs for name, case in CASES.items()}


@pytest.fixture
def small(monkeypatch, tmp_path):
    """Two small cases in place of all, and what runs the command on them with a record of their own."""
    small = {"boxes": Case(40), "low": Case(20, ranges=flips.LOW)}
    monkeypatch.setattr(flips, "CASES", small)
    monkeypatch.setattr(flips, "CONFIGS", ("rwg",))
    file = tmp_path / "record.parquet"

    def command(*options):
        monkeypatch.setattr("sys.argv", ["flips", "--file", str(file), *options])
        return flips.main()

    return SimpleNamespace(command=command, file=file)


def test_the_record_of_now_holds_and_another_does_not(small, capsys):
    assert small.command("--record") == 0
    assert small.command("--tenth") == 0
    assert small.command() == 0
    assert capsys.readouterr().out.split()[-1] == "0"
    found = {case: frame.assign(row=frame.index) for case, frame in recorded(small.file).items()}
    last = found["boxes"].index[-1]
    found["boxes"].loc[last, ["verdict", "reason"]] = ["undecided", "horizon"]
    flips.write(found, small.file)
    assert small.command("--tenth") == 0  # the last design is not among every tenth
    assert small.command() == 1
    assert "boxes, row 39: undecided, horizon ->" in capsys.readouterr().out


def test_a_record_of_other_cases_is_refused(small, capsys):
    flips.write({"boxes": rows(STANDS)}, small.file)
    with pytest.raises(SystemExit):
        small.command()
    assert "holds other cases (['configs/rwg.yaml', 'low']): freeze it with --record" in capsys.readouterr().err
