"""Break an equation, and the tests that the register names for it turn red: each of them guards what it says."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.mutations import MUTATIONS, Mutation
from tests.docs.register import entries

ROOT = Path(__file__).parents[2]
REGISTER = {entry.number: entry for entry in entries((ROOT / "docs" / "equations.md").read_text(encoding="utf-8"))}
TESTS_FAILED = 1  # exit code of pytest; another one would mean that it could not even begin


def name_of(mutation: Mutation) -> str:
    return f"{'-'.join(map(str, mutation.equations))}: {mutation.old}"


def test_there_are_mutations_of_every_kind() -> None:
    broken = {number for mutation in MUTATIONS for number in mutation.equations}
    implemented = {number for number, entry in REGISTER.items() if entry.way == "implemented"}
    assert implemented <= broken


@pytest.mark.parametrize("mutation", MUTATIONS, ids=name_of)
def test_what_is_to_be_broken_is_there(mutation: Mutation) -> None:
    text = (ROOT / mutation.file).read_text(encoding="utf-8")
    assert text.count(mutation.old) == 1


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy of the sources, to be broken."""
    folder = tmp_path_factory.mktemp("mutations")
    for name in ("kernels", "boulder_sweep", "tests", "configs"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


@pytest.mark.nightly
@pytest.mark.parametrize("mutation", MUTATIONS, ids=name_of)
def test_a_broken_equation_turns_its_tests_red(copy: Path, mutation: Mutation) -> None:
    tests = sorted({test for number in mutation.equations for test in REGISTER[number].tests})
    file = copy / mutation.file
    sound = file.read_text(encoding="utf-8")
    file.write_text(sound.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        done = run_tests(copy, tests, compiled=not is_of_kernels(mutation))
    finally:
        file.write_text(sound, encoding="utf-8")
    assert done.returncode == TESTS_FAILED, done.stdout[-2000:] + done.stderr[-1000:]


@pytest.mark.nightly
@pytest.mark.parametrize("compiled", [False, True], ids=["kernels", "others"])
def test_what_is_sound_stays_green(copy: Path, compiled: bool) -> None:
    """Every test beside the kernels that it meets broken code with."""
    broken = {number for mutation in MUTATIONS if is_of_kernels(mutation) != compiled for number in mutation.equations}
    others = REGISTER.keys() - {number for mutation in MUTATIONS for number in mutation.equations}
    tests = {test for number in broken | (others if compiled else set()) for test in REGISTER[number].tests}
    done = run_tests(copy, sorted(tests), compiled=compiled)
    assert done.returncode == 0, done.stdout[-2000:]


def is_of_kernels(mutation: Mutation) -> bool:
    return mutation.file.startswith("kernels/")


def run_tests(folder: Path, tests: list[str], *, compiled: bool) -> subprocess.CompletedProcess[str]:
    """Run tests of a copy, with the compiled kernels of the original, or without the compiler, with those of the copy.

    To compile them anew takes longer than the tests do.
    """
    environment = os.environ | {
        "PYTHONPATH": f"{folder}{os.pathsep}{(ROOT if compiled else folder) / 'kernels'}",
        "PYTHONDONTWRITEBYTECODE": "1",
        "NUMBA_DISABLE_JIT": "0" if compiled else "1",
    }
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
