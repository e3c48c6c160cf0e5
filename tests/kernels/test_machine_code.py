"""The code that the compiler made of the lanes: vectors as wide as the processor has, and no number on its own."""

import platform
import re
from collections import Counter

import llvmlite.binding
import numba
import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of, design_in
from boulder_kernels.heave import ROOM, Base, HeaveOptions, forces, heave_constants, prepare
from boulder_kernels.impact import simulate_alone
from boulder_kernels.lanes import LANES, empty_groups
from boulder_kernels.second_opinion import WORKSPACE, HeaveControl, no_heave_record, potential_energy, simulate_heave
from boulder_kernels.table import (
    attempt_steps,
    compute_constants,
    run_lanes,
    stand_still,
    take_first_steps,
    take_over_steps,
)

from .samples import control, random_designs, table_of

pytestmark = pytest.mark.compiled

CALL = re.compile(r"^\s*(call|bl)\w*\s.*(sine_versine|acceleration|closed_form|soil)", re.MULTILINE)
PACKED = re.compile(r"^\s*(v?\w+pd)\b.*%(zmm|ymm|xmm)", re.MULTILINE)
FUSED = re.compile(r"fn?m(add|sub)")
SCALAR = re.compile(r"^\s*v?(add|sub|mul|div|f?n?madd\w*|f?n?msub\w*|max|min|sqrt)sd\b", re.MULTILINE)


def makes_use_of(feature: str) -> bool:
    """Whether code is made for processors with a feature: the host's, unless the user has named others."""
    if numba.config.CPU_FEATURES is not None:
        return f"+{feature}" in numba.config.CPU_FEATURES
    return numba.config.CPU_NAME is None and llvmlite.binding.get_host_cpu_features().get(feature, False)


def widest() -> str:
    """Widest registers the code is to use, or none where the processor is of another kind."""
    if platform.machine() not in ("x86_64", "AMD64"):
        return ""
    if makes_use_of("avx512f") and "-prefer-256-bit" in (numba.config.CPU_FEATURES or ""):
        return "zmm"
    return "ymm" if makes_use_of("avx2") else "xmm"


def assembly(kernel, *arguments: object) -> str:
    """Machine code of a kernel for the types of these arguments.

    Code that comes out of the cache has no listing, so it is compiled afresh.
    """
    fresh = numba.njit(**kernel.options)(kernel.py_func)
    fresh(*arguments)
    return "\n".join(fresh.inspect_asm().values())


def widths(code: str) -> Counter[str]:
    """How many packed instructions on doubles there are by kind and register."""
    return Counter(f"{'fma' if FUSED.search(op) else op.removeprefix('v')[:3]} {register}"
                   for op, register in PACKED.findall(code))  # fmt: skip


@pytest.fixture(scope="module")
def step_code() -> str:
    return assembly(attempt_steps, empty_groups()[0])


@pytest.fixture(scope="module")
def take_over_code() -> str:
    return assembly(take_over_steps, empty_groups()[0])


def test_steps_are_vectorised(step_code: str) -> None:
    """Hundreds of operations on whole registers a step, multiply-adds fused where there are such.

    On processors of another kind, where instructions have other names: no call is left in the loop.
    """
    assert not CALL.search(step_code)
    found, register = widths(step_code), widest()
    if register:
        assert found[f"fma {register}" if makes_use_of("fma") else f"mul {register}"] > 300
        assert found[f"div {register}"] >= 6


def test_the_stack_of_a_second_opinion_begins_on_a_whole_line() -> None:
    """Else each vector that lies there may take two lines of the fast memory."""
    design = random_designs(1, seed=160)[0]
    f = heave_constants(design, constants_of(design, bk.corrected(), 0), HeaveOptions(True, True), Base(), 1)
    work = np.zeros(WORKSPACE)
    prepare(work, f)
    code = assembly(simulate_heave, f, 6800.0, HeaveControl(0.35, 0.1), work, no_heave_record())
    if widest():
        assert "andq\t$-64, %rsp" in code


def test_no_scalar_arithmetic_in_the_steps(step_code: str) -> None:
    """No division, nor any other operation, that is done for one lane at a time."""
    assert [match.group(0).strip() for match in SCALAR.finditer(step_code)] == []


