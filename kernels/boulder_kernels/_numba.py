"""How kernels are compiled: Numba's compiler without what they do not need, and an entry point for calls by address.

Imported when the first kernel is compiled, by `boulder_kernels._jit`, which has the decorators and their flags.
"""

from __future__ import annotations

import itertools
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding
import numba
import numpy as np
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.extending import lower_builtin, type_callable

from ._ahead import ENTRY, NOTHING, REAL, TRUTH, WHOLE, UnsuitableError, function_of, name_of, record_of

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
COUNTING = re.compile(r"^(define .*@NRT_(?:incref|decref)\(.*)$[\s\S]*?^\}$", re.MULTILINE)
"""Functions that count references: arrays are only views of the caller's memory, and nothing need be counted."""
ENVIRONMENT = "_ZN08NumbaEnv"
"""What the names begin with of the variables by which compiled functions find Python's objects."""


class KernelCompiler(Compiler):
    """Numba's compiler without the steps that kernels do not need."""

    def define_pipelines(self) -> list[Any]:
        """Return the steps, as Numba asks for them."""
        (steps,) = super().define_pipelines()
        kept = [(step, reason) for step, reason in steps.passes if step.__name__ not in NEEDLESS]
        repeated = [k for k, (step, _) in enumerate(kept) if step.__name__ == REPEATED]
        steps.passes = [entry for k, entry in enumerate(kept) if k not in repeated[:-1]]
        steps.finalize()
        return [steps]


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


class InsideCompiler(KernelCompiler):
    """The same for kernels that other kernels call: optimised code, without machine code."""

    library: type[JITCodeLibrary] = _Taken

    def define_pipelines(self) -> list[Any]:
        """Return the steps, whose result has no machine code."""
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()


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


def compiled_ahead(kernel: Any, types: str) -> tuple[bytes, bytes | None, dict[str, Any]]:
    """Compile a kernel with an entry point that takes numbers and addresses.

    Parameters
    ----------
    kernel
        The `boulder_kernels._jit.Kernel`.
    types
        Types of its arguments, as `boulder_kernels._ahead.flatten` gives them, with commas between them.

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
    boulder_kernels._ahead.UnsuitableError
        It returns something other than numbers and records of them, or makes arrays.
    """
    given = call_of(types)
    signature = tuple(numba.typeof(value) for value in examples(given))
    outermost = dispatcher_of(kernel.py_func, kernel.options, OutermostCompiler)
    outermost.compile(signature)
    lines: list[str] = []
    returns = append_expressions(outermost.overloads[signature].signature.return_type, "result", lines)
    kept = {"returns": returns, "numbers": len(lines), "types": types, "arrays": len(given.arrays)}
    source = f"def {ENTRY}(reals_at, wholes_at, {''.join(f'{name}, ' for name in given.arrays)}out_at):\n"
    source += f" reals = carray(reals_at, ({given.reals},))\n wholes = carray(wholes_at, ({given.wholes},))\n"
    source += f" out = carray(out_at, ({len(lines)},))\n result = function({given.arguments})\n"
    source += "".join(f" out[{index}] = {line}\n" for index, line in enumerate(lines))
    wrapper = function_of(source, carray=numba.carray, function=outermost, **given.records)
    options = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    entry = dispatcher_of(wrapper, options, InsideCompiler)
    kinds: tuple[Any, ...] = (np.float64, np.int64, *given.arrays.values(), np.float64)
    addresses = tuple(numba.types.CPointer(numba.from_dtype(np.dtype(kind))) for kind in kinds)
    entry.compile(addresses)
    compiled = entry.overloads[addresses]
    codegen = compiled.library.codegen
    module = module_of(compiled.library.get_llvm_str(), compiled.fndesc.llvm_func_name, ENTRY)
    machine = llvmlite.binding.Target.from_default_triple().create_target_machine(
        cpu=codegen._get_host_cpu_name(), features=codegen._get_host_cpu_features(), opt=3, reloc="pic"
    )
    if strange := keep_only(module, [ENTRY], machine) - MATHEMATICS:
        raise UnsuitableError(str(strange))
    code = machine.emit_object(module)
    return code, linked(code), kept


MATHEMATICS = {"sqrt", "tan", "atan2", "hypot", "pow", "exp", "log", "sin", "cos", "fmod"}
"""Functions of the C library that kernels may call."""


def module_of(code: str, function: str, name: str) -> Any:
    """Return LLVM code as a module in which a function has another name, and no references are counted."""
    module = llvmlite.binding.parse_assembly(COUNTING.sub(r"\1\n ret void\n}", code))
    module.get_function(function).name = name
    return module


