"""Tables of every version so far, kept as those versions wrote them: read for good, gone on with by their own only.

A folder of tests/store/data was written by `sweep run` while its format was that of the project; docs/formats.md says
what was new in each. The oldest comes first.
"""

from __future__ import annotations

import hashlib
import shutil
import warnings
from collections import Counter
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.columns import COLUMNS, INPUT_COLUMNS
from boulder_sweep.errors import OlderRulesWarning
from boulder_sweep.store import status
from boulder_sweep.store.failures import DamagedError, OtherVersionError, SettingsDifferError
from boulder_sweep.store.files import MANIFEST_NAME, part_name
from boulder_sweep.store.manifest import load
from boulder_sweep.store.provenance import judged_by
from boulder_sweep.store.reader import FinishedRows, read, read_row
from boulder_sweep.store.schema import encode, table_schema
from tests.store.folders import IDENTITY, ROWS, finished_folder, open_folder, part_record, rewrite_records

DATA = Path(__file__).with_name("data")
KEPT = sorted(path.name for path in DATA.glob("*.sweep"))
GRADES = ["robustness", "stands_under"]
FIRST = ["time_to_limit_error_s", "vehicle_crush_m", "overlap_m", "solidity", "validity", *GRADES, "step_s"]
LACKING = {
    "1_one_number.sweep": FIRST,
    "2_merging.sweep": FIRST,
    "3_release_0_1.sweep": FIRST,
    "4_named_sets.sweep": FIRST,
    "5_validity.sweep": ["time_to_limit_error_s", "solidity", *GRADES],
}
MORE = {
    "4_named_sets.sweep": ["soil"],
    "5_validity.sweep": ["soil"],
}
NAMES = [spec.name for spec in COLUMNS]


@pytest.fixture(params=KEPT)
def kept(request, tmp_path):
    """Return a copy of a folder that some version wrote."""
    return Path(shutil.copytree(DATA / request.param, tmp_path / request.param))


def test_every_version_is_read(kept):
    lacking = LACKING.get(kept.name, [])
    with pytest.warns(OlderRulesWarning) as told:
        table = boulder_sweep.read(kept)
    assert list(table) == NAMES + MORE.get(kept.name, [])
    assert table.design_id.tolist() == list(range(18))
    assert list(table.columns[table.isna().all()]) == lacking
    assert table[["verdict", *INPUT_COLUMNS]].notna().all(axis=None)
    counts = Counter(f"{row.verdict}/{row.reason}".removesuffix("/") for row in table.itertuples())
    recorded = Counter(load(kept).verdicts)
    recorded["pass"] = sum(recorded.pop(key) for key in list(recorded) if key.split("/")[0] == "pass")
    assert counts == recorded
    assert table.attrs["judged_by"].startswith("judged by the rules of version 0.1.0 (rules ")
    assert f"{kept} was {table.attrs['judged_by']}" in str(told[0].message)
    assert (f"it has no {', '.join(lacking)} (null here)" in str(told[0].message)) == bool(lacking)


@pytest.mark.filterwarnings("ignore::boulder_sweep.errors.OlderRulesWarning")
def test_columns_of_every_version_keep_their_order_types_and_single_rows(kept):
    wanted = ["validity", "design_id", "overlap_m", "verdict", "time_to_limit_error_s"]
    some = read(kept, wanted)
    assert list(some) == wanted
    assert str(some.dtypes["validity"]) == "category"
    assert some.overlap_m.dtype.kind == "f"
    row = read_row(kept, 17)
    assert row.column_names == NAMES + MORE.get(kept.name, [])
    types = {field.name: field.type for field in table_schema()}
    assert {name: row.schema.field(name).type for name in FIRST} == {name: types[name] for name in FIRST}
    verdict = str(read(kept).verdict[17])
    assert row.to_pylist()[0]["verdict"] == verdict


def test_the_state_of_every_version_is_told(kept):
    found = status(kept, verify=True)
    assert (found.complete, found.damaged) == (True, {})
    assert found.judged_by == judged_by(load(kept).identity) != ""


def test_no_run_goes_on_with_another_version_and_overwrite_begins_again(kept):
    before = {path.name: path.read_bytes() for path in kept.iterdir()}
    identity, rows = load(kept).identity, load(kept).rows
    refusal = OtherVersionError if kept.name in LACKING else SettingsDifferError
    with pytest.raises(refusal, match=r"another version"):
        open_folder(kept, resume=True)
    if refusal is OtherVersionError:  # nor with the very same settings and rules, if ever they are
        with pytest.raises(OtherVersionError, match=rf"lacks .*{LACKING[kept.name][0]}"):
            open_folder(kept, identity=identity, rows=rows, resume=True)
    assert {path.name: path.read_bytes() for path in kept.iterdir()} == before
    open_folder(kept, overwrite=True).close("stopped")
    assert not [path.name for path in kept.iterdir() if path.name in before and path.name != MANIFEST_NAME]


