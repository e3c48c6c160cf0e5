"""How operations are counted, in the formulas and in machine code, and the loop that shows the core's peak."""

import re

import numpy as np
import pytest

from benchmarks.flops import (
    EVALUATIONS_PER_STEP,
    Counted,
    Operations,
    Tally,
    assembly_of,
    operations_in_machine_code,
    operations_of_step,
    packed_instructions,
)
from benchmarks.peak import ITERATIONS, PeakLoop
from boulder_kernels import lanes
from boulder_kernels.dormand_prince import AA, STAGES, A
from boulder_kernels.workspace import SIZE


def test_a_counted_number_counts_what_is_done_to_it() -> None:
    tally = Tally()
    x, y = Counted(3.0, tally), Counted(4.0, tally)
    result = (2.0 * x + y * y - 1.0) / (5.0 - y)
    assert float(result) == 21.0
    assert tally.operations() == Operations(add=3, multiply=2, divide=1, least_or_most=0)
    assert float(-abs(-x)) == -3.0
    assert tally.operations().flops == 6


def stage_operations() -> int:
    """Operations of the stages of a step by hand, for three degrees of freedom: sums of products and their scaling.

    With n weights that are not zero, h times their sum takes n products, n - 1 sums and one product more; the velocity
    adds it to v. The displacement has h times (C v + h times the like), where C v is a product unless C is 1.
    """
    total = 0
    for i in range(1, STAGES):
        velocity = sum(1 for weight in A[i][:i] if weight != 0.0)
        total += 2 * velocity + 1
        displacement = sum(1 for weight in AA[i][:i] if abs(weight) > 1e-12)
        total += 2  # h times the bracket, added to x
        total += 0 if i >= 5 else 1  # C v
        total += 2 * displacement + 1 if displacement else 0  # h times the sum, added to C v
    return 3 * total


def error_operations() -> int:
    """The same of the error of a step: three sums of six products, the arm of one, the sum of all, times h."""
    return 3 * (6 + 5) + 2 + 2 + 1


def test_a_step_is_six_evaluations_and_its_stages() -> None:
    evaluation, step = operations_of_step()
    assert step.flops == EVALUATIONS_PER_STEP * evaluation.flops + stage_operations() + error_operations()
    assert step.least_or_most == EVALUATIONS_PER_STEP * evaluation.least_or_most + 1
    assert evaluation.divide == 1


def test_machine_code_does_what_the_formulas_say() -> None:
    """The compiler computes common terms once and no term twice."""
    evaluation, step = operations_of_step()
    executed = operations_in_machine_code(assembly_of(lanes.attempt_steps, np.zeros(SIZE)))
    assert executed.divide == step.divide
    # The minimum in the arm of the error is one instruction, or a comparison and a choice, as the processor has it.
    assert executed.least_or_most in (step.least_or_most, EVALUATIONS_PER_STEP * evaluation.least_or_most)
    assert 0.9 * step.flops <= executed.flops <= step.flops


def test_packed_instructions_are_told_from_others() -> None:
    assembly = """
        vfmadd213pd (%rax), %zmm0, %zmm8
        vfnmadd231pd %ymm1, %ymm2, %ymm3
        vmulpd %zmm1, %zmm2, %zmm3
        vmulsd %xmm1, %xmm2, %xmm3
        vaddpd %zmm1, %zmm2, %zmm3
        vsubpd %zmm1, %zmm2, %zmm3
        vdivpd %zmm1, %zmm2, %zmm3
        vmaxpd %zmm1, %zmm2, %zmm3
        vminpd %zmm1, %zmm2, %zmm3
        vmovupd %zmm1, (%rax)
        vandpd %zmm1, %zmm2, %zmm3
    """
    assert operations_in_machine_code(assembly) == Operations(add=4, multiply=3, divide=1, least_or_most=2)
    assert packed_instructions(assembly) == 8


@pytest.fixture(scope="module")
def peak() -> PeakLoop:
    return PeakLoop()


def test_peak_loop_is_nothing_but_multiply_adds(peak: PeakLoop) -> None:
    """One instruction for each accumulator on its own register between the loop's label and its jump."""
    loop = re.search(r"\n\.LBB0_1:.*?\n((?:.*\n)*?)\s+j\w+\s+\.LBB0_1", peak.assembly)
    assert loop is not None
    lines = [line.strip() for line in loop.group(1).splitlines() if line.strip()]
    fused = [line for line in lines if line.startswith("vfmadd")]
    assert len(fused) == peak.accumulators
    assert len({line.split("%")[-1] for line in fused}) == peak.accumulators
    assert len(lines) <= peak.accumulators + 3
    assert peak.flops == 2 * ITERATIONS * peak.accumulators * peak.width


def test_peak_loop_computes_its_fixed_point(peak: PeakLoop) -> None:
    assert peak() == pytest.approx(1.0, abs=1e-12)
