"""Answers as Arrow tables and Parquet files; every column has a unit and a meaning."""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from boulder_sweep.answers.search import WORDS
from boulder_sweep.columns import BY_NAME, DESIGN_ID, INPUTS
from boulder_sweep.errors import BoulderSweepError, OlderRulesWarning, QuestionError
from boulder_sweep.judge.quantities import QUANTITIES, quantities
from boulder_sweep.locations import Location, RemotePath, location_of
from boulder_sweep.store.errors import settings_file
from boulder_sweep.store.files import check_target, replacing
from boulder_sweep.store.provenance import identity_in, judged_by, settings_sha256
from boulder_sweep.store.schema import number_array, part_table, word_array
from boulder_sweep.text import one_line, why

if TYPE_CHECKING:
    import pandas as pd

    from boulder_sweep.answers.chance import Chance
    from boulder_sweep.answers.keys import Key
    from boulder_sweep.answers.questions import Answers
    from boulder_sweep.answers.sensitivity import Indices
    from boulder_sweep.answers.subset import Failing
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.judged import Judged
    from boulder_sweep.settings import Sweep

_IDENTITY = {"settings", "settings_sha256", "kernels_sha256", "readings", "control", "versions"}


def answer_table(key: Key, start: int, answers: Sequence[Answers], readings: Sequence[str], sweep: Sweep) -> pa.Table:
    """Return answers as a table: the inputs, the answer and its bracket, the outcome at the answer.

    Parameters
    ----------
    key
        The input asked for.
    start
        Number of the first row.
    answers
        Answers with the readings of the sweep, then with others.
    readings
        Names of the readings, in the same order.
    sweep
        The sweep: shape of its boulders and layers of its soil.
    """
    own = answers[0]
    block = replace(own.block, start=start, stop=start + len(own.block))
    table = part_table(block, own.judged, {})
    at = 1 + len(INPUTS)
    sense = "largest" if key.most else "smallest"
    unit = key.field.unit
    what = f"{sense} value of {key.field.path} that passes"
    columns: list[tuple[str, str, str, pa.Array]] = [
        (key.answer, unit, f"{what}; null where none does", _numbers(own.passes)),
        (
            "fails_at",
            unit,
            f"value next to it of {key.field.path} that does not pass; where none passes, the last one tried",
            _numbers(own.fails),
        ),
        ("passes_at", unit, "the same as the answer: judged as a run judges it", _numbers(own.passes)),
        ("found", "", "found, always, never, not_monotone or blocked_by_overlap", word_array(own.kind, WORDS)),
        ("passes_within", unit, "where it fails again further on: all stretches that pass", _words(own.stretches)),
        *((name, unit, meaning, number_array(values)) for name, unit, meaning, values in to_build(block, sweep)),
    ]
    for other, name in zip(answers[1:], readings[1:], strict=True):
        columns += [
            (
                f"{key.answer}_{name}",
                unit,
                f"{what} by the readings {name}",
                _numbers(other.passes),
            ),
            (f"found_{name}", "", f"as found, by the readings {name}", word_array(other.kind, WORDS)),
        ]
    if own.chances is not None:
        columns += [
            (
                "p_pass",
                "1",
                "chance of passing at the answer, or at the value tried last",
                number_array(own.chances.estimate),
            ),
            ("p_pass_low", "1", "lower end of the interval of p_pass", number_array(own.chances.low)),
            ("p_pass_high", "1", "upper end of the interval of p_pass", number_array(own.chances.high)),
        ]
    for place, (name, own_unit, meaning, array) in enumerate(columns):
        field = pa.field(name, array.type, metadata={"unit": own_unit, "meaning": meaning})
        table = table.add_column(at + place, field, array)
    return table


