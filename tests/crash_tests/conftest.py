"""What the tests of crash tests share."""

from __future__ import annotations

import pytest

from boulder_sweep.crash_tests.validation import Validation, validate


@pytest.fixture(scope="session")
def found() -> Validation:
    return validate()


@pytest.fixture
def known_study(found: Validation, monkeypatch: pytest.MonkeyPatch) -> None:
    """Element sums that were computed already; the tests of the statements and of the files compute them."""
    monkeypatch.setattr("boulder_sweep.crash_tests.validation.convergence", lambda: found.convergence)
