"""What ``-o`` of a command wrote, read in one way: the folder of a run, or a file of answers."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pyarrow as pa

from boulder_kernels import Control
from boulder_sweep.answers.keys import key_of
from boulder_sweep.answers.need import RECOMMENDATION, Need
from boulder_sweep.answers.recommendation import ANSWER, Recommendation
from boulder_sweep.answers.search import FAULTY, WORDS
from boulder_sweep.answers.trials import Open
from boulder_sweep.columns import BY_NAME as COLUMN_OF
from boulder_sweep.columns import COLUMNS, DESIGN_ID, GRADES, RATINGS, VERDICTS
from boulder_sweep.designs import Label
from boulder_sweep.errors import BoulderSweepError, OlderRulesWarning
from boulder_sweep.impact.recomputing import model_of
from boulder_sweep.locations import Location
from boulder_sweep.parquet import ParquetError, TableFile
from boulder_sweep.settings import Sweep
from boulder_sweep.settings.fields import BY_NAME, EMBEDMENT, INPUTS, TO_BE_FOUND
from boulder_sweep.settings.model import Criterion
from boulder_sweep.settings.problems import shorten
from boulder_sweep.settings.stored import check_entries
from boulder_sweep.settings.sweep import Axis, DesignList, allowed_in, units_in
from boulder_sweep.store.failures import settings_file
from boulder_sweep.store.folder import part_file
from boulder_sweep.store.provenance import check_identity, identity_in, judged_by, other_version, settings_sha256
from boulder_sweep.store.reading import FinishedRows
from boulder_sweep.text import counted, why

if TYPE_CHECKING:
    from boulder_sweep.answers.reserves import Reserves
    from boulder_sweep.answers.uncertainty import Uncertainty

NEED, CAPACITY, UNCERTAINTY, RUN = "need", "capacity", "uncertainty", "run"
"""Commands that write results."""
MARKS = {
    NEED: ("fails_at", "passes_at", "found"),
    CAPACITY: ("withstands_speed_m_s", "withstands_mass_kg", "withstands_friction_angle_deg"),
    UNCERTAINTY: ("p_pass", "p_pass_low", "p_pass_high", "p_pass_driver"),
}
"""Columns by which the answers of a command are known."""
OF_ONE_FILE = {"repeat"}
"""Entries of the metadata by which equal files differ."""
_IDENTITY = {"settings", "settings_sha256", "kernels_sha256", "readings", "control", "versions"}
"""Entries of the metadata that every such file has."""


@dataclass
class _Need:
    """What `sweep need` is asked."""

    asked: str
    margin: float
    probability: float | None = None
    robust: bool = False


@dataclass
class _Chances:
    """What `sweep uncertainty` is asked."""

    asked: Literal["p_pass"]
    half_width: float
    confidence: float
    margin: float
    seed: int
    most: int


_QUESTIONS = {NEED: _Need, UNCERTAINTY: _Chances}
_ADMITTED = {entry.name: entry.admitted for entry in INPUTS if entry.admitted}
_WORDS = {"verdict": VERDICTS, "rating": RATINGS, "robustness": GRADES}
OF_ANSWERS = "`sweep need`, `capacity` or `uncertainty`"


class AnswerFile:
    """The rows of a file of answers or of a time history, with the attributes of `FinishedRows`.

    Parameters
    ----------
    path
        The file.
    refusal
        The error to raise.
    histories
        Whether the file may be a time history.

    Attributes
    ----------
    rows, rows_done, identity, judged_by, columns
        See `FinishedRows`.
    question : dict
        What was asked; empty where the command asks nothing more.
    kind : str
        The command that wrote it, a key of `MARKS`; empty for a time history.

    Raises
    ------
    BoulderSweepError
        It cannot be read, is damaged, or no command wrote it.
    """

    def __init__(self, path: Path, refusal: type[BoulderSweepError], *, histories: bool = False) -> None:
        self.path = path
        self.table, identity, self.judged_by = _identified(path, refusal)
        self._refusal = refusal
        try:
            self.question: dict[str, Any] = json.loads(identity.pop("question", "{}"))
        except ValueError as problem:
            raise refusal(f"{path} is damaged; write it again ({problem})") from problem
        self._recommended = str(identity.pop(RECOMMENDATION, "null"))
        self.identity = {key: value for key, value in identity.items() if key not in OF_ONE_FILE}
        names = set(self.table.column_names)
        self.kind = next((kind for kind, marks in MARKS.items() if names >= set(marks)), "")
        if not self.kind and not histories:
            what = "a time history" if "time_s" in names else f"no file that -o of {OF_ANSWERS} wrote"
            raise refusal(f"{path} is {what}; `sweep export` takes it")
        if self.kind and not names >= {spec.name for spec in COLUMNS}:
            raise refusal(f"{path} is damaged; write it again with `sweep {self.kind}`")
        self._check(names)
        self.columns = tuple(self.table.column_names)
        self.rows = self.rows_done = len(self.table)

    def _check(self, names: set[str]) -> None:
        """Refuse a question that no command asks, more answers than designs, and inputs or words that none has."""
        settings = self.identity["settings"]
        designs, order, labels = settings["n_designs"], settings["order"], settings.get("labels", {})
        if self.kind and len(self.table) > designs:
            what = f"it has {len(self.table):,} rows for {counted(designs, 'design')}"
            raise self._refusal(f"{self.path} is damaged: {what}")
        if self.kind and (wrong := next(self._wrong_columns(self.table, designs=self.kind != NEED), "")):
            raise self._refusal(f"{self.path} is damaged: {wrong}; write it again with `sweep {self.kind}`")
        try:
            if self.kind in _QUESTIONS:
                check_entries(self.question, _QUESTIONS[self.kind], "question")
            if self.kind == NEED and self.question["asked"] not in names:
                raise ValueError("question.asked is no answer of the file")
            if self.kind and order != "table" and (lost := {*order} & {*labels} - names):
                raise ValueError(f"column {min(lost)} is missing")
        except ValueError as problem:
            raise self._refusal(f"{self.path} is damaged ({problem}); write it again") from None

    def _wrong_columns(self, table: pa.Table, *, designs: bool) -> Iterator[str]:
        """Yield what is wrong with the columns by which answers, or designs, are described: numbers and known words."""
        for name in table.column_names:
            column, admitted = table[name], _ADMITTED.get(name)
            needed = name == DESIGN_ID.name or (designs and (admitted or name == "verdict"))
            if needed and column.null_count:
                yield f"column {name} has empty cells"
            if pa.types.is_floating(column.type) and not np.isfinite(column.drop_null().to_numpy()).all():
                yield f"column {name} holds what is no number"
            if admitted:
                values = column.drop_null().to_numpy()
                if len(outside := values[~((values >= admitted.low) & (values <= admitted.high))]):
                    yield f"column {name} holds {outside[0]:g}, which no settings give"
            if name in _WORDS and (unknown := {*column.unique().to_pylist()} - {*_WORDS[name], None}):
                yield f"column {name} holds {shorten(str(unknown.pop()))!r}, none of {', '.join(_WORDS[name])}"

    def tables(self, columns: Sequence[str] | None = None, *, verify: bool = True) -> Iterator[pa.Table]:
        """Yield all rows, or some of their columns, at once."""
        yield self.table if columns is None else self.table.select(columns)

    def row(self, number: int) -> pa.Table:
        """Return one row.

        Raises
        ------
        IndexError
            There is no such row.
        """
        if not 0 <= number < self.rows:
            raise IndexError(f"the file has {counted(self.rows, 'design')}, numbered from 0; there is no {number}")
        return self.table.slice(number, 1)

    @property
    def asked(self) -> int:
        """Number of rows that the command wrote: of the designs, or of combinations of the inputs not asked for."""
        answers = self.answers() if self.kind == NEED else None
        if not isinstance(answers, Need):
            return int(self.identity["settings"]["n_designs"])
        return Open(answers.sweep, (answers.key.name,)).count

    def answers(self) -> Need | Reserves | Uncertainty:
        """Return the answers as the command had them.

        Raises
        ------
        BoulderSweepError
            The samples beside the file belong to other answers.
        """
        sweep = asked_sweep(self.identity, self.table)
        if self.kind == CAPACITY:
            from boulder_sweep.answers.reserves import Reserves

            return Reserves(sweep, self.table)
        if self.kind == UNCERTAINTY:
            return self._chances(sweep)
        asked = self.question
        sense, _, name = asked["asked"].partition("_")
        key = key_of(name, most=sense == "most")
        chance, robust = asked.get("probability"), asked.get("robust", False)
        return Need(sweep, self.table, key, asked["margin"], 0, chance, robust, self._recommendation())

    def _recommendation(self) -> Recommendation | None:
        """Return what was recommended; None where nothing was."""
        try:
            entries = json.loads(self._recommended)
            found = None if entries is None else Recommendation.of_dict(entries, self._rows_of)
            if found is not None and not found.conditions <= self.rows <= found.boulders * found.conditions:
                raise ValueError("it counts other boulders, soils and vehicles than there are")
            return found
        except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as problem:
            what = f"{self.path} is damaged; write it again with `sweep {self.kind}`"
            raise self._refusal(f"{what} (its recommendation: {shorten(str(problem))})") from None

    def _rows_of(self, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Return rows of a recommendation, or refuse them; but for the answer they have the columns of the table."""
        fields = {field.name: field for field in self.table.schema}
        for row in rows:
            if fields.keys() - row.keys() - {self.question["asked"], *ANSWER} or row.keys() - fields.keys():
                raise ValueError("it has other columns than the answers")
        table = pa.Table.from_pylist(rows, pa.schema([fields[name] for name in rows[0]]))
        if wrong := next(self._wrong_columns(table, designs=True), ""):
            raise ValueError(wrong)
        return table.to_pylist()

    def _chances(self, sweep: Sweep) -> Uncertainty:
        """Return probabilities with the samples that lie beside them."""
        from boulder_sweep.answers.uncertainty import Uncertainty

        file = self.path.with_suffix(".samples.parquet")
        samples = pa.table({"design_id": pa.array([], pa.int64())})
        if file.exists():
            samples = _rows(file, self._refusal)
            if identity_in(samples.schema.metadata) != identity_in(self.table.schema.metadata):
                raise self._refusal(f"{file} belongs to other answers than {self.path}; write both again")
        return Uncertainty(sweep, self.table, samples, self.question["seed"])


