"""Counts show what makes the project do more: the gate fails a copy of the sources with any of the sabotages.

What only a clock shows is left to ``python -m benchmarks.sabotage``.
"""

from pathlib import Path

import pytest

from benchmarks import counts
from benchmarks.sabotage import SABOTAGES, Sabotage, complaint_about_counts, sabotaged

NIGHTLY = (
    # Counts of machine code, and of a run, show these two at less cost.
    "a lane step done twice, by calls",
    "a design simulated twice by the kernels, by calls",
    # Simulates to the horizon without the compiler, which takes seconds.
    "a proof of rest that no longer ends a simulation",
)


def marks_of(name: str, sabotage: Sabotage) -> list[pytest.MarkDecorator]:
    compiled = [] if sabotage.shown_by == ("calls",) else [pytest.mark.compiled]
    return compiled + ([pytest.mark.nightly] if name in NIGHTLY else [])


SHOWN_BY_COUNTS = [
    pytest.param(sabotage, id=name, marks=marks_of(name, sabotage))
    for name, sabotage in SABOTAGES.items()
    if sabotage.counts
]


@pytest.mark.parametrize("sabotage", SHOWN_BY_COUNTS)
def test_counts_show_what_makes_the_project_do_more(tmp_path: Path, sabotage: Sabotage) -> None:
    complaint = complaint_about_counts(tmp_path, sabotaged(tmp_path, sabotage), sabotage)
    assert all(f"{name} (" in complaint for name in sabotage.counts), complaint


@pytest.mark.compiled
def test_a_run_does_what_the_record_says(tmp_path: Path) -> None:
    recorded = counts.read().counts
    found = counts.count("run")
    assert found == pytest.approx({name: recorded[name] for name in found}, rel=0.02)
    assert found["designs simulated in a run"] == recorded["designs simulated in a run"]


def test_every_sabotage_finds_what_it_replaces() -> None:
    root = Path(__file__).parents[2]
    for sabotage in SABOTAGES.values():
        assert (root / sabotage.file).read_text(encoding="utf-8").count(sabotage.old) == 1
