"""One block of designs from inputs to judged rows: the work that workers do.

The columns of a block become the SI table of the kernels, the kernels simulate it, and the rows are judged. Rows
that cannot be computed are not simulated; they come back with their reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings, simulate_table
from boulder_kernels._jit import plain
from boulder_kernels.rules import RULES, SLOWER_SPEEDS, Rows, consider_rows, rule_by_slower
from boulder_kernels.second_opinion import HeaveControl, second_opinions
from boulder_sweep.columns import SHAPES
from boulder_sweep.designs import REASONS as REFUSALS
from boulder_sweep.judge.accuracy import (
    LONGEST_HORIZON,
    Accuracy,
    control_of,
    finer_controls,
    goes_in_lanes,
    readings_of,
)
from boulder_sweep.judge.inputs import Designs, designs_of
from boulder_sweep.judge.judged import FAIL, PASS, Judged, joined, merged, not_computed, with_rows, worst_case, worst_of
from boulder_sweep.judge.robustness import (
    DECISIVE,
    ROBUST,
    can_be_asked,
    least_free_rotation,
    stands_under_the_weakest,
    with_second_opinions,
)
from boulder_sweep.judge.verdict import Limits, judged_rows, limits_of, rows_of
from boulder_sweep.settings.model import Model
from boulder_sweep.soils import with_soil

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.settings import Sweep

SLOWER_AT_ONCE = 150
"""Designs that are simulated at once with all their slower trucks: an interruption waits for the current call."""
BY_SLOWER = np.array([plain(rule_by_slower)(rule) for rule in range(len(RULES))])
"""The worst rule that a slower truck can impose on a row, by the rule that decides the slower truck."""
Simulate = Callable[..., OutcomeTable]
"""Function that simulates a table of designs, as `simulate_table`, which it always is outside tests."""


@dataclass(frozen=True)
class Evaluation:
    """How the designs of one sweep are simulated and judged; the same for every row, sent to every worker."""

    readings: Readings
    control: Control
    limits: Limits
    simulate: Simulate = simulate_table
    only: tuple[str, ...] = ()
    """Outcome columns wanted, verdict and reason among them; all of the table where empty."""
    model: Model = field(default_factory=Model)
    """Resistance, layers, water, cohesion and slope of the soil, and shape of the boulders."""
    least_margin: float = 0.0
    """Margin that a question asks for, from 0 to less than 1; see `judged`."""
    second_opinion: tuple[str, ...] = ()
    """Laws of the soil's resistance under which every pass is simulated again, see `boulder_sweep.judge.robustness`."""
    askable: bool = False
    """Whether second opinions know such designs."""
    against_slower: bool = True
    """Whether shallow boulders that slide are judged against slower trucks, too; not where the caller does so."""
    barrels_in_lanes: bool = False
    """Whether there are so many designs that barrels, of two pieces, are simulated several at a time."""

    def __call__(self, block: DesignBlock) -> Judged:
        """Simulate and judge the n rows of a block, in its order; with cases, each has the worst of their verdicts."""
        if block.cases:
            return worst_of(self.by_case(block))
        if not block.reasons.any:
            return self.judged(self.designs(block))
        computable = block.reasons.codes == 0
        refused = not_computed(REFUSALS[1:], block.reasons.codes[~computable] - 1)
        if not computable.any():
            return joined([refused])
        return merged(computable, self.judged(self.designs(block, computable)), refused)

    def by_case(self, block: DesignBlock) -> list[Judged]:
        """Return the rows of a block as judged at its own inputs, and then in each of its cases."""
        return [self(case) for case in (replace(block, cases=()), *block.cases)]

    def designs(self, block: DesignBlock, rows: np.ndarray | None = None) -> Designs:
        """Return the designs of a block, or some of them, as the kernels take them."""
        return designs_of(block, rows, self.model)

    def judged(self, designs: Designs) -> Judged:
        """Simulate and judge n designs that can be computed, in their order.

        Rows that are refused for their time steps, undecided for their numerical error, or late are simulated again by
        finer steps until they are decided or `finer_controls` ends, see `boulder_kernels.rules`. Shallow boulders that
        would pass and slide are simulated with slower trucks, too. A row depends on nothing but its own design.

        A simulation may end with a proof of its verdict while the rotation can still grow, so its margin is one up to
        then. Where a question asks for a margin, the rows that have it are simulated again with the limit of rotation
        reduced by it. Those that do not pass so, too, keep their verdict and get a margin just below the one asked for.
        Grades know no margin; `stand` does.
        """
        taped = designs.taped
        if taped.any():
            judged = self._worst_shapes(designs.rows(taped))
            if self.second_opinion and (not self.only or "robustness" in self.only):
                passing = np.flatnonzero(taped)[judged.verdict == PASS]
                judged = self._graded(judged, designs.rows(passing), self.second_opinion)
            return merged(taped, judged, self.judged(designs.rows(~taped)))
        rows = self._decided(designs)
        if self.against_slower:
            self._hold_slower(rows, designs)
        judged = joined([judged_rows(rows, designs, self.limits, self.only)])
        if self.least_margin > 0.0:
            judged = self._margins_proved(judged, designs)
        if not self.second_opinion or (self.only and "robustness" not in self.only):
            return judged
        return self._graded(judged, designs.rows(judged.verdict == PASS), self.second_opinion)

    def _worst_shapes(self, designs: Designs) -> Judged:
        """Judge boulders as taped and weighed by the worst of their shapes; by the first in which one fails."""
        alone = replace(self, second_opinion=())  # which ask all shapes of what passes
        worst, left = alone.judged(designs.in_shape(0, self.model)), np.arange(designs.size)
        for shape in range(1, len(SHAPES)):
            left = left[worst.verdict[left] != FAIL]
            if not len(left):
                break
            shaped = designs.rows(left).in_shape(shape, self.model)
            both = [worst.rows(left), replace(alone, control=self.control_of_shape(SHAPES[shape])).judged(shaped)]
            case = worst_case(both) * len(left) + np.arange(len(left))
            worst = with_rows(worst, left, joined(both).rows(case))
        return worst

    def control_of_shape(self, shape: str | None) -> Control:
        """Return how boulders of one of `SHAPES` are simulated: the barrel has two pieces, the others have one."""
        if shape != "barrel":
            return self.control
        return self.control._replace(side_by_side=self.barrels_in_lanes)

    def _decided(self, designs: Designs) -> Rows:
        """Simulate designs until each is decided at its own speed."""
        controls, limits = [self.control, *finer_controls(self.control)], self.limits.of_rules
        rows, every = rows_of(designs, self.limits), np.array(controls, dtype=float)
        number, some = 0, np.arange(designs.size)
        while number < len(controls):
            again = designs.rows(some) if number else designs
            found = self.simulate(again.table, self.readings, controls[number])
            consider_rows(*rows, some, np.stack(found), number, every, limits)
            wanted = rows.courses["wanted"]
            number = int(wanted.min(initial=len(controls)))
            some = np.flatnonzero(wanted == number)
        return rows

    def _hold_slower(self, rows: Rows, designs: Designs) -> None:
        """Let slower trucks decide the rows of shallow boulders that slide, too."""
        asked, steps, rule = np.flatnonzero(rows.courses["asked_slower"]), len(SLOWER_SPEEDS), rows.courses["rule"]
        for at in range(0, len(asked), SLOWER_AT_ONCE):
            some = asked[at : at + SLOWER_AT_ONCE]
            trucks = designs.rows(np.repeat(some, steps))
            v_0 = trucks.table.v_0 * np.tile(SLOWER_SPEEDS, len(some))
            slower = self._decided(trucks._replace(table=trucks.table._replace(v_0=v_0))).courses["rule"]
            worst = BY_SLOWER.take(slower.astype(np.intp)).reshape(-1, steps).min(axis=1)
            rule[some] = np.minimum(rule[some], worst)

    def asked(self) -> Evaluation:
        """Return this evaluation with the second opinion that decides, if that can simulate its designs."""
        return replace(self, second_opinion=(DECISIVE,)) if self.askable else self

    def graded(self, judged: Judged, block: DesignBlock, stand: np.ndarray | None = None) -> Judged:
        """Return the judged rows of a block with the second opinion that decides, without a margin.

        Rows that are known to `stand`, with a margin or without, shape (n,), are not simulated.
        """
        passing = judged.verdict == PASS
        if not self.askable or not passing.any():
            return judged
        known = None if stand is None else stand[passing]
        return self._graded(judged, self.designs(block, passing), (DECISIVE,), known)

    def _graded(
        self, judged: Judged, passes: Designs, laws: tuple[str, ...], stand: np.ndarray | None = None
    ) -> Judged:
        return with_second_opinions(judged, passes, laws, self.model, self.limits, self.longest_s, stand)

    def stand(self, block: DesignBlock, tolerance_m: float | None = None) -> np.ndarray:
        """Return which designs pass, in all cases, with the margin under the laws that decide, bool, shape (n,).

        With a tolerance, nearly so, by one solution; see `boulder_sweep.judge.robustness.stands`.
        """
        limits = self._reduced_limits
        there = np.ones(len(block), dtype=bool)
        for case in (replace(block, cases=()), *block.cases):
            rows = np.flatnonzero(there)
            designs = self.designs(case, rows)
            there[rows] = stands_under_the_weakest(designs, self.model, limits, self.longest_s, tolerance_m=tolerance_m)
        return there

    def robust_unasked(self, judged: Judged) -> np.ndarray:
        """Return which judged rows, with the margin, are robust without a second opinion, bool, shape (n,)."""
        return (judged["robustness"] == ROBUST) & (self._reduced_limits.rotation >= least_free_rotation())

    @property
    def _reduced_limits(self) -> Limits:
        return self.limits._replace(rotation=(1.0 - self.least_margin) * self.limits.rotation)

    @property
    def longest_s(self) -> float:
        """Longest time for which a second opinion is simulated."""
        return self.control.longest_horizon or LONGEST_HORIZON * self.control.horizon

    def _margins_proved(self, judged: Judged, designs: Designs) -> Judged:
        """Put margins that are not proved to last just below the one asked for; see `judged`."""
        there = np.flatnonzero((judged.verdict == PASS) & (judged["margin"] >= self.least_margin))
        if not len(there):
            return judged
        reduced = replace(
            self,
            control=self.control._replace(theta_limit=(1.0 - self.least_margin) * self.control.theta_limit),
            limits=self._reduced_limits,
            only=("verdict", "reason"),
            least_margin=0.0,
            second_opinion=(),
        )
        margin = judged["margin"].copy()
        margin[there[reduced.judged(designs.rows(there)).verdict != PASS]] = np.nextafter(self.least_margin, 0.0)
        return replace(judged, columns=judged.columns | {"margin": margin})

    def settings(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return readings and control as plain data, for the record."""
        return self.readings._asdict(), self.control._asdict()

    def warm_up(self) -> None:
        """Load or compile the kernels by simulating one step of a plain design."""
        model = self.model
        table = with_soil(PLAIN_DESIGN, model.resistance, model.ground, shape=model.shape)
        self.simulate(table, self.readings, self.control._replace(horizon=self.control.h))
        if self.second_opinion:
            second_opinions(table, HeaveControl(self.limits.rotation, self.control.h))


PLAIN_DESIGN = DesignTable(
    L=np.array([1.5]),
    W=np.array([1.5]),
    H=np.array([3.0]),
    rho_b=np.array([2600.0]),
    d=np.array([1.5]),
    e=np.array([0.95]),
    rho_s=np.array([1900.0]),
    phi=np.array([math.radians(40.0)]),
    beta=np.array([60.0]),
    K_epsilon=np.array([1.0]),
    m_v=np.array([6800.0]),
    v_0=np.array([13.4]),
    k_v=np.array([3.1e6]),
    c_v=np.array([1.4e5]),
    e_bumper=np.array([0.5]),
)
"""One usual design, in the units of the kernels."""


def evaluation_of(sweep: Sweep, accuracy: Accuracy, simulate: Simulate = simulate_table) -> Evaluation:
    """Return how the designs of a sweep are simulated, with a given accuracy, and judged."""
    askable = can_be_asked(sweep)
    return Evaluation(
        readings=readings_of(sweep),
        control=control_of(sweep, accuracy),
        limits=limits_of(sweep),
        simulate=simulate,
        model=sweep.model,
        second_opinion=sweep.model.second_opinion if askable else (),
        askable=askable,
        barrels_in_lanes=goes_in_lanes(2, sweep.n_designs),
    )
