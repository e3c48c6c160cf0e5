"""What a record in the workspace, and a design of a table, become in compiled kernels: loads and stores, one a number.

As code to be compiled and inlined wherever it is called this would take a third of the time of all kernels to compile.
A copy of a lane by a loop would be compiled to vectors gathered and scattered, which take three times as long. Numba is
told of it when the package is imported.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_type_hints

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable
from numba.np import arrayobj

from ._jit import rows_of
from .design import Constants, Design
from .layered import LayeredConstants
from .numerics import WIDTH, field, partial_sums, put
from .workspace import (
    CONSTANTS,
    KNOWN,
    LANES,
    RECORDS,
    SOIL,
    align_stack,
    copy_lane,
    given_offset,
    load,
    load_given,
    offsets_of,
    part,
    soil_in,
    store,
    store_given,
)

LINE = 64
"""Bytes of a line of the fast memory."""
_NOT_REAL = {int: types.int64, bool: types.boolean}


def _array(kind: Any) -> Any:
    """Type of the array that a workspace is, or begins with."""
    return kind if isinstance(kind, types.Array) else kind[0]


def _pointer(context: Any, builder: Any, kinds: Any, values: Any, offset: int = 0) -> Any:
    """Where a number lies: from the workspace on, the sum of some whole numbers and an offset."""
    first = context.get_constant(types.intp, offset)
    for kind, value in zip(kinds[1:], values[1:], strict=True):
        first = builder.add(first, context.cast(builder, value, kind, types.intp))
    array = values[0] if isinstance(kinds[0], types.Array) else builder.extract_value(values[0], 0)
    return builder.gep(context.make_array(_array(kinds[0]))(context, builder, array).data, [first], inbounds=True)


@type_callable(align_stack)
def _type_align_stack(context: Any) -> Callable[..., Any]:
    return lambda: types.void


@lower_builtin(align_stack)
def _lower_align_stack(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.function.attributes.add("nounwind")  # as it is anyway: llvmlite writes no alignment of the stack alone
    builder.function.attributes.alignstack = LINE
    return context.get_dummy_value()


@type_callable(field)
def _type_field(context: Any) -> Callable[..., Any]:
    return lambda ws, offset, lane: _array(ws).dtype


@lower_builtin(field, types.Any, types.Any, types.Any)
def _lower_field(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_pointer(context, builder, sig.args[:3], args[:3]))


@type_callable(put)
def _type_put(context: Any) -> Callable[..., Any]:
    return lambda ws, offset, lane, value: types.void


@lower_builtin(put, types.Any, types.Any, types.Any, types.Any)
def _lower_put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    value = context.cast(builder, args[3], sig.args[3], _array(sig.args[0]).dtype)
    builder.store(value, _pointer(context, builder, sig.args[:3], args[:3]))
    return context.get_dummy_value()


@type_callable(partial_sums)
def _type_partial_sums(context: Any) -> Callable[..., Any]:
    return lambda: types.Array(types.float64, 1, "C")


@lower_builtin(partial_sums)
def _lower_partial_sums(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Room on the stack, free again when the function returns: nothing that the array is passed to keeps it."""
    numbers = ir.ArrayType(ir.DoubleType(), 2 * WIDTH)
    room = cgutils.alloca_once(builder, numbers)
    builder.store(ir.Constant(numbers, None), room)
    size, array = context.get_constant(types.intp, 8), context.make_array(sig.return_type)(context, builder)
    shape, data = [context.get_constant(types.intp, 2 * WIDTH)], builder.bitcast(room, array.data.type)
    arrayobj.populate_array(array, data=data, shape=shape, strides=[size], itemsize=size, meminfo=None)
    return array._getvalue()


@type_callable(part)
def _type_part(context: Any) -> Callable[..., Any]:
    return lambda ws, start: ws


