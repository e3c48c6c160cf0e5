"""End runs by SIGKILL, SIGTERM and SIGINT, again and again, and resume them.

The signals come just before or after a change of the output folder: a file is made, flushed or gets its name, a folder
is made or removed. Which signal and which change is drawn with a seed. A share of them may come after a random time
instead: those are not the same every time.

A process that has loaded everything once forks a child for every command, so that a kill costs a fraction of a
second. Prints one JSON object: kills, kills by signal, tables finished, and what was wrong. Run from the root of the
repository as ``python -m tests.faults.kills FOLDER KILLS SEED SHARE``, the last one the share after a random time.
"""

from __future__ import annotations

import faulthandler
import itertools
import json
import os
import random
import signal
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pyarrow as pa

from boulder_sweep.cli.main import main
from boulder_sweep.errors import EXIT_INTERRUPTED
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.store.failures import NotASweepError
from boulder_sweep.store.reading import contents, finished_table
from tests.runner.grids import grid_of, grid_of_text, same_bits
from tests.store.folders import nothing_left
from tests.waiting import HANG_GUARD_S

ROWS = 20_000
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
LONGEST_LIFE_S = 0.6
"""Before a signal after a random time [s]; a run that is quicker is done, and another one is killed in its place."""
CHANGES = {"mkdir": 40, "open": 120, "fsync": 80, "rename": 40, "rmdir": 40}
"""Calls that change a folder, and about how often a run makes them."""


class Aim(NamedTuple):
    """When to send a signal: at a call that changes the folder."""

    call: str
    number: int
    before: bool

    def take(self, kind: signal.Signals) -> None:
        """Let this process send itself a signal at the call."""
        real, calls = getattr(os, self.call), itertools.count(1)

        def deadly(*arguments: Any, **options: Any) -> Any:
            now = next(calls) == self.number
            if now and self.before:
                os.kill(os.getpid(), kind)
            found = real(*arguments, **options)
            if now:
                os.kill(os.getpid(), kind)
            return found

        setattr(os, self.call, deadly)


def command(settings: Path, out: Path) -> int:
    """Resume the run in this process as the command does; return its exit code."""
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    try:
        main(["run", str(settings), "--output", str(out), "--jobs", "2", "--resume"])
    except SystemExit as end:
        return int(end.code or 0)
    except KeyboardInterrupt:  # before the command notes signals
        return EXIT_INTERRUPTED


def in_a_child(
    settings: Path, out: Path, life: float | Aim | None = None, kind: signal.Signals = signal.SIGKILL
) -> bool:
    """Resume the run in a child, which gets a signal after a while [s] or at a call; True if that has ended it."""
    faulthandler.dump_traceback_later(HANG_GUARD_S, exit=True)  # hang guard
    child = os.fork()
    if child == 0:
        code = 1
        try:
            if isinstance(life, Aim):
                life.take(kind)
            code = command(settings, out)
        finally:
            os._exit(code)
    if isinstance(life, float):
        time.sleep(life)
        os.kill(child, kind)
    _, how = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(how)
    if code not in (0, -kind, 128 + kind):
        raise RuntimeError(f"a run ended with {code}")
    return code != 0


def look_at(out: Path, faults: list[str]) -> None:
    """See that readers find whole parts only, each once, after a kill."""
    if not out.exists():
        return
    found = contents(out)
    if found.damaged:
        faults.append(f"damaged: {found.damaged}")
    expected = [row for part in found.intact for row in range(part.first, part.stop)]
    try:
        if finished_table(out)["design_id"].to_pylist() != expected:
            faults.append("parts are not read")
    except NotASweepError:
        if expected:
            faults.append("parts are not read")
    if pd.read_parquet(out).get("design_id", pd.Series(dtype=int)).to_list() != expected:
        faults.append("rows lost or double after a kill")


def tally(table: pa.Table, whole: pa.Table) -> dict[str, int]:
    """Count rows lost, double and different against the uninterrupted table."""
    ids = table["design_id"].to_pylist()
    return {
        "lost": len(set(range(ROWS)) - set(ids)),
        "double": len(ids) - len(set(ids)),
        "different": 0 if same_bits(table, whole) else 1,
    }


def end_and_resume() -> None:
    """End runs as often as asked for, resume them, and print the result."""
    folder, kills, seed, by_time = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
    chance = random.Random(seed)
    small = grid_of(10, soil="{elements: 100}")
    evaluation_of(small, accuracy_of(small)).warm_up()
    settings = folder / "grid.yaml"
    settings.write_text(grid_of_text(ROWS, soil="{elements: 100}"))
    whole_out = folder / "whole"
    in_a_child(settings, whole_out)
    done, tables, faults = Counter[str](), [], list[str]()
    outs = []

    def life() -> float | Aim:
        if chance.random() < by_time:
            return chance.uniform(0.0, LONGEST_LIFE_S)
        call = chance.choice(list(CHANGES))
        return Aim(call, chance.randint(1, CHANGES[call]), chance.random() < 0.5)

    while done.total() < kills:
        out = folder / f"killed-{len(outs)}"
        outs.append(out)
        clean = True
        while done.total() < kills and in_a_child(settings, out, life(), kind := chance.choice(SIGNALS)):
            done[kind.name] += 1
            look_at(out, faults)
            clean, before = nothing_left(out), clean
            if before and not clean and kind != signal.SIGKILL:
                faults.append(f"{kind.name} leaves something over")
    whole = finished_table(whole_out)
    for out in outs:
        in_a_child(settings, out)
        tables.append(tally(finished_table(out), whole))
        if not nothing_left(out) or sorted(path.name for path in out.iterdir()) != sorted(
            path.name for path in whole_out.iterdir()
        ):
            faults.append("something is left over, or a file differs")
    print(json.dumps({"kills": done.total(), "by_signal": done, "tables": tables, "faults": faults}))


if __name__ == "__main__":
    end_and_resume()
