"""Impacts as the oracle had them once: a second of computing each, so the tests read them from `impacts.jsonl.gz`.

`recorded_impact` takes the place of `tests.oracle.impact.simulate` where a test compares no more than a `Summary`. An
impact is found by its inputs, readings and options. What is not in the record, or a record of other sources of the
oracle or of another SciPy, is integrated: right, only slow. Write the record anew by

    python -m tests.oracle.records [test files]

which runs every test file that asks for recorded impacts, in two processes, and keeps what they asked for. Impacts that
the present record has are not integrated again. With test files, only those are run, and nothing is dropped.
"""

from __future__ import annotations

import gzip
import hashlib
import inspect
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from functools import cache
from math import radians
from pathlib import Path
from typing import Any

import pytest
import scipy

from .impact import simulate
from .inputs import Ground, Inputs, Layer, Readings
from .outcome import Peak
from .summary import Summary, summary_of

FILE = Path(__file__).with_name("impacts.jsonl.gz")
COMMAND = "python -m tests.oracle.records"
FOLDER = "ORACLE_RECORDS_FOLDER"
"""Environment variable: where the tests that write the record put down what they ask for."""

_OTHER = {"__init__.py", "cases.py", "heave.py", "records.py"}  # sources that make no recorded impact
_EVERY = 30.0  # seconds between lines of progress

integrated: list[str] = []
"""Keys of impacts that tests asked for and the present record does not have."""


def source_hash(folder: Path = FILE.parent) -> str:
    """Return the hash of all sources that make an impact and its summary."""
    found = hashlib.sha256()
    for file in sorted(folder.glob("*.py")):
        if file.name not in _OTHER and not file.name.startswith(("test_", "conftest")):
            found.update(f"{file.name}\n{file.read_text(encoding='utf-8')}\0".encode())
    return found.hexdigest()


def versions() -> dict[str, str]:
    """Return what a record must agree with."""
    return {"sources": source_hash(), "scipy": ".".join(scipy.__version__.split(".")[:2])}


def read(file: Path = FILE) -> tuple[dict[str, str], list[dict[str, Any]]]:
    """Return the versions of a record and its entries, each with a `case` and what was `found`."""
    if not file.exists():
        return {}, []
    with gzip.open(file, "rt", encoding="utf-8") as lines:
        header, *entries = map(json.loads, lines)
    return header, entries


def write(entries: Iterable[dict[str, Any]], file: Path = FILE, of: dict[str, str] | None = None) -> None:
    """Write a record of the present versions or `of` those given, the same bytes for the same entries."""
    lines = sorted({key_of(entry["case"]): json.dumps(entry) for entry in entries}.items())
    text = "\n".join([json.dumps(of or versions()), *(line for _, line in lines)]) + "\n"
    file.write_bytes(gzip.compress(text.encode(), compresslevel=9, mtime=0))


def case_of(inputs: Inputs, readings: Readings, **options: Any) -> dict[str, Any]:
    """Return an impact as plain values, with the options of `simulate` that were not given."""
    given = inspect.signature(simulate).bind(inputs, readings, **options)
    given.apply_defaults()
    names = [name for name in given.arguments if name not in ("inputs", "readings")]
    chosen = {name: given.arguments[name] for name in names}
    plain = {name: float(value) if hasattr(value, "dtype") else value for name, value in chosen.items()}
    return {"inputs": asdict(inputs), "readings": asdict(readings), "options": plain}


def key_of(case: dict[str, Any]) -> str:
    """Return what an impact is found by: a hash of all its values, numbers to twelve digits.

    Inputs that are logarithms or sines may differ in their last digit from one mathematical library to the other.
    """
    return hashlib.sha256(json.dumps(_rounded(case), sort_keys=True).encode()).hexdigest()[:32]


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(one) for one in value]
    return f"{value:.12g}" if isinstance(value, float) else value


def arguments_of(case: dict[str, Any]) -> tuple[Inputs, Readings, dict[str, Any]]:
    """Return inputs, readings and options of an impact from its plain values."""
    given = dict(case["inputs"])
    if given["ground"] is not None:
        layers = tuple(Layer(**layer) for layer in given["ground"]["layers"])
        given["ground"] = Ground(**(given["ground"] | {"layers": layers}))
    return Inputs(**given), Readings(**case["readings"]), dict(case["options"])


