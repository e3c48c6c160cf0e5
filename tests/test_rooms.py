"""The layout in CONTRIBUTING.md: imports point down, none runs in a circle. What the wheel holds."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[1]
PACKAGES = {"boulder_sweep": ROOT / "boulder_sweep", "boulder_kernels": ROOT / "kernels" / "boulder_kernels"}
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def module_of(file: Path, package: str) -> str:
    parts = (package, *file.relative_to(PACKAGES[package]).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(file, name): file for name, folder in PACKAGES.items() for file in folder.rglob("*.py")}


def imported(file: Path, package: str) -> Iterator[str]:
    """Modules of this project that a source imports: at the top, inside functions, and for type checkers alike."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            start = [package] if node.level else []  # both packages import relatively from their top folder only
            source = ".".join([*start, *([node.module] if node.module else [])])
            names = [f"{source}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            if name.partition(".")[0] in PACKAGES:
                yield name if name in MODULES else name.rpartition(".")[0] or name


GRAPH = {
    module: {name for name in imported(file, module.partition(".")[0]) if name != module}
    for module, file in MODULES.items()
}


def rooms_of_the_guide() -> list[str]:
    """Rooms of `boulder_sweep` in the order in which CONTRIBUTING.md lists them, the highest first."""
    tree = CONTRIBUTING.split("\nboulder_sweep/")[1].split("\nkernels/")[0]
    return re.findall(r"^  (\w+)(?:/|\.py) ", tree, re.MULTILINE)


def room_of(module: str) -> str:
    """Folder or file at the top of `boulder_sweep` that a module belongs to."""
    return module.split(".")[1]


TOP = {"boulder_sweep", "boulder_sweep.__main__"}
"""They fetch public names from the rooms at first use; nothing below may import them, see below."""


def test_the_guide_lists_every_room() -> None:
    listed = rooms_of_the_guide()
    there = {room_of(module) for module in MODULES if module.startswith("boulder_sweep.")} - {"__main__"}
    assert sorted(listed) == sorted(there)


def test_imports_point_down() -> None:
    rank = {room: place for place, room in enumerate(rooms_of_the_guide())}
    upward = [
        f"{module} -> {name}"
        for module, names in GRAPH.items()
        if module.startswith("boulder_sweep.") and module not in TOP
        for name in names
        if name.startswith("boulder_sweep.") and rank[room_of(name)] < rank[room_of(module)]
    ]
    assert upward == []


def test_nothing_below_imports_the_top_of_the_package() -> None:
    """Its names are fetched from the rooms at first use, which would hide an arrow up."""
    assert [module for module, names in GRAPH.items() if "boulder_sweep" in names] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_import_runs_in_a_circle(package: str) -> None:
    graph = {module: names for module, names in GRAPH.items() if module.split(".")[0] == package}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as circle:
        pytest.fail(" -> ".join(circle.args[1]))


def test_kernels_know_nothing_of_the_package_above() -> None:
    below = {name for module, names in GRAPH.items() if module.startswith("boulder_kernels") for name in names}
    assert {name.partition(".")[0] for name in below} == {"boulder_kernels"}


def test_modules_are_imported_by_name_in_few_places_only() -> None:
    """`import_module` escapes the tests above: the face, the one way to the pictures, an extra, kernels to compile."""
    found = {module for module, file in MODULES.items() if "import_module(" in file.read_text(encoding="utf-8")}
    product = {"boulder_sweep", "boulder_sweep.drawing", "boulder_sweep.runner.pool"}
    assert found == product | {"boulder_kernels._jit"}


def test_drawing_imports_views_only() -> None:
    source = MODULES["boulder_sweep.drawing"].read_text(encoding="utf-8")
    assert re.findall(r"import_module\((.*?)\)", source) == ['f"boulder_sweep.views.{view}"']


def test_the_wheel_holds_the_two_packages_the_examples_and_nothing_else() -> None:
    files = {Path(file.distribution_path) for file in WheelBuilder(str(ROOT)).recurse_included_files()}
    wanted = {
        Path(package) / file.relative_to(folder)
        for package, folder in PACKAGES.items()
        for file in folder.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    examples = {Path("boulder_sweep", "examples", file.name) for file in (ROOT / "configs").iterdir()}
    assert files == wanted | examples
    assert {file.suffix for file in files - examples} <= {".py", ".typed", ".html", ".css", ".js", ".wasm"}
