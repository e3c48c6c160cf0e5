"""The peak rate of one core: a loop of nothing but fused multiply-adds in registers.

Written in LLVM IR, so that no optimiser changes the number of accumulators: each holds one vector and depends only on
itself, and there are enough of them to hide the latency of both units.
"""

from __future__ import annotations

import ctypes
import time

import llvmlite.binding
import llvmlite.ir
import numba

ACCUMULATORS = {8: 20, 4: 12, 2: 12}
"""Independent chains by the width of a vector, with 32 registers for AVX-512 and 16 without; two units times a latency
of four or five cycles need eight to ten."""
ITERATIONS = 1_000_000


class PeakLoop:
    """The compiled loop and the width of its vectors."""

    def __init__(self) -> None:
        # Numba initialises LLVM for this machine when it first compiles.
        numba.njit(lambda: 0)()
        features = llvmlite.binding.get_host_cpu_features()
        self.width = 8 if features.get("avx512f") else 4 if features.get("avx2") else 2
        """Doubles in a vector."""
        self.accumulators = ACCUMULATORS[self.width]
        """Vectors that are summed up at once."""
        machine = llvmlite.binding.Target.from_default_triple().create_target_machine(
            cpu=llvmlite.binding.get_host_cpu_name(), features=f"{features.flatten()},-prefer-256-bit", opt=3
        )
        module = llvmlite.binding.parse_assembly(str(self._module()))
        self.assembly = machine.emit_assembly(module)
        self._engine = llvmlite.binding.create_mcjit_compiler(module, machine)
        self._engine.finalize_object()
        address = self._engine.get_function_address("multiply_add")
        self._call = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_int64, ctypes.c_double)(address)

    @property
    def flops(self) -> int:
        """Floating-point operations of one call; a fused multiply-add is two."""
        return 2 * ITERATIONS * self.accumulators * self.width

    def __call__(self) -> float:
        """Run the loop; the result converges to 1 and only prevents the loop from being optimised away."""
        return float(self._call(ITERATIONS, 0.5))

    def gflops(self, repeats: int = 10) -> float:
        """Highest rate in several repeats [GFLOP/s]."""
        best = float("inf")
        for _ in range(repeats):
            begun = time.process_time()
            self()
            best = min(best, time.process_time() - begun)
        return 1e-9 * self.flops / best

    def _module(self) -> llvmlite.ir.Module:
        """Return the module: each iteration replaces every accumulator a by a f + f."""
        module = llvmlite.ir.Module("peak")
        number, index = llvmlite.ir.DoubleType(), llvmlite.ir.IntType(64)
        vector = llvmlite.ir.VectorType(number, self.width)
        function = llvmlite.ir.Function(module, llvmlite.ir.FunctionType(number, [index, number]), "multiply_add")
        fma = llvmlite.ir.Function(module, llvmlite.ir.FunctionType(vector, [vector] * 3), f"llvm.fma.v{self.width}f64")
        entry, loop, done = (function.append_basic_block(name) for name in ("entry", "loop", "done"))
        build = llvmlite.ir.IRBuilder(entry)
        factor = llvmlite.ir.Constant(vector, llvmlite.ir.Undefined)
        for place in range(self.width):
            factor = build.insert_element(factor, function.args[1], index(place))
        build.branch(loop)

        build = llvmlite.ir.IRBuilder(loop)
        turn = build.phi(index)
        turn.add_incoming(index(0), entry)
        before = [build.phi(vector) for _ in range(self.accumulators)]
        after = [build.call(fma, [accumulator, factor, factor]) for accumulator in before]
        for chain in range(self.accumulators):
            before[chain].add_incoming(vector([0.1 * chain] * self.width), entry)
            before[chain].add_incoming(after[chain], loop)
        following = build.add(turn, index(1))
        turn.add_incoming(following, loop)
        build.cbranch(build.icmp_signed("<", following, function.args[0]), loop, done)

        build = llvmlite.ir.IRBuilder(done)
        total = llvmlite.ir.Constant(number, 0.0)
        for accumulator in after:
            for place in range(self.width):
                total = build.fadd(total, build.extract_element(accumulator, index(place)))
        build.ret(build.fdiv(total, llvmlite.ir.Constant(number, float(self.accumulators * self.width))))
        return module
