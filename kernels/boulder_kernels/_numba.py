"""How kernels are compiled: Numba's compiler without what they do not need, and an entry point for calls by address.

Imported when the first kernel is compiled, by `boulder_kernels._jit`, which has the decorators and their flags.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from . import _llvm
from ._arguments import (
    NOTHING,
    REAL,
    TRUTH,
    WHOLE,
    UnsuitableError,
    function_of,
    name_of,
)

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
    """The same for kernels that other kernels call: optimised code, without machine code."""

    library: type[JITCodeLibrary]

    def define_pipelines(self) -> list[Any]:
        """Return the steps, whose result has no machine code."""
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()


class _Taken(JITCodeLibrary):
    """Optimised code that is taken into that of others.

    In place of its machine code there are only the variables that Numba sets wherever it has compiled a function.
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


InsideCompiler.library = _Taken


class _Raw(_Taken):
    """Code that is optimised together with the only function that calls it."""

    def _optimize_final_module(self) -> None:
        pass


class OutermostCompiler(InsideCompiler):
    """The same for a kernel that is called by its entry point alone."""

    library = _Raw


SETTINGS: Any = numba.config
"""Numba's settings, which it fills in at run time."""


def _ask_for_wide_vectors() -> None:
    """Let the compiler use 512-bit registers where the processor has them.

    For many of these processors LLVM prefers half the width, because ordinary code lowers their clock for little
    gain. The loops over lanes are dense in multiply-adds and gain a third. The choice is Numba's, for the whole
    process, made at its first compilation; one that the user has made (NUMBA_CPU_FEATURES) stands.
    """
    if SETTINGS.CPU_FEATURES is None and SETTINGS.CPU_NAME is None and SETTINGS.ENABLE_AVX:
        features = llvmlite.binding.get_host_cpu_features()
        if features.get("avx512f", False):
            SETTINGS.CPU_FEATURES = f"{features.flatten()},-prefer-256-bit"


_ask_for_wide_vectors()


def dispatcher_of(
    function: Callable[..., Any], options: dict[str, Any], compiler: type[InsideCompiler] = InsideCompiler
) -> Any:
    """Return what compiles a function for other kernels, without a wrapper for calls from Python.

    A wrapper takes the tuples among the arguments apart, number by number. Most kernels are called by kernels only, and
    their wrappers would be a third of the work.
    """
    inside: Any = numba.njit(pipeline_class=compiler, **{**options, "no_cpython_wrapper": True})(function)
    inside.add_overload = lambda compiled: inside.overloads.__setitem__(tuple(compiled.signature.args), compiled)
    return inside