def chance_table(
    start: int,
    block: DesignBlock,
    judged: Judged,
    found: Chance,
    driver: np.ndarray,
    words: Sequence[str],
    failing: Failing | None,
) -> pa.Table:
    """Return probabilities as a table: inputs, outcome at the means, probability of passing, most influential input.

    Parameters
    ----------
    start
        Number of the first row.
    block, judged
        The designs with the means of their uncertain inputs, and their outcomes.
    found
        Probabilities of passing.
    driver
        Index of the most influential input in `words`; -1 for none.
    words
        The uncertain inputs.
    failing
        Probabilities of failing, small ones by subset simulation.
    """
    table = part_table(replace(block, start=start, stop=start + len(block)), judged, {})
    columns: list[tuple[str, str, str, pa.Array]] = [
        ("p_pass", "1", "chance that the design passes", number_array(found.estimate)),
        ("p_pass_low", "1", "lower end of the interval of p_pass", number_array(found.low)),
        ("p_pass_high", "1", "upper end of the interval of p_pass", number_array(found.high)),
        (
            "p_pass_driver",
            "",
            "most influential of the uncertain inputs; null where they change nothing",
            word_array(driver, tuple(words)),
        ),
        ("p_pass_designs", "1", "designs drawn for p_pass", number_array(found.points)),
    ]
    if failing is not None:
        from boulder_sweep.answers.subset import FAILING

        columns += [
            (
                "p_fail",
                "1",
                "chance that the design does not pass; null where p_fail_by says why",
                _numbers(failing.estimate),
            ),
            ("p_fail_low", "1", "lower end of the interval of p_fail", _numbers(failing.low)),
            ("p_fail_high", "1", "upper end of the interval of p_fail", _numbers(failing.high)),
            (
                "p_fail_by",
                "",
                "subset: by subset simulation; drawn: by the designs drawn for p_pass; no_progress: no step of the "
                "simulation came nearer to the rare designs; contradicts: its interval and that of p_pass "
                "exclude each other",
                word_array(failing.by, FAILING),
            ),
        ]
    for name, unit, meaning, array in columns:
        table = table.append_column(pa.field(name, array.type, metadata={"unit": unit, "meaning": meaning}), array)
    return table


def index_table(names: Sequence[str], found: Sequence[Indices], outputs: Sequence[str]) -> pa.Table:
    """Return Sobol indices as a table, one row for each design, output and input."""
    from boulder_sweep.answers.sensitivity import Indices

    values: dict[str, list[Any]] = {"design_id": [], "output": [], "input": []}
    numbers: dict[str, list[np.ndarray]] = {field.name: [] for field in fields(Indices)}
    for design, own in enumerate(found):
        for output, word in enumerate(outputs):
            values["design_id"] += [design] * len(names)
            values["output"] += [word] * len(names)
            values["input"] += list(names)
            for name, parts in numbers.items():
                parts.append(getattr(own, name)[output])
    columns = {
        "design_id": pa.array(values["design_id"], pa.int64()),
        "output": pa.array(values["output"], pa.string()).dictionary_encode(),
        "input": pa.array(values["input"], pa.string()).dictionary_encode(),
    }
    columns |= {name: _numbers(np.concatenate([*parts, np.empty(0)])) for name, parts in numbers.items()}
    return pa.table(columns)


def sample_table(names: Sequence[str], drawn: Sequence[tuple[Mapping[str, np.ndarray], np.ndarray]]) -> pa.Table:
    """Return sampled designs as a table: number of the design, uncertain inputs, distance from failing."""
    counts = [len(distance) for _, distance in drawn]
    columns = {"design_id": pa.array(np.repeat(np.arange(len(drawn)), counts))}
    for name in names:
        columns[name] = pa.array(np.concatenate([*(inputs[name] for inputs, _ in drawn), np.empty(0)]))
    columns["distance"] = pa.array(np.concatenate([*(distance for _, distance in drawn), np.empty(0)]))
    return pa.table(columns)


def frame_of(table: pa.Table) -> pd.DataFrame:
    """Return a table as a data frame; units and meanings in ``.attrs``."""
    frame = table.to_pandas()
    frame.attrs = {
        f"{entry}s": {field.name: (field.metadata or {}).get(entry.encode(), b"").decode() for field in table.schema}
        for entry in ("unit", "meaning")
    }
    return frame


def with_columns(table: pa.Table, columns: Sequence[tuple[str, str, str, Any]]) -> pa.Table:
    """Return a table with further columns appended.

    Parameters
    ----------
    table
        The table, n rows.
    columns
        Name, unit, meaning, and n values: numbers, NaN for none, or words, None for none.
    """
    for name, unit, meaning, values in columns:
        array = _numbers(values) if isinstance(values, np.ndarray) else _words(values)
        table = table.append_column(pa.field(name, array.type, metadata={"unit": unit, "meaning": meaning}), array)
    return table


def to_build(block: DesignBlock, sweep: Sweep) -> list[tuple[str, str, str, np.ndarray]]:
    """Return what the designs of a block take to build as columns: name, unit, meaning, values."""
    rows = {name: column.to_numpy() for name, column in block.columns.items()}
    found = quantities(rows, sweep.model.shape, sweep.model.ground)
    return [(own.name, own.unit, own.meaning, found[own.name]) for own in QUANTITIES if own.name not in block.columns]


