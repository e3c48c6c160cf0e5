"""What the tests of crash tests share."""

from __future__ import annotations

import pytest

from boulder_sweep.crash_tests.cases import Validation, validate


@pytest.fixture(scope="session")
def found() -> Validation:
    return validate()