def _identified(path: str | Path, refusal: type[BoulderSweepError]) -> tuple[pa.Table, dict[str, Any], str]:
    """Read a Parquet file that a command wrote, and warn where other rules judged it.

    Returns
    -------
    table : Table
        All of it.
    identity : dict
        What all rows have in common, see `boulder_sweep.store.provenance.identity`.
    judged : str
        Whose rules judged the rows; empty where this version's did.

    Raises
    ------
    BoulderSweepError
        `refusal`: it cannot be read, is damaged, of another version, or no command wrote it.
    """
    if advice := settings_file(path):
        raise refusal(advice)
    table = _rows(Path(path), refusal)
    try:
        table.validate(full=True)
        kinds = {field.name: field.type for field in table.schema}
        identity = identity_in(table.schema.metadata)
        if not identity.keys() >= _IDENTITY:
            raise refusal(f"{path} is neither the folder of a run nor a file that `sweep` wrote")
        if said := other_version(identity):
            raise refusal(f"{path} {said}")
        odd = [name for name, kind in kinds.items() if name in COLUMN_OF and not _is_of(COLUMN_OF[name].type, kind)]
        if odd or settings_sha256(identity["settings"]) != identity["settings_sha256"]:
            raise refusal(f"{path} is damaged; write it again")
    except BoulderSweepError:
        raise
    except (pa.ArrowException, OSError, ValueError, LookupError, OverflowError, RecursionError) as problem:
        # Of a damaged file, pyarrow raises almost anything; names and texts that are not Unicode are ValueErrors.
        raise refusal(f"{path} is damaged; write it again") from problem
    try:
        check_identity(identity)
    except ValueError as problem:
        raise refusal(f"{path} is damaged ({problem}); write it again") from None
    if judged := judged_by(identity):
        warnings.warn(f"{path} was {judged}", OlderRulesWarning, stacklevel=3)
    return table, identity, judged


