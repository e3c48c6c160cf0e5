"""A small whole run, from the settings to the table, and what it does that depends on no clock."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

if TYPE_CHECKING:
    from boulder_sweep.settings import Sweep

ROWS = 20_000
JOBS = 2
SETTINGS = """\
name: gate
boulder: {length: 1.65 m, width: {from: 0.8 m, to: 2.5 m, count: 20}, height: {from: 1.6 m, to: 4.0 m, count: 20},
          density: 2596 kg/m^3}
site: {embedment_ratio: {from: 0.40, to: 0.70, count: 10}}
soil: {density: 1859.9 kg/m^3, friction_angle: 40 deg,
       subgrade_reaction: {from: 45 MN/m^3, to: 110 MN/m^3, count: 5}, strain_rate_factor: 1.0}
vehicle: {mass: 6800 kg, speed: 13.4 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m, bumper_height: 0.5 m,
          hood_height: 1.4 m, bed_offset: 2.9 m}
criterion: {max_rotation: 20 deg, rating: P1}
model: {readings: corrected, soil: closed_form}
solver: {accuracy: balanced, horizon: 1 s}
"""
PREPARING = "interruptible work"
"""Name of the threads that prepare a run; how many designs they try depends on the clock."""


def loaded(folder: Path) -> Sweep:
    """Write the settings into a folder and load them.

    Raises
    ------
    ValueError
        The grid does not have the rows it should have.
    """
    from boulder_sweep import load

    file = folder / "gate.yaml"
    file.write_text(SETTINGS)
    sweep = load(file)
    if sweep.n_designs != ROWS:
        raise ValueError(f"the grid of the gate has {sweep.n_designs} designs, not {ROWS}")
    return sweep


def counts_of_run(folder: Path) -> dict[str, int]:
    """Run once, with all rows in one part, and count.

    Parameters
    ----------
    folder
        Where settings and table are written.

    Returns
    -------
    dict
        Designs that workers simulate, threads started, files left, bytes written, flushes to the disk.
    """
    from boulder_sweep.judge.evaluation import by_kernels
    from boulder_sweep.runner.sweeper import run

    # Lists, because appending from several threads at once loses nothing.
    designs: list[int] = []
    threads: list[str] = []
    written: list[int] = []
    flushed: list[int] = []
    start, write, fsync = threading.Thread.start, os.write, os.fsync

    def simulate(table: Any, *others: Any) -> Any:
        if threading.current_thread().name != PREPARING:
            designs.append(len(table.L))
        return by_kernels(table, *others)

    def noted_start(thread: threading.Thread) -> None:
        threads.append(thread.name)
        start(thread)

    def noted_write(descriptor: int, content: bytes) -> int:
        written.append(write(descriptor, content))
        return written[-1]

    def noted_fsync(descriptor: int) -> None:
        flushed.append(descriptor)
        fsync(descriptor)

    sweep, table = loaded(folder), folder / "table"
    with (
        patch.object(threading.Thread, "start", noted_start),
        patch.object(os, "write", noted_write),
        patch.object(os, "fsync", noted_fsync),
    ):
        run(sweep, table, jobs=JOBS, commit_every_s=float("inf"), simulate=simulate)
    return {
        "designs simulated in a run": sum(designs),
        "threads started by a run": len(threads),
        "files of a table": len(list(table.iterdir())),
        "bytes written by a run": sum(written),
        "flushes to the disk by a run": len(flushed),
    }
