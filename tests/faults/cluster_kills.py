"""Kill workers and schedulers of Dask clusters after random numbers of rows, and resume what ended.

Prints one JSON object: kills, tables finished, and what was wrong. Run from the root of the repository as
``python -m tests.faults.cluster_kills FOLDER WORKER_KILLS SCHEDULER_KILLS SEED``.
"""

from __future__ import annotations

import faulthandler
import json
import random
import sys
from collections.abc import Callable
from pathlib import Path

from boulder_sweep.errors import ClusterLostError
from boulder_sweep.runner import cluster as backend
from boulder_sweep.runner.sweeper import Progress, run
from boulder_sweep.store.reader import finished_table
from tests.faults.clusters import Cluster
from tests.faults.faulty import slowly
from tests.runner.grids import grid_of, same_bits
from tests.store.states import status
from tests.waiting import HANG_GUARD_S

ROWS, ROWS_PER_PART = 40_000, 6_000


class Watch:
    """Kills something once when a run has done some rows; ends this process if a run stands still without a word."""

    def __init__(self, kill: Callable[[], None], rows: int):
        self._kill, self._rows = kill, rows
        self._killed = False
        self._seen: tuple[int, int] = (-1, -1)

    def __call__(self, progress: Progress) -> None:
        seen = (progress.rows_done, len(progress.notes))
        if seen != self._seen:
            self._seen = seen
            faulthandler.dump_traceback_later(HANG_GUARD_S, exit=True)  # hang guard
        if not self._killed and progress.rows_done >= self._rows:
            self._killed = True
            self._kill()


def one_run(out: Path, address: str, watch: Watch, faults: list[str]) -> bool:
    """Resume a run; True if it finished."""
    try:
        run(
            grid_of(ROWS),
            out,
            backend="dask",
            scheduler=address,
            resume=True,
            progress=watch,
            rows_per_part=ROWS_PER_PART,
            simulate=slowly,
        )
    except ClusterLostError as lost:
        if "rows are safe. Resume with: " not in str(lost):
            faults.append(f"no way to go on: {lost}")
        return False
    return True


def disturbed(out: Path, cluster: Cluster, kill: Callable[[], None], rows: int, faults: list[str]) -> bool:
    """Resume a run and kill something when so many rows are done; True if it finished."""
    finished = one_run(out, cluster.address, Watch(kill, rows), faults)
    found = status(out, verify=True)
    if found.damaged:
        faults.append(f"damaged: {found.damaged}")
    if len(finished_table(out)) != found.rows_done:
        faults.append("recorded rows are missing")
    return finished


def check(out: Path, whole: Path, faults: list[str]) -> None:
    """Compare a finished table with the undisturbed one: rows, and the bytes of every part."""
    table = finished_table(out)
    if table["design_id"].to_pylist() != list(range(ROWS)) or not same_bits(table, finished_table(whole)):
        faults.append(f"{out} differs")
    for path in whole.glob("rows-*.parquet"):
        if (out / path.name).read_bytes() != path.read_bytes():
            faults.append(f"{out / path.name} differs")


def main() -> None:
    """Kill as often as requested and print the findings."""
    folder, worker_kills, scheduler_kills, seed = Path(sys.argv[1]), *map(int, sys.argv[2:5])
    chance = random.Random(seed)
    faults: list[str] = []
    whole = folder / "whole"
    backend.CONNECT_S = backend.FIRST_WORKER_S = HANG_GUARD_S  # hang guard
    run(grid_of(ROWS), whole, jobs=2, rows_per_part=ROWS_PER_PART, simulate=slowly)
    done = {"worker": 0, "scheduler": 0}
    tables = 0
    with Cluster(2, folder) as cluster:

        def kill_worker() -> None:
            cluster.start_worker()  # before, so that there is another soon
            cluster.kill_worker(chance.randrange(len(cluster.workers) - 1))
            done["worker"] += 1

        while done["worker"] < worker_kills:
            out = folder / f"workers-{tables}"
            while not disturbed(out, cluster, kill_worker, chance.randrange(8 * ROWS // 10), faults):
                pass
            check(out, whole, faults)
            tables += 1
    out, finished = folder / "schedulers-0", True
    while done["scheduler"] < scheduler_kills or not finished:
        with Cluster(1, folder) as cluster:

            def kill_scheduler(cluster: Cluster = cluster) -> None:
                if done["scheduler"] < scheduler_kills:
                    cluster.kill_scheduler()
                    done["scheduler"] += 1

            finished = disturbed(out, cluster, kill_scheduler, chance.randrange(ROWS), faults)
            if finished:
                check(out, whole, faults)
                tables += 1
                out = folder / f"schedulers-{tables}"
    print(json.dumps({"kills": done, "tables": tables, "faults": faults}))


if __name__ == "__main__":
    main()
