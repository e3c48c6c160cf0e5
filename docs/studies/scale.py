"""A plan of tables up to 10^12 rows: what they take, where that breaks first, by constants measured on one machine."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from boulder_sweep.answers.need import need
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.runner.running import COMMIT_SHARE
from boulder_sweep.runner.workers import TASK_S
from boulder_sweep.settings import load
from boulder_sweep.store.writer import ROWS_PER_PART
from boulder_sweep.text import duration_text, size_text

MEASURED = {
    "row_cpu_s": (7.16e-6, "CPU time of a row, balanced, everything included", "python -m benchmarks.serial"),
    "row_bytes": (54.7, "bytes of a row in the table", "sweep run configs/m30_sizing.yaml --json"),
    "task_cpu_s": (2.74e-3, "CPU time of the scheduler for a task", "python -m benchmarks.scale"),
    "task_run_cpu_s": (1.42e-3, "CPU time of the run for a task", "python -m benchmarks.scale"),
    "task_bytes": (5310.0, "bytes that pass the scheduler for a task", "python -m benchmarks.scale"),
    "heartbeat_cpu_s": (4.58e-4, "CPU time of the scheduler for a heartbeat of a worker", "python -m benchmarks.scale"),
    "heartbeat_bytes": (682.0, "bytes of a heartbeat", "python -m benchmarks.scale"),
    "scheduler_idle_share": (
        0.0172,
        "share of a core that the scheduler takes with nothing to do",
        "python -m benchmarks.scale",
    ),
    "part_manifest_bytes": (815.0, "bytes of a part in the manifest", "python -m benchmarks.scale"),
    "part_save_cpu_s": (2.21e-5, "CPU time to write a part into a manifest", "python -m benchmarks.scale"),
    "part_load_cpu_s": (7.7e-5, "CPU time to read a part of a manifest", "python -m benchmarks.scale"),
}
"""Value, meaning and the command that measures it."""
VALUE = {name: value for name, (value, _, _) in MEASURED.items()}
CORE_HOUR_USD, GB_MONTH_USD, THOUSAND_PUTS_USD = 0.04, 0.023, 0.005
"""Prices assumed: a core hour, a gigabyte kept for a month, a thousand requests that write."""
PUTS_PER_PART = 2
"""Staged, then copied to the final name."""
MOST_LOAD = 0.5
"""Share of a core up to which the scheduler answers without delay."""
LONG_OPENING_S = 5.0
"""Time to open a table after which people wait."""
CASES = ((1e7, 2), (1e7, 64), (1e8, 64), (1e9, 64), (1e10, 256), (1e11, 256), (1e12, 256), (1e12, 2048))
DEPTHS, VALUES = 1000, 32
"""Values along an axis of depths, millimetres over a metre, and along one in place of a distribution."""


@dataclass(frozen=True)
class Plan:
    """What a table takes."""

    rows: float
    workers: int
    task_s: float = TASK_S

    @property
    def rows_per_task(self) -> float:
        """Rows of a task: whole parts."""
        rows = min(self.task_s / VALUE["row_cpu_s"], self.rows / (4 * self.workers))
        return max(rows - rows % ROWS_PER_PART, min(rows, ROWS_PER_PART))

    @property
    def tasks(self) -> float:
        """Number of tasks."""
        return self.rows / self.rows_per_task

    @property
    def parts(self) -> int:
        """Number of files."""
        return math.ceil(self.rows / ROWS_PER_PART)

    @property
    def beats_per_s(self) -> float:
        """Heartbeats of all workers: Dask makes them rarer as workers become more."""
        n = self.workers
        interval = 0.5 if n <= 10 else 1.0 if n < 50 else 2.0 if n < 200 else n / 200 + 1.0
        return n / interval

    @property
    def load(self) -> float:
        """Share of a core that the scheduler needs for this many workers that never wait."""
        tasks = VALUE["task_cpu_s"] * self.workers / (self.rows_per_task * VALUE["row_cpu_s"])
        return VALUE["scheduler_idle_share"] + VALUE["heartbeat_cpu_s"] * self.beats_per_s + tasks

    @property
    def seconds(self) -> float:
        """Time on this many cores, longer where the scheduler cannot keep up."""
        return self.rows * VALUE["row_cpu_s"] / self.workers * max(self.load, 1.0)

    @property
    def cluster_bytes(self) -> float:
        """Bytes that pass the scheduler."""
        return self.tasks * VALUE["task_bytes"] + self.beats_per_s * self.seconds * VALUE["heartbeat_bytes"]

    @property
    def commits(self) -> float:
        """Manifests written: as many as fit into `COMMIT_SHARE` of a processor, one for each part at most."""
        parts, budget = self.parts, COMMIT_SHARE * self.seconds / VALUE["part_save_cpu_s"]
        # While part p is the last, a manifest costs p * part_save_cpu_s; the parts come evenly.
        free = min(budget / parts, parts)
        return free + budget / parts * math.log(parts / free)

    @property
    def opening_s(self) -> float:
        """Time to read the manifest."""
        return self.parts * VALUE["part_load_cpu_s"]

    @property
    def work_usd(self) -> float:
        """Price of the cores: workers, scheduler and run."""
        return (self.workers + 2) * self.seconds / 3600.0 * CORE_HOUR_USD

    @property
    def keep_usd(self) -> float:
        """Price of keeping the table for a month."""
        return self.rows * VALUE["row_bytes"] / 1e9 * GB_MONTH_USD

    @property
    def put_usd(self) -> float:
        """Price of writing into an object store."""
        return (PUTS_PER_PART * self.parts + 2 * self.commits) / 1000.0 * THOUSAND_PUTS_USD


def power(number: float) -> str:
    """Format a power of ten, or a multiple."""
    exponent = math.floor(math.log10(number) + 1e-9)
    factor = number / 10**exponent
    digits = str(exponent).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"10{digits}" if abs(factor - 1.0) < 0.05 else f"{factor:.1f}·10{digits}"


def money(usd: float) -> str:
    """Format a price."""
    return f"{usd:,.0f} USD" if usd >= 10 else f"{usd:.2f} USD"


def _table(head: list[str], rows: list[list[str]]) -> str:
    """Return a table for a page."""
    return Table(tuple(head), [tuple(row) for row in rows]).markdown()


def constants_table() -> str:
    """Return the constants."""
    rows = [[meaning, f"{value:.3g}", f"`{source}`"] for value, meaning, source in MEASURED.values()]
    return _table(["constant", "s, bytes or 1", "measured by"], rows)


def plan_table() -> str:
    """Return what tables take."""
    plans = [Plan(rows, workers) for rows, workers in CASES]
    head = ["rows", "workers", "time", "files", "tasks", "through the scheduler, bytes a design", "table", "manifest"]
    rows = [
        [
            power(plan.rows),
            str(plan.workers),
            duration_text(plan.seconds),
            f"{plan.parts:,}",
            f"{plan.tasks:,.0f}",
            f"{plan.cluster_bytes / plan.rows:.3f}",
            size_text(plan.rows * VALUE["row_bytes"]),
            size_text(plan.parts * VALUE["part_manifest_bytes"]),
        ]
        for plan in plans
    ]
    return _table(head, rows)


def price_table() -> str:
    """Return what tables cost."""
    rows = [
        [power(plan.rows), money(plan.work_usd), money(plan.put_usd), money(plan.keep_usd)]
        for plan in (Plan(rows, 256) for rows in (1e8, 1e9, 1e10, 1e11, 1e12))
    ]
    return _table(["rows", "computing", "writing", "keeping for a month"], rows)


def workers_table() -> str:
    """Return the load of the scheduler, and how many workers it can serve."""
    rows = [
        [str(workers), *(f"{Plan(1e12, workers, task_s).load:.1%}" for task_s in (TASK_S, 10 * TASK_S))]
        for workers in (2, 16, 64, 256, 1024, 4096)
    ]
    head = ["workers", f"tasks of {TASK_S:.0f} s", f"tasks of {10 * TASK_S:.0f} s"]
    most = [most_workers(task_s) for task_s in (TASK_S, 10 * TASK_S)]
    return _table(head, [*rows, [f"most at {MOST_LOAD:.0%}", *(f"{count:,}" for count in most)]])


def most_workers(task_s: float) -> int:
    """Return how many workers a scheduler serves with tasks of some length."""
    return max(workers for workers in range(1, 20_000) if Plan(1e12, workers, task_s).load <= MOST_LOAD)


def limits_words() -> str:
    """Say where it breaks, in the order of size."""
    rows = LONG_OPENING_S / VALUE["part_load_cpu_s"] * ROWS_PER_PART
    ratio = Plan(1e12, 256).keep_usd / Plan(1e12, 256).work_usd
    at_once = Plan(1e12, 256).opening_s
    return (
        f"1. **The scheduler**, at {most_workers(TASK_S):,} workers of one thread: half of its one core is taken.\n"
        f"2. **The manifest**, at {power(rows)} rows: opening a table takes {LONG_OPENING_S:.0f} s. At 10¹² rows "
        f"it would take {duration_text(at_once)}.\n"
        f"3. **Keeping the rows**, at any size: a month costs {ratio:.0f} times what computing them does."
    )


def questions_table(root: Path) -> str:
    """Return how many designs answer a question, as a grid and by search."""
    plain = need(load(root / "configs" / "site.yaml"))
    likely = need(load(root / "configs" / "uncertain_site.yaml"), probability=0.95)
    questions = (
        ("the least depth, for 10⁶ combinations", DEPTHS * 1e6, plain.simulated / len(plain) * 1e6),
        (
            "the least depth that passes with 95 %, four inputs uncertain, for 1000 boulders",
            DEPTHS * VALUES**4 * 1e3,
            likely.simulated / len(likely) * 1e3,
        ),
    )
    rows = [
        [question, power(grid), power(searched), duration_text(Plan(searched, 2).seconds)]
        for question, grid, searched in questions
    ]
    return _table(["question", "rows of a grid", "simulations by `sweep need`", "time on 2 cores"], rows)
