"""Check the settings that a result carries, which may be damaged, by the declarations that a file is checked by."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from boulder_sweep.parquet import MOST_ROWS
from boulder_sweep.settings.fields import BY_NAME, EMBEDMENT, INPUTS, MAX_ELEMENTS, TO_BE_FOUND
from boulder_sweep.settings.model import (
    PRESETS,
    PRINTED,
    SECOND_OPINIONS,
    SWITCHES,
    Bound,
    Criterion,
    Distribution,
    Ground,
    ProfilePoint,
    ReadingChoice,
    Scan,
    SolverSettings,
)
from boulder_sweep.settings.problems import shorten
from boulder_sweep.settings.soil_readings import shown_readings, strength
from boulder_sweep.settings.sweep import IMPACT_HEIGHT_RULE, Heading, derived_words, wrong_with

_NAMES = {entry.name for entry in INPUTS}
_ALWAYS = (
    EMBEDMENT,
    *((e.name,) for e in INPUTS if e.name not in EMBEDMENT and (not e.optional or e.default is not None)),
)
"""Inputs of which all settings have one."""
_WORDS = {
    **{switch: {PRINTED, corrected} for switch, corrected in SWITCHES.items()},
    "preset": {*PRESETS, "mixed"},
    "second_opinion": {*SECOND_OPINIONS},
    "impact_height_m": {IMPACT_HEIGHT_RULE},
    "embedment_depth_m": {TO_BE_FOUND},
}
"""Words that an entry may hold, where its declaration lists none."""
_OTHER_BOUNDS = {
    "n_designs": Bound(0, math.inf, ""),
    "count": Bound(1, MOST_ROWS, ""),  # some values are made from it
    "soil": Bound(1, MAX_ELEMENTS, ""),
}
_CONTROL: dict[str, tuple[type, float, float]] = {
    "h": (float, 1e-7, 1.0),
    "horizon": (float, 1e-4, 100.0),
    "theta_limit": (float, math.radians(0.01), math.radians(90.0)),
    "elements": (int, 0, MAX_ELEMENTS),
    "longest_horizon": (float, 0.0, 1e4),
    "event_tolerance": (float, 1e-12, 1.0),
    **dict.fromkeys(
        ("error_estimate", "stop_at_limit", "locate_yield", "refined", "last_resort", "paired", "side_by_side"),
        (bool, 0, 1),
    ),
}
"""Entries of `boulder_kernels.Control` with their types and bounds. The kernels are not asked: to import them, and the
compiler with them, takes longer than to read a table."""
_READINGS = {"inertia_box", "arm_geometric", "contact_left_face", "restoring_gravity", "separation_released"}
"""Names of the entries of `boulder_kernels.Readings`."""


@dataclass
class _Long:
    """Values or words that are too many to be listed."""

    count: int
    first: float | str
    last: float | str
    sha256: str


@dataclass
class _Sets:
    """Spreads of one input of named sets."""

    sets: tuple[Distribution | None, ...]


@dataclass
class _Model:
    readings: ReadingChoice
    preset: str
    soil: int | Literal["closed_form"]
    calibrated_crush_m: float
    resistance: str
    foot: str
    rock_assumed: bool = False
    profile: tuple[ProfilePoint, ...] = ()
    scan: Scan | None = None
    ground: Ground | None = None
    second_opinion: tuple[str, ...] = ()


_Case = dict[str, float | tuple[float, ...] | _Long | dict[str, str]]


@dataclass
class _Settings:
    """Settings as `Sweep.resolved` returns them."""

    name: str
    n_designs: int
    order: Literal["table"] | tuple[str, ...]
    inputs: dict[str, float | str | tuple[float, ...] | _Long]
    model: _Model
    criterion: Criterion
    solver: SolverSettings
    labels: dict[str, tuple[str, ...] | _Long] = field(default_factory=dict)
    distributions: dict[str, Distribution | _Sets] = field(default_factory=dict)
    correlation: float = 0.0
    taken_at: dict[str, str] = field(default_factory=dict)
    judged_at: tuple[_Case, ...] = ()
    partial_factor: dict[str, float] = field(default_factory=dict)
    derived: dict[str, tuple[dict[str, Any], ...]] = field(default_factory=dict)
    allow_unusual: tuple[str, ...] = ()
    report: dict[str, str] = field(default_factory=dict)
    units: Literal["si", "us"] = "si"


def check_stored(settings: Any) -> None:
    """Check what a result holds in place of what `Sweep.resolved` returned; it raises as `check_entries` does."""
    check_entries(settings, _Settings, "settings")
    if wrong := next(_inconsistencies(settings), ""):
        raise ValueError(shorten(f"settings.{wrong}", 200))


def check_entries(entries: Any, kind: type[Any], path: str) -> None:
    """Check plain data by a dataclass: which entries there are, and by their names what they may hold.

    Raise ValueError for one that is missing, unknown, of another kind, or has a value that no settings file may hold;
    the text names it, beginning with `path`.
    """
    if wrong := next(_mistakes(entries, kind, path), ""):
        raise ValueError(shorten(wrong, 200))


def check_control(control: dict[str, Any], readings: dict[str, Any]) -> None:
    """Check how a result says that the motion was integrated; raise ValueError for what no settings file leads to."""
    if control.keys() != _CONTROL.keys():
        raise ValueError(f"control has other entries than {', '.join(_CONTROL)}")
    for name, (kind, low, high) in _CONTROL.items():
        value = control[name]
        if not _is_of(value, kind) or not low <= value <= high:
            raise ValueError(f"control.{name} is {str(value)[:60]!r}, which no settings give")
    if readings.keys() != _READINGS or any(type(value) is not bool for value in readings.values()):
        raise ValueError("readings are not the five of the paper")


def _mistakes(value: Any, kind: Any, path: str) -> Iterator[str]:
    """Yield what is wrong with a value by the type that it should have, and with everything in it by its name."""
    choices = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
    fitting = [choice for choice in choices if _is_of(value, choice)]
    if len(fitting) > 1:  # the one by which least is wrong
        fitting = [next((one for one in fitting if not any(_mistakes(value, one, path))), fitting[0])]
    if not fitting:
        yield f"{path} holds {str(value)[:60]!r}, which no settings give"
        return
    kind, name = fitting[0], path.rpartition(".")[2].partition("[")[0]
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        for entry in fields(kind):
            if entry.name in value:
                yield from _mistakes(value[entry.name], hints[entry.name], f"{path}.{entry.name}")
            elif "entry" in entry.metadata or (entry.default is MISSING and entry.default_factory is MISSING):
                # Defaults of a settings file are filled in, so what a result holds has them all.
                yield f"{path}.{entry.name} is missing"
        yield from (f"{path}.{key} is no entry" for key in value if key not in hints)
    elif get_origin(kind) is dict:
        for key, inner in value.items():
            yield from _mistakes(inner, get_args(kind)[1], f"{path}.{key}")
    elif get_origin(kind) is tuple:
        for place, inner in enumerate(value):
            yield from _mistakes(inner, get_args(kind)[0], f"{path}[{place}]")
    elif kind in (int, float) or kind is str:
        declared = BY_NAME.get(name)
        admitted = _OTHER_BOUNDS.get(name, declared.admitted if declared else None)
        words = _WORDS.get(name, declared.choices if declared else ())
        outside = kind is not str and admitted and not admitted.low <= value <= admitted.high
        if outside or (kind is str and words and value not in words):
            yield f"{path} is {str(value)[:60]!r}, which no settings give"


def _is_of(value: Any, kind: Any) -> bool:
    """Whether a value may be of a type, by its outermost layer."""
    if kind is Any:
        return True
    if kind is float:
        return type(value) in (int, float) and abs(value) <= sys.float_info.max
    if kind in (int, str, bool, type(None)):
        return type(value) is kind
    if get_origin(kind) is Literal:
        return value in get_args(kind) if isinstance(value, str) else False
    return isinstance(value, list if get_origin(kind) is tuple else dict)


def _inconsistencies(settings: dict[str, Any]) -> Iterator[str]:
    """Yield what does not belong together, in settings whose entries are right one by one."""
    inputs, labels, order, count = (settings.get(name, {}) for name in ("inputs", "labels", "order", "n_designs"))
    for name in [name for part in (inputs, settings.get("distributions", {})) for name in part if name not in _NAMES]:
        yield f"inputs.{name} is no input"
    for name, value in inputs.items():
        if isinstance(value, str) and name not in ("impact_height_m", "embedment_depth_m"):
            yield f"inputs.{name} is no number"
    for names in _ALWAYS:
        if not {*names} & inputs.keys():
            yield f"inputs.{names[-1]} is missing"
    lengths = {name: _length(value) for name, value in inputs.items() if isinstance(value, list | dict)}
    sets = {name: _length(value) for name, value in labels.items()}
    if order == "table":
        expected = dict.fromkeys((*lengths, *sets), count)
    else:
        along = lengths | sets
        if len({*order}) < len(order) or not along.keys() >= {*order}:
            yield "order names what has no values, or one input twice"
        elif math.prod(along[name] for name in order) != count:
            yield f"n_designs is {count:,}, but the values make {math.prod(along[name] for name in order):,} designs"
        expected = {name: sets.get(BY_NAME[name].section) for name in lengths if name not in order}
    for name, length in expected.items():
        if (lengths | sets)[name] != length:
            yield f"inputs.{name} has another number of values"
    for case in settings.get("judged_at", ()):
        if not isinstance(case.get("taken_at"), dict) or not case.keys() | inputs.keys() >= case["taken_at"].keys():
            yield "judged_at does not say what is taken at which value"
    for name, text in settings.get("report", {}).items():
        if name not in Heading._fields or wrong_with(text):
            yield f"report.{name} is no entry of a heading"
    try:
        for units in ("si", "us"):
            derived_words(settings.get("derived", {}), units)
        for soil in settings.get("derived", {}).get("soil", ()):
            if "log" in soil:
                _ = max(map(strength, shown_readings(soil))) + soil.get("foot_m", 0.0)
        for key, name in (("rock", "name"), ("table", "file")):
            " ".join(one[name] for one in settings.get("derived", {}).get(key, ()))
        ends = [point["height"] for point in settings["model"].get("profile", ())]
        if ends and not (ends == sorted({*ends}) and (ends[0], ends[-1]) == (0.0, 1.0)):
            yield "model.profile is no outline from the foot to the top"
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError):
        yield "derived is not what a settings file gives"


def _length(values: list[Any] | dict[str, Any]) -> int:
    return int(values["count"]) if isinstance(values, dict) else len(values)
