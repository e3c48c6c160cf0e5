"""Robust or sensitive: what a pass is worth when the model has another form.

A second opinion is the same impact with friction and vertical motion, under a soil model that resists less
(`boulder_kernels.second_opinion`). A pass that stands under the weakest law, mostly `DECISIVE`, is *robust*, one that
does not under a law that was asked *sensitive*. A pass that stands, but lies outside the ranges from which the study of
the documentation draws, is *open*: nobody has looked at what second opinions are worth there. Where no second opinion
was asked for, a pass is robust if it lies where that study has found none that is not (`FREE`), otherwise open, too.

No pass stands that a finer solution overturns: where a second opinion comes near to the limit, or is not proved to stay
well below it, a fine solution decides, and it must stand with its own error taken off.

A sensitive pass is not a fail: the crash test that passed stands, and one of its second opinions turns it nearly to the
limit. It needs a better test of the soil, a deeper bed, or a crash test.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import Status
from boulder_kernels._jit import plain
from boulder_kernels.heave import Base, bearing_capacity_factor
from boulder_kernels.second_opinion import USUAL_BASE, HeaveControl, second_opinions
from boulder_kernels.table import some_rows
from boulder_sweep.columns import GRADES, SHAPES
from boulder_sweep.investigation import family_bounds
from boulder_sweep.judge.judged import PASS, Judged
from boulder_sweep.judge.validity import VEHICLE, are_studied
from boulder_sweep.settings.model import RESISTANCES, SECOND_OPINIONS
from boulder_sweep.soils import layer_coefficients

if TYPE_CHECKING:
    from boulder_kernels import DesignTable
    from boulder_sweep.judge.inputs import Designs
    from boulder_sweep.settings import Sweep
    from boulder_sweep.settings.model import Ground, Model

ROBUST, SENSITIVE, OPEN = range(len(GRADES))
DECISIVE = "width_capped"
"""The soil model that decides: it resists least, except for slender boulders in dense soil (`resists_less`)."""
_OTHERS = tuple(law for law in SECOND_OPINIONS if law != DECISIVE)
IN_WORDS = (
    "stands with friction and vertical motion under the weakest of three soil models; not modelled: soil on one side "
    "only, rounded boulders"
)
"""Explanation of the grade ``robust``."""
SENSITIVE_IN_WORDS = (
    "a second opinion overturns it; no fail, but ask for a better soil test, a deeper bed or a crash test"
)
"""Explanation of the grade ``sensitive``."""
MEANINGS = {
    "robust": IN_WORDS,
    "sensitive": SENSITIVE_IN_WORDS,
    "open": "second opinions know rock of given density and corrected readings only",
}
"""What a grade means of a pass of which second opinions were asked, if they could be."""
UNSTUDIED_IN_WORDS = "stands under the second opinions that were asked, but outside the ranges of their study"
"""Explanation of the grade ``open`` where second opinions were asked."""
GIVES_WAY = (
    "no second opinion: by the density and friction angle of the soil the ground under the foot cannot carry the "
    "boulder's own weight; ask for a better soil test, a deeper bed or a foundation"
)
"""Explanation of a sensitive pass whose boulder would sink before the impact."""
FREE_ROTATION_DEG = 8.0
"""Rotation up to which a pass within `FREE` and `FREE_EMBEDMENT` is robust without a second opinion."""
FREE = {
    "L": (1.0, 2.0),
    "W": (0.8, 2.5),
    "H": (1.5, 4.0),
    "rho_b": (2400.0, 3074.0),
    "e": (0.5, 1.0),
    "rho_s": (1520.0, 2240.0),
    "phi": (math.radians(36.0), math.radians(42.0)),
    "K_epsilon": (1.0, 1.2),
    **VEHICLE,
}
"""Ranges of the inputs in which the study lost no such pass (SI, `boulder_kernels.DesignTable`)."""
FREE_EMBEDMENT = (0.5, 0.75)
"""Range of embedment depth over height; the subgrade reaction must belong to the friction angle, too."""
FREE_LIMIT_DEG = 20.0
"""The limit of rotation that the study asks about; a higher one is no easier to stay below for a second opinion."""
ROUNDING = 1e-9
"""Share by which rounding may put a value outside the end of a range."""
QUICK_M = 5e-4
"""Error of a step of a second opinion [m]: of 6,800 random designs that turn about as far as the limit, none turned by
0.6 deg too little. Shallow ones may err more, by shorter steps, too; `benchmarks.grades` holds their grades."""
NEAR_DEG = 1.0
"""Distance from the limit of rotation within which a second opinion is simulated again finely."""
NEAR_M = 0.01
"""Distance from the limit of penetration within which a second opinion is simulated again finely."""
FINENESS, TOLERANCE_M = 2, 1e-6
"""Fineness and error of a step of the fine solution (`boulder_kernels.second_opinion.HeaveControl`)."""
ERROR_DEG, ERROR_M = 0.05, 1e-3
"""Bound on the largest error of the fine solution [deg, m]; it is taken off the limits."""
AT_ONCE = 2000
"""Designs simulated per call: an interruption waits for the current call."""


def can_be_asked(sweep: Sweep) -> bool:
    """Return whether second opinions can simulate the designs of a sweep.

    They simulate only rock of given density, with corrected readings.
    """
    return sweep.model.preset == "corrected" and not sweep.model.rock_assumed


def meaning_of(row: Mapping[str, Any]) -> str | None:
    """Return what the grade of a row of the table means; None where it has none.

    A boulder that the ground cannot carry (Eq 133) is sensitive: it would sink, and a second opinion starts from rest.
    """
    if row["robustness"] == "sensitive":
        angle = math.radians(row["friction_angle_deg"])
        load = row["boulder_density_kg_m3"] * row["boulder_height_m"]
        if load >= row["soil_density_kg_m3"] * row["embedment_depth_m"] * plain(bearing_capacity_factor)(angle):
            return GIVES_WAY
    if row["robustness"] == "open" and row["stands_under"]:
        return UNSTUDIED_IN_WORDS
    return MEANINGS.get(row["robustness"])


def grades_without_asking(facts: Any) -> np.ndarray:
    """Return the codes of `GRADES` that passes have without a second opinion, shape (n,), by the `Facts` of n rows."""
    grades = np.full(len(facts.verdict), OPEN, dtype=np.int32)
    limits, outcomes = facts.limits, facts.outcomes
    if limits.studied and limits.rotation >= least_free_rotation():
        near = facts.rows["passing"] & (outcomes.theta_max + outcomes.theta_error <= math.radians(FREE_ROTATION_DEG))
        rows = np.flatnonzero(near)
        grades[rows[is_free(some_rows(facts.designs.table, rows))]] = ROBUST
    return grades


def least_free_rotation() -> float:
    """Return the least limit of rotation with which a pass can be robust without a second opinion [rad]."""
    return math.radians(FREE_LIMIT_DEG) * (1.0 - ROUNDING)


def is_free(table: DesignTable) -> np.ndarray:
    """Return which of n designs lie in the ranges that the study draws from, bool, shape (n,)."""
    ranges = [(getattr(table, name), *ends) for name, ends in FREE.items()]
    ranges.append((table.d / table.H, *FREE_EMBEDMENT))
    ranges.append((table.beta, *family_bounds(np.degrees(table.phi))))
    inside = [(values >= low * (1.0 - ROUNDING)) & (values <= high * (1.0 + ROUNDING)) for values, low, high in ranges]
    return np.logical_and.reduce(inside)


def base_under(ground: Ground) -> Base:
    """Return the ground under the foot for a second opinion: its water table [m] and slope [rad]."""
    water = math.inf if ground.water_table_m is None else ground.water_table_m
    varies = not ground.is_proportional
    return USUAL_BASE._replace(water=water, slope=math.radians(ground.slope_deg), varies=varies)


def resists_less(designs: Designs, law: str) -> np.ndarray:
    """Return where a soil model resists less than `DECISIVE`, in some layer of the soil, bool, shape (n,).

    Where a boulder is narrow `DECISIVE` resists most.
    """
    table: Any = designs.table._replace(W=designs.narrowest)
    return np.asarray((layer_coefficients(table, law) < layer_coefficients(table, DECISIVE)).any(axis=1))


def stands(
    designs: Designs, law: str, model: Model, limits: Any, longest_s: float, *, tolerance_m: float | None = None
) -> np.ndarray:
    """Return which of n designs, all of which the vehicle hits, pass by a second opinion, bool, shape (n,).

    Taped designs pass if each of their shapes does. What is not proved to stand by the longest simulated time does not.
    With a tolerance, an error of a step [m], one solution decides in place of a quick and a fine one, nearly as they
    do.
    """
    passes, taped = np.ones(designs.size, dtype=bool), designs.taped
    if taped.any():
        passes[~taped] = stands(designs.rows(~taped), law, model, limits, longest_s, tolerance_m=tolerance_m)
        for shape in range(len(SHAPES)):
            left = np.flatnonzero(passes & taped)
            if len(left):
                shaped = designs.rows(left).in_shape(shape, model)
                passes[left] = stands(shaped, law, model, limits, longest_s, tolerance_m=tolerance_m)
        return passes
    table, base = designs.under(law, model), base_under(model.ground)
    fine = HeaveControl(limits.rotation - math.radians(ERROR_DEG), longest_s, TOLERANCE_M, FINENESS)
    usual = HeaveControl(limits.rotation, longest_s, QUICK_M, margin=math.radians(NEAR_DEG))
    if tolerance_m is not None:
        usual = fine._replace(tolerance=tolerance_m, fineness=1)
    length = designs.length

    def below(some: np.ndarray, control: HeaveControl) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return which of some designs stay below the limit of rotation, how far they turn, and how far in."""
        outcome = second_opinions(some_rows(table, some), control, base=base)
        penetration = outcome.x_v_max - designs.bed_offset[some] - length[some]
        return np.equal(outcome.status, Status.BELOW_LIMIT.value), np.asarray(outcome.theta_max), penetration

    for at in range(0, designs.size, AT_ONCE):
        some = np.arange(at, min(at + AT_ONCE, designs.size))
        stays, turned, penetration = below(some, usual)
        passes[some] = stays & (penetration <= limits.penetration)
        near = (turned >= usual.theta_limit - usual.margin) | (np.abs(penetration - limits.penetration) < NEAR_M)
        again = some[stays & near]
        if len(again) and tolerance_m is None:
            stays, _, penetration = below(again, fine)
            passes[again] = stays & (penetration <= limits.penetration - ERROR_M)
    return passes


