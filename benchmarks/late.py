"""Shallow boulders, which rock for seconds, against an independent integration: ``python -m benchmarks.late``.

Random designs with d/H from 0.02 to 0.35 are run as a user would run them, and followed for 30 s by the plain
Runge-Kutta method of the tests (`tests.rk4`), with steps of 0.2 and of 0.1 ms. It shares no code with the kernels,
estimates no error and ends on no proof. Where the two steps do not agree on the verdict the truth is not known, and the
design is set aside. Exit code 1 if a pass overturns or a fail stands.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd

import boulder_sweep
from boulder_sweep.judge.inputs import SOURCES
from tests import rk4

DESIGNS, SEED = 30_000, 22
STEPS_S = (2e-4, 1e-4)
UNTIL_S, LIMIT = 30.0, math.radians(20.0)
PIECE = 250
"""Designs followed at a time, between two looks at the progress."""
CORRECTED = (True,) * 5


def shallow(count: int, seed: int) -> pd.DataFrame:
    """Draw shallow designs that the truck hits, with the columns of a table of designs."""
    rng = np.random.default_rng(seed)
    n = 4 * count
    H = rng.uniform(1.2, 4.0, n)
    drawn = pd.DataFrame(
        {
            "boulder_length_m": rng.uniform(1.0, 3.0, n),
            "boulder_width_m": rng.uniform(0.8, 2.5, n),
            "boulder_height_m": H,
            "boulder_density_kg_m3": rng.uniform(2400.0, 3074.0, n),
            "embedment_depth_m": rng.uniform(0.02, 0.35, n) * H,
            "soil_density_kg_m3": rng.uniform(1520.0, 2240.0, n),
            "friction_angle_deg": rng.uniform(27.0, 49.0, n),
            "subgrade_reaction_MN_m3": rng.uniform(10.0, 110.0, n),
            "strain_rate_factor": rng.uniform(1.0, 1.2, n),
            "vehicle_mass_kg": rng.uniform(1500.0, 7500.0, n),
            "impact_speed_m_s": rng.uniform(4.0, 14.0, n),
            "vehicle_spring_N_m": rng.uniform(1.5e6, 4.0e6, n),
            "vehicle_damper_N_s_m": rng.uniform(0.9e5, 2.4e5, n),
            "bumper_height_m": rng.uniform(0.3, 0.55, n),
            "hood_height_m": rng.uniform(0.8, 1.6, n),
        }
    )
    reached = drawn.boulder_height_m - drawn.embedment_depth_m > drawn.bumper_height_m + 0.3
    return drawn[reached].head(count).reset_index(drop=True)


def judged(designs: pd.DataFrame, accuracy: str) -> pd.DataFrame:
    """Run designs as a user would, and return the table."""
    with tempfile.TemporaryDirectory() as folder:
        designs.to_csv(Path(folder) / "designs.csv", index=False)
        grid = Path(folder) / "grid.yaml"
        grid.write_text(f"name: shallow\ntable: designs.csv\nsolver: {{accuracy: {accuracy}}}\n")
        boulder_sweep.run(boulder_sweep.load(grid), Path(folder) / "shallow.sweep")
        return boulder_sweep.read(Path(folder) / "shallow.sweep")


def truth(table: pd.DataFrame, jobs: int) -> np.ndarray:
    """Largest rotations [rad] of the rows of a table by each of `STEPS_S`, shape (n, 2)."""
    inputs = {name: table[column].to_numpy(float) for name, column in SOURCES.items() if name != "e_bumper"}
    inputs["phi"] = np.radians(inputs["phi"])
    pieces = [slice(at, at + PIECE) for at in range(0, len(table), PIECE)]

    def by_both(piece: slice) -> np.ndarray:
        some = {name: values[piece] for name, values in inputs.items()}
        return np.column_stack([rk4.follow_table(some, CORRECTED, h, UNTIL_S, LIMIT).theta for h in STEPS_S])

    found = []
    with ThreadPoolExecutor(jobs) as pool:
        for done, piece in enumerate(pool.map(by_both, pieces), start=1):
            found.append(piece)
            print(f"\r{done} of {len(pieces)} pieces followed", end="", file=sys.stderr)
    print(file=sys.stderr)
    return np.concatenate(found)


def compared(table: pd.DataFrame, rotations: np.ndarray) -> dict[str, int]:
    """Count what a table says against what is true.

    Parameters
    ----------
    table
        Result of a run.
    rotations
        Largest rotations [rad] by each of `STEPS_S`, shape (n, 2).
    """
    overturns = rotations >= LIMIT
    known = overturns[:, 0] == overturns[:, 1]
    falls, stands = known & overturns[:, 1], known & ~overturns[:, 1]
    verdict, reason = table["verdict"].astype(str).to_numpy(), table["reason"].astype(str).to_numpy()
    return {
        "designs": len(table),
        "late": int((table["end_time_s"] > 1.0).sum()),
        "set aside": int((~known).sum()),
        "passes": int((verdict == "pass").sum()),
        "passes that overturn": int(((verdict == "pass") & falls).sum()),
        "fails": int((reason == "overturns").sum()),
        "fails that stand": int(((reason == "overturns") & stands).sum()),
        "undecided": int((verdict == "undecided").sum()),
        "undecided for their error": int(((verdict == "undecided") & (reason == "error")).sum()),
    }


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.late", description=__doc__)
    parser.add_argument("--designs", type=int, default=DESIGNS)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--accuracy", nargs="+", default=["balanced", "fine"])
    asked = parser.parse_args()
    designs = shallow(asked.designs, asked.seed)
    tables = {accuracy: judged(designs, accuracy) for accuracy in asked.accuracy}
    rotations = truth(next(iter(tables.values())), asked.jobs)
    counts = pd.DataFrame({accuracy: compared(table, rotations) for accuracy, table in tables.items()})
    print(counts.to_string())
    return int(counts.loc[["passes that overturn", "fails that stand"]].to_numpy().any())


if __name__ == "__main__":
    sys.exit(main())