def test_taking_over_is_vectorised(take_over_code: str) -> None:
    assert not CALL.search(take_over_code)
    found, register = widths(take_over_code), widest()
    if register and register != "xmm":
        assert found[f"fma {register}"] > 20


HOW = control(8e-3, 1.0, 0.3, stop_at_limit=True)
DESIGNS = np.stack(table_of(random_designs(LANES, seed=142)))
STARTS = {
    compute_constants: (DESIGNS, 0, bk.corrected(), HOW),
    stand_still: (bk.corrected(), HOW),
    take_first_steps: (bk.corrected(), HOW),
}


@pytest.mark.parametrize("kernel", STARTS, ids=lambda kernel: kernel.__name__)
def test_starts_are_vectorised(kernel) -> None:
    """Constants, first steps and their ends: whole registers, next to nothing a lane at a time."""
    code = assembly(kernel, empty_groups()[0], *STARTS[kernel])
    assert not CALL.search(code)
    found, register = widths(code), widest()
    if register and register != "xmm":
        packed = sum(count for name, count in found.items() if name.endswith(register))
        assert packed > 100
        assert len(SCALAR.findall(code)) < packed / 10


IN_SOILS = (attempt_steps, take_over_steps, compute_constants)


@pytest.mark.parametrize("kernel", IN_SOILS, ids=lambda kernel: kernel.__name__)
@pytest.mark.parametrize(("pieces", "strength", "outline"), [(2, True, False), (1, False, True), (2, True, True)])
def test_pieces_of_soil_are_vectorised(pieces: int, strength: bool, outline: bool, kernel) -> None:
    """Written out part by part, so that neither a loop nor a branch nor a logarithm keeps the lanes apart."""
    given = np.zeros((22 + 8 * pieces, LANES))
    starting = (given, 0, bk.corrected(), HOW) if kernel is compute_constants else ()
    group = empty_groups(pieces, has_strength=strength, has_outline=outline)[0]
    code = assembly(kernel, group, *starting)
    assert not CALL.search(code)
    found, register = widths(code), widest()
    if register and register != "xmm":
        packed = sum(count for name, count in found.items() if name.endswith(register))
        assert packed > 100
        assert len(SCALAR.findall(code)) < packed / 10


def test_pieces_of_a_second_opinion_are_vectorised() -> None:
    """Soil, sides and foot of one impact: roots and divisions in whole registers; only the ends of sums are left."""
    design = random_designs(1, seed=143)[0]
    f = heave_constants(design, constants_of(design, bk.corrected(), 0), HeaveOptions(True, True), Base(), 1)
    work = np.zeros(ROOM)
    prepare(work, f)
    code = assembly(forces, 0.05, 1.0, 0.05, 0.5, 0.01, 0.1, 0.6, 12.0, True, work, f)
    held = assembly(potential_energy, 0.05, 0.05, 0.01, work, f)
    assert not CALL.search(code + held)
    found, register = widths(code), widest()
    if register and register != "xmm":
        assert found[f"div {register}"] >= 1
        assert found[f"sqr {register}"] >= 2
        assert widths(held)[f"max {register}"] >= 2


def test_wide_vectors_are_asked_for() -> None:
    """On processors that have them, unless the user has said otherwise."""
    if llvmlite.binding.get_host_cpu_features().get("avx512f") and numba.config.CPU_NAME is None:
        assert numba.config.CPU_FEATURES is not None


def test_kernels_leave_the_interpreter_lock_free() -> None:
    """All kernels are compiled without the interpreter: they run side by side in threads."""
    for kernel in (run_lanes, simulate_alone, attempt_steps, take_over_steps):
        assert kernel.options["nogil"]


def test_a_design_is_read_from_any_order_of_an_array() -> None:
    """Rows are asked for by their number, wherever they lie in memory."""
    table = np.stack(table_of(random_designs(3, seed=160)))
    first = numba.njit(lambda designs: design_in(designs, 0))
    assert first(table) == design_in(table, 0) == first(np.asfortranarray(table))
