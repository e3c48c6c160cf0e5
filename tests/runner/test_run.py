"""A whole run: the same table whatever the workers, open to every reader, resumed or replaced as asked for."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest

from boulder_sweep.columns import COLUMNS
from boulder_sweep.runner.run import run
from boulder_sweep.store import folder, read
from boulder_sweep.store.failures import ForeignFilesError, OutputExistsError, SettingsDifferError, StoreError
from boulder_sweep.store.provenance import canonical, sha256_of
from boulder_sweep.store.reading import finished_table
from tests.runner.grids import grid, grid_of, partly_impossible, plausible, same_bits
from tests.store.folders import nothing_left, rows_done

ROOT = Path(__file__).parents[2]


def part_files(out: Path) -> dict[str, bytes]:
    """Names and bytes of the parts."""
    return {path.name: path.read_bytes() for path in sorted(out.glob("rows-*.parquet"))}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished table of 441 real designs in four parts."""
    out = tmp_path_factory.mktemp("finished") / "out"
    summary = run(grid(), out, jobs=2)
    return out, summary


def test_summary(finished):
    out, summary = finished
    assert summary.rows == summary.rows_computed == 441
    assert summary.parts == 4
    assert sum(summary.verdicts.values()) == 441
    assert summary.verdicts["pass"] > 20
    assert summary.verdicts["fail"] > 20
    assert summary.exit_code == 0
    assert replace(summary, rows_computed=30, seconds=0.5).rows_per_second == 60.0
    assert summary.bytes == sum(len(content) for content in part_files(out).values())
    json.dumps(summary.to_dict())


def test_pandas_duckdb_and_polars_open_it_as_one_table_in_design_order(finished):
    out, _ = finished
    expected = np.arange(441)
    frame = pd.read_parquet(out)
    assert list(frame.columns) == [spec.name for spec in COLUMNS]
    assert np.array_equal(frame["design_id"], expected)
    assert np.array_equal(pl.read_parquet(out)["design_id"], expected)
    assert np.array_equal(pl.read_parquet(f"{out}/*.parquet")["design_id"], expected)
    found = duckdb.sql(f"select design_id from read_parquet('{out}/*.parquet')").fetchnumpy()["design_id"]
    assert np.array_equal(found, expected)
    counts = duckdb.sql(f"select verdict, count(*) from '{out}/*.parquet' group by 1").fetchall()
    assert dict(counts) == frame["verdict"].value_counts().loc[lambda n: n > 0].to_dict()


def test_units_and_meanings_are_in_the_fields_and_in_what_pandas_reads(finished):
    out, _ = finished
    schema = pq.read_schema(next(out.glob("rows-*.parquet")))
    for spec in COLUMNS:
        metadata = schema.field(spec.name).metadata
        assert metadata[b"unit"].decode() == spec.unit
        assert metadata[b"meaning"].decode() == spec.meaning
    units = {spec.name: spec.unit for spec in COLUMNS}
    assert pd.read_parquet(out).attrs["units"] == units
    assert read(out).attrs["units"] == units
    assert read(out).attrs["complete"] is True


def test_every_part_says_what_it_was_computed_from(finished):
    out, _ = finished
    sweep = grid()
    for path in out.glob("rows-*.parquet"):
        metadata = pq.read_metadata(path).metadata
        settings = json.loads(metadata[b"boulder_sweep.settings"])
        assert canonical(settings) == canonical(sweep.resolved())
        assert metadata[b"boulder_sweep.settings_sha256"].decode() == sha256_of(sweep.resolved())
        assert len(metadata[b"boulder_sweep.kernels_sha256"]) == 64
        assert json.loads(metadata[b"boulder_sweep.readings"])["inertia_box"] is True
        assert json.loads(metadata[b"boulder_sweep.versions"])["numba"]
        assert json.loads(metadata[b"boulder_sweep.rows"]) == 441
        said = b"".join(metadata.values())
        assert not any(name.encode() in said for name in (str(out), "test.yaml"))


