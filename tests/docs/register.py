"""Reads the equation register and says what is wrong with it."""

from __future__ import annotations

import functools
import importlib
import inspect
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

EQUATIONS = (*range(1, 56), 101, 102, *range(105, 109), *range(131, 138), *range(141, 151))
"""Equations of the paper, and equations added to it."""
WAYS = ("implemented", "derived", "explained")
SWITCHES = ("inertia", "impact_arm", "contact", "restoring", "separation")
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
    """Return the rows of the register: a line of names, then cells between tabs."""
    found = []
    for line in text.splitlines()[1:]:
        number, meaning, way, functions, tests, reading = line.split("\t")
        found.append(Entry(int(number), meaning, way, tuple(functions.split()), tuple(tests.split()), reading))
    return found


def problems(text: str, root: Path) -> list[str]:
    """Return everything that is wrong with a register; empty where it is complete."""
    found = []
    rows = entries(text)
    numbers = [entry.number for entry in rows]
    found += [f"{n}: missing" for n in EQUATIONS if n not in numbers]
    found += [f"{n}: stands twice" for n in set(numbers) if numbers.count(n) > 1]
    files = {test.partition("::")[0] for entry in rows for test in entry.tests}
    by_day = run_by_day(tuple(sorted(file for file in files if (root / file).exists())), root)
    for entry in rows:
        found += [f"{entry.number}: {problem}" for problem in _of_entry(entry, root, by_day)]
    return found


def _of_entry(entry: Entry, root: Path, by_day: frozenset[str]) -> list[str]:
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
        elif test not in by_day:
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


@functools.cache
def run_by_day(files: tuple[str, ...], root: Path) -> frozenset[str]:
    """Return the tests of files that plain ``pytest`` runs: what is not nightly."""
    words = ("--collect-only", "-q", "-p", "no:cacheprovider", "-o", "addopts=--import-mode=importlib")
    command = [sys.executable, "-m", "pytest", *words, "-m", "not nightly", *files]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED), done.stdout
    return frozenset(line.partition("[")[0] for line in done.stdout.splitlines() if "::" in line)


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
