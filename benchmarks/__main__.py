"""Run all benchmarks and write their tables into the README: ``python -m benchmarks``; takes about eight minutes.

Some tables contain wall times, so the machine should be otherwise idle.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

from . import accuracy, intervals, kernel, named, rates, sweep
from .designs import DESIGNS
from .peers.__main__ import measure_with
from .report import Table, write_between_markers

NAMES = ("kernel", "rates", "accuracy", "named", "sweep", "intervals", "peers")


def _accuracy() -> list[Table]:
    points = accuracy.measure()
    accuracy.write(points)
    return accuracy.tables(points, DESIGNS)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--peers-python", help="interpreter of an environment with benchmarks/requirements-peers.txt")
    parser.add_argument("--large", action="store_true", help="a sweep of 10^7 designs, too: minutes more")
    parser.add_argument("--only", nargs="+", choices=NAMES, help="only these")
    arguments = parser.parse_args()
    works: dict[str, Callable[[], list[Table]]] = {
        "kernel": lambda: [kernel.measure()],
        "rates": lambda: [rates.measure()],
        "accuracy": _accuracy,
        "named": lambda: [named.measure()],
        "sweep": lambda: sweep.measure(large=arguments.large),
        "intervals": lambda: [intervals.measure()[0]],
        "peers": lambda: [measure_with(arguments.peers_python, write=True)],
    }
    for name in arguments.only or works:
        begun = time.monotonic()
        tables = works[name]()
        write_between_markers(tables)
        print(f"{name}: {time.monotonic() - begun:.0f} s", file=sys.stderr)
        for table in tables:
            print(table.markdown(), end="\n\n")


if __name__ == "__main__":
    main()