def joined_tables(tables: Sequence[pa.Table], metadata: Mapping[bytes, bytes]) -> pa.Table:
    """Concatenate tables of consecutive rows, adding the metadata of a file to that for pandas."""
    from boulder_sweep.store.schema import PANDAS_ATTRIBUTES

    table = pa.concat_tables(tables).unify_dictionaries().combine_chunks()
    own = {field.name: field.metadata or {} for field in table.schema}
    attributes = {
        f"{entry}s": {name: found.get(entry.encode(), b"").decode() for name, found in own.items()}
        for entry in ("unit", "meaning")
    }
    return table.replace_schema_metadata({PANDAS_ATTRIBUTES: json.dumps(attributes).encode(), **metadata})


def write_parquet(table: pa.Table, path: str | Location) -> Location:
    """Write a table to a Parquet file, by path or URL.

    Raises
    ------
    QuestionError
        The name has another ending, its folder does not exist or holds the result of a run, or it cannot be written.
    """
    target = checked_parquet(path)
    split = [field.name for field in table.schema if field.name != DESIGN_ID.name and pa.types.is_floating(field.type)]
    words = [field.name for field in table.schema if pa.types.is_dictionary(field.type)]
    content = io.BytesIO()
    try:
        with replacing(target) if isinstance(target, Path) else nullcontext(content) as file:
            pq.write_table(
                table,
                file,
                compression="zstd",
                use_dictionary=words,
                use_byte_stream_split=split,
                write_page_checksum=True,
            )
        if isinstance(target, RemotePath):
            target.put(content.getbuffer())
    except OSError as problem:
        raise QuestionError(f"{path} cannot be written: {why(problem)}") from problem
    return target


def read_parquet(path: str | Path, refusal: type[BoulderSweepError]) -> tuple[pa.Table, dict[str, Any], str]:
    """Read a file that `write_parquet` wrote, and warn where other rules than those of this version judged it.

    Parameters
    ----------
    path
        The file.
    refusal
        The error to raise.

    Returns
    -------
    table : Table
        All of it.
    identity : dict
        As of `boulder_sweep.store.provenance.identity`.
    judged : str
        As of `boulder_sweep.store.provenance.judged_by`.

    Raises
    ------
    BoulderSweepError
        It cannot be read, is damaged, or no command wrote it.
    """
    if advice := settings_file(path):
        raise refusal(advice)
    try:
        table = pq.read_table(path, page_checksum_verification=True)
        table.validate(full=True)
        kinds = {field.name: field.type for field in table.schema}
        found = identity_in(table.schema.metadata)
        if not found.keys() >= _IDENTITY:
            raise refusal(f"{path} is neither the folder of a run nor a file that `sweep` wrote")
        odd = [name for name, kind in kinds.items() if name in BY_NAME and not _is_of(BY_NAME[name].type, kind)]
        if odd or settings_sha256(found["settings"]) != found["settings_sha256"]:
            raise refusal(f"{path} is damaged; write it again")
    except BoulderSweepError:
        raise
    except (pa.ArrowException, OSError, ValueError, LookupError, OverflowError, RecursionError) as problem:
        # Of a damaged file, pyarrow raises almost anything; names and texts that are not Unicode are ValueErrors.
        raise refusal(f"{path} cannot be read as a Parquet file: {one_line(problem)}") from problem
    if judged := judged_by(found):
        warnings.warn(f"{path} was {judged}", OlderRulesWarning, stacklevel=3)
    return table, found, judged


def _is_of(type_: str, kind: pa.DataType) -> bool:
    """Whether a column holds what it should: words or numbers."""
    if type_ == "dictionary":
        return pa.types.is_dictionary(kind)
    return pa.types.is_floating(kind) or pa.types.is_integer(kind)


def checked_parquet(path: str | Location) -> Location:
    """Check and return the path or URL of a Parquet file to be written.

    Raises
    ------
    QuestionError
        The name has another ending, or its folder does not exist or holds the result of a run.
    """
    target = location_of(path)
    if target.suffix.lower() != ".parquet":
        raise QuestionError(f"{path}: answers are a Parquet file; its name must end in .parquet")
    check_target(target, QuestionError)
    return target


def _numbers(values: np.ndarray) -> pa.Array:
    """Return numbers as an array, null for NaN."""
    return number_array(values, np.isnan(values))


def _words(texts: Sequence[str | None]) -> pa.Array:
    """Return words as an array, null for None."""
    known = tuple(dict.fromkeys(text for text in texts if text is not None))
    codes = {None: -1} | {text: code for code, text in enumerate(known)}
    return word_array(np.array([codes[text] for text in texts], dtype=np.int32), known)
