"""Reads the equation register and says what is wrong with it."""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import re
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

EQUATIONS = (*range(1, 56), 101, 102, *range(105, 109), *range(131, 138), *range(141, 148))
"""Those of the paper, and those added to it."""
WAYS = ("implemented", "derived", "explained")
SWITCHES = ("inertia", "impact_arm", "contact", "restoring", "separation")
_ROW = re.compile(r"^\| (\d+) \|(.*)\|$", re.MULTILINE)
_CODE = re.compile(r"`([^`]+)`")
_NUMBERS = re.compile(r"Eqs?\.? (\d+(?:(?:, | and | to |-|–| or )\d+)*)")


@dataclass(frozen=True)
class Entry:
    """One row of the register."""

    number: int
    meaning: str
    way: str
    functions: tuple[str, ...]
    tests: tuple[str, ...]
    reading: str


def entries(text: str) -> list[Entry]:
    """Return the rows of the register."""
    found = []
    for number, rest in _ROW.findall(text):
        cells = [cell.strip() for cell in rest.split("|")]
        meaning, way, functions, tests, reading = cells
        found.append(
            Entry(int(number), meaning, way, tuple(_CODE.findall(functions)), tuple(_CODE.findall(tests)), reading)
        )
    return found


def problems(text: str, root: Path) -> list[str]:
    """Return everything that is wrong with a register; empty where it is complete."""
    found = []
    rows = entries(text)
    numbers = [entry.number for entry in rows]
    found += [f"{n}: missing" for n in EQUATIONS if n not in numbers]
    found += [f"{n}: stands twice" for n in set(numbers) if numbers.count(n) > 1]
    for entry in rows:
        found += [f"{entry.number}: {problem}" for problem in _of_entry(entry, root)]
    return found


def _of_entry(entry: Entry, root: Path) -> list[str]:
    if entry.way not in WAYS:
        return [f"'{entry.way}' is none of {WAYS}"]
    if not entry.meaning:
        return ["no meaning"]
    if entry.way == "explained":
        return [] if len(entry.reading) > 40 else ["explained, but without an explanation"]
    found = []
    if not entry.functions:
        found.append("no function")
    if not entry.tests:
        found.append("no test")
    texts = ""
    for name in entry.functions:
        function = _resolve(name)
        if function is None:
            found.append(f"there is no function {name}")
            continue
        texts += _documentation(name, function)
    if not found and entry.number not in mentioned(texts):
        found.append(f"{' and '.join(entry.functions)} do not mention it")
    for test in entry.tests:
        file, _, function_name = test.partition("::")
        text = (root / file).read_text(encoding="utf-8") if (root / file).exists() else ""
        if not re.search(rf"^def {function_name}\(", text, re.MULTILINE):
            found.append(f"there is no test {test}")
        elif is_nightly(text, function_name):
            found.append(f"test {test} is nightly")
    found += [f"unknown reading {word}" for word in _CODE.findall(entry.reading) if word not in SWITCHES]
    return found


def _resolve(name: str) -> Any:
    """Return the function or method of a dotted name, None where there is none."""
    parts = name.split(".")
    for split in range(len(parts) - 1, 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:split]))
        except ModuleNotFoundError:
            continue
        for part in parts[split:]:
            found = getattr(found, part, None)
        return found
    return None


def _documentation(name: str, function: Any) -> str:
    """Docstrings of a function, its class and its module, and the comments and fields of what it returns."""
    function = function.fget if isinstance(function, property) else function
    plain = getattr(function, "py_func", function)
    module: ModuleType | None = inspect.getmodule(plain)
    assert module is not None, name
    return "\n".join((inspect.getdoc(plain) or "", inspect.getsource(plain), inspect.getsource(module)))


def is_nightly(text: str, test: str) -> bool:
    """Whether plain ``pytest`` leaves out a test of a file: it, its module or all its parameters are marked nightly.

    Parameters are looked at where the decorator lists them; a list that has a name or is computed counts as kept.
    """
    for node in _syntax_tree(text).body:
        if isinstance(node, ast.FunctionDef) and node.name == test:
            if any(_is_mark(decorator) or _has_nightly_parameters(decorator) for decorator in node.decorator_list):
                return True
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if "pytestmark" in map(ast.unparse, targets) and node.value is not None and _marks(node.value):
                return True
    return False


@functools.cache
def _syntax_tree(text: str) -> ast.Module:
    return ast.parse(text)


def _is_mark(node: ast.expr) -> bool:
    """Whether this is the mark, with or without a reason in parentheses."""
    node = node.func if isinstance(node, ast.Call) else node
    return isinstance(node, ast.Attribute) and node.attr == "nightly"


def _marks(node: ast.expr) -> bool:
    """Whether the mark is here or somewhere in a list."""
    return any(_is_mark(part) for part in ast.walk(node) if isinstance(part, ast.expr))


def _has_nightly_parameters(decorator: ast.expr) -> bool:
    """Whether this lists parameters and every one of them has the mark."""
    if not isinstance(decorator, ast.Call) or not ast.unparse(decorator.func).endswith("mark.parametrize"):
        return False
    named = {keyword.arg: keyword.value for keyword in decorator.keywords}
    values = decorator.args[1] if len(decorator.args) > 1 else named.get("argvalues")
    if not isinstance(values, ast.List | ast.Tuple):
        return False
    return bool(values.elts) and all(map(_marks, values.elts))


def mentioned(text: str) -> set[int]:
    """Return the equations that a text names: ``Eq 16``, ``Eqs 5, 6``, ``Eqs 24-28``, ``Eqs 53 to 55``."""
    found: set[int] = set()
    for group in _NUMBERS.findall(" ".join(text.split())):
        pieces = re.split(r"(, | and | or | to |-|–)", group)
        previous = int(pieces[0])
        found.add(previous)
        for sign, number in zip(pieces[1::2], pieces[2::2], strict=True):
            value = int(number)
            found |= set(range(previous, value + 1)) if sign in (" to ", "-", "–") else {value}
            previous = value
    return found
