"""LLVM at work on compiled kernels: what a function needs and no more, as code of this processor, loaded."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Collection
from typing import Any

import llvmlite.binding as llvm

COUNTING = re.compile(r"^(define .*@NRT_(?:incref|decref)\(.*)$[\s\S]*?^\}$", re.MULTILINE)
"""Functions that count references: arrays are only views of the caller's memory, and nothing need be counted."""


def module_of(code: str, function: str, name: str) -> Any:
    """Return LLVM code as a module in which a function has another name, and no references are counted."""
    module = llvm.parse_assembly(COUNTING.sub(r"\1\n ret void\n}", code))
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
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    passes.run(module, llvm.create_pass_builder(machine, options))
    called = {function.name for function in module.functions if function.is_declaration}
    return {name for name in called if not name.startswith("llvm.")}


def loaded(code: bytes, name: str) -> tuple[Any, Any]:
    """Load object code; return the function of a name, as of ctypes, and what must stay loaded."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return ctypes.CFUNCTYPE(ctypes.c_int32)(engine.get_function_address(name)), engine