@pytest.mark.parametrize("name", KEPT)
def test_damage_of_an_old_part_is_still_found(name, tmp_path):
    out = Path(shutil.copytree(DATA / name, tmp_path / name))
    (part,) = out.glob("rows-*")
    content = bytearray(part.read_bytes())
    content[len(content) // 2] ^= 1
    part.write_bytes(content)
    with pytest.warns(OlderRulesWarning), pytest.raises(DamagedError, match="its checksum differs"):
        read(out)
    assert status(out, verify=True).damaged


def test_nothing_is_said_of_a_table_of_this_version(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = read(finished_folder(tmp_path / "out"))
    assert (len(table), table.attrs["judged_by"]) == (ROWS, "")


@pytest.mark.parametrize("name", ["rules_sha256", "kernels_sha256"])
def test_other_rules_or_kernels_are_told(tmp_path, name):
    out = finished_folder(tmp_path / "out")
    rewrite_records(out, lambda records: records["identity"].update({name: "abcdef012345", "versions": {}}))
    words = rf"judged by the rules of version unknown \(.*{name[:-7]} abcdef01\W"
    with pytest.warns(OlderRulesWarning, match=words):
        read(out)


def test_who_wrote_no_hash_is_not_of_this_version():
    assert judged_by({}) == "judged by the rules of version unknown (rules unknown, kernels unknown)"
    assert judged_by(IDENTITY) == ""
    long = judged_by({"rules_sha256": "\x1b[2J" * 99, "versions": {"boulder-sweep": "9\n" * 10**6}})
    assert long.isprintable()
    assert len(long) < 200


def with_colour(out: Path, *, also_in_manifest: bool = True) -> None:
    """Give a table one more column, as a later version may."""
    (part,) = out.glob("rows-*")
    table = pq.read_table(part)
    table = table.append_column("colour", pa.array(["red"] * len(table)))
    part.write_bytes(encode(table))
    content = part.read_bytes()
    sums = {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    if also_in_manifest:
        manifest = pq.read_schema(out / MANIFEST_NAME)
        pq.write_table(manifest.append(pa.field("colour", pa.string())).empty_table(), out / MANIFEST_NAME)
    rewrite_records(out, lambda records: part_record(records).update(sums))


@pytest.mark.parametrize("columns", [None, ["colour", "verdict"]])
def test_columns_of_a_later_version_are_kept(tmp_path, columns):
    out = Path(shutil.copytree(DATA / KEPT[-1], tmp_path / "out"))
    with_colour(out)
    with pytest.warns(OlderRulesWarning, match=r"it has more columns, kept as they are: colour$"):
        table = read(out, columns)
    assert list(table) == (columns or [*NAMES, "soil", "colour"])
    assert set(table.colour) == {"red"}
    with pytest.raises(OtherVersionError, match="its table also has colour"):
        open_folder(out, resume=True)


@pytest.mark.filterwarnings("ignore::boulder_sweep.errors.OlderRulesWarning")
def test_a_part_that_contradicts_the_manifest_is_damaged(tmp_path):
    out = Path(shutil.copytree(DATA / KEPT[-1], tmp_path / "out"))
    with_colour(out, also_in_manifest=False)
    for columns in (None, ["verdict"]):
        with pytest.raises(DamagedError, match="its columns are not those of the manifest"):
            read(out, columns)


@pytest.mark.filterwarnings("ignore::boulder_sweep.errors.OlderRulesWarning")
def test_a_table_without_rows_has_its_columns(tmp_path):
    out = Path(shutil.copytree(DATA / "4_named_sets.sweep", tmp_path / "out"))
    rewrite_records(out, lambda records: records.update(parts={}))
    assert list(read(out)) == [*NAMES, "soil"]
    assert list(read(out, ["soil", "overlap_m"])) == ["soil", "overlap_m"]
    assert FinishedRows(out).lacking == set(FIRST)


def test_the_first_part_names_are_known():
    (name,) = (path.name for path in (DATA / KEPT[0]).glob("rows-*"))
    assert name == "rows-000000000000.parquet" != part_name(0, 18, 18)
