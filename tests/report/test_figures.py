"""A verdict has one colour, in pictures and on pages."""

from __future__ import annotations

from boulder_sweep.report.figures import COLOURS
from boulder_sweep.views.verdict_map import CLASSES


def test_a_verdict_has_one_colour() -> None:
    for key, colour, _ in CLASSES:
        name = key.replace("/", ": ")
        found = COLOURS.get(name) or COLOURS[name.split(":")[0]]  # as the page's script looks it up
        assert found == colour, key
    assert len(set(COLOURS.values())) == len(COLOURS)
