"""Which sources the number blocks of the documentation depend on, and whether they changed since a block was checked.

A block's stamp is a hash of the modules that its function can reach by imports, those inside functions included, and of
the settings files. The stamps of the blocks as they were last found right stand in ``stamps.toml``. A block whose stamp
is the recorded one need not be computed again.
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

RECORD = Path("docs/studies/stamps.toml")
ROOTS = {"boulder_sweep": ".", "docs": ".", "benchmarks": ".", "boulder_kernels": "kernels"}
"""Packages whose modules count, and the folders they lie in."""
DATA = ("configs", "docs/examples")
"""Folders whose files any block may read."""
HEAD = "# Sources that each block was last checked with; written by python -m docs.studies [--write BLOCK ...].\n"


def stamp(root: Path, compute: Callable[..., object]) -> str:
    """Return the hash of everything that the text of a block depends on.

    Parameters
    ----------
    root
        Folder of the repository.
    compute
        Function that makes the text.
    """
    modules, text = used_by(compute)
    files = {file for module in modules for file in reached(root, module)}
    files |= {file for folder in DATA for file in (root / folder).rglob("*") if file.is_file()}
    found = sha256(text.encode())
    for file in sorted(files):
        found.update(f"{file.relative_to(root).as_posix()}\0".encode())
        found.update(_content_hash(file))
    return found.hexdigest()[:16]


def read(root: Path) -> dict[str, str]:
    """Return the recorded stamps."""
    file = root / RECORD
    return tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}


def write(root: Path, contents: Mapping[str, Callable[..., object]], checked: Iterable[str]) -> None:
    """Record the stamps of blocks that were just found or made right; those of others stay."""
    recorded = read(root) | {name: stamp(root, contents[name]) for name in checked}
    lines = [f'{name} = "{recorded[name]}"\n' for name in contents if name in recorded]
    (root / RECORD).write_text(HEAD + "".join(lines), encoding="utf-8")


def used_by(function: Callable[..., object]) -> tuple[set[str], str]:
    """Return the modules that a function of the table of contents names, and the text of the function itself.

    The table imports every study; only what this one function names counts. Of what it names from the table, the same.
    """
    function = inspect.unwrap(function)
    home = inspect.getmodule(function)
    if home is None or not inspect.isfunction(function):
        raise TypeError(f"{function!r} is not a function of a module")
    if not home.__name__.endswith(".contents"):
        return {home.__name__}, ""
    modules: set[str] = set()
    text = inspect.getsource(function)
    for name, used in sorted(_named(function.__code__, vars(home)).items()):
        if isinstance(used, ModuleType):
            modules.add(used.__name__)
        elif callable(used) and inspect.getmodule(used) is home:
            more, more_text = used_by(used)
            modules |= more
            text += more_text
        elif callable(used):
            modules.add(used.__module__)
        else:
            text += f"{name} = {used!r}\n"
    return modules, text


def _named(code: CodeType, names: Mapping[str, Any]) -> dict[str, Any]:
    """Return the global values that code names, also inside comprehensions and inner functions."""
    found = {name: names[name] for name in code.co_names if name in names}
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            found |= _named(constant, names)
    return found


@cache
def reached(root: Path, module: str) -> set[Path]:
    """Return the files of a module and of all that it imports from this repository, directly or not."""
    found: set[Path] = set()
    left = [module]
    seen = set(left)
    while left:
        name = left.pop()
        file = _file_of(root, name)
        if file is None:
            continue
        found.add(file)
        fresh = {each for each in _imports(file, name) if each not in seen}
        seen |= fresh
        left += fresh
    return found


def _file_of(root: Path, module: str) -> Path | None:
    """Return the file of a module, None for what is no module of this repository."""
    package = module.partition(".")[0]
    if package not in ROOTS:
        return None
    path = root / ROOTS[package] / module.replace(".", "/")
    candidates = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)


@cache
def _imports(file: Path, module: str) -> frozenset[str]:
    """Return the names of modules that a file imports, except for type checkers only."""
    found: set[str] = set()
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    for node in _statements(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            found.add(base)
            found |= {_home_of(base, alias.name) for alias in node.names}
    return frozenset(found)


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield every node below one, but nothing below ``if TYPE_CHECKING``."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and isinstance(child.test, ast.Name) and child.test.id == "TYPE_CHECKING":
            continue
        yield child
        yield from _statements(child)


def _home_of(base: str, name: str) -> str:
    """Return the module that ``from base import name`` needs: the package's public names are loaded on demand."""
    if base == "boulder_sweep":
        value = getattr(importlib.import_module(base), name)
        return value.__name__ if isinstance(value, ModuleType) else str(getattr(value, "__module__", base))
    return f"{base}.{name}"


@cache
def _content_hash(file: Path) -> bytes:
    return sha256(file.read_bytes()).digest()
