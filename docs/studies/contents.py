"""Every block of the documentation that holds computed numbers, and the function that makes its text."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

from benchmarks.grades import grades, grades_table
from boulder_sweep.crash_tests.cases import rigid_wall_test, statement_table
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.crash_tests.validation import Validation, validate, wall_figures
from docs.studies import (
    against_tests,
    answers,
    coverage,
    energy,
    extremes,
    forms,
    free_region,
    gallery,
    knife_edge,
    one_face,
    readings,
    settings_tables,
    shapes,
    site_data,
    soil,
    stones,
    taped,
    validity,
    vehicle,
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


def _rigid_wall(_: Path) -> Table:
    table = Table(("of the paper's truck against a rigid wall", "value"))
    units = {"per_s": "1/s", "m": "m", "s": "s", "kN": "kN", "m_s": "m/s"}
    for name, value in wall_figures(rigid_wall_test()).items():
        suffix = next(text for text in ("per_s", "m_s", "kN", "m", "s") if name.endswith(f"_{text}"))
        table.add(name.removesuffix(f"_{suffix}").replace("_", " "), f"{value:.4f} {units[suffix]}")
    return table


CONTENTS: dict[str, Callable[[Path], str | Table]] = {
    "validation-table": lambda _: _validation().table(),
    "statements": lambda _: statement_table(_validation().statements),
    "rigid-wall": _rigid_wall,
    "convergence": lambda _: _validation().convergence.table(),
    "convergence-words": lambda _: against_tests.convergence_words(_validation().convergence),
    "readings-crash-tests": lambda root: readings_of_grid(root).crash_test_table(),
    "readings-grid": lambda root: readings_of_grid(root).grid_table(),
    "readings-words": lambda root: readings.readings_words(readings_of_grid(root)),
    "energy-balance": lambda _: energy.balance_table(_balances()),
    "energy-words": lambda _: energy.balance_words(_balances()),
    "energy-audit": lambda _: energy.audit_table(),
    "vehicle-fit": vehicle.fit_text,
    "vehicle-caution": vehicle.caution_text,
    "coverage": lambda root: coverage.documented(root / GRID),
    "knife-edge": lambda _: knife_edge.knife_edge_words(),
    "admitted-box": lambda _: extremes.admitted_table(),
    "refusals": lambda _: extremes.refusal_table(),
    "box-shares": lambda _: extremes.box_shares_table(),
    "validity-flags": lambda _: validity.flags_table(),
    "validity-shares": lambda root: validity.flags_of_grids(root / GRID),
    "soil-tests": lambda _: soil.tests_table(),
    "soil-grid": lambda root: soil.grid_table(root / GRID),
    "soil-ground": lambda _: soil.ground_table(),
    "pushover": lambda _: against_tests.pushover_table(),
    "post-speeds": lambda _: against_tests.post_table(),
    "front-face": lambda root: one_face.one_face_words(root / GRID),
    "forms-grids": lambda root: forms.grids_table(root / GRID),
    "forms-grids-words": lambda root: forms.grids_words(root / GRID),
    "forms-tests": lambda root: forms.tests_table(root / GRID),
    "forms-random": lambda root: forms.random_table(root / GRID),
    "forms-random-words": lambda root: forms.random_words(root / GRID),
    "forms-free": lambda root: free_region.region_table(root / GRID),
    "forms-free-words": lambda root: free_region.region_words(root / GRID),
    "grades": lambda root: grades_table(grades(root / GRID)),
    "wild-families": lambda root: wild.wild_table(root / GRID),
    "settings-entries": lambda _: settings_tables.entries_table(),
    "settings-choices": lambda _: settings_tables.choices_table(),
    "result-columns": lambda _: settings_tables.columns_table(),
    "need-site": answers.need_of_site,
    "need-mass": answers.lightest_of_grid,
    "capacity-site": answers.capacity_of_site,
    "uncertainty-site": answers.uncertainty_of_site,
    "uncertainty-cases": answers.uncertainty_of_cases,
    "need-probability": answers.need_with_probability,
    "partial-factors": answers.partial_factors,
    "stone-shapes": lambda root: shapes.shapes_table(root / GRID),
    "rocks": lambda _: taped.rocks_table(),
    "taped-stones": lambda root: taped.taped_table(root / GRID),
    "taped-words": lambda root: taped.taped_words(root / GRID),
    "stone-example": stones.stone_of_example,
    "stone-settings": stones.settings_of_example,
    "stone-site": stones.site_of_example,
    "borehole-notes": site_data.notes_of_borehole,
    "log-drawing": site_data.drawing_of_log,
    "spt-angles": site_data.angles_of_counts,
    **{f"gallery-{site.name.replace('_', '-')}": site.words for site in gallery.SITES},
}
"""Function of every block by its name."""

LONG = {
    *("readings-crash-tests", "readings-grid", "readings-words", "coverage", "box-shares", "front-face"),
    *(name for name in CONTENTS if name.startswith("forms-")),
    *("grades", "wild-families", "partial-factors", "stone-shapes", "stone-site"),
    *("taped-stones", "taped-words"),
}
"""Blocks that take more than ten seconds, or share what does: computed again every night, not with every change."""
