"""What answers cost: ``python -m benchmarks.answers``.

Least depths of random designs, both ends of some of their brackets judged again, many designs drawn of one, and the
map of a grid from a part of it.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_sweep.answers.chance import Points, chance
from boulder_sweep.answers.draws import Draws
from boulder_sweep.answers.need import Need, need
from boulder_sweep.answers.spread import Spread
from boulder_sweep.answers.trials import judges_of
from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.runner.pool import Pool
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.sweep import DesignList

from .report import Table
from .timing import machine, versions

ROWS = 100_000
VERIFIED = 500
DRAWN = 1 << 20
SITE, GRID = "configs/uncertain_site.yaml", "configs/m30_sizing.yaml"
ENDS = {
    "boulder_length_m": (0.6, 2.0),
    "boulder_width_m": (0.8, 2.5),
    "boulder_height_m": (1.8, 4.0),
    "boulder_density_kg_m3": (2400.0, 3074.0),
    "soil_density_kg_m3": (1520.0, 2240.0),
    "friction_angle_deg": (27.0, 49.0),
    "subgrade_reaction_MN_m3": (2.0, 110.0),
    "strain_rate_factor": (1.0, 1.2),
    "vehicle_mass_kg": (5000.0, 9000.0),
    "impact_speed_m_s": (8.0, 25.0),
    "vehicle_spring_N_m": (2e6, 5e6),
    "vehicle_damper_N_s_m": (0.7e5, 2.5e5),
}
"""What random designs are drawn from, evenly: the usual ranges."""


@dataclass(frozen=True)
class Timed:
    """What something took."""

    result: Any
    cpu_s: float
    wall_s: float

    @classmethod
    def of(cls, work: Callable[[], Any]) -> Timed:
        """Call a function."""
        begun, clock = time.process_time(), time.perf_counter()
        result = work()
        return cls(result, time.process_time() - begun, time.perf_counter() - clock)


def random_sweep(count: int, seed: int = 1) -> Sweep:
    """Return a list of random designs, their depth to be found."""
    rng = np.random.default_rng(seed)
    columns = {name: rng.uniform(*ends, count) for name, ends in ENDS.items()}
    constants = {"bumper_height_m": 0.5, "hood_height_m": 1.4, "bed_offset_m": 2.9, "embedment_depth_m": 1.0}
    return Sweep("random", None, (), constants, DesignList("random.csv", columns))


def wrong_ends(found: Need, count: int, seed: int = 2) -> tuple[int, int]:
    """Judge both ends of some brackets again, as a run judges designs: how many there were, how many wrong."""
    frame = found.frame
    both = frame[frame.passes_at.notna() & frame.fails_at.notna()]
    chosen = both.sample(min(count, len(both)), random_state=seed)
    wrong = 0
    for end, passes in (("passes_at", True), ("fails_at", False)):
        listed = {name: chosen[name].to_numpy(dtype=float) for name in INPUT_COLUMNS if name != "impact_height_m"}
        listed["embedment_depth_m"] = chosen[end].to_numpy(dtype=float)
        sweep = Sweep("again", None, (), {}, DesignList("again.csv", listed))
        verdict = evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, sweep.n_designs)).verdict
        wrong += int(((verdict == PASS) != passes).sum())
    return len(chosen), wrong


def draw_one(drawn: int) -> float:
    """Return the chance of passing of the uncertain site by so many designs."""
    sweep = load(SITE)
    draws = Draws(sweep.plan.given_rows(0, 1), Spread(sweep), judges_of(sweep), Pool(None))
    points = Points(len(draws.spread.names), 0)
    found = chance(
        lambda index, z: draws.distance(index, z) > 0.0, 1, points, half_width=0.0, most=drawn, first=drawn // 16
    )
    return float(found.estimate[0])


def measure(rows: int = ROWS, verified: int = VERIFIED, drawn: int = DRAWN) -> Table:
    """Measure all answers."""
    table = Table(
        "answers",
        "Answers",
        f"{machine()}; {versions('numba', 'numpy', 'scipy')}; all cores, CPU time of all threads",
        ["what", "CPU time", "wall time", "simulations", "CPU time of each"],
    )
    sweep = random_sweep(rows)
    need(random_sweep(100))
    found = Timed.of(lambda: need(sweep))
    counts = ", ".join(f"{word} {count:,}" for word, count in found.result.counts().items())
    table.rows.append(_row(f"least depth to 1 mm, {rows:,} random designs", found, found.result.simulated, rows))
    tried, wrong = wrong_ends(found.result, verified)
    table.notes.append(f"Of the least depths: {counts}.")
    table.notes.append(f"Both ends of {tried} random brackets judged again as `sweep run` does: {wrong} wrong.")
    draw_one(4096)
    chances = Timed.of(lambda: draw_one(drawn))
    table.rows.append(_row(f"chance of one design by {drawn:,} drawn", chances, drawn, drawn))
    busy = os.getloadavg()[0]
    if busy > 1.5 * (os.cpu_count() or 1):
        table.notes.append(f"Other programs used the machine (load {busy:.0f}): idle, wall times are shorter.")
    return table


def _row(what: str, found: Timed, simulations: int, count: int) -> list[str]:
    each = f"{1e6 * found.cpu_s / count:.1f} us"
    return [what, f"{found.cpu_s:.2f} s", f"{found.wall_s:.2f} s", f"{simulations:,}", each]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.answers", description=__doc__)
    parser.add_argument("--rows", type=int, default=ROWS, help="random designs (default %(default)s)")
    print(measure(parser.parse_args().rows).markdown())


if __name__ == "__main__":
    main()
