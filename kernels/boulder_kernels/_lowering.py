"""What a place in the workspace, and a design of a table, become in compiled kernels: loads and stores, one a number.

As code to be compiled and inlined wherever it is called this would take a third of the time of all kernels to compile.
A copy of a lane by a loop would be compiled to vectors gathered and scattered, which take three times as long. Numba is
told of it when the first kernel is compiled, see `boulder_kernels._jit.when_compiling`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_type_hints

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable
from numba.np import arrayobj

from .design import Design, design_in
from .flat import WIDTH, field, partial_sums, put
from .workspace import KNOWN, LANES, RECORDS, align_stack, copy_lane, load, offsets_of, store

LINE = 64
"""Bytes of a line of the fast memory."""
_NOT_REAL = {int: types.int64, bool: types.boolean}


def _pointer(context: Any, builder: Any, kinds: Any, values: Any, offset: int = 0) -> Any:
    """Where a number lies: from the workspace on, the sum of some whole numbers and an offset."""
    first = context.get_constant(types.intp, offset)
    for kind, value in zip(kinds[1:], values[1:], strict=True):
        first = builder.add(first, context.cast(builder, value, kind, types.intp))
    return builder.gep(context.make_array(kinds[0])(context, builder, values[0]).data, [first], inbounds=True)


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
    return lambda ws, place, lane: ws.dtype


@lower_builtin(field, types.Array, types.Any, types.Any)
def _lower_field(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.load(_pointer(context, builder, sig.args[:3], args[:3]))


@type_callable(put)
def _type_put(context: Any) -> Callable[..., Any]:
    return lambda ws, place, lane, value: types.void


@lower_builtin(put, types.Array, types.Any, types.Any, types.Any)
def _lower_put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    value = context.cast(builder, args[3], sig.args[3], sig.args[0].dtype)
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


@type_callable(load)
def _type_load(context: Any) -> Callable[..., Any]:
    def result(ws: Any, place: Any, lane: Any) -> Any:
        """Return the type of the record, or None where the place is not yet known as a constant."""
        if not isinstance(place, types.IntegerLiteral):
            return None
        record = RECORDS[place.literal_value]
        kinds = [_NOT_REAL.get(kind, ws.dtype) for kind in get_type_hints(record).values()]
        return types.BaseTuple.from_types(kinds, record)

    return result


@lower_builtin(load, types.Array, types.IntegerLiteral, types.Any)
def _lower_load(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    record = sig.return_type.instance_class
    offsets = offsets_of(record)
    values = []
    for name, kind in zip(record._fields, sig.return_type.types, strict=True):
        if name in offsets:
            number = builder.load(_pointer(context, builder, sig.args[:3], args[:3], offsets[name]))
            values.append(context.cast(builder, number, sig.args[0].dtype, kind))
        else:
            values.append(context.get_constant(kind, KNOWN[name]))
    return context.make_tuple(builder, sig.return_type, values)


@type_callable(store)
def _type_store(context: Any) -> Callable[..., Any]:
    return lambda ws, place, lane, record: types.void


@lower_builtin(store, types.Array, types.Any, types.Any, types.BaseNamedTuple)
def _lower_store(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    record = sig.args[3]
    offsets = offsets_of(record.instance_class)
    for i, (name, kind) in enumerate(zip(record.fields, record.types, strict=True)):
        if name in offsets:
            value = context.cast(builder, builder.extract_value(args[3], i), kind, sig.args[0].dtype)
            builder.store(value, _pointer(context, builder, sig.args[:3], args[:3], offsets[name]))
    return context.get_dummy_value()


@type_callable(copy_lane)
def _type_copy_lane(context: Any) -> Callable[..., Any]:
    def result(ws: Any, lane: Any, other: Any, end: Any) -> Any:
        """Return the type of the result, or None where the end is not yet known as a constant."""
        return types.void if isinstance(end, types.IntegerLiteral) else None

    return result


@lower_builtin(copy_lane, types.Array, types.Any, types.Any, types.IntegerLiteral)
def _lower_copy_lane(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    for place in range(0, sig.args[3].literal_value, LANES):
        source, target = (
            _pointer(context, builder, (sig.args[0], sig.args[i]), (args[0], args[i]), place) for i in (1, 2)
        )
        builder.store(builder.load(source), target)
    return context.get_dummy_value()


# Inside kernels it is one load for every field: an index that need not be checked lets a loop over rows be vectorised.


@type_callable(design_in)
def _type_design_in(context: Any) -> Callable[..., Any]:
    def result(designs: Any, row: Any) -> Any:
        """Return the type of the result, or None where a column is not one piece of memory."""
        return types.NamedUniTuple(designs.dtype, len(Design._fields), Design) if designs.layout == "C" else None

    return result


@lower_builtin(design_in, types.Array, types.Any)
def _lower_design_in(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    designs = context.make_array(sig.args[0])(context, builder, args[0])
    columns = builder.extract_value(designs.shape, 1)
    place, numbers = context.cast(builder, args[1], sig.args[1], types.intp), []
    for _ in Design._fields:
        numbers.append(builder.load(builder.gep(designs.data, [place], inbounds=True)))
        place = builder.add(place, columns)
    return context.make_tuple(builder, sig.return_type, numbers)
