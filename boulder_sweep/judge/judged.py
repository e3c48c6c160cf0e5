"""Judged rows: the outcome columns of the table as arrays, and the words that their codes stand for.

Numbers only, so that stored tables can be read and put together without the kernels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from boulder_sweep.columns import OUTCOME_COLUMNS

VERDICTS = ("pass", "fail", "undecided", "error")
"""What a verdict may be; codes of `Judged.verdict` index it."""
REASONS = ("", "no_contact", "overturns", "penetration", "horizon", "error")
"""The reasons of every verdict but ``error``, which names its own."""
RATINGS = ("P1", "P2", "P3")
"""Penetration ratings; codes of `Judged.rating` index it, -1 is none."""
PASS, FAIL, UNDECIDED, ERROR = range(len(VERDICTS))
NO_REASON, NO_CONTACT, OVERTURNS, PENETRATION, HORIZON, NUMERICAL_ERROR = range(len(REASONS))


class Judged(NamedTuple):
    """Outcome columns of n rows under their names in the table: arrays of shape (n,), NaN for no value."""

    verdict: np.ndarray
    """int8, index into `VERDICTS`."""
    reason: np.ndarray
    """int32, index into `reasons`."""
    margin: np.ndarray
    """Least (limit - value) / limit over the criteria; NaN where overturned or without contact."""
    max_rotation_deg: np.ndarray
    """Largest |theta_b|."""
    max_displacement_m: np.ndarray
    """Largest x_b."""
    max_vehicle_displacement_m: np.ndarray
    """Largest x_v."""
    peak_force_kN: np.ndarray
    """Largest contact force."""
    penetration_m: np.ndarray
    """How far the leading edge of the cargo bed came past the rear face of the boulder; negative if not."""
    rating: np.ndarray
    """int8, index into `RATINGS`; -1 where there is none."""
    time_to_limit_s: np.ndarray
    """Time at which the rotation reached its limit."""
    end_time_s: np.ndarray
    """Simulated time."""
    rotation_error_deg: np.ndarray
    """Estimated numerical error of the rotation."""
    displacement_error_m: np.ndarray
    """Estimated numerical error of the displacements."""
    reasons: tuple[str, ...]
    """`REASONS`, then the named reasons of rows that could not be computed. The words of `reason`."""


def not_computed(reasons: tuple[str, ...], codes: np.ndarray) -> Judged:
    """Return rows of verdict ``error`` without any value.

    Parameters
    ----------
    reasons
        Why, in words; none of them empty.
    codes
        Index into `reasons` of each row, shape (n,).

    Returns
    -------
    Judged
        As many rows as `codes` has.
    """
    n = len(codes)
    nothing = np.full(n, np.nan)
    empty = dict.fromkeys(OUTCOME_COLUMNS, nothing)
    empty["verdict"] = np.full(n, ERROR, dtype=np.int8)
    empty["reason"] = (np.asarray(codes) + len(REASONS)).astype(np.int32)
    empty["rating"] = np.full(n, -1, dtype=np.int8)
    return Judged(**empty, reasons=(*REASONS, *reasons))


def joined(pieces: list[Judged]) -> Judged:
    """Put consecutive pieces together; the named reasons in use end up sorted, whatever the pieces.

    Parameters
    ----------
    pieces
        At least one.

    Returns
    -------
    Judged
        All rows, in the order of the pieces.
    """
    used = {piece.reasons[code] for piece in pieces for code in np.flatnonzero(np.bincount(piece.reason))}
    reasons = (*REASONS, *sorted(used - set(REASONS)))
    place = {reason: code for code, reason in enumerate(reasons)}
    translated = [piece._replace(reason=_translated(piece, place)) for piece in pieces]
    if len(translated) == 1:
        return translated[0]._replace(reasons=reasons)
    columns = {name: np.concatenate([getattr(piece, name) for piece in translated]) for name in OUTCOME_COLUMNS}
    return Judged(**columns, reasons=reasons)


def rows_of(judged: Judged, start: int, stop: int) -> Judged:
    """Return the rows [start, stop) of some judged rows; views, not copies."""
    return Judged(**{name: getattr(judged, name)[start:stop] for name in OUTCOME_COLUMNS}, reasons=judged.reasons)


def _translated(piece: Judged, place: dict[str, int]) -> np.ndarray:
    """Reason codes of a piece as indices into other words; words that no row uses need no place."""
    if all(place.get(reason, code) == code for code, reason in enumerate(piece.reasons)):
        return piece.reason
    return np.array([place.get(reason, 0) for reason in piece.reasons], dtype=np.int32)[piece.reason]
