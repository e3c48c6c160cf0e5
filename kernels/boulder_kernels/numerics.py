"""Sine, versine, angles, roots and long sums without branches, so that a loop over lanes or elements stays vectorised.

**Roots** in a bracket by the Illinois method: regula falsi whose ends do not stall. M. Dowell and P. Jarratt, A
modified regula falsi method for computing the root of an equation, BIT 11 (1971), 168-174. The functions here narrow a
bracket; the caller evaluates its own function in between, because a function passed as an argument could not be
compiled ahead and kept.

**Long sums** have the same bits on every processor. A compiler that may reorder a sum chooses the order by how wide the
registers are, and another processor gives other last bits. Here a long sum is made of `WIDTH` partial ones, in an order
of its own, which registers of any width can keep up with:

    sums = partial_sums()
    whole = count - count % WIDTH
    for first in range(0, whole, WIDTH):
        for j in range(WIDTH):
            add(sums, j, ...)            # element first + j
    for j in range(count - whole):
        add(sums, j, ...)                # element whole + j
    return total(sums, 0), total(sums, WIDTH)

The loop over j is vectorised if its elements are read by `field`, whose index need not be checked.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, get_type_hints

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils

from ._jit import exact_inlined, inlined, overload


@functools.cache
def record_type(kind: Any) -> np.dtype:
    """Return the type of a record with a number for each field of a named tuple, or a record where it is one itself."""
    fields = get_type_hints(kind).items()
    return np.dtype(
        (np.record, [(name, record_type(each) if hasattr(each, "_fields") else np.float64) for name, each in fields])
    )


def records_of(kind: Any, columns: Iterable[Any]) -> np.ndarray:
    """Return columns of n numbers, one for each field of a named tuple, as n records."""
    return np.rec.fromarrays([np.asarray(column, dtype=float) for column in columns], dtype=record_type(kind))


class SineVersine(NamedTuple):
    """sin(theta) and 1 - cos(theta)."""

    sin: float
    versin: float


@inlined
def sine_versine(theta: float) -> SineVersine:
    """Sine and versine of an angle by polynomials of its half.

    The versine is returned in place of the cosine because displacements need 1 - cos(theta), which a cosine near 1
    would give with a large relative error.

    ``theta``: angle [rad], |theta| <= pi; beyond, the polynomials leave the functions gradually.

    The absolute error of either is at most 1e-15 for |theta| <= pi; exact at 0.

    The coefficients interpolate (sin(x)/x - 1)/x^2 and (cos(x) - 1)/x^2 in x^2 at the eight Chebyshev nodes of [0,
    (pi/2)^2], computed in 50-digit arithmetic.
    """
    x = 0.5 * theta
    z = x * x
    s = 2.7314447669863995e-15
    s = s * z - 7.643970296798572e-13
    s = s * z + 1.6058977312464087e-10
    s = s * z - 2.5052107616996182e-08
    s = s * z + 2.7557319219163234e-06
    s = s * z - 0.00019841269841254974
    s = s * z + 0.008333333333333316
    s = s * z - 0.16666666666666666
    sin_half = x + x * z * s
    c = 4.6276759850181716e-14
    c = c * z - 1.1464689885720029e-11
    c = c * z + 2.0876630867422994e-09
    c = c * z - 2.755731776732053e-07
    c = c * z + 2.4801587292446213e-05
    c = c * z - 0.0013888888888860709
    c = c * z + 0.04166666666666634
    c = c * z - 0.5
    cos_half = 1.0 + z * c
    twice = 2.0 * sin_half
    return SineVersine(twice * cos_half, twice * sin_half)


@exact_inlined
def half_tangent(angle: float) -> float:
    """Tangent of half an angle of at most a right one, |angle| <= pi/2 [rad].

    Lambert's continued fraction x/(1 - x^2/(3 - x^2/(5 - ... x^2/17))) as a ratio of polynomials: to 5e-16 of itself.
    """
    x = 0.5 * angle
    z = x * x
    above = (((z - 990.0) * z + 135135.0) * z - 4729725.0) * z + 34459425.0
    below = (((45.0 * z - 13860.0) * z + 945945.0) * z - 16216200.0) * z + 34459425.0
    return x * above / below


@exact_inlined
def nearer(angle: float, x: float, y: float) -> float:
    """Angle [rad] nearer to the direction of (x, y), by the tangent of what is left."""
    s = sine_versine(angle)
    cos = 1.0 - s.versin
    return angle + (y * cos - x * s.sin) / (x * cos + y * s.sin)


@exact_inlined
def direction(x: float, y: float) -> float:
    """Angle of the point (x, y) in the first quadrant, atan(y/x) [rad], to rounding.

    The first guess is off by 0.072 rad at most, and each step leaves a third of the cube of that.
    """
    angle = 0.5 * math.pi * y / (x + y)
    return nearer(nearer(nearer(angle, x, y), x, y), x, y)


ITERATIONS = 50
"""More than any root here needs: the bracket at least halves every third time."""


class Bracket(NamedTuple):
    """Two points between which a function changes its sign."""

    low: float
    f_low: float
    high: float
    f_high: float
    side: float
    """Which end was moved last: -1 the low one, 1 the high one, 0 none."""


@inlined
def next_guess(b: Bracket) -> float:
    """Where the chord meets zero, or the middle where rounding puts that outside the bracket."""
    tau = b.high - b.f_high * (b.high - b.low) / (b.f_high - b.f_low)
    inside = (b.low < tau) & (tau < b.high)
    return tau if inside else 0.5 * (b.low + b.high)


@inlined
def narrowed(b: Bracket, tau: float, f: float) -> Bracket:
    """Bracket with the point tau, at which the function is f, in place of one end.

    An end that stays twice running has its value halved, which pulls the next chord over to it.
    """
    from_below = (f > 0.0) == (b.f_low > 0.0)
    f_low = 0.5 * b.f_low if b.side > 0.0 else b.f_low
    f_high = 0.5 * b.f_high if b.side < 0.0 else b.f_high
    return Bracket(
        tau if from_below else b.low,
        f if from_below else f_low,
        b.high if from_below else tau,
        f_high if from_below else f,
        -1.0 if from_below else 1.0,
    )


WIDTH = 32
"""Partial sums: with 8, a vector of the widest registers, the loop would be unrolled and not vectorised."""


@inlined
def field(values: np.ndarray, offset: int, index: int) -> float:
    """Return the number of an array at an offset and an index from it, neither negative."""
    number: float = values[np.uintp(offset + index)]  # no sign: nothing is counted from the end
    return number


@inlined
def put(values: np.ndarray, offset: int, index: int, value: float) -> None:
    """Write the number at an offset and an index from it, see `field`."""
    values[np.uintp(offset + index)] = value


@inlined
def write_numbers(to: np.ndarray, numbers: tuple[float, ...]) -> None:
    """Write the numbers of a tuple into the first places of an array, shape (m,)."""
    for i in range(len(numbers)):
        to[i] = numbers[i]


@numba.extending.intrinsic
def _room_for_sums(typing: Any) -> Any:
    """Return where there is room for partial sums on the stack, free again when the function returns; all zero."""

    def allocate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Reserve the room once, at the beginning of the function."""
        numbers = ir.ArrayType(ir.DoubleType(), 2 * WIDTH)
        room = cgutils.alloca_once(builder, numbers)
        builder.store(ir.Constant(numbers, None), room)
        return builder.bitcast(room, ir.DoubleType().as_pointer())

    return numba.types.CPointer(numba.types.float64)(), allocate


def partial_sums() -> np.ndarray:
    """Return the partial sums of two numbers for every element, all of them zero, shape (2 WIDTH,)."""
    return np.zeros(2 * WIDTH)


@overload(partial_sums)
def _partial_sums() -> Callable[..., np.ndarray]:
    room: Any = _room_for_sums
    return lambda: numba.carray(room(), (2 * WIDTH,))


@inlined
def add(sums: np.ndarray, j: int, one: float, other: float) -> None:
    """Add what an element has of both numbers to the partial sums j."""
    put(sums, 0, j, field(sums, 0, j) + one)
    put(sums, WIDTH, j, field(sums, WIDTH, j) + other)


@inlined
def total(sums: np.ndarray, first: int) -> float:
    """Return the sum of WIDTH partial sums, one after another."""
    result = 0.0
    for j in range(WIDTH):
        result += field(sums, first, j)
    return result
