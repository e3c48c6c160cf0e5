"""Is single precision worthwhile? ``python -m benchmarks.single_precision``: the same kernels for 32-bit floats.

The sources of the kernels are loaded a second time with every literal rounded to single precision and the lanes in
a 32-bit workspace, twice as many of them in the same registers. The constants of a design and its stable step are
still computed in double precision, once. Both precisions simulate the same designs; errors are against a far finer
solution in double precision. Compiling takes more than a minute: nothing is kept.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
import types
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np

import boulder_kernels as bk
from boulder_kernels import _jit
from boulder_kernels import lanes as double_lanes

from .accuracy import control, reference_of
from .designs import DESIGNS, HORIZON, ROTATION_LIMIT, sample
from .points import Peaks, point_of
from .report import Table, significant
from .timing import machine, timed, versions

PACKAGE = "boulder_kernels_single"
SOURCES = Path(bk.__file__).parent
KEPT = ("design", "control")
"""Modules that stay in double precision: what is computed once per design."""
CHANGES = {
    "soil": (
        ("TINY = 1e-30", "TINY = 1e-15"),  # its square must not be zero
        ("    if c.elements > 0:\n        return element_sums(k, c)\n", ""),
        ("    if c.elements > 0:\n        return summed_potential(A, slope_x, c)\n", ""),
    ),
    "dormand_prince": (("error_arm(c) *", "c.d - min(c.z_0, 0.0) *"),),  # its 0.5 is a double
    "workspace": (("LANES = 8", "LANES = 16"),),
    "lanes": (("WHOLE + LANES)", "WHOLE + LANES, np.float32)"),),
}
STEPS_MS = (16.0, 12.0, 8.0, 4.0, 2.0, 1.0)


class _Rounded(ast.NodeTransformer):
    """Wraps every literal, infinity, NaN and pi in ``_single``."""

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        return self._single(node) if isinstance(node.value, float) else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        if ast.unparse(node) in ("np.inf", "np.nan", "math.pi"):
            return self._single(node)
        self.generic_visit(node)  # the result of a call may have literals among its arguments
        return node

    @staticmethod
    def _single(node: ast.expr) -> ast.expr:
        return ast.copy_location(ast.Call(ast.Name("_single", ast.Load()), [node], []), node)


def load_single_precision() -> types.ModuleType:
    """Return the module of the lanes, to be compiled in single precision."""
    package = types.ModuleType(PACKAGE)
    package.__path__ = []
    sys.modules[PACKAGE] = package
    _add("_jit", _decorators())
    for name in ("_lowering", "lanes"):  # the first is what the second compiles with
        _load(name)
    _jit.compiler()  # tells Numba of what is no kernel
    return sys.modules[f"{PACKAGE}.lanes"]


def _load(name: str) -> None:
    """Add a module of the kernels, and first those that it imports."""
    if f"{PACKAGE}.{name}" in sys.modules:
        return
    if name in KEPT:
        _add(name, sys.modules[f"boulder_kernels.{name}"])
        return
    for node in ast.parse((SOURCES / f"{name}.py").read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            for imported in [node.module] if node.module else [one.name for one in node.names]:
                _load(imported)
    _add(name, _translated(name))


def _add(name: str, module: types.ModuleType) -> None:
    sys.modules[f"{PACKAGE}.{name}"] = module
    setattr(sys.modules[PACKAGE], name, module)


def _decorators() -> types.ModuleType:
    """Return the decorators of the kernels, without their folder of compiled code."""

    def decorator(fastmath: set[str], *, inline: bool = False) -> Callable[[Any], Any]:
        return lambda f: numba.njit(nogil=True, error_model="numpy", fastmath=fastmath, forceinline=inline)(f)

    module: Any = types.ModuleType(f"{PACKAGE}._jit")
    module.kernel = module.array_kernel = decorator({"contract", "nsz"})
    module.inlined = decorator({"contract", "nsz"}, inline=True)
    module.exact_kernel = decorator({"nsz"})
    module.exact_inlined = decorator({"nsz"}, inline=True)
    module.function_of = _jit.function_of
    module.unless_none, module.overload = _jit.unless_none, _jit.overload
    return module


def _translated(name: str) -> types.ModuleType:
    """Execute the source of a module with its literals in single precision."""
    file = SOURCES / f"{name}.py"
    source = file.read_text()
    for before, after in CHANGES.get(name, ()):
        if before not in source:
            raise RuntimeError(f"{file.name} no longer holds {before!r}")
        source = source.replace(before, after)
    tree = ast.parse(source)
    tree = _Rounded().visit(tree)
    module: Any = types.ModuleType(f"{PACKAGE}.{name}")
    module.__package__, module._single = PACKAGE, np.float32
    sys.modules[module.__name__] = module
    with np.errstate(over="ignore"):  # 1e300 means never, and so does infinity
        exec(compile(ast.fix_missing_locations(tree), str(file), "exec"), module.__dict__)
    if name == "dormand_prince":  # the tableau checks itself by exact fractions; what comes out of it is rounded
        module.C, module.ERROR = (tuple(np.float32(value) for value in row) for row in (module.C, module.ERROR))
        module.A, module.AA = (tuple(tuple(np.float32(v) for v in row) for row in m) for m in (module.A, module.AA))
    return module


def single_control(step_ms: float) -> bk.Control:
    """How designs are simulated in single precision."""
    single: Any = np.float32
    return bk.Control(single(1e-3 * step_ms), single(HORIZON), single(ROTATION_LIMIT), 0, False)


def simulated(lanes: Any, designs: bk.DesignTable, how: bk.Control) -> bk.OutcomeTable:
    """Simulate designs in lanes of either precision."""
    out = lanes.simulate_lanes(np.stack(designs), bk.corrected(), how)
    return bk.OutcomeTable(out[0].astype(np.int8), *out[1:])


def measure(count: int = DESIGNS, repeats: int = 4) -> Table:
    """Time both precisions on the same designs and compare their errors."""
    designs = sample(count)
    known = Peaks.of(reference_of(designs, bk.corrected()))
    lanes = load_single_precision()
    table = Table(
        "single-precision",
        "Single against double precision, readings `corrected`",
        f"{machine()}; {versions('numba', 'llvmlite', 'numpy')}; {count} random designs; CPU time of one thread",
        ["step", "single", "double", "ratio", "rotation, single: max, 99 % [deg]", "rotation, double: max, 99 % [deg]"],
    )
    for step_ms in STEPS_MS:
        ways = ((lanes, single_control(step_ms)), (double_lanes, control(1e-3 * step_ms)))
        simulated(*_first(ways[0], designs))
        cells, costs = [], []
        for way, how in ways:
            out, seconds = timed(partial(simulated, way, designs, how), repeats)
            costs.append(1e6 * seconds / count)
            point = point_of("corrected", "lanes", 1e-3 * step_ms, costs[-1], Peaks.of(out), known)
            cells.append(f"{significant(point.theta_max_deg)}, {significant(point.theta_p99_deg)}")
        ratio = f"{costs[0] / costs[1]:.2f}"
        table.rows.append([f"{step_ms:g} ms", *(f"{cost:.2f} us" for cost in costs), ratio, *cells])
    code = "".join(lanes.attempt_steps.inspect_asm().values())
    packed = [len(re.findall(rf"\bv\w+p{kind}\s", code)) for kind in "sd"]
    table.notes.append(f"Packed instructions of a step: {packed[0]} single, {packed[1]} double.")
    return table


def _first(way: tuple[Any, bk.Control], designs: bk.DesignTable) -> tuple[Any, bk.DesignTable, bk.Control]:
    """One design, to compile with."""
    return way[0], bk.DesignTable(*(column[:1] for column in designs)), way[1]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.single_precision", description=__doc__)
    parser.add_argument("--designs", type=int, default=DESIGNS, help="size of the sample (default %(default)s)")
    print(measure(parser.parse_args().designs).markdown())


if __name__ == "__main__":
    main()
