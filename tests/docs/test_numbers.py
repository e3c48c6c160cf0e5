"""Every block of numbers in the documentation is what the commands give."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.studies.contents import CONTENTS, LONG, compute
from docs.studies.documents import blocks, drift

ROOT = Path(__file__).parents[2]


def drift_of(name: str) -> list[str]:
    """Compute a block; write it anew with ``python -m docs.studies --write NAME``."""
    (written,) = [block.text for block in blocks(ROOT) if block.name == name]
    return drift(written, compute(ROOT, [name])[name])


@pytest.mark.parametrize("name", [name for name in CONTENTS if name not in LONG])
def test_a_number_that_is_soon_computed_has_not_drifted(name: str) -> None:
    assert drift_of(name) == []


@pytest.mark.nightly
@pytest.mark.parametrize("name", sorted(LONG))
def test_no_number_has_drifted(name: str) -> None:
    assert drift_of(name) == []
