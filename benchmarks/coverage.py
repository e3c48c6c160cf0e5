"""Coverage of the estimated errors: ``python -m benchmarks.coverage``.

Simulates random realistic designs and a sample of the M30 grid with both presets by the steps of the named accuracies,
and by some of those that an accuracy given as a number may choose; compares estimated with true errors, the latter
against a far finer solution; and ends with exit code 1 where fewer than 99 % of the estimates hold (98 % by `fast` as
printed) or a verdict that is not undecided is wrong.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from docs.studies.coverage import coverage_table, coverages, grid_table, random_table

GRID = Path(__file__).parent.parent / "configs" / "m30_sizing.yaml"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.coverage", description=__doc__)
    parser.add_argument("--designs", type=int, default=16384, help="random designs (default %(default)s)")
    parser.add_argument("--rows", type=int, default=8192, help="rows of the M30 grid (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the random designs (default %(default)s)")
    arguments = parser.parse_args()
    tables = {
        "random": random_table(arguments.designs, arguments.seed),
        "M30 grid": grid_table(GRID, arguments.rows),
    }
    found = list(coverages(tables))
    print(coverage_table(found).text())
    poor = [c for c in found if not c.is_enough]
    wrong = [c for c in found if c.flips]
    for c in poor:
        print(f"only {min(c.rotation, c.displacement):.2%}: {c.designs}, {c.readings}, {1e3 * c.steps.step_s:g} ms")
    for c in wrong:
        print(f"{c.flips} wrong verdicts: {c.designs}, {c.readings}, {1e3 * c.steps.step_s:g} ms")
    if not poor and not wrong:
        print("estimates hold for as many designs as they must, and no verdict is wrong")
    return 1 if poor or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
