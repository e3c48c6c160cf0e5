"""How much the model's form decides: verdicts with friction and vertical motion, and under laws that resist less."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from boulder_kernels import DesignTable, Status
from boulder_kernels.heave import Base, HeaveOptions
from boulder_kernels.second_opinion import USUAL_BASE, WHOLE, HeaveControl, HeaveOutcome, second_opinions
from boulder_sweep import elementary
from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.designs import impact_height_of_face
from boulder_sweep.investigation import api_curve, family_bounds
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.inputs import Designs, designs_of, sampled_designs
from boulder_sweep.judge.judged import FAIL, PASS
from boulder_sweep.judge.validity import VEHICLE
from boulder_sweep.settings import load
from boulder_sweep.settings.model import RESISTANCES, SECOND_OPINIONS
from boulder_sweep.soils import with_law
from docs.studies.random_designs import RANGES

PAPER = RESISTANCES[0]
RISING = HeaveOptions(heave=True, friction=False)
SPEEDS = {"M30": "30 mph", "M40": "40 mph"}
DRAWN, SEED = 1200, 1
"""Passes, and fails, that are drawn of each grid."""
RANDOM = 30_000
"""Number of random designs."""
FAILS_ASKED = 5000
"""Fails of these that are simulated again."""
BUMPER_M, HOOD_M, BED_OFFSET_M = 0.5, 1.4, 2.9
LITTLE_DEG = 12.0
"""Rotation up to which passes of the grids are looked at apart."""
SCATTER = 0.3
"""Standard deviation of the logarithm of the subgrade reaction about the API curve."""
BINS_DEG = (0.0, 6.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 16.0, 18.0, 20.0)
WATCHED_S = 1.5
"""How long the crash tests are watched [s]."""


@cache
def grid_evaluation(grid: Path, speed: str = SPEEDS["M30"]) -> Evaluation:
    """Return how the designs of a grid are judged, at a speed."""
    sweep = load(grid, (f"vehicle.speed={speed}",))
    return evaluation_of(sweep, accuracy_of(sweep))


@cache
def drawn_of_grid(grid: Path, speed: str, count: int = DRAWN) -> tuple[Designs, Designs]:
    """Return passes and fails of a grid at a speed, `count` of each at most."""
    sweep = load(grid, (f"vehicle.speed={speed}",))
    block = sweep.plan.selection(np.arange(sweep.n_designs))
    designs = designs_of(block, np.asarray(block.reasons.codes) == 0)
    verdict = grid_evaluation(grid, speed).judged(designs).verdict
    rng = np.random.default_rng(SEED)
    passes, fails = (np.sort(rng.permutation(np.flatnonzero(verdict == which))[:count]) for which in (PASS, FAIL))
    return designs.rows(passes), designs.rows(fails)


def by_second_opinion(
    designs: Designs,
    law: str,
    evaluation: Evaluation,
    form: HeaveOptions = WHOLE,
    base: Base = USUAL_BASE,
    *,
    watched: bool = False,
) -> HeaveOutcome:
    """Simulate designs that have the paper's law by another law and form, to a proof or, if watched, for a time."""
    longest = WATCHED_S if watched else evaluation.control.longest_horizon
    control = HeaveControl(evaluation.limits.rotation, longest, stop=not watched)
    return second_opinions(with_law(designs.table, law), control, form, base)


def passing(designs: Designs, law: str, evaluation: Evaluation, form: HeaveOptions = WHOLE) -> np.ndarray:
    """Return which designs pass by a law and a form, bool, shape (n,)."""
    found = by_second_opinion(designs, law, evaluation, form)
    penetration = found.x_v_max - designs.bed_offset - designs.table.L
    return (found.status == Status.BELOW_LIMIT.value) & (penetration <= evaluation.limits.penetration)


def robust(designs: Designs, evaluation: Evaluation) -> np.ndarray:
    """Return which designs stand under both second opinions, bool, shape (n,)."""
    return np.logical_and.reduce([passing(designs, law, evaluation) for law in SECOND_OPINIONS])


def grids_words(grid: Path) -> str:
    """Return how many passes of a grid are robust at two speeds, and of those that turn little."""
    shares, few = [], np.array([], dtype=bool)
    for name, speed in SPEEDS.items():
        evaluation, (passes, _) = grid_evaluation(grid, speed), drawn_of_grid(grid, speed)
        standing = robust(passes, evaluation)
        few = np.append(few, standing[evaluation.judged(passes)["max_rotation_deg"] <= LITTLE_DEG])
        shares.append(f"{standing.mean():.0%} of the passes of {name}")
    return (
        f"{' and '.join(shares)} are robust, and so are {np.count_nonzero(few)} of the {few.size} that turn by at most "
        f"{LITTLE_DEG:g}°."
    )