@lower_builtin(part, types.Any, types.Any)
def _lower_part(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Move the beginning of the array; its length is not asked for, and nothing keeps the array."""
    whole = args[0] if isinstance(sig.args[0], types.Array) else builder.extract_value(args[0], 0)
    moved = context.make_array(_array(sig.args[0]))(context, builder, whole)
    moved.data = _pointer(context, builder, sig.args, args)
    moved.meminfo = cgutils.get_null_value(moved.meminfo.type)  # or Numba would give the memory back with the part
    value = moved._getvalue()
    return value if isinstance(sig.args[0], types.Array) else builder.insert_value(args[0], value, 0)


def _record(ws: Any, record: Any) -> Any:
    """Type of a record of numbers that are kept, or known, of a workspace of a type."""
    real = _array(ws).dtype
    return types.BaseTuple.from_types([_NOT_REAL.get(kind, real) for kind in get_type_hints(record).values()], record)


def _parts(ws: Any, part: Any) -> Any:
    """Type of as many records as the soil of a lane has parts."""
    return types.UniTuple(_record(ws, part), len(ws[1]))


def _soil(ws: Any) -> Any:
    """Type of the soil of a lane."""
    soil: Any = soil_in(ws)
    return types.NamedTuple([_record(ws, soil.whole), _parts(ws, soil.part)], soil.record)


@type_callable(load)
def _type_load(context: Any) -> Callable[..., Any]:
    def result(ws: Any, offset: Any, lane: Any) -> Any:
        """Return the type of the record, or None where the offset is not yet known as a constant."""
        if not isinstance(offset, types.IntegerLiteral):
            return None
        kind = _record(ws, RECORDS[offset.literal_value])
        if offset.literal_value == CONSTANTS and not isinstance(ws, types.Array):
            return types.NamedTuple([*kind.types, _soil(ws)], LayeredConstants)
        return kind

    return result


def _load_numbers(context: Any, builder: Any, sig: Any, args: Any, kind: Any, offset: int) -> tuple[Any, int]:
    """Load numbers one after another into records within records; return it and the offset behind."""
    if isinstance(kind, types.Float):
        kinds, values = (sig.args[0], sig.args[-1]), (args[0], args[-1])
        return builder.load(_pointer(context, builder, kinds, values, offset)), offset + LANES
    fields = []
    for each in kind.types:
        value, offset = _load_numbers(context, builder, sig, args, each, offset)
        fields.append(value)
    return context.make_tuple(builder, kind, fields), offset


def _store_numbers(context: Any, builder: Any, ws: Any, lane: Any, record: Any, offset: int) -> int:
    """Store the numbers of records within records one after another, all as (type, value); return the offset behind."""
    kind, value = record
    if isinstance(kind, types.Float):
        builder.store(value, _pointer(context, builder, (ws[0], lane[0]), (ws[1], lane[1]), offset))
        return offset + LANES
    for i, each in enumerate(kind.types):
        offset = _store_numbers(context, builder, ws, lane, (each, builder.extract_value(value, i)), offset)
    return offset


@lower_builtin(load, types.Any, types.IntegerLiteral, types.Any)
def _lower_load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    record = RECORDS[sig.args[1].literal_value]
    offsets = offsets_of(record)
    values = []
    for name, kind in zip(record._fields, sig.return_type.types, strict=False):
        if name in offsets:
            number = builder.load(_pointer(context, builder, sig.args[:3], args[:3], offsets[name]))
            values.append(context.cast(builder, number, _array(sig.args[0]).dtype, kind))
        else:
            values.append(context.get_constant(kind, KNOWN[name]))
    if len(values) < len(sig.return_type):
        values.append(_load_numbers(context, builder, sig, args, sig.return_type.types[-1], SOIL)[0])
    return context.make_tuple(builder, sig.return_type, values)


@type_callable(load_given)
def _type_load_given(context: Any) -> Callable[..., Any]:
    def result(ws: Any, lane: Any) -> Any:
        """Return the type of the parts, or of another record and of them."""
        soil: Any = soil_in(ws)
        parts = _parts(ws, soil.given_part)
        return types.Tuple([_record(ws, soil.given_whole), parts]) if soil.given_whole._fields else parts

    return result


@lower_builtin(load_given, types.Any, types.Any)
def _lower_load_given(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    soil: Any = soil_in(sig.args[0])
    return _load_numbers(context, builder, sig, args, sig.return_type, given_offset(soil, len(sig.args[0][1])))[0]


@type_callable(store)
def _type_store(context: Any) -> Callable[..., Any]:
    return lambda ws, offset, lane, record: types.void


@lower_builtin(store, types.Any, types.Any, types.Any, types.BaseNamedTuple)
def _lower_store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    record = sig.args[3]
    layered = record.instance_class is LayeredConstants
    offsets = offsets_of(Constants if layered else record.instance_class)
    for i, (name, kind) in enumerate(zip(record.fields, record.types, strict=True)):
        if name in offsets:
            value = context.cast(builder, builder.extract_value(args[3], i), kind, _array(sig.args[0]).dtype)
            builder.store(value, _pointer(context, builder, sig.args[:3], args[:3], offsets[name]))
    if layered:
        last = len(record.types) - 1
        soil = record.types[last], builder.extract_value(args[3], last)
        _store_numbers(context, builder, (sig.args[0], args[0]), (sig.args[2], args[2]), soil, SOIL)
    return context.get_dummy_value()


@type_callable(store_given)
def _type_store_given(context: Any) -> Callable[..., Any]:
    return lambda ws, lane, designs, row: types.void


@lower_builtin(store_given, types.Any, types.Any, types.Array, types.Any)
def _lower_store_given(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    if isinstance(sig.args[0], types.Array):
        return context.get_dummy_value()
    soil: Any = soil_in(sig.args[0])
    count = len(sig.args[0][1])
    size = soil.given_size(count) // LANES
    for i, number in enumerate(rows_of(context, builder, sig.args[2:], args[2:], len(Design._fields), size)):
        offset = given_offset(soil, count) + i * LANES
        builder.store(number, _pointer(context, builder, sig.args[:2], args[:2], offset))
    return context.get_dummy_value()


@type_callable(copy_lane)
def _type_copy_lane(context: Any) -> Callable[..., Any]:
    def result(ws: Any, lane: Any, other: Any, end: Any) -> Any:
        """Return the type of the result, or None where the end is not yet known as a constant."""
        return types.void if isinstance(end, types.IntegerLiteral) else None

    return result


@lower_builtin(copy_lane, types.Any, types.Any, types.Any, types.IntegerLiteral)
def _lower_copy_lane(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    offsets = [*range(0, sig.args[3].literal_value, LANES)]
    if not isinstance(sig.args[0], types.Array):
        soil: Any = soil_in(sig.args[0])
        offsets += range(SOIL, SOIL + soil.size(len(sig.args[0][1])), LANES)
    for offset in offsets:
        source, target = (
            _pointer(context, builder, (sig.args[0], sig.args[i]), (args[0], args[i]), offset) for i in (1, 2)
        )
        builder.store(builder.load(source), target)
    return context.get_dummy_value()
