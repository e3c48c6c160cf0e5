"""How a test fails: soon and in few words."""

from __future__ import annotations

import os

import pytest


def test_a_long_difference_is_not_written_out() -> None:
    """Two lists of rows that differ everywhere are compared to the first difference, also where CI is set."""
    assert not os.environ.get("CI")
    with pytest.raises(AssertionError) as failed:
        assert list(range(300)) == list(range(1, 301))
    assert "At index 0 diff: 0 != 1" in str(failed.value)
    assert str(failed.value).count("\n") < 10