@pytest.mark.parametrize(
    "how",
    [
        {"jobs": 1},
        {"jobs": 5},
        {"jobs": 2, "backend": "dask"},
    ],
    ids=["one", "five", "dask"],
)
def test_workers_change_no_byte(finished, tmp_path, how):
    run(grid(), tmp_path / "out", **how)
    assert part_files(tmp_path / "out") == part_files(finished[0])


def test_the_size_of_parts_changes_no_bit(finished, tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "FEWEST_ROWS", 1)
    monkeypatch.setattr("boulder_sweep.runner.ranges.WORK_S", 1e-6)
    run(grid(), tmp_path / "out")
    assert len(part_files(tmp_path / "out")) == 440
    assert same_bits(finished_table(tmp_path / "out"), finished_table(finished[0]))


def test_impossible_rows_are_errors_with_a_reason_and_exit_3(tmp_path):
    sweep = partly_impossible()
    summary = run(sweep, tmp_path / "out")
    frame = read(tmp_path / "out")
    impossible = frame["embedment_depth_m"] >= frame["boulder_height_m"]
    assert 0 < impossible.sum() == summary.errors
    assert summary.exit_code == 3
    errors = frame[frame["verdict"] == "error"]
    assert errors["reason"].str.contains("height").all()
    assert errors["max_rotation_deg"].isna().all()
    assert np.array_equal(frame["design_id"], np.arange(sweep.n_designs))


def test_dictionaries_that_differ_between_parts_are_one_table(tmp_path):
    """Named reasons occur in some parts only."""
    sweep = partly_impossible()
    run(sweep, tmp_path / "out")
    frame = pd.read_parquet(tmp_path / "out")
    assert frame["reason"].str.contains("height").sum() == (frame["verdict"] == "error").sum() > 0
    assert pl.read_parquet(tmp_path / "out")["reason"].cast(pl.String).to_list() == frame["reason"].to_list()
    found = duckdb.sql(f"select reason from '{tmp_path}/out/*.parquet'").fetchnumpy()["reason"]
    assert list(found) == frame["reason"].to_list()


def test_progress_comes_and_ends_at_the_last_row(tmp_path):
    told = []
    run(grid_of(20_000), tmp_path / "out", progress=told.append, simulate=plausible)
    assert told[-1].rows_done == told[-1].rows == 20_000
    done = [progress.rows_done for progress in told]
    assert done == sorted(done)


def test_a_progress_function_that_raises_stops_the_run_and_lets_the_folder_go(tmp_path):
    def broken(progress):
        raise RuntimeError("no bar")

    with pytest.raises(RuntimeError, match="no bar"):
        run(grid(), tmp_path / "out", progress=broken)
    assert nothing_left(tmp_path / "out")
    assert rows_done(tmp_path / "out") <= 441
    assert run(grid(), tmp_path / "out", resume=True).rows == 441


def test_output_that_exists_is_refused_unless_told(finished):
    out, _ = finished
    before = part_files(out)
    with pytest.raises(OutputExistsError, match=r"is finished: see it with .*--overwrite") as refused:
        run(grid(), out)
    assert refused.value.exit_code == 4
    with pytest.raises(StoreError, match="cannot be used together"):
        run(grid(), out, resume=True, overwrite=True)
    assert part_files(out) == before


def test_output_that_is_unfinished_is_refused_with_how_to_continue_it(tmp_path):
    run(grid(), tmp_path / "out", simulate=plausible)
    min((tmp_path / "out").iterdir()).unlink()
    with pytest.raises(OutputExistsError, match="holds 331 of 441 rows: use --resume"):
        run(grid(), tmp_path / "out", simulate=plausible)


def test_resuming_a_finished_run_computes_nothing(finished):
    out, _ = finished
    before = part_files(out)
    summary = run(grid(), out, resume=True)
    assert summary.rows_computed == 0
    assert summary.rows == 441
    assert sum(summary.verdicts.values()) == 441
    assert part_files(out) == before


