"""The numbers of many lanes in one flat array, field by field.

A loop over lanes is vectorised only where the compiler can see that no store touches a later load. One array with
constant offsets shows it; separate arrays do not. A field occupies LANES consecutive entries, so that neighbouring
lanes are neighbours in memory. There are two groups of lanes; a lane is known by the start of its group plus its
number in it. The functions below are the only ones that know where a field lies.

What works on one lane takes the workspace from that lane on, as whose lane 0 it is known there: offsets are then
constants, and no index need be checked for being negative, as one that counts from the end.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from ._jit import IS_PLAIN, function_of, overload
from .design import Body, Constants, Design, Readings, constants_of
from .dynamics import Acceleration, Modes, State, Switches
from .following import Clock, Pace
from .layered import COUNTS, FewLayers, GivenLayer, Layer, LayeredConstants, SoilSums, constants_of_few
from .modes import GapFactors
from .numerics import field, put
from .outcomes import Compression, Maxima
from .outlined import FewPieces, GivenPiece, Lean, Piece, TaperedPiece, TaperedSoil, constants_beside

LANES = 1 if IS_PLAIN else 8
"""Designs that are integrated side by side: one vector of eight doubles. More of them hide no more latency and take
more of the fastest memory (measured: 2 to 5 % slower with 16 or 32). Without the compiler there is nothing to gain."""
KNOWN: dict[str, object] = {"elements": 0, "c_x": 0.0, "c_y": 0.0, "d_N": 0.0}
"""Fields that are not kept: lanes know the closed form of the soil only; and no motion depends on three lengths from
which other constants have been made."""


class Attempt(NamedTuple):
    """What is known of a lane's last step, beside where it ended."""

    error: float
    """Its error [m/s]."""
    plain: float
    """1.0 where it has been accepted as it is."""
    status: float
    """RUNNING, or why the design that has been started here needs no step."""


_LAYOUT: dict[str, Any] = {
    "constants": Constants,
    "pace": Pace,
    "state": State,
    "start": Acceleration,
    "front": Compression,
    "maxima": Maxima,
    "clock": Clock,
    "modes": Modes,
    "switches": Switches,
    "factors": GapFactors,
    "end_state": State,
    "end": Acceleration,
    "attempt": Attempt,
    "design": Design,
}
"""The records of a lane: constants, what `boulder_kernels.following.Impact` has, the end of a step, and the design of a
lane that is being started."""


def _size(record: Any) -> int:
    return LANES * sum(name not in KNOWN for name in record._fields)


def _offset_of(name: str) -> int:
    names = list(_LAYOUT)
    return sum(_size(_LAYOUT[before]) for before in names[: names.index(name)])


CONSTANTS, PACE, STATE, START, FRONT, MAXIMA, CLOCK, MODES, SWITCHES, FACTORS, END_STATE, END, ATTEMPT, DESIGN = map(
    _offset_of, _LAYOUT
)
SIZE = DESIGN + _size(Design)
"""Numbers of a group of lanes."""
STARTS = SIZE
"""Where the second group begins, in which designs are started."""
RECORDS = {_offset_of(name): record for name, record in _LAYOUT.items()}
SOIL = 2 * SIZE
"""Where the soil of a design lies that is not uniform, from its lane on: in a second half of the array, laid out as the
first, which only the workspaces of `SOILS` have."""


class LayeredLanes(NamedTuple):
    """A workspace for designs in soils of layers."""

    numbers: np.ndarray
    """The array, of twice the length."""
    parts: tuple[int, ...]
    """As many zeros as there are layers: how many is known when kernels are compiled."""


class OutlinedLanes(NamedTuple):
    """A workspace for boulders with an outline; ``parts`` has as many zeros as there are pieces of their soil."""

    numbers: np.ndarray
    parts: tuple[int, ...]


class TaperedLanes(NamedTuple):
    """A workspace for tapered boulders in uniform soil; ``parts`` has one zero."""

    numbers: np.ndarray
    parts: tuple[int, ...]


class Nothing(NamedTuple):
    """A record of no numbers."""


class LaneSoil(NamedTuple):
    """What the lanes of a workspace keep of the soil: a record of one other record and of several of a third."""

    record: type
    """The soil of the constants, `LayeredConstants`."""
    whole: Any
    part: Any
    given_whole: Any
    """What there is once of a design that is being started, the rows of a table below those of `Design`."""
    given_part: Any
    """What there is of every part of the soil."""
    constants: Callable[[int], Callable[..., Any]]
    """The function that works out the constants, of the number of parts."""

    def size(self, count: int) -> int:
        """Return how many numbers of a lane belong to its soil of as many parts, times LANES."""
        return LANES * (len(self.whole._fields) + len(self.part._fields) * count)

    def given_size(self, count: int) -> int:
        """Return how many of them belong to what is given of it."""
        return LANES * (len(self.given_whole._fields) + len(self.given_part._fields) * count)


SOILS: dict[type, LaneSoil] = {
    LayeredLanes: LaneSoil(FewLayers, SoilSums, Layer, Nothing, GivenLayer, constants_of_few),
    OutlinedLanes: LaneSoil(FewPieces, Lean, Piece, Body, GivenPiece, constants_beside),
    TaperedLanes: LaneSoil(TaperedSoil, Lean, TaperedPiece, Body, GivenPiece, lambda count: constants_beside(0)),
}
"""By the type of the workspace."""


