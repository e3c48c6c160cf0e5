"""How Numba compiles kernels: without the steps that nothing here needs. The machine code computes the same bits.

Compiling the kernels takes most of a first start. Two things are left out. What only other kernels call is optimised,
to be taken into their code, but is not made machine code by itself: nothing would run it. And steps for what kernels do
not have are skipped: closures, calls of ``literally``, expressions of whole arrays, listings of types.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

NEEDLESS = {
    "WithLifting",
    "InlineClosureLikes",
    "RewriteDynamicRaises",
    "MakeFunctionToJitFunction",
    "InlineInlinables",
    "FindLiterallyCalls",
    "LiteralUnroll",
    "LiteralPropagationSubPipelinePass",
    "NopythonRewrites",
    "NoPythonSupportedFeatureValidation",
    "AnnotateTypes",
    "DumpParforDiagnostics",
}
"""Steps of Numba's compiler that kernels do without, by name."""
REPEATED = "DeadBranchPrune"
"""A step that Numba takes three times; the last one finds everything that the others do."""
ENVIRONMENT = "_ZN08NumbaEnv"
"""What the names begin with of the variables by which compiled functions find Python's objects."""


class KernelCompiler(Compiler):
    """Numba's compiler without the steps that kernels do not need."""

    def define_pipelines(self) -> list[Any]:
        """Return the steps, as Numba asks for them."""
        (steps,) = super().define_pipelines()
        kept = [(step, reason) for step, reason in steps.passes if step.__name__ not in NEEDLESS]
        repeated = [place for place, (step, _) in enumerate(kept) if step.__name__ == REPEATED]
        steps.passes = [entry for place, entry in enumerate(kept) if place not in repeated[:-1]]
        steps.finalize()
        return [steps]


class InsideCompiler(KernelCompiler):
    """The same for kernels that other kernels call."""

    def define_pipelines(self) -> list[Any]:
        """Return the steps, and let the result be kept without machine code."""
        state = self.state
        state.library = _Taken(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


class _Taken(JITCodeLibrary):
    """Optimised code that is taken into that of others.

    In place of its machine code there are only the variables that Numba sets wherever it has compiled a function or
    loaded it from the disk.
    """

    def _finalize_final_module(self) -> None:
        code = self._final_module
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        variables = [str(known) for known in code.global_variables if known.name.startswith(ENVIRONMENT)]
        head = str(self._codegen._create_empty_module(self.name))
        self._final_module = llvmlite.binding.parse_assembly("\n".join([head, *variables]))
        self._final_module.name = code.name
        super()._finalize_final_module()
        self._final_module = code
