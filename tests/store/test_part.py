"""The table on disk."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from boulder_sweep.columns import (
    BY_NAME,
    COLUMNS,
    DESIGN_ID,
    GRADES,
    INPUT_COLUMNS,
    OUTCOME_COLUMNS,
    REASONS,
    STANDINGS,
    VERDICTS,
)
from boulder_sweep.designs import Column, DesignBlock
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import Judged
from boulder_sweep.store.part import encode, encoded_part, part_table, verdict_counts
from tests.runner.grids import partly_impossible, plausible


@pytest.fixture(scope="module")
def block() -> DesignBlock:
    sweep = partly_impossible()
    return sweep.block(0, sweep.n_designs)


@pytest.fixture(scope="module")
def judged(block):
    return evaluation_of(partly_impossible(), accuracy_of(partly_impossible()), plausible)(block)


def written(block, judged, metadata=None) -> pa.Table:
    return pq.read_table(pa.BufferReader(encode(part_table(block, judged, metadata or {}))))


def test_columns_and_types_are_those_of_the_register(block, judged):
    table = written(block, judged)
    assert table.schema.names == [spec.name for spec in COLUMNS]
    words = pa.dictionary(pa.int32(), pa.string())
    expected = {"int64": pa.int64(), "float64": pa.float64(), "dictionary": words}
    for spec in COLUMNS:
        assert table.schema.field(spec.name).type == expected[spec.type], spec.name


def test_inputs_come_back(block, judged):
    table = written(block, judged)
    for name in INPUT_COLUMNS:
        assert np.array_equal(table[name].to_numpy(), block.columns[name].to_numpy())


def test_inputs_are_never_written_out_row_by_row(block, judged):
    table = part_table(block, judged, {})
    for name in INPUT_COLUMNS:
        column = table[name].chunk(0)
        assert isinstance(column, pa.DictionaryArray)
        assert len(column.dictionary) == len(block.columns[name].values) < 100


def test_outcomes_come_back(block, judged):
    table = written(block, judged)
    for name in OUTCOME_COLUMNS:
        values = judged[name]
        if values.dtype.kind == "f":
            assert np.array_equal(table[name].to_numpy(), values, equal_nan=True), name
        else:
            words = [judged.words[name][code] if code >= 0 else None for code in values]
            assert table[name].to_pylist() == words, name


def test_a_part_says_its_range_and_its_rows_by_verdict(block, judged):
    content, verdicts = encoded_part(block, judged, {b"a": b"b"})
    metadata = pq.read_schema(pa.BufferReader(content)).metadata
    assert metadata[b"boulder_sweep.range"] == f"[0,{len(block)}]".encode()
    assert json.loads(metadata[b"boulder_sweep.verdicts"]) == verdicts == verdict_counts(judged)
    assert metadata[b"a"] == b"b"
    assert sum(verdicts.values()) == len(block)


def test_rows_are_counted_by_what_decided_them():
    """Passes by their grade; sensitive ones, where a second opinion was asked for, by what they stand under."""
    expected = {
        ("fail", "overturns", None, None): "fail/overturns",
        ("pass", "", "open", "paper"): "pass/open",
        ("pass", "", "robust", "paper;broms;width_capped"): "pass/robust",
        ("pass", "", "sensitive", None): "pass/sensitive",
        ("pass", "", "sensitive", "paper;broms"): "pass/sensitive (stands under broms)",
        ("pass", "", "sensitive", "paper;broms;width_capped"): "pass/sensitive (stands under broms and width_capped)",
    }
    words = {"verdict": VERDICTS, "reason": REASONS, "robustness": GRADES, "stands_under": STANDINGS}
    rows = [row for times, row in enumerate(expected, 1) for _ in range(times)]
    said = dict(zip(words, zip(*rows, strict=True), strict=True))
    codes = {name: [-1 if word is None else words[name].index(word) for word in said[name]] for name in words}
    columns = {name: np.array(column, dtype=np.int32) for name, column in codes.items()}
    assert verdict_counts(Judged(columns, words)) == {key: times for times, key in enumerate(expected.values(), 1)}


def test_a_missing_value_is_null_never_nan(block, judged):
    table = written(block, judged)
    for name in OUTCOME_COLUMNS:
        values = judged[name]
        missing = np.isnan(values) if values.dtype.kind == "f" else values < 0
        assert table[name].null_count == np.count_nonzero(missing)
        if values.dtype.kind == "f":
            assert not np.isnan(table[name].drop_null().to_numpy()).any()


@pytest.mark.parametrize("coded", [True, False])
def test_a_missing_input_is_null(block, judged, coded):
    values = np.array([np.nan, 0.7])
    codes = np.arange(len(block), dtype=np.int32) % 2
    column = Column(codes, values) if coded else Column(None, values[codes])
    with_gap = DesignBlock(block.start, block.stop, {**block.columns, "impact_height_m": column}, block.reasons)
    read = written(with_gap, judged)["impact_height_m"]
    assert read.null_count == np.count_nonzero(codes == 0)
    assert set(read.drop_null().to_pylist()) == {0.7}


def test_encodings(block, judged):
    plain = Column(None, np.linspace(0.1, 0.9, len(block)))
    mixed = DesignBlock(block.start, block.stop, {**block.columns, "impact_height_m": plain}, block.reasons)
    group = pq.read_metadata(pa.BufferReader(encode(part_table(mixed, judged, {})))).row_group(0)
    for place in range(group.num_columns):
        column = group.column(place)
        assert column.compression == "ZSTD"
        name = column.path_in_schema
        if name == DESIGN_ID.name:
            assert "DELTA_BINARY_PACKED" in column.encodings
        elif (name in INPUT_COLUMNS or BY_NAME[name].type == "dictionary") and name != "impact_height_m":
            assert "RLE_DICTIONARY" in column.encodings
        else:
            assert "BYTE_STREAM_SPLIT" in column.encodings


def test_the_same_rows_give_the_same_bytes(block, judged):
    metadata = {b"a": b"b"}
    one = encode(part_table(block, judged, metadata))
    assert bytes(one) == bytes(encode(part_table(block, judged, metadata)))


def test_a_flipped_bit_in_any_page_is_noticed(block, judged):
    content = bytearray(encode(part_table(block, judged, {})))
    group = pq.read_metadata(pa.BufferReader(content)).row_group(0)
    for place in range(group.num_columns):
        column = group.column(place)
        # The last bytes of a column are always data, not the header of a page.
        start = column.dictionary_page_offset or column.data_page_offset
        last = start + column.total_compressed_size - 1
        flipped = bytearray(content)
        flipped[last] ^= 1
        with pytest.raises(OSError, match=r"(?i)crc|corrupt"):
            pq.read_table(pa.BufferReader(flipped), page_checksum_verification=True)


def test_tables_pass_the_checks_of_arrow(block, judged):
    """The arrays are put together from their buffers; words beyond ASCII and missing numbers included."""
    reasons = (*judged.reasons, "Böschung zu steil: 35° > 30°", "")
    last = judged.reason.copy()
    last[:2] = len(reasons) - 2, len(reasons) - 1
    changed = Judged(judged.columns | {"reason": last}, judged.words | {"reason": reasons})
    table = part_table(block, changed, {})
    table.validate(full=True)
    assert table["reason"].slice(0, 2).to_pylist() == ["Böschung zu steil: 35° > 30°", ""]
    for name in ("margin", "penetration_m"):
        values = judged[name]
        assert table[name].equals(pa.chunked_array([pa.array(values, mask=np.isnan(values))])), name


_RUN_AND_LIST = """
import sys
from tests.runner.grids import grid_of
from boulder_sweep.runner.run import run
run(grid_of(20), sys.argv[1])
print(*sorted({"pandas", "matplotlib", "polars", "duckdb"} & set(sys.modules)))
"""


def test_a_run_does_without_pandas(tmp_path):
    """Importing it takes longer than many runs do; `pyarrow.array` would."""
    command = [sys.executable, "-c", _RUN_AND_LIST, str(tmp_path / "out")]
    found = subprocess.run(command, check=True, capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert found.stdout.strip() == ""
