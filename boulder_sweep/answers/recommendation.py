"""The one design that answers a question of `need`, and what comes nearest where there is none.

The rows of an answer give a depth for every soil; a boulder is buried once. So it is taken at the depth that every soil
and vehicle of the file needs, and judged there in all of them: deeper is not always safer. Of those that hold, the
robust ones come first, then the lightest (or what else is preferred).
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_sweep.answers.keys import key_of, range_of, usual_ends
from boulder_sweep.answers.questions import Question, ValueSearch
from boulder_sweep.answers.result import chance_columns, rows_table, to_build
from boulder_sweep.answers.search import FAILS, HOLDS, search, steady
from boulder_sweep.answers.trials import (
    DEPTH,
    HEIGHT,
    MILLIMETRES,
    RATIO,
    InputRows,
    Judges,
    block_at,
    depth_within,
    judges_of,
    rows_at,
    uncertain_rows,
    ungraded,
)
from boulder_sweep.columns import BOULDER_MASS, DESIGN_ID
from boulder_sweep.designs import SIDES
from boulder_sweep.judge.quantities import EXCAVATED
from boulder_sweep.judge.robustness import DECISIVE
from boulder_sweep.judge.validity import FLAGS, SEPARATOR
from boulder_sweep.settings.fields import EMBEDMENT
from boulder_sweep.settings.soil_readings import covered_depth

if TYPE_CHECKING:
    import pyarrow as pa

PREFERENCES = {"mass": BOULDER_MASS, "depth": DEPTH, "excavation": EXCAVATED.name}
"""What may be preferred among designs that qualify, and the column that is to be least."""
OF_A_DESIGN = (*SIDES, "boulder_density_kg_m3", BOULDER_MASS, *EMBEDMENT)
"""Inputs that whoever builds chooses. The others, soil and vehicle, are what a design must hold in and against."""
RANKS = {"robust": 0, None: 1, "open": 1, "sensitive": 2}
"""Order of designs by the worst of their grades."""
ANSWER = ("fails_at", "passes_at", "found", "passes_within")
"""Columns of an answer, beside its value, which a design does not have."""
LESS = 0.05
"""Steps in which the margin is lowered until the nearest boulder has a depth that passes."""
CHANGES = ("impact_speed_m_s", "friction_angle_deg", HEIGHT)
"""Inputs by which the nearest design might qualify."""
Rows = list[dict[str, Any]]
"""Rows of a table, by column."""


@dataclass(frozen=True, eq=False)
class Design:
    """A boulder at one depth, judged in every soil and before every vehicle that the file has for it.

    Attributes
    ----------
    rows : list of dict
        One for each soil and vehicle: inputs, outcome and what it takes to build, by column of the table.
    """

    rows: list[dict[str, Any]]

    @property
    def sizes(self) -> dict[str, float]:
        """Sides and depth [m] and mass [kg], by column; the same in every row."""
        return {name: self.rows[0][name] for name in (*SIDES, DEPTH, BOULDER_MASS)}

    @property
    def excavated_m3(self) -> float:
        """Soil to excavate, in the soil that takes the most."""
        return float(max(row[EXCAVATED.name] for row in self.rows))

    @property
    def margin(self) -> float:
        """Least margin to the limits."""
        return float(min(row["margin"] for row in self.rows))

    @property
    def chance(self) -> float | None:
        """Least probability of passing; None where none was asked for."""
        return min((row["p_pass"] for row in self.rows if "p_pass" in row), default=None)

    @property
    def chance_robust(self) -> float | None:
        """Least probability of a pass that stands under the second opinion that decides; None where none was asked."""
        return min((row["p_robust"] for row in self.rows if "p_robust" in row), default=None)

    @property
    def grade(self) -> str | None:
        """Worst grade, one of `GRADES`; None where there is none."""
        return max((row["robustness"] for row in self.rows), key=RANKS.__getitem__)

    @property
    def stands(self) -> bool:
        """Whether it stands under the second opinion that decides, in every row."""
        return all(
            row["robustness"] == "robust"
            or (row["robustness"] == "open" and DECISIVE in (row["stands_under"] or "").split(SEPARATOR))
            for row in self.rows
        )

    @property
    def flags(self) -> tuple[str, ...]:
        """Flags of all rows, in the order of `FLAGS`."""
        raised = {name for row in self.rows for name in (row["validity"] or "").split(SEPARATOR)}
        return tuple(flag.name for flag in FLAGS if flag.name in raised)

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            **self.sizes,
            EXCAVATED.name: self.excavated_m3,
            "margin": self.margin if self.chance is None else None,
            "p_pass": self.chance,
            **({} if self.chance_robust is None else {"p_robust": self.chance_robust}),
            "robustness": self.grade,
            "validity": SEPARATOR.join(self.flags),
            "rows": self.rows,
        }


@dataclass(frozen=True, eq=False)
class Nearest:
    """The boulder that comes nearest, where none qualifies.

    Attributes
    ----------
    rows : list of dict
        Its rows of the answer, or at the greatest depth at which it reaches the bumper where nothing passes; of a run
        the rows of the design.
    design : Design or None
        It at the depth at which it has the most of what was asked for; None where it does not pass even without a
        margin.
    margin : float
        The margin that it has there, in steps of 5 %.
    robust : bool
        Whether it has this margin under the second opinion that decides, too.
    changes : dict of str to Design
        It as it would qualify with another value of one input, by column: the largest speed, the least friction angle,
        the least height.
    """

    rows: list[dict[str, Any]]
    design: Design | None
    margin: float
    robust: bool
    changes: dict[str, Design]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "rows": self.rows,
            "design": None if self.design is None else self.design.to_dict(),
            "margin": self.margin,
            "robust": self.robust,
            "changes": {name: design.to_dict() for name, design in self.changes.items()},
        }


@dataclass(frozen=True, eq=False)
class Recommendation:
    """The design to build. Made by `recommended`.

    Attributes
    ----------
    prefer : str
        What is least among those that qualify, a key of `PREFERENCES`.
    design : Design or None
        The design; None where no boulder qualifies.
    others : dict of str to Design
        The best by the other preferences, where it is another boulder.
    boulders, qualified, alike, conditions : int
        Number of boulders, of those with an answer under all conditions, of these the ones whose grade is no worse than
        the grade of the design, and of conditions: soils and vehicles, combined.
    nearest : Nearest or None
        What comes nearest where none qualifies, of depths without a probability.
    of_run : bool
        Whether it is one of the designs of a run, whose depths were given; a boulder is then one of these designs.
    deepest_m : float or None
        How deep the design may be buried at most [m]: from its depth down to there it qualifies. None where that was
        not asked: of a run, or with a probability.
    """

    prefer: str
    design: Design | None
    others: dict[str, Design]
    boulders: int
    qualified: int
    alike: int
    conditions: int
    nearest: Nearest | None = None
    of_run: bool = False
    deepest_m: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "prefer": self.prefer,
            "design": None if self.design is None else self.design.to_dict(),
            "others": {name: design.to_dict() for name, design in self.others.items()},
            "boulders": self.boulders,
            "qualified": self.qualified,
            "alike": self.alike,
            "conditions": self.conditions,
            "nearest": None if self.nearest is None else self.nearest.to_dict(),
            "deepest_m": self.deepest_m,
        }

    @classmethod
    def of_dict(cls, entries: Mapping[str, Any], checked: Callable[[Rows], Rows]) -> Recommendation:
        """Return what `to_dict` returned.

        Parameters
        ----------
        entries
            Plain data.
        checked
            Returns rows as they are, or raises a ValueError because they are none of the table.

        Raises
        ------
        LookupError, TypeError, ValueError
            An entry is missing, or no recommendation has it.
        """

        def design(own: Mapping[str, Any]) -> Design:
            read = Design(checked(own["rows"]))
            _ = sum(read.to_dict()[name] for name in read.sizes)  # what words take from it is there
            return read

        def by_name(own: Mapping[str, Any], known: tuple[str, ...]) -> dict[str, Design]:
            if own.keys() - {*known}:
                raise ValueError(f"{', '.join(own)}: none but {', '.join(known)} are known")
            return {name: design(own[name]) for name in known if name in own}  # JSON keeps no order

        best, near = entries["design"], entries["nearest"]
        nearest = None
        if near is not None:
            built = None if near["design"] is None else design(near["design"])
            rows, margin, robust = checked(near["rows"]), float(near["margin"]), bool(near["robust"])
            if "passes_at" not in rows[0] or not 0.0 <= margin <= 1.0:
                raise ValueError("what comes nearest has no answer, or a margin that none has")
            nearest = Nearest(rows, built, margin, robust, by_name(near["changes"], CHANGES))
        boulders, qualified, alike, conditions = (
            int(entries[name]) for name in ("boulders", "qualified", "alike", "conditions")
        )
        prefer, others = entries["prefer"], by_name(entries["others"], (*PREFERENCES,))
        if prefer not in PREFERENCES:
            raise ValueError(f"{prefer} cannot be preferred")
        chosen, deepest = None if best is None else design(best), entries["deepest_m"]
        if deepest is not None and not (chosen and chosen.sizes[DEPTH] <= deepest <= chosen.sizes[HEIGHT]):
            raise ValueError("its greatest depth is none")
        return cls(prefer, chosen, others, boulders, qualified, alike, conditions, nearest, deepest_m=deepest)


def recommended(asked: Question, table: pa.Table, prefer: str) -> Recommendation | None:
    """Return the design to build by the answers to a question, the least by `prefer`, a key of `PREFERENCES`.

    None where the question is not about a least size or embedment of boulders.
    """
    if asked.key.most or asked.key.name not in OF_A_DESIGN:
        return None
    boulders = _Boulders(asked, table)
    found = {name: boulders.best(name) for name in PREFERENCES}
    best, nearest = found[prefer], None
    others = {
        name: design
        for name, design in found.items()
        if best is not None and design is not None and design.grade == best.grade and design.sizes != best.sizes
    }
    if best is None and asked.key.name in EMBEDMENT and boulders.sampling is None:
        nearest = boulders.nearest(asked)
    alike = 0 if best is None else int((boulders.rank <= RANKS[best.grade]).sum())
    counts = (len(boulders.members), len(boulders.qualified), alike, max(map(len, boulders.members)))
    deepest = None if best is None or boulders.sampling is not None else boulders.deepest(best)
    return Recommendation(prefer, best, others, *counts, nearest, deepest_m=deepest)


class _Boulders:
    """The boulders of a question, each with its rows: one for every soil and vehicle."""

    def __init__(self, asked: Question, table: pa.Table) -> None:
        self.asked, self.table = asked, table
        opened, count = asked.open, asked.count
        self.given = uncertain_rows(opened.sweep, opened.rows(0, count), 0, count)
        self.labels = opened.labels(0, count)
        self.sampling = getattr(asked, "sampling", None)
        chosen = [self.given[name] for name in OF_A_DESIGN if name in self.given]
        told_apart = np.stack([values for values in chosen if values.min() < values.max()] or [np.zeros(count)])
        number = np.unique(told_apart, axis=1, return_inverse=True)[1].reshape(-1)
        self.members = np.split(np.argsort(number, kind="stable"), np.cumsum(np.bincount(number))[:-1])
        self.passes = self._column("passes_at")
        self.qualified = [rows for rows in self.members if np.isfinite(self.passes[rows]).all()]
        self.tried = [(rows, sizes) for rows in self.qualified for sizes in self._sizes(rows)]
        self.figures, self.rank = self._figures()
        self._judged: dict[int, Design | None] = {}

    def _column(self, name: str) -> np.ndarray:
        return np.array(self.table[name].to_pylist(), dtype=float)  # to_numpy() imports pandas

    def _rows(self, rows: np.ndarray, without: tuple[str, ...] = ()) -> list[dict[str, Any]]:
        """Return rows of the answers, some columns left out."""
        table = self.table.select([name for name in self.table.column_names if name not in without])
        return [table.slice(row, 1).to_pylist()[0] for row in rows.tolist()]  # take() imports pandas

    def _sizes(self, rows: np.ndarray) -> list[dict[str, float]]:
        """Return what to try of a boulder that has an answer in all its rows: the value that all of them need.

        Of depths that were found beside it, each is tried.
        """
        needed = {self.asked.key.name: float(self.passes[rows].max())}
        depths = np.unique(self._column(DEPTH)[rows]).tolist()
        return [needed | {DEPTH: depth} for depth in depths] if self.asked.seeks_depth else [needed]

    def _figures(self) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Return, for all that is to be tried, the columns of `PREFERENCES` and the rank of the worst grade."""
        if not self.tried:
            return {}, np.empty(0)
        index = np.concatenate([rows for rows, _ in self.tried])
        counts = [len(rows) for rows, _ in self.tried]
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        inputs = {name: np.repeat([sizes[name] for _, sizes in self.tried], counts) for name in self.tried[0][1]}
        block = block_at(self.given, index, **inputs)
        values = {name: column.to_numpy() for name, column in block.columns.items()}
        values |= {name: built for name, _, _, built in to_build(block, self.asked.sweep)}
        ranks = np.array([RANKS[grade] for grade in self.table["robustness"].to_pylist()])
        worst = {name: np.maximum.reduceat(values[name], starts) for name in PREFERENCES.values()}
        return worst, np.maximum.reduceat(ranks[index], starts)

    def best(self, prefer: str) -> Design | None:
        """Return the design of best grade that holds in all its rows, and of these the least by a preference.

        Few designs are judged: the grades at the answers say in which order. One whose grade turns out to be worse
        waits for those that may be better.
        """
        columns = [PREFERENCES[name] for name in (prefer, *PREFERENCES)]
        order = np.lexsort([self.figures[name] for name in reversed(columns)]) if self.tried else np.empty(0, np.int64)
        waiting = [(int(self.rank[each]), place, int(each)) for place, each in enumerate(order)]
        heapq.heapify(waiting)
        while waiting:
            rank, place, each = heapq.heappop(waiting)
            if each not in self._judged:
                self._judged[each] = self.holding(*self.tried[each])
            design = self._judged[each]
            if design is not None and RANKS[design.grade] <= rank:
                return design
            if design is not None:
                heapq.heappush(waiting, (RANKS[design.grade], place, each))
        return None

    def holding(self, rows: np.ndarray, sizes: dict[str, float]) -> Design | None:
        """Return what was tried as a design; None where it fails in a row. Rows that it is the answer to are known."""
        key = self.asked.key.name
        own = {name: self.passes if name == key else self._column(name) for name in sizes}
        known = np.logical_and.reduce([own[name][rows] == value for name, value in sizes.items()])
        others = rows[~known]
        judged = self.judged(others, rows_at(self.given, others), sizes, self.asked.judges) if len(others) else []
        if judged is None:
            return None
        by_row = dict(zip(others.tolist(), judged, strict=True))
        answers = self._rows(rows[known], without=(self.asked.key.answer, *ANSWER))
        by_row |= zip(rows[known].tolist(), answers, strict=True)
        return Design([by_row[row] for row in rows.tolist()])

    def judged(
        self, rows: np.ndarray, given: InputRows, sizes: dict[str, float], judges: Judges, *, failing: bool = False
    ) -> list[dict[str, Any]] | None:
        """Return a boulder of some sizes in some rows, with the inputs given there.

        None where it fails in one, unless it is wanted all the same.
        """
        inputs = {name: np.full(len(rows), value) for name, value in sizes.items()}
        block = block_at(given, np.arange(len(rows)), **inputs)
        block = replace(block, labels={name: label.at(rows) for name, label in self.labels.items()})
        judged, columns = judges.final(block), to_build(block, self.asked.sweep)
        if self.sampling is None:
            if not failing and not judges.holds(judged, block).all():
                return None
            judged = judges.final.graded(judged, block)
        else:
            chances = self.sampling.chances(self.sampling.draws(given), inputs)
            if (chances.asked.estimate < self.sampling.probability).any():
                return None
            judged = ungraded(judged)
            columns += chance_columns(chances)
        return rows_table(0, block, judged, columns).to_pylist()

    def deepest(self, design: Design) -> float:
        """Return how deep [m] a design may be buried at most: down to there it holds in all rows, graded no worse."""
        rows, _ = next(self.tried[each] for each, one in self._judged.items() if one is design)
        given = {name: values[rows] for name, values in self.given.items() if name not in EMBEDMENT}
        sizes, sweep = {name: design.sizes[name] for name in (*SIDES, DEPTH)}, self.asked.sweep
        bumper, least = given["bumper_height_m"], sizes[DEPTH]
        high, height = covered_depth(sweep.derived), np.full(len(rows), sizes[HEIGHT])
        most = depth_within(least, high, np.ones(len(rows)), height, bumper, sweep.criterion.min_overlap_m).min()

        def predicate(index: np.ndarray, positions: np.ndarray) -> np.ndarray:
            held = []
            for position in positions.tolist():
                depth = {DEPTH: position / MILLIMETRES}
                known = position == last  # its own depth
                one = None if known else self.judged(rows, given, sizes | depth, self.asked.judges)
                held.append(known or (one is not None and RANKS[Design(one).grade] <= RANKS[design.grade]))
            return np.where(held, HOLDS, FAILS)

        # From the greatest depth up: where it begins to hold for good.
        first, last = int(most * MILLIMETRES + 1e-6), math.ceil(least * MILLIMETRES - 1e-6)
        if first <= last:
            return least
        found = steady(search(predicate, np.array([first]), np.array([last])))
        return float(found.holds[0]) / MILLIMETRES

    def nearest(self, asked: Question) -> Nearest:
        """Return the boulder that fails in the fewest rows, and of these the one that is least short of the limits."""
        margin, time = (np.nan_to_num(self._column(name), nan=-1.0) for name in ("margin", "time_to_limit_s"))

        def short(rows: np.ndarray) -> tuple[float, ...]:
            failing = rows[np.isnan(self.passes[rows])]
            if len(failing):
                return len(failing), -float(margin[failing].min()), -float(time[failing].min())
            return 0, float(self.passes[rows].max() - self.given[HEIGHT][rows[0]]), 0.0  # the highest above the ground

        rows = min(self.members, key=short)
        given, key, judges = rows_at(self.given, rows), asked.key, asked.judges
        low, high = range_of(asked.sweep, key, given, asked.between)
        steps = range(round(judges.least_margin / LESS) - 1, -1, -1)
        lower = [round(step * LESS, 2) for step in steps]
        has = [(True, margin) for margin in lower] if judges.robust else []
        has += [(False, margin) for margin in ([judges.least_margin] if judges.robust else []) + lower]
        design, robust, left = None, False, 0.0
        for robust, left in has:
            easier = judges_of(asked.sweep, left, robust=robust)
            depth = ValueSearch(asked.sweep, key, easier).answers_of(given, low, high).passes.max()
            found = None if np.isnan(depth) else self.judged(rows, given, {key.name: float(depth)}, easier)
            if found is not None:
                design = Design(found)
                break
        failing = rows[np.isnan(self.passes[rows])]
        # Deeper, the truck would ride over it.
        reach = given[HEIGHT] - given["bumper_height_m"] - asked.sweep.criterion.min_overlap_m
        tried = self._column(DEPTH)[failing if len(failing) else rows]
        deepest = min(float(tried.max()), math.floor(float(reach.min()) * 1000.0) / 1000.0)
        shown = self.table.take(rows.tolist()).to_pylist()
        if deepest >= low.max() * (given[HEIGHT].min() if key.name == RATIO else 1.0):
            others = {name: values for name, values in given.items() if name not in EMBEDMENT}
            there = self.judged(rows, others, {DEPTH: deepest}, judges, failing=True) or []
            for row, one in zip(shown, there, strict=True):
                row |= {} if row["passes_at"] is not None else one | {DESIGN_ID.name: row[DESIGN_ID.name]}
        return Nearest(shown, design, left, robust, self._changes(rows, given, deepest))

    def _changes(self, rows: np.ndarray, given: InputRows, depth: float) -> dict[str, Design]:
        """Return a boulder as it would qualify at the greatest depth: in a stronger soil, higher, or at less speed."""
        sweep = self.asked.sweep
        deep, share = {DEPTH: np.full(len(rows), depth)}, {RATIO: depth / given[HEIGHT]}
        searches = [(key_of("speed", most=True), deep)]
        if sweep.model.ground.is_usual and sweep.partial_factor == 1.0:
            searches.append((key_of("friction_angle"), deep))
        if sweep.model.shape.is_box and BOULDER_MASS not in given:
            searches.append((key_of("boulder.height"), share))
        changes = {}
        for key, embedment in searches:
            own, far = given[key.name], usual_ends(key)
            ends = (far[0], own.max()) if key.most else (own.min(), far[1])
            if ends[0] >= ends[1] or key.name in sweep.taken_at:
                continue
            low, high = (np.full(len(rows), end) for end in ends)
            others = {name: values for name, values in given.items() if name not in (key.name, *EMBEDMENT)} | embedment
            values = ValueSearch(sweep, key, self.asked.judges).answers_of(others, low, high).passes
            value = float(values.min() if key.most else values.max())
            found = None if np.isnan(value) else self.judged(rows, others, {key.name: value}, self.asked.judges)
            if found is not None:
                changes[key.name] = Design(found)
        return changes