def stands_under_the_weakest(
    designs: Designs, model: Model, limits: Any, longest_s: float, *, tolerance_m: float | None = None
) -> np.ndarray:
    """Return which of n designs pass by the laws that decide, bool, shape (n,); arguments: see `stands`."""
    there = stands(designs, DECISIVE, model, limits, longest_s, tolerance_m=tolerance_m)
    for law in _OTHERS:
        rows = np.flatnonzero(there & resists_less(designs, law))
        there[rows] = stands(designs.rows(rows), law, model, limits, longest_s, tolerance_m=tolerance_m)
    return there


def standing(judged: Judged) -> np.ndarray:
    """Return which judged rows stand under the soil model that decides, robust or open, bool, shape (n,)."""
    grade, under, bit = judged["robustness"], judged["stands_under"], 1 << SECOND_OPINIONS.index(DECISIVE)
    return (grade == ROBUST) | ((grade == OPEN) & (under >= 0) & ((under & bit) > 0))


def with_second_opinions(
    judged: Judged,
    passes: Designs,
    laws: tuple[str, ...],
    model: Model,
    limits: Any,
    longest_s: float,
    stand: np.ndarray | None = None,
) -> Judged:
    """Return judged rows with the designs of those that pass simulated again.

    Where `DECISIVE` is asked and a pass stands, it is robust, or open outside the study; where a law overturns it, it
    is sensitive. If `DECISIVE` alone is asked, passes that are robust without asking are not simulated. Passes that it
    overturns, and passes where another law resists less, are simulated under that law, too. Passes that are known to
    `stand` under all laws that decide are not simulated.
    """
    passing = np.flatnonzero(judged.verdict == PASS)
    grade, under = judged["robustness"].copy(), judged["stands_under"].copy()
    known = np.zeros(len(passing), dtype=bool) if stand is None else stand
    if laws == (DECISIVE,):
        # Those that are robust without asking are so by the whole limit.
        asked = np.flatnonzero((grade[passing] != ROBUST) | (limits.rotation < least_free_rotation()))
        passing, passes, known = passing[asked], passes.rows(asked), known[asked]
    under[passing] = 0
    turned = np.zeros(len(passing), dtype=bool)

    def ask(law: str, rows: np.ndarray) -> None:
        """Note which of some passes stand under a law."""
        there = known[rows]
        there[~there] = stands(passes.rows(rows[~there]), law, model, limits, longest_s)
        under[passing[rows[there]]] += 1 << SECOND_OPINIONS.index(law)
        turned[rows[~there]] = True

    for law in laws:
        ask(law, np.arange(len(passing)))
    if laws == (DECISIVE,):
        for law in _OTHERS:
            ask(law, np.flatnonzero(turned | resists_less(passes, law)))
    grade[passing[turned]] = SENSITIVE
    if DECISIVE in laws:
        studied = are_studied(passes, limits)
        grade[passing[~turned & studied]] = ROBUST
        grade[passing[~turned & ~studied]] = OPEN
    columns: dict[str, Any] = judged.columns | {"robustness": grade, "stands_under": under}
    return Judged(columns, judged.words)


def is_studied(sweep: Sweep) -> bool:
    """Return whether a sweep has the study's model: the paper's law, its plain soil, and boxes of known rock."""
    model = sweep.model
    boxes = model.shape.is_box and not any(case.is_taped for case in (sweep, *sweep.cases))
    return boxes and model.resistance == RESISTANCES[0] and model.ground.is_usual and can_be_asked(sweep)
