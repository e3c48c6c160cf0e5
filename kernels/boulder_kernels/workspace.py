"""The numbers of many lanes in one flat array, field by field.

A loop over lanes is vectorised only where the compiler can see that no store touches a later load. One array with
constant offsets shows it; separate arrays do not. A field occupies LANES consecutive places, so that neighbouring
lanes are neighbours in memory. The functions below are the only ones that know where a field lies.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, get_type_hints

import numpy as np
from numba.extending import overload

from ._jit import inlined
from .design import Constants
from .dynamics import Acceleration, State
from .gaps import GapFactors
from .modes import Modes, Switches
from .outcomes import Compression, Maxima

LANES = 8
"""Designs that are integrated side by side: one vector of eight doubles. More of them hide no more latency and take
more of the fastest memory (measured: 2 to 5 % slower with 16 or 32)."""

KNOWN: dict[str, object] = {"elements": 0} | {name: 0.0 for name in Maxima._fields if name.startswith("t_")}
"""Fields that are not kept: lanes know the closed form of the soil only, and no times of maxima."""


class Number(NamedTuple):
    """A field that belongs to no record."""

    value: float


_LAYOUT: dict[str, Any] = {
    "constants": Constants,
    "switches": Switches,
    "factors": GapFactors,
    "state": State,
    "start": Acceleration,
    "end_state": State,
    "end": Acceleration,
    "compression": Compression,
    "maxima": Maxima,
    "modes": Modes,
    "step": Number,
    "step_full": Number,
    "time": Number,
    "barrier": Number,
    "horizon": Number,
    "attention": Number,
    "attempts_left": Number,
}


def _place(name: str) -> int:
    names = list(_LAYOUT)
    return LANES * sum(len(_LAYOUT[before]._fields) for before in names[: names.index(name)])


SIZE = LANES * sum(len(record._fields) for record in _LAYOUT.values())
CONSTANTS = _place("constants")
SWITCHES = _place("switches")
FACTORS = _place("factors")
STATE = _place("state")
"""State at the start of the step."""
START = _place("start")
"""Acceleration there."""
END_STATE = _place("end_state")
"""State at the end of the step."""
END = _place("end")
"""Acceleration there."""
COMPRESSION = _place("compression")
"""Compression of the vehicle's spring at the start of the step."""
MAXIMA = _place("maxima")
"""Largest values so far."""
MODES = _place("modes")
STEP = _place("step")
"""Length of the next step [s]."""
STEP_FULL = _place("step_full")
"""Length of a step that nothing shortens [s]."""
TIME = _place("time")
"""Start of the next step [s]."""
BARRIER = _place("barrier")
"""Energy below which the motion has settled [J], see `boulder_kernels.settling`."""
HORIZON = _place("horizon")
"""Time at which the simulation ends, unless there is a reason to go on [s]."""
ATTENTION = _place("attention")
"""1.0 where a step cannot simply be accepted."""
ATTEMPTS_LEFT = _place("attempts_left")
_RECORDS = {_place(name): record for name, record in _LAYOUT.items()}


@inlined
def field(ws: np.ndarray, place: int, lane: int) -> float:
    """Return the number at a place for one lane."""
    return ws[place + lane]


@inlined
def put(ws: np.ndarray, place: int, lane: int, value: float) -> None:
    """Write the number at a place for one lane."""
    ws[place + lane] = value


def load(ws: np.ndarray, place: int, lane: int) -> Any:
    """Return the record at a place, one of the constants above, for one lane."""
    numbers = [
        KNOWN[name] if name in KNOWN else kind(ws[place + i * LANES + lane])
        for i, (name, kind) in enumerate(get_type_hints(_RECORDS[place]).items())
    ]
    return _RECORDS[place](*numbers)


def store(ws: np.ndarray, place: int, lane: int, record: Any) -> None:
    """Write a record at a place, one of the constants above, for one lane."""
    for i, name in enumerate(record._fields):
        if name not in KNOWN:
            ws[place + i * LANES + lane] = record[i]


# Inside kernels both are written out, field by field, wherever they are called.


@overload(load, inline="always", prefer_literal=True, strict=False)
def _load(ws: Any, place: Any, lane: Any) -> Callable[..., Any]:
    record = _RECORDS[place.literal_value]
    values = (
        str(KNOWN[name]) if name in KNOWN else f"{kind.__name__}(ws[place + {i * LANES} + lane])"
        for i, (name, kind) in enumerate(get_type_hints(record).items())
    )
    return _function(f"def written_out(ws, place, lane):\n return Record({', '.join(values)})", record)


@overload(store, inline="always", strict=False)
def _store(ws: Any, place: Any, lane: Any, record: Any) -> Callable[..., Any]:
    lines = (
        f" ws[place + {i * LANES} + lane] = record.{name}"
        for i, name in enumerate(record.instance_class._fields)
        if name not in KNOWN
    )
    return _function("\n".join(("def written_out(ws, place, lane, record):", *lines)), None)


def _function(source: str, record: Any) -> Callable[..., Any]:
    names = {"Record": record}
    exec(source, names)
    return names["written_out"]
