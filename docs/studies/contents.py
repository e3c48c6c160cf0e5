"""Every block of the documentation that holds computed numbers, and the function that makes its text."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

from benchmarks.grades import grades, grades_table
from boulder_sweep.crash_tests.cases import Validation, statement_table, validate
from boulder_sweep.crash_tests.tables import Table
from docs.site.reference import bounds_of_flags
from docs.studies import (
    against_tests,
    answers,
    energy,
    extremes,
    forms,
    free_region,
    knife_edge,
    one_face,
    readings,
    soil,
    taped,
    wild,
)

GRID = Path("configs/m30_sizing.yaml")
EVERY = 29
"""Every so many-th design of the grid is in the readings study; 29 divides the length of none of its axes."""
_validation: Callable[[], Validation] = cache(validate)
_balances = cache(energy.balances)


def compute(root: Path, names: Iterable[str] | None = None) -> dict[str, str]:
    """Return the text of blocks by name; all of them by default.

    Parameters
    ----------
    root
        Folder of the repository.
    names
        Which blocks.
    """
    found = {name: CONTENTS[name](root) for name in (CONTENTS if names is None else names)}
    return {name: (text.markdown() if isinstance(text, Table) else text).strip() for name, text in found.items()}


@cache
def readings_of_grid(root: Path) -> readings.ReadingsStudy:
    """Return the readings study of the documentation."""
    return readings.readings_study(root / GRID, EVERY)


CONTENTS: dict[str, Callable[[Path], str | Table]] = {
    "validation-table": lambda _: _validation().table(),
    "statements": lambda _: statement_table(_validation().statements),
    "readings-words": lambda root: readings.readings_words(readings_of_grid(root)),
    "energy-balance": lambda _: energy.balance_table(_balances()),
    "energy-audit": lambda _: energy.audit_words(),
    "vehicle-fit": answers.vehicle_fit,
    "knife-edge": lambda _: knife_edge.knife_edge_words(),
    "box-shares": lambda _: extremes.box_words(),
    "validity-flags": lambda _: bounds_of_flags(),
    "soil-grid": lambda root: soil.grid_table(root / GRID),
    "soil-ground": lambda _: soil.ground_table(),
    "pushover": lambda _: against_tests.pushover_table(),
    "post-speeds": lambda _: against_tests.post_table(),
    "front-face": lambda root: one_face.one_face_words(root / GRID),
    "forms-grids-words": lambda root: forms.grids_words(root / GRID),
    "forms-tests": lambda root: forms.crash_table(root / GRID),
    "forms-random": lambda root: forms.random_table(root / GRID),
    "forms-random-words": lambda root: forms.random_words(root / GRID),
    "forms-free-words": lambda root: free_region.region_words(root / GRID),
    "grades": lambda root: grades_table(grades(root / GRID)),
    "wild-families": lambda root: wild.wild_table(root / GRID),
    "need-least": answers.least_of_site,
    "capacity-site": answers.capacity_of_site,
    "uncertainty-site": answers.uncertainty_of_site,
    "need-probability": answers.need_with_probability,
    "partial-factors": answers.partial_factors,
    "rocks": lambda _: taped.rocks_table(),
    "taped-stones": lambda root: taped.taped_table(root / GRID),
    "taped-words": lambda root: taped.taped_words(root / GRID),
    "borehole-notes": answers.notes_of_borehole,
    "log-drawing": answers.drawing_of_log,
}
"""Function of every block by its name."""

LONG = {
    *("readings-words", "box-shares", "front-face", "grades", "wild-families", "partial-factors"),
    *(name for name in CONTENTS if name.startswith(("forms-", "taped-"))),
}
"""Blocks that take more than ten seconds, or share what does: computed again every night, not with every change."""
