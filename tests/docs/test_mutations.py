"""Break an equation, and the tests that the register names for it turn red: each of them guards what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.mutants import broken, copy_sources, run_tests
from tests.docs.mutations import MUTATIONS, Mutation
from tests.docs.register import entries

ROOT = Path(__file__).parents[2]
REGISTER = {entry.number: entry for entry in entries((ROOT / "docs" / "equations.tsv").read_text(encoding="utf-8"))}
_PASSED = re.compile(r"^(\S+?::\w+).* PASSED", re.MULTILINE)


def is_of_kernels(mutation: Mutation) -> bool:
    return mutation.file.startswith("kernels/")


IN_ORDER = sorted(MUTATIONS, key=is_of_kernels, reverse=True)
"""Those beside the kernels last: their tests need compiled kernels, which other tests have compiled by then."""


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
    copy_sources(folder)
    return folder


@pytest.mark.parametrize("mutation", IN_ORDER, ids=name_of)
def test_a_broken_equation_turns_its_tests_red(copy: Path, mutation: Mutation) -> None:
    tests = sorted({test for number in mutation.equations for test in REGISTER[number].tests})
    with broken(copy, mutation):
        done = run_tests(copy, tests, compiled=not is_of_kernels(mutation))
    assert done.code == pytest.ExitCode.TESTS_FAILED, done.output[-3000:]


@pytest.mark.parametrize(
    "compiled", [pytest.param(False, id="kernels", marks=pytest.mark.nightly), pytest.param(True, id="others")]
)
def test_what_is_sound_stays_green(copy: Path, compiled: bool) -> None:
    """Every test beside the kernels that it meets broken code with."""
    met = {number for mutation in MUTATIONS if is_of_kernels(mutation) != compiled for number in mutation.equations}
    others = REGISTER.keys() - {number for mutation in MUTATIONS for number in mutation.equations}
    tests = {test for number in met | (others if compiled else set()) for test in REGISTER[number].tests}
    done = run_tests(copy, sorted(tests), compiled=compiled)
    assert done.code == pytest.ExitCode.OK, done.output[-3000:]
    assert set(_PASSED.findall(done.output)) == tests