def _rows(path: Path, refusal: type[BoulderSweepError]) -> pa.Table:
    """Return all rows of a Parquet file, or refuse it."""
    try:
        with path.open("rb") as file:
            return TableFile(file).read()
    except ParquetError as problem:
        raise refusal(f"{path}: {problem}") from problem
    except OSError as problem:
        raise refusal(f"{path} cannot be read: {why(problem)}") from problem


def _is_of(type_: str, kind: pa.DataType) -> bool:
    """Whether a column holds what it should: words or numbers."""
    if type_ == "dictionary":
        return pa.types.is_dictionary(kind)
    return pa.types.is_floating(kind) or pa.types.is_integer(kind)


def result_of(
    path: Location, refusal: type[BoulderSweepError], *, histories: bool = False
) -> FinishedRows | AnswerFile:
    """Return the rows of what a command wrote: a folder, or a file beside none.

    Raises
    ------
    StoreError
        There is no result in the folder, or it is damaged.
    BoulderSweepError
        The file cannot be read, is damaged, or no command wrote it.
    """
    if not isinstance(path, Path) or not path.is_file() or part_file(path.name):
        return FinishedRows(path)
    return AnswerFile(path, refusal, histories=histories)


def answered(table: pa.Table) -> pa.Table:
    """Return answers with what was found of each as its verdict: that it passes, or why nothing does."""
    import pyarrow.compute as pc

    passes = table["passes_at"].is_valid()
    found = table["found"].cast("string")
    faulty = pc.equal(found, WORDS[FAULTY])
    words = {
        "verdict": pc.if_else(passes, "pass", "fail"),
        "reason": pc.if_else(passes, "", pc.if_else(faulty, table["reason"].cast("string"), found)),
        "robustness": pc.if_else(passes, table["robustness"].cast("string"), None),
    }
    for name, column in words.items():
        index = table.column_names.index(name)
        table = table.set_column(index, table.field(name), column.dictionary_encode().cast(table.field(name).type))
    return table


