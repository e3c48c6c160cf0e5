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
    energy,
    forms,
    free_region,
    gallery,
    moves,
    shapes,
    site_data,
    soil,
    stones,
    taped,
)
from docs.studies.coverage import NUMBERS, coverage_table, coverages, grid_table, random_table
from docs.studies.extremes import admitted_table, box_shares_table, refusal_table
from docs.studies.knife_edge import knife_edge_words
from docs.studies.one_face import one_face_words
from docs.studies.readings import ReadingsStudy, readings_study
from docs.studies.settings_tables import choices_table, columns_table, entries_table
from docs.studies.validity import crush_words, flags_of_grids, flags_table
from docs.studies.wild import wild_table
from docs.studies.wording import balance_words, caution_text, convergence_words, fit_text, readings_words

GRID = Path("configs/m30_sizing.yaml")
EVERY = 29
"""Every so many-th design of the grid is in the readings study; 29 divides the length of none of its axes."""


def compute(root: Path, names: Iterable[str] | None = None) -> dict[str, str]:
    """Return the text of blocks by name; all of them by default.

    Parameters
    ----------
    root
        Folder of the repository.
    names
        Which blocks.
    """
    return {name: CONTENTS[name](root).strip() for name in (CONTENTS if names is None else names)}


@cache
def _validation() -> Validation:
    return validate()


@cache
def readings_of_grid(root: Path) -> ReadingsStudy:
    """Return the readings study of the documentation."""
    return readings_study(root / GRID, EVERY)


@cache
def _balances() -> list[energy.Balance]:
    return energy.balances()


def _validation_table(_: Path) -> str:
    return _validation().table().markdown()


def _statements(_: Path) -> str:
    return statement_table(_validation().statements).markdown()


def _convergence(_: Path) -> str:
    return _validation().convergence.table().markdown()


def _convergence_words(_: Path) -> str:
    return convergence_words(_validation().convergence)


def _rigid_wall(_: Path) -> str:
    table = Table(("of the paper's truck against a rigid wall", "value"))
    units = {"per_s": "1/s", "m": "m", "s": "s", "kN": "kN", "m_s": "m/s"}
    for name, value in wall_figures(rigid_wall_test()).items():
        suffix = next(text for text in ("per_s", "m_s", "kN", "m", "s") if name.endswith(f"_{text}"))
        table.add(name.removesuffix(f"_{suffix}").replace("_", " "), f"{value:.4f} {units[suffix]}")
    return table.markdown()


def _readings_crash_tests(root: Path) -> str:
    return readings_of_grid(root).crash_test_table().markdown()


def _readings_grid(root: Path) -> str:
    return readings_of_grid(root).grid_table().markdown()


def _readings_words(root: Path) -> str:
    return readings_words(readings_of_grid(root))


def _balance_table(_: Path) -> str:
    return energy.balance_table(_balances()).markdown()


def _balance_words(_: Path) -> str:
    return balance_words(_balances())


def _audit(_: Path) -> str:
    return energy.audit_table().markdown()


def _fit(_: Path) -> str:
    return fit_text()


def _coverage(root: Path) -> str:
    tables = {"random": random_table(16_384, 1), "M30 grid": grid_table(root / GRID, 8192)}
    shown = [own for own in coverages(tables) if own.accuracy != "a number" or own.steps == NUMBERS[1]]
    return coverage_table(shown).markdown()


def _knife_edge(_: Path) -> str:
    return knife_edge_words()


def _admitted_box(_: Path) -> str:
    return admitted_table().markdown()


def _refusals(_: Path) -> str:
    return refusal_table().markdown()


def _box_shares(_: Path) -> str:
    return box_shares_table().markdown()


def _settings_entries(_: Path) -> str:
    return entries_table().markdown()


def _settings_choices(_: Path) -> str:
    return choices_table().markdown()


def _result_columns(_: Path) -> str:
    return columns_table().markdown()


def _validity_flags(_: Path) -> str:
    return flags_table().markdown()


def _validity_shares(root: Path) -> str:
    return flags_of_grids(root / GRID).markdown()


def _soil_tests(_: Path) -> str:
    return soil.tests_table().markdown()


def _soil_ground(_: Path) -> str:
    return soil.ground_table().markdown()


def _soil_grid(root: Path) -> str:
    return soil.grid_table(root / GRID).markdown()


def _pushover(_: Path) -> str:
    return against_tests.pushover_table().markdown()


def _moves(root: Path) -> str:
    return moves.moves_table(root).markdown()


def _post_speeds(_: Path) -> str:
    return against_tests.post_table().markdown()


def _crush_words(root: Path) -> str:
    return crush_words(root / GRID)


