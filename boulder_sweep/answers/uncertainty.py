"""The probability that a design passes when inputs are uncertain, and which input matters most."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.answers.chance import FIRST, SCRAMBLINGS, Chances, Estimates, Event, Points, chance
from boulder_sweep.answers.draws import Draws
from boulder_sweep.answers.keys import margin_asked, share
from boulder_sweep.answers.result import Result, chance_columns, collected, joined_tables, rows_table, write_parquet
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import Judges, judges_of, ranges, uncertain_rows, ungraded
from boulder_sweep.designs import block_of
from boulder_sweep.drawing import draw
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.robustness import can_be_asked
from boulder_sweep.locations import Location
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings.loader import sweep_of
from boulder_sweep.store.provenance import PREFIX
from boulder_sweep.text import ProgressCallback

if TYPE_CHECKING:
    import pyarrow as pa

    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.loader import Settings

ROWS_AT_ONCE = 256
STRATA = 8
"""Strata of each input whose means are compared by `drivers`."""
MOST_SAMPLED = 100
"""Most rows of which samples are kept."""
SAMPLES = 4096
"""Samples kept of each row for plots and inspection."""


@dataclass(frozen=True, eq=False, repr=False)
class Uncertainty(Result):
    """Probabilities of the designs of a sweep. Made by `uncertainty`.

    Attributes
    ----------
    sweep, arrow
        The sweep asked about, and one row for each design: inputs with the means of the uncertain ones, the outcome at
        these means, the chance of passing and of a robust pass (`p_robust`, unless second opinions are left out or do
        not know such designs), with their intervals, and the most influential input.
    samples : pyarrow.Table
        Designs drawn: number of the design, uncertain inputs, distance to failing; none where there are more than
        `MOST_SAMPLED` designs.
    seed : int
        Seed of all random numbers.
    """

    samples: pa.Table
    seed: int

    def to_dict(self) -> dict[str, Any]:
        """Return everything except the samples as plain data."""
        return {"name": self.sweep.name, "seed": self.seed, "rows": self.arrow.to_pylist()}

    def write(self, path: str | Location) -> list[Location]:
        """Write the answers, with the samples next to them; see `Result.write`."""
        files = super().write(path)
        if len(self.samples):
            metadata = self.arrow.schema.metadata.items()
            identity = {key: value for key, value in metadata if key.startswith(PREFIX.encode())}
            samples = self.samples.replace_schema_metadata(identity)
            files.append(write_parquet(samples, files[0].with_suffix(".samples.parquet")))
        return files

    def plot(self, path: str | Path, design_id: int = 0, *, units: str = "si") -> None:
        """Draw which samples pass, and how each input affects the probability; in ``si`` or ``us`` units.

        Raises
        ------
        PictureError
            It cannot be drawn.
        """
        draw("answer_charts", "draw_uncertainty", self, path, design_id=design_id, units=units)


def uncertainty(
    sweep: Settings,
    *,
    half_width: str | float = 0.01,
    confidence: str | float = 0.95,
    margin: str | float = 0.0,
    seed: int = 0,
    most: int = 1 << 16,
    jobs: int | None = None,
    progress: ProgressCallback | None = None,
    ready: Callable[[], None] | None = None,
) -> Uncertainty:
    """Estimate the probability of passing for every design of a sweep with uncertain inputs.

    Parameters
    ----------
    sweep
        The sweep, the path of its file, or a mapping that `boulder_sweep.load` takes; some inputs have distributions.
    half_width
        Largest half-width of the interval; sampling continues until it is reached.
    confidence
        Confidence level of the interval.
    margin
        Least margin to the limits, ``0.25`` or ``"25 %"``.
    seed
        Seed of all random numbers; the same seed gives the same result, whatever the number of threads.
    most
        Most samples of a row; fewer than 512 are not drawn.
    jobs
        Threads; all cores by default.
    progress
        Called as the sampling progresses.
    ready
        Called once the question is known to be one that can be answered, before anything is computed.

    Raises
    ------
    QuestionError
        No input has a distribution, the depth is to be found, or an argument is out of range.
    TypeError, ValueError
        The number of jobs is not a whole number, or out of range.
    """
    sweep = sweep_of(sweep)
    width, sure = share(half_width, "--half-width"), share(confidence, "--confidence")
    least_margin = margin_asked(margin)
    if not 1e-6 <= width <= 0.5:
        raise QuestionError(f"--half-width {half_width}: must be between 0.000001 and 0.5")
    if not 0.5 <= sure < 1.0:
        raise QuestionError(f"--confidence {confidence}: must be at least 50 % and less than 100 %")
    if seed < 0:
        raise QuestionError(f"--seed {seed}: must not be negative")
    spread, graded = Spread(sweep), can_be_asked(sweep) and bool(sweep.model.second_opinion)
    sweep.need_depth()
    judges = judges_of(sweep, least_margin, robust=graded)
    points = Points(len(spread.names), seed)
    sampled = partial(chance, points=points, half_width=width, confidence=sure, most=most)
    asked = _Arguments(sweep, spread, judges.of_any_pass(), judges if graded else None, points, sampled, Pool(jobs))
    if ready is not None:
        ready()
    judges.final.asked().warm_up()
    parts = (_rows(asked, start, stop) for start, stop in ranges(sweep.n_designs, ROWS_AT_ONCE))
    tables = collected(parts, sweep.n_designs, progress)
    samples = _sample_table(asked, sweep.n_designs if sweep.n_designs <= MOST_SAMPLED else 0)
    question = {"asked": "p_pass", "half_width": width, "confidence": sure, "margin": least_margin}
    question |= {"seed": seed, "most": most}
    table = joined_tables(tables, sweep, asked.judges, "boulder_sweep.uncertainty", question)
    return Uncertainty(sweep, table, samples, seed)


@dataclass(frozen=True, eq=False)
class _Arguments:
    """What is asked of every row of a sweep."""

    sweep: Sweep
    spread: Spread
    judges: Judges
    robust: Judges | None
    """Judges that count only robust passes; None where second opinions are not asked."""
    points: Points
    sampled: Callable[[Event, int], Estimates]
    """Returns the probabilities of an event in so many rows."""
    parallel: Pool

    def draws(self, start: int, stop: int) -> Draws:
        """Return what samples the designs of the rows ``[start, stop)``."""
        rows = uncertain_rows(self.sweep, self.sweep.plan.given_rows(start, stop), start, stop)
        return Draws(rows, self.spread, self.judges, self.parallel)


def _rows(asked: _Arguments, start: int, stop: int) -> pa.Table:
    """Return the table of the rows ``[start, stop)``: inputs, outcome at the means, probability, main input."""
    from boulder_sweep.store.part import word_array

    draws, n = asked.draws(start, stop), stop - start
    first: list[np.ndarray] = []

    def event(index: np.ndarray, z: np.ndarray) -> np.ndarray:
        distance, known = draws.drawn(index, z)
        if not first:
            first.append(distance.reshape(n, -1))
        return known

    sampled, graded = asked.sampled(event, n), None
    if asked.robust is not None:
        robust = replace(draws, judges=asked.robust)
        graded = asked.sampled(lambda index, z: robust.drawn(index, z)[1], n)
    driver = drivers(asked.points.upto(FIRST).reshape(FIRST * SCRAMBLINGS, -1), first[0])
    block = replace(block_of(draws.rows), labels=asked.sweep.block(start, stop).labels)
    judged = ungraded(asked.judges.final(block))
    meaning = "most influential of the uncertain inputs; null where they change nothing"
    columns = [
        *chance_columns(Chances(sampled, graded)),
        ("p_pass_driver", "", meaning, word_array(driver, tuple(asked.spread.words))),
        ("p_pass_designs", "1", "designs drawn for p_pass", sampled.points),
    ]
    return rows_table(start, block, judged, columns)


def drivers(z: np.ndarray, output: np.ndarray) -> np.ndarray:
    """Return the most influential input of each row; -1 where the output does not vary, int64, shape (n,).

    The means of the output, shape (n, m), are compared over strata of each input, by standard normals, shape (m, d).
    """
    shares = np.empty((len(output), z.shape[1]))
    for k in range(z.shape[1]):
        strata = np.array_split(np.argsort(z[:, k], kind="stable"), STRATA)
        shares[:, k] = np.var([output[:, stratum].mean(axis=1) for stratum in strata], axis=0)
    return np.where(output.var(axis=1) > 0.0, shares.argmax(axis=1), -1)


def _sample_table(asked: _Arguments, rows: int) -> pa.Table:
    """Return samples of the first rows as a table: number of the design, uncertain inputs, distance from failing."""
    import pyarrow as pa

    draws = asked.draws(0, rows)
    index = np.repeat(np.arange(rows), SAMPLES)
    z = np.tile(asked.points.upto(SAMPLES // SCRAMBLINGS).reshape(SAMPLES, -1), (rows, 1))
    given = draws.given(index, z, {})
    inputs = {name: given[name] for name in asked.spread.names}
    return pa.table({"design_id": index, **inputs, "distance": draws.drawn(index, z)[0]})
