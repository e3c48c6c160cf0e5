"""What each of the five doubtful formulas does: to both crash tests, and to the designs of a grid that stand."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_sweep.answers.advice import listed
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import HORIZON, PASS
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.model import PRESETS, PRINTED, SWITCHES, ReadingChoice
from docs.studies.documents import points

BLOCK = 32_768


class ReadingRow(NamedTuple):
    """Results under one choice of readings."""

    base: str
    """Preset it starts from."""
    switch: str
    """The one reading that differs from it; empty for the preset itself."""
    abg_verdict: str
    """Verdict of American Black Granite, reason included."""
    rwg_rotation_deg: float
    """Largest rotation of Rockville White Granite."""
    stands: np.ndarray
    """Which designs of the grid stand up to the horizon, bool, shape (n,)."""


class ReadingsStudy(NamedTuple):
    """Results under both presets, each followed by its five single changes."""

    rows: list[ReadingRow]

    def row(self, base: str, switch: str = "") -> ReadingRow:
        """Return the row of one reading."""
        return next(row for row in self.rows if (row.base, row.switch) == (base, switch))

    @property
    def designs(self) -> int:
        """Number of designs simulated."""
        return len(self.rows[0].stands)

    def changed(self, row: ReadingRow) -> tuple[int, int]:
        """How many designs stand under a row but not under its preset, and the other way round."""
        base = self.row(row.base).stands
        return int((row.stands & ~base).sum()), int((base & ~row.stands).sum())

    def deciding(self) -> list[tuple[str, int]]:
        """Switches by how many verdicts of the grid they change from ``corrected``, most first."""
        rows = [row for row in self.rows if row.base == "corrected" and row.switch]
        return sorted(((row.switch, sum(self.changed(row))) for row in rows), key=lambda item: -item[1])


def choices() -> list[tuple[str, str, ReadingChoice]]:
    """Return both presets and every single change of them: preset, switch (or ""), readings."""
    found = []
    for base in PRESETS:
        whole = ReadingChoice.of_preset(base)
        found.append((base, "", whole))
        for switch, corrected in SWITCHES.items():
            other = corrected if base == "as_printed" else PRINTED
            found.append((base, switch, dataclasses.replace(whole, **{switch: other})))
    return found


def readings_study(grid: Path, every: int = 1) -> ReadingsStudy:
    """Simulate both crash tests and a whole grid under both presets and every single change of them.

    Parameters
    ----------
    grid
        Settings of the grid; its own readings do not matter.
    every
        Simulate only every so many-th design of the grid.
    """
    sweep, rows = load(grid), []
    for base, switch, choice in choices():
        abg, rwg = (simulate(crash_test(test), readings=choice) for test in ("abg", "rwg"))
        verdict = ", ".join(word for word in (abg.verdict, abg.reason) if word)
        rotation = math.degrees(rwg.motion.outcome.maxima.theta)
        rows.append(ReadingRow(base, switch, verdict, rotation, standing(sweep, choice, every)))
    return ReadingsStudy(rows)


def standing(sweep: Sweep, choice: ReadingChoice, every: int = 1) -> np.ndarray:
    """Return which designs of a grid stand up to the horizon under some readings, bool, shape (n,).

    As printed none of them passes, since nothing is proved of later times.

    Parameters
    ----------
    sweep
        The grid.
    choice
        Readings in place of its own.
    every
        Only every so many-th design, from the first on.
    """
    read_so = dataclasses.replace(sweep, model=dataclasses.replace(sweep.model, readings=choice))
    whole = evaluation_of(read_so, accuracy_of(read_so))
    evaluation = dataclasses.replace(whole, control=whole.control._replace(longest_horizon=0.0))
    stands = []
    for start in range(0, sweep.n_designs, BLOCK):
        block = sweep.block(start, min(start + BLOCK, sweep.n_designs))
        chosen = block.design_id() % every == 0
        computable = chosen & (np.asarray(block.reasons.codes) == 0)
        found = evaluation.judged(designs_of(block, computable))
        here = np.zeros(len(block), dtype=bool)
        here[computable] = (found.verdict == PASS) | (found.reason == HORIZON)
        stands.append(here[chosen])
    return np.concatenate(stands)


def readings_words(study: ReadingsStudy) -> str:
    """What the readings study shows."""
    printed, corrected = study.row("as_printed"), study.row("corrected")
    deciding = study.deciding()
    (most, changes), (second, second_changes), (least, least_changes) = deciding[0], deciding[1], deciding[-1]
    gained, _ = study.changed(study.row("corrected", most))
    return points(
        f"**`{most}` decides most verdicts.** As printed, with everything else corrected, it changes "
        f"{changes / study.designs:.1%} of {study.designs:,} designs between standing and not, {gained / changes:.0%} "
        f"of them to standing. `{second}` comes next with {second_changes / study.designs:.1%}; `{least}` is the least "
        f"with {least_changes / study.designs:.1%}.",
        _arm_words(study),
        _preset_words(printed, corrected, study.designs),
        _strictness_words(study),
    )


def _arm_words(study: ReadingsStudy) -> str:
    """What the sign of one length does to the test that passed."""
    before = study.row("as_printed").rwg_rotation_deg
    after = study.row("as_printed", "impact_arm").rwg_rotation_deg
    return (
        f"On the crash test that passed, the sign of d₁ alone (`impact_arm: geometric` in place of printed) moves the "
        f"largest rotation from {before:.2f}° to {after:.2f}°, {after / before:.1f} times as far."
    )


def _preset_words(printed: ReadingRow, corrected: ReadingRow, designs: int) -> str:
    """How far the presets agree."""
    unsafe = int((printed.stands & ~corrected.stands).sum())
    lost = int((corrected.stands & ~printed.stands).sum())
    return (
        f"About as many designs stand as printed, {printed.stands.mean():.1%}, as corrected, "
        f"{corrected.stands.mean():.1%}, because the misprints partly cancel. They are not the same designs: "
        f"{unsafe / designs:.1%} of all stand only as printed, {lost / designs:.1%} only as corrected."
    )


def _strictness_words(study: ReadingsStudy) -> str:
    """Which misprints are on the safe side."""
    rows = {switch: study.changed(study.row("corrected", switch)) for switch in SWITCHES}
    safe = tuple(f"`{switch}`" for switch, (gained, _) in rows.items() if gained == 0)
    lax = tuple(f"`{switch}`" for switch, (gained, lost) in rows.items() if gained > lost)
    return (
        f"A single printed formula among corrected ones is safe for {listed(safe)}, because fewer designs stand, "
        f"and unsafe for {listed(lax)}, because more do."
    )
