"""What can be asked for: an input by its name, its bounds and the step of its search."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.answers.spread import narrowed
from boulder_sweep.answers.trials import LEAST_RATIO
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings import fields
from boulder_sweep.settings.fields import BOULDER_MASS, UnknownNameError, named
from boulder_sweep.settings.problems import Position, SettingsError
from boulder_sweep.settings.soil_readings import covered_depth
from boulder_sweep.settings.tree import Scalar
from boulder_sweep.settings.values import NumberError, outside, read_quantity, read_single, refuse_bare

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from boulder_sweep.settings import Sweep

Ends = tuple[str | float, str | float] | None
"""Search range given by the user."""
STEPS = {
    "m": 1e-3,
    "1": 1e-3,
    "deg": 0.01,
    "m/s": 0.01,
    "kg": 1.0,
    "kg/m^3": 1.0,
    "MN/m^3": 0.1,
    "N/m": 1000.0,
    "N*s/m": 100.0,
}
"""Spacing of the values tried, by unit."""
MILDEST = {"impact_speed_m_s": 0.0, "vehicle_mass_kg": 100.0}
"""Where a search for the largest value begins [table units]: a boulder must withstand all smaller values, too."""
STRONGEST = ("friction_angle_deg", "embedment_depth_m", "embedment_ratio")
"""Inputs of which a boulder must pass at every greater value: a pass between two fails is no answer."""


@dataclass(frozen=True)
class Key:
    """The input that is asked for, its smallest value or its largest (`most`)."""

    field: fields.Field
    most: bool

    @property
    def name(self) -> str:
        """Column of the input (or ``embedment_ratio``)."""
        return self.field.name

    @property
    def is_steady(self) -> bool:
        """Whether everything between the answer and the safe end of the input must pass too."""
        return self.name in (MILDEST if self.most else STRONGEST)

    @property
    def step(self) -> float:
        """Spacing of the values tried, in the unit of the table; answers are multiples of it."""
        return STEPS[self.field.unit]

    @property
    def answer(self) -> str:
        """Column of the answer: ``least_embedment_depth_m``."""
        return f"{'most' if self.most else 'least'}_{self.name}"

    def values(self, positions: np.ndarray) -> np.ndarray:
        """Return the values at some positions (whole numbers) of the search lattice."""
        per_unit = round(1.0 / self.step)
        # A quotient is the float nearest to 1.234, as a file would give it.
        return positions / per_unit if per_unit > 1 else positions * self.step

    def ends(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the outermost lattice positions within a range; the next one above its start where none is within."""
        first, last = self.within(low, high)
        return first, np.maximum(first, last)

    def within(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the outermost lattice positions within a range, the first behind the last where there is none."""
        first = np.ceil(low / self.step - 1e-6).astype(np.int64)
        return first, np.floor(high / self.step + 1e-6).astype(np.int64)


def key_of(word: str, *, most: bool = False) -> Key:
    """Return the input that a path, key or column names; ``mass`` is the boulder's.

    Raises
    ------
    QuestionError
        The word names no input or several.
    """
    try:
        field = BOULDER_MASS if word == BOULDER_MASS.key else named(word)
    except UnknownNameError as problem:
        raise QuestionError(str(problem)) from None
    return Key(field, most)


def share(text: str | float, option: str) -> float:
    """Return a number such as 0.25, ``25 %`` or 25: a bare number above 1 is per cent.

    Raises
    ------
    QuestionError
        It is not a number.
    """
    if isinstance(text, str):
        try:
            value = float(read_quantity(Scalar(Position(option), text), "1").value)
        except SettingsError as problem:
            raise QuestionError(f"{option} {text}: {problem.problems[0].message}") from None
        if "%" in text:
            return value
    else:
        value = float(text)
    return value / 100.0 if value > 1.0 else value


def margin_asked(text: str | float) -> float:
    """Return the least margin to the limits as a fraction, 0.25 for ``25 %``.

    Raises
    ------
    QuestionError
        It is not a number, negative, or 100 % or more, which no design has.
    """
    margin = share(text, "--margin")
    if not 0.0 <= margin < 1.0:
        raise QuestionError(f"--margin {text}: must be 0 or more and less than 100 %")
    return margin


def bound(text: str | float, field: fields.Field) -> float:
    """Return one end of the search range, or refuse one that is not admitted by a `QuestionError`."""
    option = "--between"
    if not isinstance(text, str):
        problem = outside(float(text), field)
        if problem:
            raise QuestionError(f"{option}: {problem}")
        return float(text)
    try:
        return read_single(Scalar(Position(option), text), field)
    except SettingsError as problem:
        raise QuestionError(f"{option} {text}: {problem.problems[0].message}") from None


def sweep_ranges(sweep: Sweep) -> dict[str, tuple[float, float]]:
    """Return the smallest and largest value of every input that varies, by column."""
    columns = (item for axis in sweep.axes for item in axis.columns.items())
    return {name: (float(values.min()), float(values.max())) for name, values in columns}


def range_of(sweep: Sweep, key: Key, given: Mapping[str, np.ndarray], between: Ends) -> tuple[np.ndarray, np.ndarray]:
    """Return the search range of the input, row by row.

    Where the input is an axis of the grid, the axis is the range; for the largest speed or mass of the vehicle it
    begins as `MILDEST` says all the same. Ends that the user gave take precedence. If the input has a distribution,
    its mean is searched, where the distribution is within the admitted range.

    Returns
    -------
    low, high : ndarray, shape (n,)
        Ends in the unit of the table.

    Raises
    ------
    QuestionError
        The range is empty, or the distribution of the input cannot take the means of the range.
    """
    low, high = _whole_range(sweep, key, given, between)
    return narrowed(sweep, key.name, low, high, least=key.step, given=between is not None)


def _whole_range(
    sweep: Sweep, key: Key, given: Mapping[str, np.ndarray], between: Ends
) -> tuple[np.ndarray, np.ndarray]:
    """Return the search range, whatever the distribution of the input; arguments: see `range_of`."""
    one = np.ones(len(next(iter(given.values()))))
    if between is not None:
        try:
            refuse_bare("--between", [end for end in between if isinstance(end, str)], key.field.unit)
        except NumberError as problem:
            raise QuestionError(str(problem)) from None
        low, high = (bound(end, key.field) for end in between)
        if not low < high:
            raise QuestionError(f"--between {between[0]} {between[1]}: the first must be less than the second")
        return low * one, high * one
    axes = sweep_ranges(sweep)
    if key.name in axes:
        low, high = axes[key.name]
        return _mildest(key, low) * one, high * one
    if key.name == "embedment_depth_m":
        height, bumper = given["boulder_height_m"], given["bumper_height_m"]
        low, high = axes.get("embedment_ratio", (LEAST_RATIO, 1.0))
        return low * height, np.minimum(high * height, height - bumper)
    if key.name == "embedment_ratio":
        height, bumper = given["boulder_height_m"], given["bumper_height_m"]
        if "embedment_depth_m" in axes:
            low, high = axes["embedment_depth_m"]
            return np.minimum(low / height, 1.0), np.minimum(high / height, 1.0)
        return LEAST_RATIO * one, 1.0 - bumper / height
    if key.name == "impact_height_m":
        return 0.0 * one, given["hood_height_m"]
    low, high = usual_ends(key)
    return low * one, high * one


def usual_ends(key: Key) -> tuple[float, float]:
    """Return the ends of the usual range of an input, with all that is milder where the largest is asked for."""
    usual = key.field.usual or key.field.admitted
    assert usual is not None
    return _mildest(key, usual.low), usual.high


def _mildest(key: Key, low: float) -> float:
    return min(low, MILDEST[key.name]) if key.most and key.name in MILDEST else low


def refuse_narrow(sweep: Sweep, key: Key, pieces: Iterable[Mapping[str, np.ndarray]], between: Ends) -> None:
    """Refuse ranges of `range_of` in which there is nothing to search, by a `QuestionError`.

    A range may be as narrow as it likes where it ends because the truck goes over the boulder beyond. Otherwise a
    multiple of the step must lie within it. Where the user chose the range, at least one must hold two, a value that
    passes and the next. `pieces` are the other inputs of all rows.
    """
    most, widest = 0, (0.0, 0.0)
    for given in pieces:
        low, high = range_of(sweep, key, given, between)
        first, last = key.within(low, high)
        reach = math.inf if between is not None else reach_of(key, given)
        by_nature = (key.values(first) > reach) & (high - low < key.step)
        none = np.flatnonzero((first > last) & ~by_nature & (low < high))
        if len(none):
            raise _unsearchable(key, low[none[0]], high[none[0]], "no multiple")
        held = np.where(low < high, last - first + 1, 0)
        if held.max(initial=0) > most:
            row = held.argmax()
            most, widest = held[row], (low[row], high[row])
    if between is not None and most == 1:
        raise _unsearchable(key, *widest, "only one multiple")


def refuse_deep(sweep: Sweep, foot_m: float, ranged: str) -> None:
    """Refuse a search whose deepest foot is below readings of the soil that were left out, by a `QuestionError`.

    `ranged` is what the file must give so that deeper readings count.
    """
    covered = covered_depth(sweep.derived)
    if foot_m < covered:
        return
    remedy = f"they count where the file gives {ranged}"
    if sweep.table is not None:
        remedy = "search less deep (--between); or they count where the table has a design with such a foot"
    raise QuestionError(
        f"the search goes down to a foot at {foot_m:.4g} m, and the readings of the soil below {covered:.4g} m were "
        f"left out, since no foot in the file is so deep; {remedy}"
    )


def reach_of(key: Key, given: Mapping[str, np.ndarray]) -> np.ndarray | float:
    """Return the value beyond which the truck goes over the boulder, row by row; infinity for other inputs."""
    if key.name == "embedment_depth_m":
        return given["boulder_height_m"] - given["bumper_height_m"]
    return 1.0 - given["bumper_height_m"] / given["boulder_height_m"] if key.name == "embedment_ratio" else math.inf


def _unsearchable(key: Key, low: float, high: float, held: str) -> QuestionError:
    """Return the error for a range that is too narrow."""
    unit = "" if key.field.unit == "1" else f" {key.field.unit}"
    return QuestionError(
        f"the range to search, {low:.10g} to {high:.10g}{unit}, holds {held} of its step, {key.step:.10g}{unit}; "
        "give a wider range (--between)"
    )
