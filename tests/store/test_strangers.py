"""Folders that somebody else made or changed: nothing outside them is read, written or removed, and it is said why."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from io import BytesIO
from types import SimpleNamespace

import pyarrow.parquet as pq
import pytest

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.locations import location_of
from boulder_sweep.store import lock as locks
from boulder_sweep.store import read
from boulder_sweep.store.failures import DamagedError, FolderRemovedError, ImpossibleRecordsError, WriteError
from boulder_sweep.store.files import MANIFEST_NAME, hidden_name, is_ours, part_name, staged_name
from boulder_sweep.store.manifest import load
from boulder_sweep.store.reader import FinishedRows, finished_table
from boulder_sweep.store.storage import storage_of
from boulder_sweep.store.writer import stage
from tests.runner.grids import same_bits
from tests.store.folders import (
    ROWS,
    SIZE,
    commit,
    encoded_part,
    finished_folder,
    open_folder,
    part_bytes,
    part_record,
    rewrite_records,
)
from tests.store.object_stores import store
from tests.store.states import status

OTHER = {"settings": {"soil": 2}}
FIRST, SECOND = (part_name(first, first + SIZE, ROWS) for first in (0, SIZE))
TOKEN = "0123456789abcdef"


def names(out):
    return sorted(path.name for path in out.iterdir())


@pytest.fixture
def out(tmp_path):
    return finished_folder(tmp_path / "out")


@pytest.mark.parametrize(
    ("place", "error", "words"),
    [
        ("disk", DamagedError, r"is not what a worker wrote there \(missing"),
        ("object store", WriteError, "cannot write into faulty://bucket/out: file not found error"),
    ],
)
def test_what_a_worker_of_another_run_stages_is_never_published(tmp_path, place, error, words):
    with store():
        out = tmp_path / "out" if place == "disk" else location_of("faulty://bucket/out")
        killed = open_folder(out, identity=OTHER)
        killed._lock.release()
        folder = open_folder(out, overwrite=True)
        own = [folder.stage(encoded_part(first)) for first in (0, SIZE)]
        late = stage(storage_of(out), killed.token, ROWS, encoded_part(0, of=200))
        assert late.name == own[0].name == FIRST
        folder.commit(own)
        assert (out / FIRST).read_bytes() == part_bytes(0, SIZE)[0]
        with pytest.raises(error, match=words):
            folder.commit([late])  # nor if it were reported
        assert (out / FIRST).read_bytes() == part_bytes(0, SIZE)[0]
        folder.close("interrupted")
        found = out.names() if place == "object store" else names(out)
        assert not [name for name in found if name.endswith(".writing")]
        assert load(out).rows_done == 2 * SIZE


def test_what_was_staged_and_not_committed_is_computed_again(tmp_path):
    killed = open_folder(tmp_path / "out")
    commit(killed, 0)
    killed.stage(encoded_part(SIZE))
    killed._lock.release()
    folder = open_folder(tmp_path / "out", resume=True)
    assert folder.token != killed.token
    assert next(folder.manifest.missing()) == (SIZE, 2 * SIZE)
    assert names(tmp_path / "out") == ["_lock", MANIFEST_NAME, FIRST]
    folder.close("interrupted")


def test_a_staged_part_that_was_changed_is_not_published(tmp_path):
    folder = open_folder(tmp_path / "out")
    staged = folder.stage(encoded_part(0))
    temporary = tmp_path / "out" / staged_name(staged.name, folder.token, staged.part.sha256)
    changed = bytearray(temporary.read_bytes())
    changed[1000] ^= 1
    temporary.write_bytes(changed)
    with pytest.raises(
        DamagedError, match=r"not what a worker wrote there \(changed: .*Resume with: sweep run x\.yaml"
    ):
        folder.commit([staged])
    assert FIRST not in names(tmp_path / "out")
    folder.close("stopped")
    assert load(tmp_path / "out").rows_done == 0


def test_the_same_rows_staged_twice_with_other_bytes_do_not_disturb_each_other(tmp_path):
    """As by machines whose processors have other names."""
    folder = open_folder(tmp_path / "out")
    one, other = folder.stage(encoded_part(0)), folder.stage(encoded_part(0, of=200))
    assert folder.is_staged(one)
    assert folder.is_staged(other)
    folder.commit([one])
    assert (tmp_path / "out" / FIRST).read_bytes() == part_bytes(0, SIZE)[0]
    folder.close("interrupted")
    assert names(tmp_path / "out") == [MANIFEST_NAME, FIRST]


def test_a_lock_that_another_run_has_taken_keeps_parts_from_being_published(monkeypatch):
    with store():
        out = location_of("faulty://bucket/out")
        asleep = open_folder(out)
        staged = asleep.stage(encoded_part(0))
        monkeypatch.setattr(locks, "DEAD_AFTER_S", 0.0)
        other = open_folder(out, resume=True)
        with pytest.raises(BoulderSweepError, match="taken over by another run"):
            asleep.commit([staged])
        assert FIRST not in out.names()
        other.close("interrupted")


def test_a_run_does_not_lock_again_what_another_has_finished_meanwhile(monkeypatch):
    """It would publish its parts over those of the other before it noticed."""
    with store():
        out = location_of("faulty://bucket/out")
        asleep = open_folder(out, identity=OTHER)
        staged = asleep.stage(encoded_part(0))
        monkeypatch.setattr(locks, "DEAD_AFTER_S", 0.0)
        other = open_folder(out, overwrite=True)
        commit(other, 0)
        other.close("finished")
        with monkeypatch.context() as patch:
            ends = iter([False, True])
            patch.setattr(asleep._lock, "_released", SimpleNamespace(wait=lambda _: next(ends), is_set=lambda: False))
            asleep._lock._beat()
        before = (out / FIRST).read_bytes()
        with pytest.raises(FolderRemovedError):
            asleep.heartbeat()
        with pytest.raises(FolderRemovedError):
            asleep.commit([staged])
        assert (out / FIRST).read_bytes() == before
        assert "_lock" not in out.names()


def test_a_folder_removed_during_a_run_is_called_that(tmp_path):
    out = tmp_path / "out"
    folder = open_folder(out)
    staged = folder.stage(encoded_part(0))
    shutil.rmtree(out)
    for act in (lambda: folder.commit([staged]), lambda: folder.stage(encoded_part(0)), folder.check):
        with pytest.raises(FolderRemovedError, match=rf"{out} was removed, moved or replaced during the run") as told:
            act()
        assert told.value.exit_code == 2
        assert "\n" not in str(told.value)
    folder.close("stopped")
    assert not out.exists()


def test_the_heartbeat_notices_that_the_folder_was_removed(tmp_path):
    folder = open_folder(tmp_path / "out")
    shutil.rmtree(tmp_path / "out")
    folder.heartbeat()  # not due
    folder._lock._renewed = float("-inf")
    with pytest.raises(FolderRemovedError):
        folder.heartbeat()
    folder.close("stopped")


def test_a_folder_that_another_run_has_put_in_its_place_is_left_alone(tmp_path):
    out = tmp_path / "out"
    folder = open_folder(out)
    commit(folder, 0)
    out.rename(tmp_path / "moved")
    other = open_folder(out, identity=OTHER)
    commit(other, SIZE)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    with pytest.raises(FolderRemovedError):
        commit(folder, 200)
    folder.close("stopped")
    folder.discard()
    after = {path.name: path.read_bytes() for path in out.iterdir() if not path.name.endswith(".writing")}
    assert after == before
    other.close("interrupted")
    assert names(out) == [MANIFEST_NAME, SECOND]


def _merge(records, **change):
    """Announce a merge of two small parts that were the first."""
    record = records["parts"].pop(FIRST)
    small = {part_name(first, first + 50, ROWS): {**record, "first": first, "rows": 50} for first in (0, 50)}
    records["parts"] |= small
    records["merge"] = {"name": FIRST, "part": record, "replaced": [*small], **change}


def _renamed(name):
    return lambda records: records["parts"].update({name: records["parts"].pop(FIRST)})


def _part(**change):
    return lambda records: part_record(records).update(change)


def _deep(records):
    nested: dict = {}
    for _ in range(200):
        nested = {"a": nested}
    records["identity"]["settings"]["x"] = nested


HOSTILE = {
    "merge removes above": lambda records: _merge(records, replaced=["../victim"]),
    "merge removes anywhere": lambda records: _merge(records, replaced=["VICTIM"]),
    "merge removes the folder above": lambda records: _merge(records, replaced=[".."]),
    "merge removes nothing": lambda records: _merge(records, replaced=[]),
    "merge removes twice": lambda records: _merge(records, replaced=[part_name(0, 50, ROWS)] * 2),
    "merge removes a part of it": lambda records: _merge(records, replaced=[part_name(0, 50, ROWS)]),
    "merge removes others": lambda records: _merge(records, replaced=[SECOND]),
    "merge removes no names": lambda records: _merge(records, replaced=[["x"], 1]),
    "merge removes the manifest": lambda records: _merge(records, replaced=[MANIFEST_NAME]),
    "merged above": lambda records: _merge(records, name="../victim"),
    "merged anywhere": lambda records: _merge(records, name="VICTIM"),
    "merged into a part": lambda records: _merge(records, name=SECOND),
    "part above": _renamed("../victim"),
    "part anywhere": _renamed("VICTIM"),
    "part in a folder": _renamed(f"./{FIRST}"),
    "part with other digits": _renamed("rows-" + 12 * "\u0660" + "-000000000100.parquet"),
    "part with more digits": _renamed(f"rows-{0:013d}-{SIZE:013d}.parquet"),
    "part with more digits, by its first row": _renamed(f"rows-{0:013d}.parquet"),
    "part under another name": _renamed(part_name(0, SIZE - 1, ROWS)),
    "part that is no part": _renamed("_lock"),
    "part twice": lambda records: records["parts"].update({f"./{FIRST}": part_record(records)}),
    "part twice, with more digits": lambda records: records["parts"].update(
        {f"rows-{0:013d}-{SIZE:013d}.parquet": part_record(records)}
    ),
    "negative first": _part(first=-100),
    "first beyond the table": _part(first=10**6),
    "negative rows": _part(rows=-1),
    "no rows": _part(rows=0),
    "too many rows": _part(rows=ROWS + 1),
    "rows across two parts": _part(rows=150),
    "no bytes": _part(bytes=0),
    "counts that are no numbers": _part(verdicts={"pass": "many"}),
    "counts below nothing": _part(verdicts={"pass": -5}),
    "no size of parts": lambda records: records.update(rows_per_part=0),
    "negative table": lambda records: records.update(rows=-1),
    "endless table": lambda records: records.update(rows=10**30),
    "deep": _deep,
    "settings that are none": lambda records: records["identity"].update(settings=[1]),
    "inputs that are none": lambda records: records["identity"]["settings"].update(inputs=7),
    "model that is none": lambda records: records["identity"]["settings"].update(model="x"),
    "labels that are none": lambda records: records["identity"]["settings"].update(labels=3),
    "versions that are none": lambda records: records["identity"].update(versions="x"),
    "control characters": _renamed("\x1b]0;x\x07\n../victim"),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_an_impossible_manifest_is_refused_before_anything_is_touched(out, tmp_path, kind):
    victim = tmp_path / "victim"
    victim.write_bytes((out / FIRST).read_bytes())
    text = json.dumps  # absolute names are known here only

    def change(records):
        HOSTILE[kind](records)
        changed = json.loads(text(records).replace("VICTIM", str(victim)))
        records.clear()
        records.update(changed)

    rewrite_records(out, change)
    before = {path: path.read_bytes() for path in (*out.iterdir(), victim)}
    for act in (load, read, status, lambda folder: open_folder(folder, resume=True), open_folder, FinishedRows):
        with pytest.raises(ImpossibleRecordsError, match="holds what no sweep writes") as refused:
            act(out)
        assert refused.value.exit_code == 2
        assert str(refused.value).isprintable()
        assert len(str(refused.value)) < 1000
    assert {path: path.read_bytes() for path in (*out.iterdir(), victim)} == before
    open_folder(out, overwrite=True).close("interrupted")
    assert names(out) == [MANIFEST_NAME]
    assert victim.exists()


@pytest.mark.parametrize(
    "text", ["[" * 100_000, "[" * 900 + "]" * 900, '{"rows": 1' + "0" * 5000 + "}", "{", "\ud800", ""]
)
def test_records_that_cannot_be_parsed_are_refused(out, text):
    content = text.encode(errors="surrogatepass")
    schema = pq.read_schema(out / MANIFEST_NAME)
    value = hashlib.sha256(content).hexdigest().encode() + content
    pq.write_table(schema.with_metadata({b"boulder_sweep.manifest": value}).empty_table(), out / MANIFEST_NAME)
    with pytest.raises(ImpossibleRecordsError):
        load(out)


@pytest.mark.parametrize("record", ["sessions", "parts", "rows"])
def test_truth_is_no_number(out, record):
    def change(records):
        {"sessions": records["sessions"][0], "parts": part_record(records), "rows": records}[record].update(
            {"sessions": {"pid": True}, "parts": {"rows": True}, "rows": {"rows": True}}[record]
        )

    rewrite_records(out, change)
    with pytest.raises(BoulderSweepError, match=r"is True"):
        load(out)


def test_a_column_whose_name_is_no_text_is_refused(out):
    content = (out / MANIFEST_NAME).read_bytes()
    (out / MANIFEST_NAME).write_bytes(content.replace(b"margin", b"\xff\xfergin", 1))
    for act in (read, status):
        with pytest.raises(ImpossibleRecordsError, match="codec can't decode"):
            act(out)


def test_a_merge_that_a_killed_run_announced_is_still_finished(out):
    whole = finished_table(out)
    small = {first: part_bytes(first, 50)[0] for first in (0, 50)}
    for first, content in small.items():
        (out / part_name(first, first + 50, ROWS)).write_bytes(content)

    def announced(records):
        _merge(records)
        for record in records["parts"].values():
            if record["first"] in small and record["rows"] == 50:
                record.update(
                    bytes=len(small[record["first"]]), sha256=hashlib.sha256(small[record["first"]]).hexdigest()
                )
                record["verdicts"] = part_bytes(record["first"], 50)[1]

    rewrite_records(out, announced)
    (out / FIRST).rename(out / hidden_name(FIRST))
    open_folder(out, resume=True).close("interrupted")
    assert FIRST in names(out)
    assert same_bits(finished_table(out), whole)


def test_a_table_said_to_be_huge_is_looked_at_in_no_time(out):
    def huge(records):
        records.update(rows=2**62, rows_per_part=SIZE)
        records["parts"] = {
            part_name(0, SIZE, 2**62): part_record(records),
            part_name(200, 300, 2**62): {**part_record(records), "first": 200},
        }

    rewrite_records(out, huge)
    found = status(out)
    assert found.missing == [(0, 2**62)]  # neither file is there
    assert found.rows == 2**62


@pytest.mark.parametrize("content", [
    json.dumps({"host": os.uname().nodename, "pid": 10**30, "time": 0}),
    json.dumps({"host": os.uname().nodename, "pid": -(10**30), "time": 10**400}),
    '{"host": "x", "pid": 1, "time": NaN}', "[" * 100_000, "\xff", "null",
])  # fmt: skip
def test_a_lock_that_no_run_wrote_is_that_of_a_dead_run(content):
    with store():
        out = location_of("faulty://bucket/out")
        open_folder(out).close("stopped")
        (out / "_lock").put(content.encode("latin-1"))
        assert not status("faulty://bucket/out").running
        open_folder(out, resume=True).close("stopped")


@pytest.mark.parametrize("number", ["9" * 13, "9" * 5000, "-1", "x"])
def test_the_number_of_a_version_that_no_run_wrote_is_not_believed(number):
    with store():
        out = location_of("faulty://bucket/out")
        open_folder(out).close("stopped")
        path = out / MANIFEST_NAME
        schema = pq.read_schema(path.open("rb"))
        content = BytesIO()
        metadata = {**schema.metadata, b"boulder_sweep.generation": number.encode(), b"boulder_sweep.writer": b"\xff"}
        pq.write_table(schema.with_metadata(metadata).empty_table(), content)
        path.put(content.getvalue())
        open_folder(out, resume=True).close("stopped")
        assert all(is_ours(name) for name in out.names())


def test_damaged_parts_are_called_that_where_checksums_are_not_compared(out):
    path = out / SECOND
    content = path.read_bytes()
    footer = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    told = 0
    for place in range(footer, len(content), 211):
        changed = bytearray(content)
        changed[place] ^= 0xA0  # no ASCII any more
        path.write_bytes(changed)
        try:
            read(out, verify=False)
        except DamagedError:
            told += 1
    assert told > 20


def test_a_part_with_other_rows_than_recorded_is_damaged(out):
    pq.write_table(pq.read_table(out / SECOND).slice(1), out / SECOND)
    content = (out / SECOND).read_bytes()

    def change(records):
        records["parts"][SECOND].update(bytes=len(content), sha256=hashlib.sha256(content).hexdigest())

    rewrite_records(out, change)
    for verify in (True, False):
        with pytest.raises(DamagedError, match="other rows or columns than recorded"):
            read(out, verify=verify)
