"""How many floating-point operations a step takes, counted twice: in the formulas and in the machine code.

In the formulas, the kernels' Python functions are run with numbers that count what is done to them, in a separate
process with the compiler off. In the machine code, the packed instructions of the loop over the lanes are counted;
it has no branches, so each is executed once for every vector of lanes. The second count is what the processor does
and what rates are computed from; it is a little smaller, because the compiler computes common terms once.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from typing import Any, NamedTuple

EVALUATIONS_PER_STEP = 6
"""Stages of a step that are new: the first is the last of the step before."""


class Operations(NamedTuple):
    """Counts of operations."""

    add: int
    multiply: int
    divide: int
    least_or_most: int
    """Minima and maxima; processors do them in the same units, but they are not counted as flops."""

    @property
    def flops(self) -> int:
        """Additions, subtractions, multiplications and divisions; a fused multiply-add is two."""
        return self.add + self.multiply + self.divide


class Tally:
    """Collects what the counting numbers report."""

    def __init__(self) -> None:
        self.add = self.multiply = self.divide = self.least_or_most = 0

    def operations(self) -> Operations:
        """Counts so far."""
        return Operations(self.add, self.multiply, self.divide, self.least_or_most)


class Counted:
    """A number that counts the operations done to it. Signs and moduli are bits and cost nothing."""

    def __init__(self, value: float, tally: Tally) -> None:
        self.value, self.tally = float(value), tally

    def _new(self, value: float, kind: str) -> Counted:
        setattr(self.tally, kind, getattr(self.tally, kind) + 1)
        return Counted(value, self.tally)

    def __float__(self) -> float:
        return self.value

    def __add__(self, other: Any) -> Counted:
        return self._new(self.value + float(other), "add")

    def __sub__(self, other: Any) -> Counted:
        return self._new(self.value - float(other), "add")

    def __rsub__(self, other: Any) -> Counted:
        return self._new(float(other) - self.value, "add")

    def __mul__(self, other: Any) -> Counted:
        return self._new(self.value * float(other), "multiply")

    def __truediv__(self, other: Any) -> Counted:
        return self._new(self.value / float(other), "divide")

    def __rtruediv__(self, other: Any) -> Counted:
        return self._new(float(other) / self.value, "divide")

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Counted:
        return Counted(-self.value, self.tally)

    def __abs__(self) -> Counted:
        return Counted(abs(self.value), self.tally)


class _CountingMath:
    """Replaces the functions, other than arithmetic, that the right-hand side calls."""

    def __init__(self, tally: Tally) -> None:
        self._tally = tally

    def copysign(self, value: Any, sign: Any) -> Counted:
        return Counted(math.copysign(float(value), float(sign)), self._tally)

    def min(self, a: Any, b: Any) -> Counted:
        return self._chosen(min(float(a), float(b)))

    def max(self, a: Any, b: Any) -> Counted:
        return self._chosen(max(float(a), float(b)))

    def _chosen(self, value: float) -> Counted:
        self._tally.least_or_most += 1
        return Counted(value, self._tally)


def operations_of_step() -> tuple[Operations, Operations]:
    """Count in the formulas: one evaluation of the right-hand side, and one step of six with its stages."""
    output = subprocess.run(
        [sys.executable, "-m", "benchmarks.flops"],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    evaluation, step = json.loads(output)
    return Operations(*evaluation), Operations(*step)


def _count() -> tuple[Operations, Operations]:
    """Count; runs in a process with the compiler off."""
    import boulder_kernels as bk
    from boulder_kernels import design, soil
    from boulder_kernels.design import design_at
    from boulder_kernels.dormand_prince import step
    from boulder_kernels.dynamics import (
        TURNING_FORWARD,
        Acceleration,
        Modes,
        State,
        Switches,
        acceleration,
        switches_of,
    )

    from .designs import sample

    readings = bk.corrected()
    plain = bk.constants_of(design_at(sample(1), 0), readings, 0)
    modes = Modes(TURNING_FORWARD, True, 1.0, 1.0, 0, 0)

    def counted(kind: Any, values: Any, tally: Tally) -> Any:
        return kind(*(value if isinstance(value, int) else Counted(value, tally) for value in values))

    counts = []
    for whole_step in (False, True):
        tally = Tally()
        counting = _CountingMath(tally)
        vars(soil).update(math=counting, min=counting.min, max=counting.max)
        vars(design).update(min=counting.min)
        c = counted(bk.Constants, plain, tally)
        s = counted(Switches, switches_of(modes, readings, plain), tally)
        y = counted(State, (0.02, 1.0, 0.03, 0.5, 0.2, 10.0), tally)
        if whole_step:
            step(y, counted(Acceleration, (1.0, 2.0, -3.0, 4.0), tally), Counted(0.01, tally), s, c)
        else:
            acceleration(*y, s, c)
        counts.append(tally.operations())
    return counts[0], counts[1]


_PACKED = re.compile(r"\bv?(fn?m(?:add|sub)\w*|add|sub|mul|div|min|max)pd\s+(.*)")


def operations_in_machine_code(assembly: str) -> Operations:
    """Count the packed instructions of a function whose body is one loop over lanes, for one lane.

    Parameters
    ----------
    assembly
        Of the function, AT&T or Intel form; scalar instructions and moves are passed over.
    """
    add = multiply = divide = least_or_most = 0
    for kind, _ in _PACKED.findall(assembly):
        if kind.startswith("f"):
            add, multiply = add + 1, multiply + 1
        elif kind in ("add", "sub"):
            add += 1
        elif kind == "mul":
            multiply += 1
        elif kind == "div":
            divide += 1
        else:
            least_or_most += 1
    return Operations(add, multiply, divide, least_or_most)


def packed_instructions(assembly: str) -> int:
    """Count the packed floating-point instructions, a fused multiply-add as one."""
    return len(_PACKED.findall(assembly))


def assembly_of(kernel: Any, *arguments: Any) -> str:
    """Return the machine code of a kernel; compiled anew, because code loaded from the cache cannot be inspected."""
    import numba

    from boulder_kernels._jit import compiler

    compiler()  # tells Numba of what is no kernel
    options = {name: value for name, value in kernel.options.items() if name not in ("cache", "nopython")}
    again = numba.njit(**options)(kernel.py_func)
    again(*arguments)
    return str(again.inspect_asm(again.signatures[0]))


if __name__ == "__main__":
    print(json.dumps(_count()))