def test_resuming_nothing_begins(tmp_path):
    assert run(grid_of(10), tmp_path / "out", resume=True, simulate=plausible).rows_computed == 10


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"friction": "[36, 40, 43] deg"}, "friction_angle_deg"),
        ({"rotation": "15 deg"}, "max_rotation_deg: 20.0 -> 15.0"),
        ({"step": "2 ms"}, "control.h: 0.004 -> 0.002"),
        ({"soil": "{elements: 9}"}, "control.elements: 0 -> 9"),
        ({"name": "other"}, 'name: "test" -> "other"'),
        ({"height": "{from: 1.6 m, to: 3.4 m, count: 8}"}, "n_designs: 441 -> 504"),
    ],
)
def test_resuming_with_other_settings_is_refused_and_says_what_differs(finished, changes, words):
    out, _ = finished
    before = part_files(out)
    with pytest.raises(SettingsDifferError) as refused:
        run(grid(**changes), out, resume=True)
    assert words in str(refused.value)
    assert refused.value.exit_code == 4
    assert part_files(out) == before


@pytest.mark.parametrize("name", ["kernels_sha256", "rules_sha256", "versions"])
def test_resuming_with_other_code_is_refused(finished, monkeypatch, name):
    import boulder_sweep.store.provenance as provenance

    other = {"numba": "0.1"} if name == "versions" else "0" * 64
    monkeypatch.setattr(provenance, name, lambda: other)
    with pytest.raises(SettingsDifferError, match=name.removesuffix("_sha256")):
        run(grid(), finished[0], resume=True)


def test_overwriting_replaces_the_table(tmp_path):
    out = tmp_path / "out"
    run(grid(), out, simulate=plausible)
    summary = run(grid_of(30), out, overwrite=True, simulate=plausible)
    assert summary.rows == len(pd.read_parquet(out)) == 30
    assert len(part_files(out)) == len(list(out.iterdir())) == 1


@pytest.mark.parametrize("how", [{}, {"resume": True}, {"overwrite": True}])
@pytest.mark.parametrize(
    ("name", "is_finished", "refused"),
    [
        ("notes.txt", False, True),
        ("notes.txt", True, False),
        ("mine.parquet", False, True),
        ("mine.parquet", True, True),  # readers would take it for rows
        (".DS_Store", False, False),
        (".DS_Store", True, False),
    ],
)
def test_other_files_in_the_folder_stay_and_are_told(tmp_path, name, is_finished, refused, how):
    out = tmp_path / "out"
    if is_finished:
        run(grid_of(10), out, simulate=plausible)
    out.mkdir(exist_ok=True)
    (out / name).write_text("mine")
    before = part_files(out)
    error = ForeignFilesError if refused else OutputExistsError if is_finished and not how else None
    if error is not None:
        with pytest.raises(error) as told:
            run(grid_of(10), out, simulate=plausible, **how)
        assert told.value.exit_code == 4
    else:
        assert run(grid_of(10), out, simulate=plausible, **how).rows == 10
    assert (out / name).read_text() == "mine"
    assert not is_finished or part_files(out) == before


def test_a_run_outside_the_main_thread(tmp_path):
    """Where Python allows no signal handlers."""
    summaries = []
    thread = threading.Thread(target=lambda: summaries.append(run(grid_of(50), tmp_path / "out")))
    thread.start()
    thread.join()
    assert summaries[0].rows == 50


_MEMORY = """
import sys, tempfile
from pathlib import Path
from tests.runner.grids import grid_of, settled
from boulder_sweep.runner.run import run
if __name__ == "__main__":
    rows = int(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        sweep = grid_of(1000, width=f"{{from: 1 m, to: 2 m, count: {rows // 1000}}}")
        assert run(sweep, folder + "/out", jobs=2, simulate=settled).rows == rows
    print(int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) >> 10)
"""


@pytest.mark.nightly
def test_memory_does_not_grow_with_the_rows():
    def peak(rows: int) -> int:
        command = [sys.executable, "-c", _MEMORY, str(rows)]
        return int(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)

    few, many = peak(600_000), peak(10_000_000)
    assert many < few + 100, f"{few} MB for 0.6 million rows, {many} MB for 10 million"
    assert many < 600
