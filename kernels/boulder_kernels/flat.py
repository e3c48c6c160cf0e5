"""Numbers in flat arrays, and long sums whose bits do not depend on the processor.

A compiler that may reorder a sum chooses the order by how wide the registers are, and another processor gives other
last bits. Here a long sum is made of `WIDTH` partial ones, in an order of its own, which registers of any width can
keep up with:

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

from typing import Any

import numpy as np

from ._jit import inlined

WIDTH = 32
"""Partial sums: with 8, a vector of the widest registers, the loop would be unrolled and not vectorised."""


def field(values: Any, place: int, offset: int) -> float:
    """Return the number at a place and an offset from it, neither negative, of an array or a record that begins so."""
    # A number of NumPy's, so that lanes without a design divide by zero here as they do when compiled.
    number: float = (values[0] if isinstance(values, tuple) else values)[place + offset]
    return number


def put(values: Any, place: int, offset: int, value: float) -> None:
    """Write the number at a place and an offset from it, see `field`."""
    (values[0] if isinstance(values, tuple) else values)[place + offset] = value


def partial_sums() -> np.ndarray:
    """Return the partial sums of two numbers for every element, all of them zero, shape (2 WIDTH,)."""
    return np.zeros(2 * WIDTH)


@inlined
def add(sums: np.ndarray, j: int, one: float, other: float) -> None:
    """Add what an element has of both numbers to the partial sums j."""
    put(sums, 0, j, field(sums, 0, j) + one)
    put(sums, WIDTH, j, field(sums, WIDTH, j) + other)


@inlined
def total(sums: np.ndarray, first: int) -> float:
    """Return the sum of WIDTH partial sums, one after another."""
    found = 0.0
    for j in range(WIDTH):
        found += field(sums, first, j)
    return found