def soil_in(ws: Any) -> LaneSoil | None:
    """Return what lanes keep of the soil, of a workspace or, inside kernels, its Numba type; None of uniform soil."""
    return SOILS.get(getattr(ws, "instance_class", type(ws)))


def room(form: type | None, parts: int) -> int:
    """Return how many numbers a workspace has, by its type and the number of parts of its soil."""
    if form is None:
        return 2 * SIZE
    return SOIL + STARTS + SOILS[form].size(parts) + SOILS[form].given_size(parts)


def given_offset(soil: LaneSoil, count: int) -> int:
    """Return where what is given of the soil of a design that is being started lies, from its lane on."""
    return SOIL + soil.size(count)


for _soil in SOILS.values():
    assert _soil.size(COUNTS[-1]) <= SIZE, "the soil of a lane reaches into the other group"


def part(ws: Any, start: int) -> Any:
    """Return a workspace from one of its lanes on."""
    return ws[start:] if soil_in(ws) is None else ws._replace(numbers=ws.numbers[start:])


def offsets_of(record: Any) -> dict[str, int]:
    """Offsets of the fields that are kept of a record, from its beginning on."""
    kept = (name for name in record._fields if name not in KNOWN)
    return {name: i * LANES for i, name in enumerate(kept)}


def load(ws: Any, offset: int, lane: int) -> Any:
    """Return the record at an offset, one of the constants above, for one lane."""
    record = RECORDS[offset]
    offsets = offsets_of(record)
    numbers = [
        kind(field(ws, offset + offsets[name], lane)) if name in offsets else KNOWN[name]
        for name, kind in get_type_hints(record).items()
    ]
    soil = soil_in(ws)
    if offset == CONSTANTS and soil is not None:
        return LayeredConstants(*numbers, soil.record(*_load_parts(ws, lane, SOIL, soil.whole, soil.part)))
    return record(*numbers)


def _load_parts(ws: Any, lane: int, offset: int, whole: Any, part: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return a record of one kind and, behind it, as many of another as the soil has parts."""
    count, width = len(whole._fields), len(part._fields)
    numbers = [field(ws, offset + i * LANES, lane) for i in range(count + width * len(ws.parts))]
    parts = tuple(part(*numbers[first : first + width]) for first in range(count, len(numbers), width))
    return whole(*numbers[:count]), parts


def store(ws: Any, offset: int, lane: int, record: Any) -> None:
    """Write a record at an offset, one of the constants above, for one lane."""
    for name, within in offsets_of(RECORDS[offset]).items():
        put(ws, offset + within, lane, getattr(record, name))
    if isinstance(record, LayeredConstants):
        whole, parts = record.soil
        for i, number in enumerate([*whole, *itertools.chain(*parts)]):
            put(ws, SOIL + i * LANES, lane, number)


def store_given(ws: Any, lane: int, designs: np.ndarray, row: int) -> None:
    """Write what is given of the soil of a design that is being started, the rows below those of `Design`."""
    soil = soil_in(ws)
    if soil is not None:
        for i, number in enumerate(designs[len(Design._fields) :, row]):
            put(ws, given_offset(soil, len(ws.parts)) + i * LANES, lane, number)


def load_given(ws: Any, lane: int) -> Any:
    """Return what is given of the soil of a design that is being started: the parts, or another record and they."""
    soil: Any = soil_in(ws)
    whole, parts = _load_parts(ws, lane, given_offset(soil, len(ws.parts)), soil.given_whole, soil.given_part)
    return (whole, parts) if len(whole) else parts


def constants_in_lane(ws: Any, lane: int, design: Design, readings: Readings) -> Any:
    """Return the constants of a design that is being started."""
    soil = soil_in(ws)
    if soil is not None:
        return soil.constants(len(ws.parts))(design, readings, load_given(ws, lane))
    return constants_of(design, readings, 0)


@overload(constants_in_lane)
def _constants_in_lane(ws: Any, lane: Any, design: Any, readings: Any) -> Callable[..., Any]:
    soil = soil_in(ws)
    if soil is None:
        return lambda ws, lane, design, readings: constants_of(design, readings, 0)
    source = "def in_lane(ws, lane, design, readings):\n return constants(design, readings, load_given(ws, lane))"
    return function_of(source, constants=soil.constants(len(ws[1])), load_given=load_given)


def align_stack() -> None:
    """Let the function that calls this keep its stack on whole lines of the fast memory, as the workspace is.

    What finds no room in the registers goes to the stack, a vector as long as a line: nearly four hundred times in a
    step. By default a vector may lie across two lines there, which takes twice as long.
    """


def copy_lane(ws: Any, lane: int, other: int, end: int) -> None:
    """Copy the numbers of one lane to another, up to before an offset, and its soil where it is not uniform."""
    numbers, soil = ws, soil_in(ws)
    if soil is not None:
        numbers, behind = ws.numbers, SOIL + soil.size(len(ws.parts))
        numbers[other + SOIL : other + behind : LANES] = numbers[lane + SOIL : lane + behind : LANES]
    numbers[other : other + end : LANES] = numbers[lane : lane + end : LANES]