def dispatcher_for_python(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Return what compiles a function for calls from Python that cannot be compiled ahead; nothing is kept of it."""
    return numba.njit(pipeline_class=KernelCompiler, **options)(function)


def compiled_ahead(
    kernel: Any, arguments: tuple[Any, ...], described: str
) -> tuple[bytes, bytes | None, dict[str, Any]]:
    """Compile a kernel with an entry point that takes numbers and addresses.

    Parameters
    ----------
    kernel
        The `boulder_kernels._jit.Kernel`.
    arguments
        What it is called with; only their types matter.
    described
        These types as text.

    Returns
    -------
    code : bytes
        The object code.
    library : bytes or None
        The same as a shared library; None where there is no linker.
    kept : dict
        What comes back from a call, how many numbers that is, how many arrays a call has, and the types.

    Raises
    ------
    boulder_kernels._arguments.UnsuitableError
        It returns something other than numbers and records of them, or makes arrays.
    """
    types = tuple(numba_type(value) for value in arguments)
    outermost = dispatcher_of(kernel.py_func, kernel.options, OutermostCompiler)
    outermost.compile(types)
    returns = outermost.overloads[types].signature.return_type
    lines: list[str] = []
    kept = {"returns": written_out(returns, "found", lines), "numbers": len(lines), "types": described}
    reals, wholes, arrays = _Counter(), _Counter(), _Counter()
    records: list[type] = []
    given = [argument_text(value, reals, wholes, arrays, records) for value in arguments]
    kept |= {"arrays": arrays.count}
    pointers = [f"p{number}" for number in range(arrays.count)]
    source = f"def {ENTRY}(reals_at, wholes_at, {''.join(f'{name}, ' for name in pointers)}out_at):\n"
    source += f" reals = carray(reals_at, ({reals.count},))\n wholes = carray(wholes_at, ({wholes.count},))\n"
    source += f" out = carray(out_at, ({len(lines)},))\n found = function({', '.join(given)})\n"
    source += "".join(f" out[{place}] = {line}\n" for place, line in enumerate(lines))
    named = {f"R{number}": record for number, record in enumerate(records)}
    wrapper = function_of(source, carray=numba.carray, function=outermost, **named)
    options = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    entry = dispatcher_of(wrapper, options, InsideCompiler)
    real, whole = numba.types.CPointer(numba.types.float64), numba.types.CPointer(numba.types.int64)
    signature = (real, whole, *arrays.kinds, real)
    entry.compile(signature)
    compiled = entry.overloads[signature]
    codegen = compiled.library.codegen
    module = _llvm.module_of(compiled.library.get_llvm_str(), compiled.fndesc.llvm_func_name, ENTRY)
    machine = llvmlite.binding.Target.from_default_triple().create_target_machine(
        cpu=codegen._get_host_cpu_name(), features=codegen._get_host_cpu_features(), opt=3, reloc="pic"
    )
    if strange := _llvm.keep_only(module, [ENTRY], machine) - MATHEMATICS:
        raise UnsuitableError(str(strange))
    code = machine.emit_object(module)
    return code, linked(code), kept


ENTRY = "entry"
"""Name of the function in a library."""
MATHEMATICS = {"sqrt", "tan", "atan2", "hypot", "pow", "exp", "log", "sin", "cos", "fmod"}
"""Functions of the C library that kernels may call."""


class _Counter:
    """Counts the numbers or arrays of a call."""

    def __init__(self) -> None:
        self.count = 0
        self.kinds: list[Any] = []

    def next(self) -> int:
        """Return the number of the next one."""
        self.count += 1
        return self.count - 1


def numba_type(value: Any) -> Any:
    """Return Numba's type of an argument."""
    types = numba.types
    if isinstance(value, np.ndarray):
        return types.Array(numba.from_dtype(value.dtype), value.ndim, "C")
    if isinstance(value, tuple):
        kinds = [numba_type(one) for one in value]
        return types.BaseTuple.from_types(kinds, type(value) if hasattr(value, "_fields") else None)
    if value is None:
        return types.none
    if isinstance(value, bool | np.bool_):
        return types.boolean
    return types.float64 if isinstance(value, float) else types.int64


def argument_text(value: Any, reals: _Counter, wholes: _Counter, arrays: _Counter, records: list[type]) -> str:
    """Return the expression of an argument from the numbers of a call, in the order of `flatten`."""
    if isinstance(value, np.ndarray):
        shape = "".join(f"wholes[{wholes.next()}], " for _ in value.shape)
        arrays.kinds.append(numba.types.CPointer(numba.from_dtype(value.dtype)))
        return f"carray(p{arrays.next()}, ({shape}))"
    if isinstance(value, tuple):
        name = ""
        if hasattr(value, "_fields"):
            name = f"R{len(records)}"
            records.append(type(value))
        fields = "".join(f"{argument_text(one, reals, wholes, arrays, records)}, " for one in value)
        return f"{name}({fields})"
    if value is None:
        return "None"
    if isinstance(value, bool | np.bool_):
        return f"(wholes[{wholes.next()}] != 0)"
    return f"reals[{reals.next()}]" if isinstance(value, float) else f"wholes[{wholes.next()}]"


def written_out(kind: Any, expression: str, lines: list[str]) -> Any:
    """Append the expressions of all numbers of what a kernel returns, and return how they are put together again.

    Raises
    ------
    boulder_kernels._arguments.UnsuitableError
        It holds something other than numbers.
    """
    types: Any = numba.types
    if isinstance(kind, types.NoneType):
        return NOTHING
    for number, letter in ((types.Boolean, TRUTH), (types.Integer, WHOLE), (types.Float, REAL)):
        if isinstance(kind, number):
            lines.append(expression)
            return letter
    if not isinstance(kind, types.BaseTuple):
        raise UnsuitableError(str(kind))
    name = name_of(kind.instance_class) if isinstance(kind, types.BaseNamedTuple) else ""
    parts = (
        [f"{expression}.{field}" for field in kind.fields] if name else [f"{expression}[{i}]" for i in range(len(kind))]
    )
    return [name, [written_out(one, part, lines) for one, part in zip(kind.types, parts, strict=True)]]


def linked(code: bytes) -> bytes | None:
    """Return object code as a shared library, linked by the C compiler (``cc`` or CC); None where there is none."""
    compiler = shlex.split(os.environ.get("CC", "cc"))
    if not compiler or shutil.which(compiler[0]) is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "kernel.o", Path(folder) / "kernel.so"
        source.write_bytes(code)
        command = [*compiler, "-shared", "-s", "-o", str(target), str(source), "-lm"]
        done = subprocess.run(command, capture_output=True, check=False)
        return target.read_bytes() if done.returncode == 0 else None