def crash_table(grid: Path, base: Base = USUAL_BASE) -> Table:
    """Return the crash tests with friction and vertical motion, by soil model, with the constants of a foot."""
    table = Table(("test", *(f"`{law}`" for law in RESISTANCES)))
    evaluation = grid_evaluation(grid)
    for name, title in NAMES.items():
        design = sampled_designs(crash_test(name), 1)
        cells = []
        for law in RESISTANCES:
            found = by_second_opinion(design, law, evaluation, WHOLE, base, watched=True)
            (rotation,), (reached,) = np.degrees(found.theta_max), np.asarray(found.t_limit)
            cells.append(f"{rotation:.1f}°" if np.isnan(reached) else f"20° after {1e3 * reached:.0f} ms")
        table.add(title, *cells)
    return table


def random_designs(count: int = RANDOM, seed: int = SEED) -> Designs:
    """Return random designs of usual boulders, soils and medium-duty trucks, all hit by the truck."""
    rng = np.random.default_rng(seed)
    draws = 2 * count
    names = ("L", "W", "H", "rho_b", "rho_s")
    columns = {name: rng.uniform(*ends, draws) for name, ends in ({n: RANGES[n] for n in names} | VEHICLE).items()}
    d = columns["H"] * rng.uniform(*RANGES["embedment_ratio"], draws)
    angle = rng.uniform(*RANGES["phi_deg"], draws)
    beta = np.clip(api_curve(angle) * elementary.exp(rng.normal(0.0, SCATTER, draws)), *family_bounds(angle))
    table = DesignTable(
        **columns,
        d=d,
        e=impact_height_of_face(columns["H"], d, BUMPER_M, HOOD_M),
        phi=np.radians(angle),
        beta=beta,
        K_epsilon=np.ones(draws),
        e_bumper=np.full(draws, BUMPER_M),
    )
    hit = np.flatnonzero(columns["H"] - d > BUMPER_M)[:count]
    return Designs(table, np.full(draws, BED_OFFSET_M)).rows(hit)


@cache
def random_verdicts(grid: Path, count: int = RANDOM) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return what becomes of random designs.

    Parameters
    ----------
    grid
        Whose criterion they are judged by.
    count
        How many designs.

    Returns
    -------
    tuple
        Largest rotations of those that pass [deg], shape (n,); which of them are lost under vertical motion alone and
        by each law, bool, shape (n,); and which of some fails pass by each law, bool, shape (m,).
    """
    evaluation, designs = grid_evaluation(grid), random_designs(count)
    judged = evaluation.judged(designs)
    passes = designs.rows(judged.verdict == PASS)
    lost = {"vertical motion alone": ~passing(passes, PAPER, evaluation, RISING)}
    lost |= {f"`{law}`": ~passing(passes, law, evaluation) for law in SECOND_OPINIONS}
    fails = designs.rows(np.flatnonzero(judged.verdict == FAIL)[:FAILS_ASKED])
    won = {law: passing(fails, law, evaluation) for law in RESISTANCES}
    return judged["max_rotation_deg"][judged.verdict == PASS], lost, won


def random_table(grid: Path, count: int = RANDOM) -> Table:
    """Return how many random passes are lost, by their largest rotation."""
    rotation, lost, _ = random_verdicts(grid, count)
    table = Table(("largest rotation [°]", "passes", "lost [%]", *(f"{name} [%]" for name in lost)))
    places = np.digitize(rotation, BINS_DEG[1:-1], right=True)
    masks = {f"{low:g} to {high:g}": places == place for place, (low, high) in enumerate(pairwise(BINS_DEG))}
    any_lost = np.logical_or.reduce(list(lost.values()))
    for words, there in (masks | {"all": np.ones(len(rotation), dtype=bool)}).items():
        shares = (100.0 * which[there].mean() if there.any() else 0.0 for which in (any_lost, *lost.values()))
        table.add(words, str(np.count_nonzero(there)), *(f"{share:.1f}" for share in shares))
    return table


def random_words(grid: Path, count: int = RANDOM) -> str:
    """Return how many random passes are robust, and how many fails pass."""
    rotation, lost, won = random_verdicts(grid, count)
    standing = ~np.logical_or.reduce([lost[f"`{law}`"] for law in SECOND_OPINIONS])
    of_laws = ", ".join(f"{won[law].mean():.1%} under `{law}`" for law in reversed(RESISTANCES))
    return (
        f"Of {len(rotation)} passes among {count} designs {standing.mean():.0%} are robust. "
        f"Of {len(won[PAPER])} designs that fail, these pass with friction and vertical motion: {of_laws}."
    )
