"""Grades of passes against a fine solution of each: ``python -m benchmarks.grades``.

Passes of the M30 grid at 30 and at 40 mph, of random designs, of shallow boulders, of soil of 30 degrees, on sites with
layers, water, cohesion or slope, and of boulders that are no boxes are graded as `sweep run --second-opinion` grades
them. Each is then simulated under every law of a second opinion with 256 parts of the soil, strips of the foot and
points of the sides, and errors of a step of 1e-8 m. On each site, and of each shape, the pass that stands nearest to
the limit is simulated by an independent program, too, in which a face presses on the soil as it lies at its present
depth, and in which the inclination of a face counts where it holds the boulder down, too. Exit code 1 if a pass that
stands overturns in one of these.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boulder_kernels import Design, Status
from boulder_kernels.heave import FINEST
from boulder_kernels.second_opinion import HeaveControl, second_opinions
from boulder_sweep.columns import SHAPES
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.designs import impact_height_of_face
from boulder_sweep.investigation import api_curve
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.inputs import Designs
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.robustness import DECISIVE, base_under, standing, with_second_opinions
from boulder_sweep.settings.model import SECOND_OPINIONS, Ground, Layer, Model, ProfilePoint, Shape
from boulder_sweep.soils import with_soil
from docs.studies.forms import BUMPER_M, HOOD_M, SPEEDS, drawn_of_grid, grid_evaluation, random_designs
from tests.oracle import heave as oracle
from tests.oracle import inputs as known

from .timing import here

GRID = Path("configs/m30_sizing.yaml")
PASSES = 500
"""Passes of each set."""
DRAWN = 40
"""Random designs for each pass that is wanted, more than are needed."""
TOLERANCE_M = 1e-8
SHALLOW = (0.15, 0.35)
"""Embedment over height of shallow boulders, and"""
SLOW_M_S = (4.0, 13.0)
"""speeds that they stop."""
LOOSE_DEG = 30.0
LEAST_SITES, OF_A_SITE = 4, 25
"""Number of sites where few passes are asked for, and else the passes of one, which turn by at least"""
FAR_DEG = 9.0
"""in the planar motion."""
WATCHED_S = 0.6
"""How long the soil as it lies is simulated [s]."""
SEED, SHAPES_SEED = 55, 77
NARROWEST, LEANS = 0.55, 0.06
"""Least share of the whole sides that a shape has, and how far a profile leans, as a share of its length."""
FILLS = (0.45, 0.94)
"""Solidity of taped boulders."""
TAPED_SHARE = 3
"""One shape in so many is taped."""


class GradeCounts(NamedTuple):
    """How many passes of a set stand."""

    passes: int
    stand: int
    """Passes that stand as they are graded."""
    unsafe: int
    """Passes that overturn in a fine solution."""
    cautious: int
    """Passes that do not stand, though no fine solution overturns them."""
    cpu_s: float
    """CPU time of the grades [s]."""


def sets(grid: Path, count: int) -> Iterator[tuple[str, Evaluation, Designs]]:
    """Yield the names of the sets, how their designs are judged, and passes of them, `count` at most."""
    for name, speed in SPEEDS.items():
        yield name, grid_evaluation(grid, speed), drawn_of_grid(grid, speed, count)[0]
    evaluation = grid_evaluation(grid)
    drawn = random_designs(DRAWN * count, SEED)
    table, rng = drawn.table, np.random.default_rng(SEED)
    d = table.H * rng.uniform(*SHALLOW, drawn.size)
    e = impact_height_of_face(table.H, d, BUMPER_M, HOOD_M)
    angle = np.full(drawn.size, LOOSE_DEG)
    for name, changed in {
        "random": table,
        "shallow": table._replace(d=d, e=e, v_0=rng.uniform(*SLOW_M_S, drawn.size)),
        f"soil of {LOOSE_DEG:g}°": table._replace(
            phi=np.full(drawn.size, math.radians(LOOSE_DEG)), beta=api_curve(angle)
        ),
    }.items():
        designs = drawn._replace(table=changed)
        yield name, evaluation, designs.rows(np.flatnonzero(evaluation.judged(designs).verdict == PASS)[:count])


def random_ground(rng: np.random.Generator) -> Ground:
    """Draw a site: up to two boundaries of layers, weaker or stronger, and at times water, cohesion and a slope."""
    angles, tops = rng.uniform(28.0, 46.0, 2), np.sort(rng.uniform(0.2, 2.0, 2))
    cohesions, some = rng.uniform(0.0, 10.0, 3), rng.uniform(size=6) < 0.5
    layers = [
        Layer(float(top), rng.uniform(1600.0, 2200.0), float(angle), float(api_curve(angle)), float(cohesion))
        for top, angle, cohesion in zip(tops, angles, cohesions[1:] * some[1:3], strict=True)
    ]
    water, slope = rng.uniform(0.2, 2.0) if some[4] else None, rng.uniform(2.0, 15.0) if some[5] else 0.0
    return Ground(tuple(layers[: rng.integers(3)]), float(cohesions[0] * some[0]), water, slope)


def sites(evaluation: Evaluation, count: int) -> Iterator[tuple[Evaluation, Designs]]:
    """Yield how the designs of random sites are judged, and passes of them that turn far."""
    rng = np.random.default_rng(SEED)
    n = max(count // OF_A_SITE, LEAST_SITES)
    for site in range(n):
        model = Model(**random_ground(rng).fields())
        here, drawn = replace(evaluation, model=model), random_designs(DRAWN * OF_A_SITE, SEED + site)
        designs = drawn._replace(table=with_soil(drawn.table, model.resistance, model.ground))
        judged = here.judged(designs)
        far = (judged.verdict == PASS) & (judged["max_rotation_deg"] >= FAR_DEG)
        yield here, designs.rows(np.flatnonzero(far)[: count // n])


def random_profile(rng: np.random.Generator) -> tuple[ProfilePoint, ...]:
    """Draw a taper either way, a barrel, or a profile of five points that leans, on a foot that is wide enough."""
    while True:
        end = rng.uniform(NARROWEST, 0.97)
        five = rng.uniform(NARROWEST, 1.0, 5)
        sides = [[1.0, end], [end, 1.0], [end, 1.0, end], five / five.max()][rng.integers(4)]
        leans = rng.uniform(-LEANS, LEANS, len(sides)) * (len(sides) == 5)
        heights = np.linspace(0.0, 1.0, len(sides))
        points = [
            ProfilePoint(float(z), float(side), float(0.5 * side - lean), float(0.5 * side + lean))
            for z, side, lean in zip(heights, sides, leans, strict=True)
        ]
        if Shape(tuple(points)).stands_flat:
            return tuple(points)


def shapes(evaluation: Evaluation, count: int, seed: int = SHAPES_SEED) -> Iterator[tuple[Evaluation, Designs]]:
    """Yield how designs of random shapes are judged, every other in the soil of a site, and passes that turn far."""
    rng = np.random.default_rng(seed)
    n = max(count // OF_A_SITE, LEAST_SITES)
    for number in range(n):
        ground = random_ground(rng).fields() if number % 2 else {}
        drawn, taped = random_designs(DRAWN * OF_A_SITE, 2 * seed + number), number % TAPED_SHARE == 0
        model = Model(**ground) if taped else Model(**ground, profile=random_profile(rng))
        given, rocks, fills = drawn.table, drawn.table.rho_b, rng.uniform(*FILLS, drawn.size)
        if taped:
            given = given._replace(rho_b=rocks * fills)
        table = with_soil(given, model.resistance, model.ground, shape=model.shape)
        designs = Designs(table, drawn.bed_offset, fills, rocks if taped else None, given.K_epsilon)
        here = replace(evaluation, model=model, control=evaluation.control._replace(side_by_side=False))
        judged = here.judged(designs)
        far = (judged.verdict == PASS) & (judged["max_rotation_deg"] >= FAR_DEG)
        yield here, designs.rows(np.flatnonzero(far)[: count // n])


def in_shapes(passes: Designs, model: Model) -> list[Designs]:
    """Return designs in each of the shapes that may stand for them."""
    taped = passes.size > 0 and bool(passes.taped.all())
    return [passes.in_shape(shape, model) for shape in range(len(SHAPES))] if taped else [passes]


def overturned_as_it_lies(passes: Designs, stand: np.ndarray, evaluation: Evaluation) -> np.ndarray:
    """Return which passes the soil as it lies overturns, bool, (n,); asks of those that stand the one nearest to it."""
    found, model = np.zeros(passes.size, dtype=bool), evaluation.model
    if not (stand.any() and (hasattr(passes.table, "layers") or passes.taped.all())):
        return found
    control = HeaveControl(evaluation.limits.rotation, WATCHED_S, stop=False)
    shaped = in_shapes(passes, model)
    tables = [each.under(DECISIVE, model) for each in shaped]
    turned = [second_opinions(table, control, base=base_under(model.ground)).theta_max for table in tables]
    worst, row = np.unravel_index(np.argmax(np.where(stand, turned, 0.0)), (len(shaped), passes.size))
    found[row] = falls_as_it_lies(shaped[worst].rows(slice(row, row + 1)), evaluation)
    return found


def falls_as_it_lies(one: Designs, evaluation: Evaluation) -> bool:
    """Return whether the independent program overturns a design in the soil as it lies."""
    ground = evaluation.model.ground
    given = Design(*(float(column[0]) for column in one.table[: len(Design._fields)]))._asdict()
    del given["e_bumper"]
    given["K_epsilon"] = float(one.given_factors[0])
    top = known.Layer(0.0, given["rho_s"], given["phi"], given["beta"], 1e3 * ground.cohesion_kPa)
    deeper = [
        known.Layer(
            layer.from_m,
            layer.density_kg_m3,
            math.radians(layer.friction_angle_deg),
            layer.subgrade_reaction_MN_m3,
            1e3 * layer.cohesion_kPa,
        )
        for layer in ground.layers
    ]
    water = math.inf if ground.water_table_m is None else ground.water_table_m
    lies = known.Ground((top, *deeper), water, math.radians(ground.slope_deg))
    inputs, limit = known.Inputs(**given, ground=lies, resistance=DECISIVE), evaluation.limits.rotation
    table: Any = one.table
    outline = table.outlines[0] if one.has_outlines else None
    impact = oracle.simulate_heave(
        inputs,
        as_it_lies=True,
        fineness=2,
        outline=outline,
        both_ways=True,
        horizon=WATCHED_S,
        limit=limit,
        rtol=1e-6,
    )
    return math.isfinite(impact.t_limit)


def overturned(passes: Designs, evaluation: Evaluation) -> np.ndarray:
    """Return which passes a fine solution under one of the laws overturns, bool, shape (n,)."""
    control = HeaveControl(evaluation.limits.rotation, evaluation.longest_s, TOLERANCE_M, FINEST)
    found, model = np.zeros(passes.size, dtype=bool), evaluation.model
    for law in SECOND_OPINIONS:
        for each in in_shapes(passes, model):
            outcome = second_opinions(each.under(law, model), control, base=base_under(model.ground))
            penetration = outcome.x_v_max - passes.bed_offset - each.length
            found |= (outcome.status == Status.LIMIT.value) | ~(penetration <= evaluation.limits.penetration)
    return found


def held(evaluation: Evaluation, passes: Designs) -> GradeCounts:
    """Grade passes, and hold the grades to fine solutions."""
    judged = evaluation.judged(passes)
    begun = time.process_time()
    graded = with_second_opinions(
        judged, passes, (DECISIVE,), evaluation.model, evaluation.limits, evaluation.longest_s
    )
    cpu_s = time.process_time() - begun
    stand = standing(graded)
    lost = overturned(passes, evaluation) | overturned_as_it_lies(passes, stand, evaluation)
    unsafe, cautious = (int(np.count_nonzero(which)) for which in (stand & lost, ~stand & ~lost))
    return GradeCounts(passes.size, int(np.count_nonzero(stand)), unsafe, cautious, cpu_s)


def grades(grid: Path = GRID, count: int = PASSES) -> dict[str, GradeCounts]:
    """Hold the grades of all sets to fine solutions."""
    found = {name: held(evaluation, passes) for name, evaluation, passes in sets(grid, count)}
    for name, draw in {"sites": sites, "shapes": shapes}.items():
        each = [held(evaluation, passes) for evaluation, passes in draw(grid_evaluation(grid), count)]
        found[name] = GradeCounts(*map(sum, zip(*each, strict=True)))
    return found


def grades_table(found: dict[str, GradeCounts], *, cpu: bool = False) -> Table:
    """Return the grades of the sets as a table, with the CPU time of a pass if asked."""
    table = Table(("passes of", "passes", "stand", "unsafe", "over-cautious", *(["CPU [µs]"] if cpu else [])))
    for name, one in found.items():
        time_us = [f"{1e6 * one.cpu_s / one.passes:.0f}"] if cpu else []
        table.add(name, *(str(count) for count in one[:4]), *time_us)
    return table


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.grades", description=__doc__)
    parser.add_argument("--passes", type=int, default=PASSES, help="passes of each set (default %(default)s)")
    count = parser.parse_args().passes
    grid_evaluation(GRID).asked().warm_up()
    found = grades(count=count)
    print(here())
    print(grades_table(found, cpu=True).text())
    return 1 if any(one.unsafe for one in found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