def summary_from(found: dict[str, Any]) -> Summary:
    """Return a summary from its plain values."""
    peaks = {name: Peak(**value) for name, value in found.items() if isinstance(value, dict)}
    return Summary(**(found | peaks))


def recorded_impact(inputs: Inputs, readings: Readings, *, may_be_new: bool = False, **options: Any) -> Summary:
    """Return what is compared of an impact, from the record if it has it.

    Parameters
    ----------
    inputs, readings
        As `tests.oracle.impact.simulate` takes them.
    may_be_new : bool
        The impact depends on what the kernels find, so that no record has it for certain.
    **options
        Those of `simulate`.

    Returns
    -------
    Summary
    """
    case = case_of(inputs, readings, **options)
    key = key_of(case)
    found = _recorded().get(key)
    if found is None:
        found = summary_of(simulate(inputs, readings, **options))
        if is_current() and not may_be_new:
            integrated.append(key)
    if folder := os.environ.get(FOLDER):
        with Path(folder, f"{os.getpid()}.jsonl").open("a", encoding="utf-8") as lines:
            lines.write(json.dumps({"case": case, "found": asdict(found)}) + "\n")
    return found


@cache
def is_current() -> bool:
    """Whether the record is one of the present sources and of this SciPy."""
    return read()[0] == versions()


@cache
def _recorded() -> dict[str, Summary]:
    """Return the record by its keys; nothing where it is not current."""
    entries = read()[1] if is_current() else []
    return {key_of(entry["case"]): summary_from(entry["found"]) for entry in entries}


def on_a_knife_edge(inputs: Inputs, readings: Readings, **options: Any) -> bool:
    """Whether the largest rotation moves by 0.001 degree or more for a part in 10^9 of the speed of impact."""
    if readings.restoring == "gravity":
        return False
    nudged = [replace(inputs, v_0=inputs.v_0 * (1.0 + nudge)) for nudge in (-1e-9, 0.0, 1e-9)]
    found = [recorded_impact(one, readings, may_be_new=True, **options).max_rotation.value for one in nudged]
    return max(found) - min(found) >= radians(1e-3)


@pytest.fixture(autouse=True)
def every_impact_is_recorded() -> Iterator[None]:
    """Fail a test that asks for an impact the record should have and has not; folders that ask import this."""
    before = len(integrated)
    yield
    new = len(integrated) - before
    assert new == 0 or FOLDER in os.environ, f"{new} impacts are not in the record; put them there by: {COMMAND}"


def askers() -> list[Path]:
    """Return the test files that ask for recorded impacts."""
    tests = Path(__file__).parents[1]
    files = (file for file in tests.rglob("test_*.py") if file.name != "test_records.py")
    return sorted(file for file in files if "recorded_impact" in file.read_text(encoding="utf-8"))


def _asked(folder: Path) -> list[dict[str, Any]]:
    """Return what the tests have put down so far, unfinished lines left out."""
    lines = [line for file in folder.glob("*.jsonl") for line in file.read_text(encoding="utf-8").split("\n")[:-1]]
    return [json.loads(line) for line in lines]


def _run(files: list[Path], folder: Path) -> int:
    """Run test files in two processes, with a line of progress now and then; return the exit code."""
    words = ["-q", "-m", "", "-p", "no:cacheprovider", "-n", "2", "--dist", "worksteal", *map(str, files)]
    running = subprocess.Popen([sys.executable, "-m", "pytest", *words], env=os.environ | {FOLDER: str(folder)})
    while True:
        try:
            return running.wait(_EVERY)
        except subprocess.TimeoutExpired:
            print(f"{len({key_of(entry['case']) for entry in _asked(folder)})} impacts", flush=True)


def main(words: list[str]) -> int:
    """Write the record anew; return the exit code of the tests that asked for it."""
    before = versions()
    kept = read()[1] if words and is_current() else []
    with tempfile.TemporaryDirectory() as name:
        code = _run([Path(word) for word in words] or askers(), Path(name))
        asked = _asked(Path(name))
    if not asked:
        return code or 1
    write([*kept, *asked], of=before)
    print(f"{FILE}: {len(read()[1])} impacts" + (", but tests have failed" if code else ""))
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
