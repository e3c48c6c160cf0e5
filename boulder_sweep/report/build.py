"""Build the kernel of the page: ``python -m boulder_sweep.report.build``.

Numba compiles the entry points to LLVM code, llvmlite compiles that for WebAssembly, and zig (from PyPI) links it with
the few C library functions that it calls. The result is kept among the sources and shipped, so that users need not
build it. It carries a hash of its sources, and a page is made only where that is the hash of the sources at hand.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

from boulder_sweep.errors import ReportError

KERNEL = Path(__file__).with_name("kernel.wasm")
STAMP = "boulder-sweep"
"""Name of the section of the file that holds the hash of its sources."""
TRIPLE = "wasm32-unknown-unknown"
LAYOUT = "e-m:e-p:32:32-p10:8:8-p20:8:8-i64:64-i128:128-n32:64-S128-ni:1:10:20"
PORTABLE = {
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
}
"""Numba settings under which the LLVM code does not depend on this machine's processor."""
MATHEMATICS = {"sqrt", "tan", "atan2", "hypot", "pow", "sin", "cos"}
"""C library functions that the kernels call."""
COUNTING = re.compile(r"^ .*\bcall void @NRT_(?:incref|decref)\(.*$", re.MULTILINE)
"""Calls that count references: arrays are only views of the page's memory, and nothing need be counted."""


SOURCES = ("build.py", "entry_points.py", "page_records.py")
"""Modules of this folder that the kernel is built from, beside all of `boulder_kernels`."""


def sources_hash() -> str:
    """Return the hash of what the kernel is built from: kernels, modules of the page, this one (SHA-256, hex)."""
    from boulder_kernels import source_hash

    digest = hashlib.sha256(source_hash().encode())
    for source in SOURCES:
        digest.update(Path(__file__).with_name(source).read_bytes())
    return digest.hexdigest()


def stamp_of(module: bytes) -> str:
    """Return the hash in a built kernel; empty if it has none."""
    _, found, behind = module.rpartition(_section(STAMP, b"")[2:])
    return behind[:64].decode() if found else ""


def kernel() -> bytes:
    """Return the kernel that the page carries.

    Raises
    ------
    ReportError
        It is missing, or was built from other sources: the page could judge a design otherwise than a table.
    """
    module = KERNEL.read_bytes() if KERNEL.exists() else b""
    if stamp_of(module) != sources_hash():
        raise ReportError(
            f"{KERNEL} was not built from the kernels of this installation, so the simulator in the page could judge "
            "otherwise than `sweep run`: build it with `python -m boulder_sweep.report.build` in a clone with the "
            "extra dev (pip install -e '.[dev]'), or reinstall boulder-sweep if you have not changed its sources"
        )
    return module


def intermediate_code() -> str:
    """Compile the entry points to LLVM code for WebAssembly.

    Raises
    ------
    RuntimeError
        The code depends on this machine: Numba was imported before it could be configured, or a structure in memory
        holds addresses, whose length differs in WebAssembly.
    """
    import llvmlite.binding as llvm
    import numba

    from boulder_sweep.report import entry_points

    if {name: os.environ.get(name) for name in PORTABLE} != PORTABLE:
        raise RuntimeError("Numba must be configured for a generic processor before it is imported")
    modules = []
    for name, record in entry_points.EXPORTS.items():
        function, arguments = getattr(entry_points, name), (numba.types.CPointer(numba.from_dtype(record)),)
        function.compile(numba.types.void(*arguments))
        compiled = function.overloads[arguments]
        code = compiled.library.get_llvm_str()
        code = re.sub(r"^target triple = .*$", f'target triple = "{TRIPLE}"', code, flags=re.MULTILINE)
        code = re.sub(r"^target datalayout = .*$", f'target datalayout = "{LAYOUT}"', code, flags=re.MULTILINE)
        module = llvm.parse_assembly(COUNTING.sub("", code))
        module.get_function(compiled.fndesc.llvm_func_name).name = name
        modules.append(module)
    whole, *others = modules
    for other in others:
        whole.link_in(other)
    _keep_only(whole, entry_points.EXPORTS)
    return str(whole)


def _keep_only(module: Any, names: Collection[str]) -> None:
    """Remove everything that the named functions do not need from a module, and check the rest.

    Raises
    ------
    RuntimeError
        It calls more than the C library's mathematics, or holds addresses in a structure.
    """
    import llvmlite.binding as llvm

    for function in module.functions:
        if not function.is_declaration and function.name not in names:
            function.linkage = "internal"
    for variable in module.global_variables:
        variable.linkage = "internal"
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    passes.run(module, llvm.create_pass_builder(llvm.Target.from_triple(TRIPLE).create_target_machine(), options))
    called = {function.name for function in module.functions if function.is_declaration}
    strange = {name for name in called if not name.startswith("llvm.")} - MATHEMATICS
    structures = [line for line in str(module).splitlines() if re.search(r"alloca [\[{].*\bptr\b", line)]
    if strange or structures:
        raise RuntimeError(f"this code cannot be compiled for WebAssembly: it needs {sorted(strange)} and {structures}")


def built() -> bytes:
    """Build the kernel.

    Returns
    -------
    bytes
        A WebAssembly module that imports nothing, with its stamp.
    """
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(opt=3)
    code = machine.emit_object(llvm.parse_assembly(intermediate_code()))
    from boulder_sweep.report.entry_points import EXPORTS

    with tempfile.TemporaryDirectory() as folder:
        compiled, linked = Path(folder) / "kernel.o", Path(folder) / "kernel.wasm"
        compiled.write_bytes(code)
        exports = [f"-Wl,--export={name}" for name in (*EXPORTS, "__heap_base")]
        linker = [sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-wasi", "-mexec-model=reactor", "-O2"]
        subprocess.run([*linker, *exports, "-Wl,--strip-all", str(compiled), "-o", str(linked)], check=True)
        return linked.read_bytes() + _section(STAMP, sources_hash().encode())


def _section(name: str, content: bytes) -> bytes:
    """Return a custom section of a WebAssembly module, which runtimes ignore; name and content under 128 bytes."""
    inner = bytes([len(name)]) + name.encode() + content
    return bytes([0, len(inner)]) + inner


def main() -> None:
    """Build the kernel in a process with its own settings and put it in place."""
    if any(os.environ.get(name) != value for name, value in PORTABLE.items()):
        with tempfile.TemporaryDirectory() as cache:
            environment = os.environ | PORTABLE | {"BOULDER_SWEEP_CACHE_DIR": cache}
            again = [sys.executable, "-m", "boulder_sweep.report.build", *sys.argv[1:]]
            sys.exit(subprocess.run(again, env=environment, check=False).returncode)
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else KERNEL
    target.write_bytes(built())
    print(f"{target}: {target.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
