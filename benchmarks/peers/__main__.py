"""Compare with other solvers: ``python -m benchmarks.peers``.

The packages of ``benchmarks/requirements-peers.txt`` are best installed in a separate environment; give its
interpreter with ``--python``. The table lists what is not installed.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
from pathlib import Path

from ..designs import DESIGNS, sample
from ..report import FIGURES, FOLDER, Table, as_json, from_json, significant
from ..timing import machine, versions
from .compare import ACCURACY_DEG, Measured, finite, measure_all
from .problem import problem_of

PACKAGES = ("numba", "numpy", "scipy", "numbalsoda", "diffrax", "jax", "heyoka")


def measure(count: int = DESIGNS) -> tuple[Table, dict[str, list[tuple[float, float]]]]:
    """Measure in this interpreter: the table, and the points of the figure by solver."""
    problem = problem_of(sample(count))
    measured, missing = measure_all(problem)
    table = Table(
        "peers",
        f"Other solvers at the same accuracy: largest error of the largest rotation at most {ACCURACY_DEG:g} deg",
        f"{machine()}; {versions(*PACKAGES)}; corrected readings; CPU time of all threads; each solver has the first "
        "designs of the same sample, its loosest tolerance that is accurate enough on them, and then the fewest output "
        "times that are",
        ["solver", "designs", "tolerance (step)", "output times", "error", "CPU time per design", "over the lanes"],
    )
    table.rows = [_row(each, measured[0]) for each in measured]
    table.notes = [
        "The others get the end time of each design; the lanes find it themselves. Peaks of the others are "
        "taken from the states at their output times by quintic polynomials, uncounted; the figure shows them with 65.",
        "The accuracy is easier to reach with fewer designs, which favours solvers with a small sample.",
        *missing,
        *(f"{each.name}: {each.problem}" for each in measured if each.problem),
    ]
    return table, {each.name: finite(each.points) for each in measured}


def _row(each: Measured, kernels: Measured) -> list[str]:
    own, lanes = each.chosen, kernels.chosen
    if own is None or lanes is None:
        best = min(each.points, key=lambda point: point[2])
        return [each.name, str(each.designs), "none", "", f"{significant(best[2])} deg at best", "", "not comparable"]
    tolerance, cost, error = own
    shown = f"{1e3 * tolerance:.2g} ms" if each.in_steps else f"{tolerance:.0e}"
    return [
        each.name,
        str(each.designs),
        shown,
        str(each.outputs or "none"),
        f"{significant(error)} deg",
        f"{1e6 * cost:.3g} us" if cost < 1e-2 else f"{1e3 * cost:.3g} ms",
        "1" if each is kernels else f"{cost / lanes[1]:,.0f}",
    ]


def measure_with(python: str | None, *, write: bool) -> Table:
    """Measure in another interpreter, or in this one; draw the figure if wanted.

    Parameters
    ----------
    python
        An interpreter that has the packages; None for this one.
    write
        Whether to write the figure.
    """
    if python is None:
        table, series = measure()
    else:
        root = FOLDER.parent
        # The kernels come from the source tree: both sides are timed in one process.
        path = os.pathsep.join([str(root), str(root / "kernels"), *filter(None, [os.environ.get("PYTHONPATH")])])
        output = subprocess.run(
            [python, "-m", "benchmarks.peers", "--json"],
            cwd=root,
            env=os.environ | {"PYTHONPATH": path},
            check=True,
            stdout=subprocess.PIPE,
            text=True,
        ).stdout
        text, series = json.loads(output)
        (table,) = from_json(text)
    if write:
        from ..plots import plot_peers

        FIGURES.mkdir(exist_ok=True)
        plot_peers(series, Path(FIGURES / "peers.png"), ACCURACY_DEG)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("--python", help="interpreter of an environment that has the packages")
    parser.add_argument("--write", action="store_true", help="write the figure into benchmarks/figures")
    parser.add_argument("--json", action="store_true", help="print table and points as JSON")
    arguments = parser.parse_args()
    if arguments.json:
        table, series = measure()
        print(json.dumps([as_json([table]), series]))
    else:
        print(measure_with(arguments.python, write=arguments.write).markdown())


if __name__ == "__main__":
    main()