def _front_face(root: Path) -> str:
    return one_face_words(root / GRID)


def _forms_grids(root: Path) -> str:
    return forms.grids_table(root / GRID).markdown()


def _forms_grids_words(root: Path) -> str:
    return forms.grids_words(root / GRID)


def _forms_bases(root: Path) -> str:
    return forms.bases_table(root / GRID).markdown()


def _forms_tests(root: Path) -> str:
    return forms.tests_table(root / GRID).markdown()


def _forms_random(root: Path) -> str:
    return forms.random_table(root / GRID).markdown()


def _forms_random_words(root: Path) -> str:
    return forms.random_words(root / GRID)


def _grades(root: Path) -> str:
    return grades_table(grades(root / GRID)).markdown()


def _forms_free(root: Path) -> str:
    return free_region.region_table(root / GRID).markdown()


def _forms_free_words(root: Path) -> str:
    return free_region.region_words(root / GRID)


def _wild_families(root: Path) -> str:
    return wild_table(root / "configs" / "m30_sizing.yaml").markdown()


CONTENTS: dict[str, Callable[[Path], str]] = {
    "validation-table": _validation_table,
    "statements": _statements,
    "rigid-wall": _rigid_wall,
    "convergence": _convergence,
    "convergence-words": _convergence_words,
    "readings-crash-tests": _readings_crash_tests,
    "readings-grid": _readings_grid,
    "readings-words": _readings_words,
    "energy-balance": _balance_table,
    "energy-words": _balance_words,
    "energy-audit": _audit,
    "vehicle-fit": _fit,
    "vehicle-caution": caution_text,
    "coverage": _coverage,
    "knife-edge": _knife_edge,
    "admitted-box": _admitted_box,
    "refusals": _refusals,
    "box-shares": _box_shares,
    "validity-flags": _validity_flags,
    "validity-shares": _validity_shares,
    "soil-tests": _soil_tests,
    "soil-grid": _soil_grid,
    "soil-ground": _soil_ground,
    "pushover": _pushover,
    "post-speeds": _post_speeds,
    "crush-words": _crush_words,
    "front-face": _front_face,
    "forms-grids": _forms_grids,
    "forms-grids-words": _forms_grids_words,
    "forms-bases": _forms_bases,
    "forms-tests": _forms_tests,
    "forms-random": _forms_random,
    "forms-random-words": _forms_random_words,
    "grades": _grades,
    "forms-free": _forms_free,
    "forms-free-words": _forms_free_words,
    "wild-families": _wild_families,
    "settings-entries": _settings_entries,
    "settings-choices": _settings_choices,
    "result-columns": _result_columns,
    "need-site": answers.need_of_site,
    "need-mass": answers.lightest_of_grid,
    "capacity-site": answers.capacity_of_site,
    "uncertainty-site": answers.uncertainty_of_site,
    "uncertainty-cases": answers.uncertainty_of_cases,
    "need-probability": answers.need_with_probability,
    "moves": _moves,
    "partial-factors": answers.partial_factors,
    "stone-shapes": lambda root: shapes.shapes_table(root / GRID).markdown(),
    "rocks": lambda _: taped.rocks_table().markdown(),
    "taped-stones": lambda root: taped.taped_table(root / GRID).markdown(),
    "taped-words": lambda root: taped.taped_words(root / GRID),
    "stone-example": stones.stone_of_example,
    "stone-settings": stones.settings_of_example,
    "stone-site": stones.site_of_example,
    "borehole-notes": site_data.notes_of_borehole,
    "log-drawing": site_data.drawing_of_log,
    "spt-angles": site_data.angles_of_counts,
    "gallery-embassy-street": lambda root: gallery.words_of(root, "embassy_street"),
    "gallery-wet-backfill": lambda root: gallery.words_of(root, "wet_backfill"),
    "gallery-clayey-terrace": lambda root: gallery.words_of(root, "clayey_terrace"),
    "gallery-embankment": lambda root: gallery.words_of(root, "embankment"),
    "gallery-quarry-stone": lambda root: gallery.words_of(root, "quarry_stone"),
    "gallery-uncertain-site": lambda root: gallery.words_of(root, "uncertain_site"),
}
"""Function of every block by its name."""

LONG = {
    *("readings-crash-tests", "readings-grid", "readings-words", "coverage", "box-shares", "front-face"),
    *(name for name in CONTENTS if name.startswith("forms-")),
    *("grades", "wild-families", "moves", "partial-factors", "stone-site"),
    *("taped-stones", "taped-words"),
}
"""Blocks that take more than ten seconds, or share what does: computed again every night, not with every change."""
