"""The soak finds what it looks for, and its plans are the same for the same seed.

The whole of it takes a quarter of an hour: ``python -m benchmarks.soak``.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.soak.__main__ import table
from benchmarks.soak.store_server import BUCKET, Holding
from benchmarks.soak.trials import Found, Reference, Tally, plan
from tests.faults.processes import ROOT
from tests.waiting import HANG_GUARD_S

ROWS = 60
SEED = 5


def right() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "design_id": np.arange(ROWS),
            "margin": np.where(np.arange(ROWS) % 7 == 0, np.nan, np.linspace(-0.5, 0.5, ROWS)),
            "verdict": pd.Categorical(np.where(np.arange(ROWS) % 2, "pass", "fail")),
            "label": [f"site {n // 10}" for n in range(ROWS)],
        }
    )


def lose(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.drop(index=17)


def double(frame: pd.DataFrame) -> pd.DataFrame:
    return pd.concat([frame, frame.iloc[[3, 4]]], ignore_index=True)


def shuffle(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.sample(frac=1.0, random_state=1)


def change(column: str, value: Any) -> Any:
    def changed(frame: pd.DataFrame) -> pd.DataFrame:
        frame = frame.astype({"verdict": object})
        frame.loc[11, column] = value
        return frame.astype({"verdict": "category"})

    return changed


@pytest.mark.parametrize(
    ("doctor", "expected"),
    [
        (lambda frame: frame, Tally(0, 0, 0)),
        (shuffle, Tally(0, 0, 0)),
        (lose, Tally(1, 0, 0)),
        (double, Tally(0, 2, 0)),
        (change("margin", np.nextafter(right()["margin"][11], 1.0)), Tally(0, 0, 1)),
        (change("margin", np.nan), Tally(0, 0, 1)),
        (change("verdict", "fail"), Tally(0, 0, 1)),
        (change("verdict", "undecided"), Tally(0, 0, 1)),
        (change("verdict", None), Tally(0, 0, 1)),
        (change("label", "another"), Tally(0, 0, 1)),
        (change("design_id", ROWS), Tally(1, 0, 1)),
        (change("design_id", -1), Tally(1, 0, 1)),
        (change("design_id", 12), Tally(1, 1, 1)),
        (lambda frame: frame.drop(columns="label"), Tally(0, 0, ROWS)),
        (lambda frame: frame.astype({"margin": "float32"}), Tally(0, 0, ROWS)),
        (lambda frame: double(lose(frame)), Tally(1, 2, 0)),
    ],
)
def test_lost_doubled_and_wrong_rows_are_counted(doctor, expected):
    assert Reference(right()).tally(doctor(right())) == expected


def test_an_unfinished_table_has_lost_only_what_was_seen_before():
    part, seen = right().iloc[:20], np.zeros(ROWS, dtype=bool)
    reference = Reference(right())
    seen[:20] = True
    assert reference.tally(part, wanted=seen) == Tally(0, 0, 0)
    seen[20:23] = True
    assert reference.tally(part, wanted=seen) == Tally(3, 0, 0)


def test_minus_zero_is_not_zero():
    whole = right().assign(margin=0.0)
    assert Reference(whole).tally(whole.assign(margin=-0.0)).wrong == ROWS


def test_the_same_seed_plans_the_same():
    def plans(seed: int) -> list[Any]:
        return [plan(seed, kind, number) for kind in ("disk", "store") for number in range(50)]

    assert plans(SEED) == plans(SEED)
    assert plans(SEED) != plans(SEED + 1)
    aims = [aim for aims in plans(SEED) for aim in aims]
    assert {aim.signal for aim in aims} == {signal.SIGKILL, signal.SIGTERM}
    assert {aim.by_time for aim in aims} == {True, False}
    assert all(0.0 <= aim.share <= 1.0 for aim in aims)


@pytest.mark.parametrize(("when", "carried_out"), [("before", 2), ("after", 3)])
def test_the_store_holds_one_write_until_the_writer_is_dead(when, carried_out):
    done, told = [], []

    def app(environ, start_response):
        done.append(environ["PATH_INFO"])
        return [b"done"]

    def tell(line):
        told.append((line, len(done)))
        holding.obey("go out")  # before it waits for that

    holding = Holding(app, tell)
    holding.obey(f"watch out 3 {when}")
    refused = []
    for number in range(3):
        holding({"REQUEST_METHOD": "GET", "PATH_INFO": f"/{BUCKET}/out/part"}, refused.append)
        holding({"REQUEST_METHOD": "PUT", "PATH_INFO": f"/{BUCKET}/other/{number}"}, refused.append)
        holding({"REQUEST_METHOD": "PUT", "PATH_INFO": f"/{BUCKET}/out/{number}"}, lambda *words: refused.append(words))
    assert sum(path.startswith(f"/{BUCKET}/out/") and path != f"/{BUCKET}/out/part" for path in done) == carried_out
    assert [line for line, _ in told] == ["reached out"]
    assert len(refused) == (when == "before")


def test_whatever_is_wrong_shows_in_the_table():
    assert Found("disk", disturbed=3, tables=2).right
    for name in ("lost", "doubled", "wrong", "hangs"):
        assert not Found("disk", **{name: 1}).right
    assert not Found("disk", failures=["exit code 1"]).right
    (cells,) = table(
        [Found("disk", 3, 2, halfway=1, lost=4, doubled=5, wrong=6, hangs=7, failures=["one"])], SEED, 1.0
    ).rows
    assert cells[1:-1] == ["3", "2", "4", "5", "6", "7", "1"]


@pytest.mark.faults
@pytest.mark.nightly  # real processes
def test_one_kill():
    others = [word for kind in ("store", "lost", "stopped", "left-over") for word in (f"--{kind}", "0")]
    command = [sys.executable, "-m", "benchmarks.soak", "--disk", "1", *others]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=HANG_GUARD_S)  # hang guard
    assert done.returncode == 0, done.stderr[-3000:]
    (row,) = (line for line in done.stdout.splitlines() if line.startswith("| runs killed"))
    assert row.split(" | ")[3:8] == ["0"] * 5
