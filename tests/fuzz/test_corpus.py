"""Each input that the fuzzer kept, or failed with once, passes."""

from __future__ import annotations

import pytest

from tests.fuzz.targets import CORPUS, TARGETS


@pytest.mark.parametrize("name", TARGETS)
def test_inputs_end_in_a_result_or_in_words(name: str) -> None:
    taken = set()
    for file in sorted((CORPUS / name).iterdir()):
        try:
            taken.add(TARGETS[name].attempt(file.read_bytes()))
        except Exception as problem:
            raise AssertionError(f"{file}: {problem}") from problem
    assert taken == {True, False}
