"""A process that runs a sweep, for tests that do things to processes.

It prints a line for every progress report and at last the summary or the problem as JSON; it has the
exit code of the command line. Run as ``python -m tests.faults.driver OUT [options]`` from the root of the repository.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading

from boulder_kernels import simulate_table
from boulder_sweep.errors import Interrupted
from boulder_sweep.runner.run import Progress, run
from boulder_sweep.store.failures import StoreError
from tests.faults import faulty
from tests.runner.grids import grid_of


def main() -> int:
    """Run a sweep as the arguments say."""
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("--rows", type=int, default=2000)
    parser.add_argument("--soil", default="closed_form")
    parser.add_argument("--simulate", default="simulate_table")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--backend", default="threading")
    parser.add_argument("--stuck", action="store_true", help="never return from a report of rows")
    parser.add_argument("--resume", action="store_true")
    parser.add_argument("--overwrite", action="store_true")
    options = parser.parse_args()

    def report(progress: Progress) -> None:
        print(progress.rows_done, flush=True)
        while options.stuck and progress.rows_done:  # a signal handler of Python runs meanwhile
            threading.Event().wait(0.05)

    try:
        summary = run(
            grid_of(options.rows, soil=options.soil),
            options.out,
            jobs=options.jobs,
            backend=options.backend,
            resume=options.resume,
            overwrite=options.overwrite,
            progress=report,
            simulate=simulate_table if options.simulate == "simulate_table" else getattr(faulty, options.simulate),
        )
    except (Interrupted, StoreError) as problem:
        print(json.dumps({"problem": str(problem)}), flush=True)
        return problem.exit_code
    print(json.dumps(summary.to_dict()), flush=True)
    return summary.exit_code


if __name__ == "__main__":
    sys.exit(main())