def kind_of(result: FinishedRows | AnswerFile) -> str:
    """Return the command that wrote a result."""
    return result.kind if isinstance(result, AnswerFile) else RUN


def asked_sweep(identity: Mapping[str, Any], table: pa.Table) -> Sweep:
    """Return the sweep that was asked about, as far as answers are shown by it: not its distributions.

    The answers hold the values of axes and lists that are too long for the settings.
    """
    settings = identity["settings"]
    given, order, labels = settings["inputs"], settings["order"], settings.get("labels", {})
    constants = {name: value for name, value in given.items() if isinstance(value, int | float)}
    varying = {name: _values(name, value, table) for name, value in given.items() if isinstance(value, list | dict)}
    axes: tuple[Axis, ...] = ()
    listed = None
    if order == "table":
        words = {name: _label(table, name) for name in labels if name in table.column_names}
        listed = DesignList("", varying, words)
    else:
        axes = tuple(_axis(name, labels, varying, order) for name in order)
    return Sweep(
        name=settings["name"],
        path=None,
        axes=axes,
        constants=constants,
        table=listed,
        criterion=Criterion(**settings["criterion"]),
        model=model_of(settings, Control(**identity["control"])),
        units=units_in(settings),
        taken_at=settings.get("taken_at", {}),
        derived=settings.get("derived", {}),
        depth_sought=given.get(EMBEDMENT[1]) == TO_BE_FOUND,
        allowed=allowed_in(settings),
    )


def _axis(name: str, labels: Mapping[str, list[str]], varying: Mapping[str, np.ndarray], order: Sequence[str]) -> Axis:
    """Return an axis: values of one input, or named sets of those that are on no axis of their own."""
    if name not in labels:
        return Axis(name, varying[name])
    columns = {key: values for key, values in varying.items() if key not in order and BY_NAME[key].section == name}
    return Axis(name, np.arange(float(len(labels[name]))), columns, tuple(labels[name]))


def _values(name: str, given: Any, table: pa.Table) -> np.ndarray:
    """Return the values of an input that varies; of a very long axis or list those in the table."""
    if isinstance(given, list):
        return np.array(given, dtype=float)
    if name in table.column_names:
        return np.array(table[name].unique().to_pylist(), dtype=float)
    return np.linspace(given["first"], given["last"], given["count"])


def _label(table: pa.Table, name: str) -> Label:
    column = table[name].combine_chunks()
    words = tuple(column.unique().to_pylist())
    codes = {word: code for code, word in enumerate(words)}
    return Label(np.array([codes[word] for word in column.to_pylist()], dtype=np.int32), words)