def keep_only(module: Any, names: Collection[str], machine: Any) -> set[str]:
    """Remove everything that the named functions do not need from a module.

    Returns
    -------
    set of str
        Functions that it calls and does not define, LLVM's own left out.
    """
    for function in module.functions:
        if not function.is_declaration and function.name not in names:
            function.linkage = "internal"
    for variable in module.global_variables:
        variable.linkage = "internal"
    passes = llvmlite.binding.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    options = llvmlite.binding.create_pipeline_tuning_options(speed_level=3)
    passes.run(module, llvmlite.binding.create_pass_builder(machine, options))
    called = {function.name for function in module.functions if function.is_declaration}
    return {name for name in called if not name.startswith("llvm.")}


class Call(NamedTuple):
    """A call of a kernel, written out."""

    arguments: str
    """Expression of them, from ``reals``, ``wholes``, and the names below; ``carray`` is Numba's."""
    reals: int
    wholes: int
    arrays: dict[str, np.dtype[Any]]
    """By the name of its address, what each array holds."""
    records: dict[str, Any]
    """Types of records by name."""


def call_of(types: str) -> Call:
    """Return how a kernel is called, by the types of its arguments as of `compiled_ahead`."""
    reals, wholes = itertools.count(), itertools.count()
    arrays: dict[str, np.dtype[Any]] = {}
    records: dict[str, Any] = {}
    simple = {
        REAL: lambda: f"reals[{next(reals)}]",
        WHOLE: lambda: f"wholes[{next(wholes)}]",
        TRUTH: lambda: f"(wholes[{next(wholes)}] != 0)",
        NOTHING: lambda: "None",
    }

    def expression_of(match: re.Match[str]) -> str:
        """Return the expression of a number or an array, or the name of a type of records."""
        kind = match.group()
        if kind in simple:
            return simple[kind]()
        if ":" in kind:
            name = f"R{len(records)}"
            records[name] = record_of(kind)
            return name
        name = f"p{len(arrays)}"
        arrays[name] = np.dtype(kind[:2])
        return f"carray({name}, ({''.join(f'{simple[WHOLE]()}, ' for _ in range(int(kind[2:])))}))"

    # A comma ends every tuple, because those of one need it.
    arguments = re.sub(r"[^(),]+", expression_of, types.replace(")", ",)"))
    return Call(arguments, next(reals), next(wholes), arrays, records)


def examples(call: Call) -> list[Any]:
    """Return arguments of a call: zeros, and arrays without numbers."""
    numbers = {"reals": [0.0] * call.reals, "wholes": [0] * call.wholes}
    made = {"carray": lambda kind, shape: np.empty(shape, kind)}
    return function_of(f"def call():\n return [{call.arguments}]", **numbers, **made, **call.arrays, **call.records)()


def append_expressions(kind: Any, expression: str, lines: list[str]) -> Any:
    """Append the expressions of all numbers of what a kernel returns, and return how they are put together again.

    Raises
    ------
    boulder_kernels._ahead.UnsuitableError
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
    return [name, [append_expressions(one, f"{expression}[{i}]", lines) for i, one in enumerate(kind.types)]]


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


def rows_of(context: Any, builder: Any, kinds: Any, values: Any, first: int, count: int) -> list[Any]:
    """Load the numbers of a column of an array from some of its rows."""
    array = context.make_array(kinds[0])(context, builder, values[0])
    columns = builder.extract_value(array.shape, 1)
    index, numbers = context.cast(builder, values[1], kinds[1], numba.types.intp), []
    if first:
        index = builder.add(index, builder.mul(columns, context.get_constant(numba.types.intp, first)))
    for _ in range(count):
        numbers.append(builder.load(builder.gep(array.data, [index], inbounds=True)))
        index = builder.add(index, columns)
    return numbers


def lower_take(take: Any, record: Any) -> None:
    """Tell Numba of a function of `boulder_kernels._jit.in_columns`.

    It is one load for every field: an index that need not be checked lets a loop over rows be vectorised.
    """

    def result(array: Any, row: Any) -> Any:
        """Return the type of the result, or None where a column is not one piece of memory."""
        return numba.types.NamedUniTuple(array.dtype, len(record._fields), record) if array.layout == "C" else None

    def loads(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        """Load its numbers."""
        numbers = rows_of(context, builder, sig.args, args, 0, len(record._fields))
        return context.make_tuple(builder, sig.return_type, numbers)

    type_callable(take)(lambda context: result)
    lower_builtin(take, numba.types.Array, numba.types.Any)(loads)
