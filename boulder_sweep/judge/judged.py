"""Judged rows: the outcome columns of the table as arrays, and the words that their codes stand for.

Numbers only, so that stored tables can be read and put together without the kernels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_sweep.columns import GRADES, OUTCOMES, REASONS, VERDICTS, OutcomeColumn

PASS, FAIL, UNDECIDED, ERROR = range(len(VERDICTS))
_ORDER = np.array([3, 0, 2, 1])
"""Where each verdict stands among the verdicts of one row, the worst first: a fail is one, whatever the others are."""
CHANGES_SIDE = "changes_side"
"""Flag of a row whose verdict depends on which value its uncertain inputs have."""
NO_REASON, NO_CONTACT, OVERTURNS, PENETRATION, HORIZON, NUMERICAL_ERROR, CRUSH, OVERRIDE = range(8)


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """Outcomes of n rows."""

    columns: dict[str, np.ndarray]
    """Every outcome column of the table by its name: float64, NaN for no value, or int32 codes of words, -1 for none;
    shape (n,)."""
    words: dict[str, tuple[str, ...]]
    """What the codes of each dictionary column stand for: first the register's words, then these rows'."""

    def __len__(self) -> int:
        return len(self.verdict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    @property
    def verdict(self) -> np.ndarray:
        """Codes of `VERDICTS`, shape (n,)."""
        return self.columns["verdict"]

    @property
    def reason(self) -> np.ndarray:
        """Codes of `reasons`, shape (n,)."""
        return self.columns["reason"]

    @property
    def reasons(self) -> tuple[str, ...]:
        """`REASONS`, then the reasons of rows that could not be computed."""
        return self.words["reason"]

    def rows(self, chosen: np.ndarray | slice) -> Judged:
        """Return some rows, chosen by a mask, by their indices or by a slice."""
        return Judged({name: values[chosen] for name, values in self.columns.items()}, self.words)

    def row(self, index: int) -> dict[str, Any]:
        """Return one row as plain data by the names of the columns: words, numbers, None for no value."""
        result: dict[str, Any] = {}
        for name, values in self.columns.items():
            value = values[index]
            if name in self.words:
                result[name] = self.words[name][int(value)] if value >= 0 else None
            else:
                result[name] = float(value) if math.isfinite(value) else None
        return result


def not_computed(reasons: tuple[str, ...], codes: np.ndarray) -> Judged:
    """Return rows of verdict ``error`` without any value, by the index of each into reasons in words, shape (n,)."""
    n = len(codes)
    nothing, no_word = np.full(n, np.nan), np.full(n, -1, dtype=np.int32)
    columns = {spec.name: no_word if spec.type == "dictionary" else nothing for spec in OUTCOMES}
    columns["verdict"] = np.full(n, ERROR, dtype=np.int32)
    columns["reason"] = (np.asarray(codes) + len(REASONS)).astype(np.int32)
    words = {spec.name: spec.words for spec in OUTCOMES if spec.type == "dictionary"}
    return Judged(columns, words | {"reason": (*REASONS, *reasons)})


def joined(pieces: list[Judged]) -> Judged:
    """Put consecutive pieces together; the words in use end up sorted behind the words of the register.

    The columns are those that all pieces have. The same rows give the same words and codes, however they were cut.
    """
    columns: dict[str, np.ndarray] = {}
    words: dict[str, tuple[str, ...]] = {}
    for spec in OUTCOMES:
        if any(spec.name not in piece.columns for piece in pieces):
            continue
        parts = [piece[spec.name] for piece in pieces]
        if spec.type == "dictionary":
            words[spec.name] = _words_in_use(spec, pieces)
            parts = [_translate_codes(piece, spec.name, words[spec.name]) for piece in pieces]
        columns[spec.name] = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return Judged(columns, words)


def merged(chosen: np.ndarray, some: Judged, others: Judged) -> Judged:
    """Return n rows, of which those where `chosen` is true (bool, shape (n,)) are `some`, and the rest `others`."""
    return joined([some, others]).rows(np.argsort(np.concatenate([np.flatnonzero(chosen), np.flatnonzero(~chosen)])))


def with_rows(judged: Judged, indices: np.ndarray, rows: Judged) -> Judged:
    """Return judged rows with those at some indices replaced."""
    order = np.arange(len(judged))
    order[indices] = len(judged) + np.arange(len(rows))
    return joined([judged, rows]).rows(order)


def worst_of(cases: list[Judged]) -> Judged:
    """Return for every row the worst of several judgements, and flag those on whose verdict they differ.

    Each row is whole from one of them: a fail before an error, what is undecided, and a pass; of equal verdicts the one
    with the least reserve, and of equal reserves the first. A pass is graded by the worst of its grades.
    """
    n = len(cases[0])
    worst = joined(cases).rows(n * worst_case(cases) + np.arange(n))
    columns, words = dict(worst.columns), dict(worst.words)
    passing = worst.verdict == PASS
    if "robustness" in columns:
        grades = np.stack([case["robustness"] for case in cases])
        open_too = np.where((grades == GRADES.index("open")).any(axis=0), GRADES.index("open"), grades.max(axis=0))
        graded = np.where((grades == GRADES.index("sensitive")).any(axis=0), GRADES.index("sensitive"), open_too)
        columns["robustness"] = np.where(passing, graded, columns["robustness"]).astype(np.int32)
    if "stands_under" in columns:
        # The codes are bits, one for each second opinion; -1 where none was asked for.
        standing = np.bitwise_and.reduce([case["stands_under"] for case in cases])
        unasked = np.min([case["stands_under"] for case in cases], axis=0) < 0
        columns["stands_under"] = np.where(passing & ~unasked, standing, columns["stands_under"]).astype(np.int32)
    if "validity" in columns:
        changes = np.any([case.verdict != cases[0].verdict for case in cases], axis=0)
        flagged = tuple(";".join(part for part in (word, CHANGES_SIDE) if part) for word in words["validity"])
        changes &= columns["validity"] >= 0
        columns["validity"] = (columns["validity"] + changes * len(words["validity"])).astype(np.int32)
        words["validity"] = (*words["validity"], *flagged)
    return joined([Judged(columns, words)])


def worst_case(cases: list[Judged]) -> np.ndarray:
    """Return from which of several judgements of the same n rows `worst_of` takes each, shape (n,)."""
    rank, left = np.stack([_ORDER[case.verdict] for case in cases]), np.stack([reserves(case) for case in cases])
    return np.where(rank == rank.min(axis=0), left, np.inf).argmin(axis=0)


def reserves(judged: Judged) -> np.ndarray:
    """Return what n rows have left before a limit, shape (n,).

    It is the margin of a row that has one. A boulder that overturns has less than -1, the less the earlier; others 0.
    """
    margin, time = judged["margin"], judged["time_to_limit_s"]
    overturned = np.where(np.isnan(time), 0.0, -1.0 - 1.0 / np.maximum(time, 1e-3))
    return np.where(np.isnan(margin), overturned, margin)


def _words_in_use(spec: OutcomeColumn, pieces: list[Judged]) -> tuple[str, ...]:
    """Words of a column: the register's, then what else some row has, sorted."""
    used = set()
    for piece in pieces:
        piece_words = piece.words[spec.name]
        if piece_words != spec.words:
            counts = np.bincount(piece[spec.name] + 1, minlength=1)[1:]
            used |= {piece_words[code] for code in np.flatnonzero(counts)}
    return (*spec.words, *sorted(used - set(spec.words)))


def _translate_codes(piece: Judged, name: str, words: tuple[str, ...]) -> np.ndarray:
    """Codes of a column of a piece as indices into other words; words that no row uses need no code."""
    piece_words, codes = piece.words[name], piece[name]
    if piece_words == words[: len(piece_words)]:
        return codes
    code_of = {word: code for code, word in enumerate(words)}
    # Code -1 takes the last entry, which stands for no word.
    return np.array([*(code_of.get(word, 0) for word in piece_words), -1], dtype=codes.dtype)[codes]
