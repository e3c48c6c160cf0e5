"""Commands on tables that earlier versions wrote: all but `run --resume` take them, and say whose rules judged."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import matplotlib.figure
import pyarrow.parquet as pq
import pytest

from boulder_sweep.store.manifest import load
from boulder_sweep.store.provenance import judged_by
from tests.store.test_formats import DATA, KEPT, LACKING


@pytest.fixture(params=[pytest.param(name, marks=[pytest.mark.nightly] * (name[0] not in "15")) for name in KEPT])
def old(request, tmp_path, monkeypatch):
    """Work beside a folder that some version wrote."""
    monkeypatch.chdir(tmp_path)
    return shutil.copytree(DATA / request.param, request.param)


def note_on(old: str) -> str:
    lacking = f"; it has no {', '.join(LACKING[old])} (null here)" if old in LACKING else ""
    return f"note: {old} was {judged_by(load(Path(old)).identity)}{lacking}\n"


def test_an_old_table_is_drawn_exported_and_reported(sweep, old, monkeypatch):
    captions = []
    monkeypatch.setattr(matplotlib.figure.Figure, "supxlabel", lambda self, text, **_: captions.append(text))
    judged = judged_by(load(Path(old)).identity)
    assert sweep("plot", old, "-o", "map.svg") == (0, "map.svg: 18 of 18 designs\n", note_on(old))
    assert " ".join(captions[0].split()).endswith(f"J{judged[1:]}.")
    assert ("what the model was tested on" in " ".join(captions[0].split())) == ("validity" not in LACKING.get(old, []))
    assert sweep("export", old, "-o", "t.csv") == (0, "t.csv: 18 rows\n", note_on(old))
    with Path("t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["judged_by"] for row in rows} == {judged}
    lacks = "time_to_limit_error_s" in LACKING.get(old, [])
    assert {row["time_to_limit_error_s"] == "" for row in rows} == ({True} if lacks else {True, False})
    assert sweep("export", old, "-o", "t.parquet", "--units", "us")[0] == 0
    table = pq.read_table("t.parquet")
    assert set(table.column("judged_by").to_pylist()) == {judged}
    assert f"verdicts\t{judged}\t".encode() in table.schema.metadata[b"about"]
    code, _, err = sweep("report", old, "-o", "page.html")
    assert (code, err) == (0, note_on(old))
    page = Path("page.html").read_text()
    assert f"The verdicts of the table were {judged}." in page
    unflagged = "The table does not say which of those that pass lie outside" in page
    assert unflagged == ("validity" in LACKING.get(old, []))


def test_the_state_of_an_old_table_says_whose_rules_judged(sweep, old):
    judged = judged_by(load(Path(old)).identity)
    code, out, err = sweep("status", old)
    assert (code, err) == (0, "")
    assert f"\nrules    {judged}\n" in out
    assert json.loads(sweep("status", old, "--json")[1])["judged_by"] == judged


def test_only_resuming_an_old_table_is_refused(sweep, old):
    Path("grid.yaml").write_text(GRID)
    before = {path.name: path.read_bytes() for path in Path(old).iterdir()}
    code, out, err = sweep("run", "grid.yaml", "-o", old, "--resume", "-q")
    assert (code, out) == (4, "")
    assert "another version" in err
    assert "--overwrite" in err
    assert {path.name: path.read_bytes() for path in Path(old).iterdir()} == before


GRID = """\
name: kept
boulder: {length: 1.65 m, width: 1.68 m, height: [1.0, 3.0, 3.4] m, density: 2600 kg/m^3}
site: {embedment_ratio: [0.3, 0.6, 0.75]}
soil: {density: 1860 kg/m^3, friction_angle: [36, 42] deg, subgrade_reaction: 63 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


def test_an_old_table_beside_one_of_today(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    old = shutil.copytree(DATA / KEPT[0], KEPT[0])
    Path("grid.yaml").write_text(GRID)
    assert sweep("run", "grid.yaml", "-o", "new.sweep", "-q")[0] == 0
    judged = judged_by(load(Path(old)).identity)
    code, out, err = sweep("compare", old, "new.sweep")
    assert (code, err) == (0, note_on(old))
    assert out.startswith(f"rules    {old}: {judged}\nrules    new.sweep: judged by the rules of this version\n")
    assert "18 designs in both" in out
    found = json.loads(sweep("compare", "new.sweep", old, "--json")[1])
    assert found["judged_by"] == ["", judged]
    code, out, err = sweep("compare", "new.sweep", "new.sweep")
    assert (code, err) == (0, "")
    assert "rules" not in out
    for words in (["plot"], ["export", "-o", "t.csv"], ["report"], ["status"]):
        code, out, err = sweep(words[0], "new.sweep", *words[1:])
        assert (code, err) == (0, "")
        assert "judged" not in out
    assert "judged" not in Path("t.csv").read_text()
    assert "The verdicts of the table were" not in Path("new.html").read_text()


def test_a_row_of_an_old_table_is_explained_as_far_as_it_can_be(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for old in (KEPT[0], "5_validity.sweep"):
        shutil.copytree(DATA / old, old)
        judged = judged_by(load(Path(old)).identity)
        code, out, err = sweep("explain", old, "9")
        assert (code, err) == (0, note_on(old))
        assert f"as stored, the row was {judged}\n" in out
        assert "changed since: rules_sha256: " in out
        assert "differs now: overlap_m" not in out
        found = json.loads(sweep("explain", old, "9", "--json")[1])
        assert found["judged_by"] == judged
