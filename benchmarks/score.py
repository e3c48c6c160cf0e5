"""Score results against the reference solutions of the open benchmark: ``python -m benchmarks.score [RESULTS]``.

RESULTS is a table of any solver, a Parquet file or a folder of them, with the column ``design_id`` and any of the
columns of the reference; without it the named accuracies of boulder-sweep are run and scored. A design overturns where
``time_to_limit_s`` has a value. Exit code 1 if a design is missing, or on the wrong side of the limit.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from .boulders import FILE, REFERENCE
from .report import Table, significant, write_between_markers

SETTINGS = """
name: boulders
table: designs.parquet
criterion: {max_rotation: 20 deg, min_overlap: 0 m}
solver: {horizon: 1 s}
"""
ACCURACIES = ("fast", "balanced", "fine")
SHOWN = {
    "max_rotation_deg": ("largest rotation [deg]", 1.0),
    "max_displacement_m": ("displacement of the boulder [mm]", 1e3),
    "max_vehicle_displacement_m": ("of the vehicle [mm]", 1e3),
    "peak_force_kN": ("peak force [%]", 1e2),
    "time_to_limit_s": ("time to the limit [ms]", 1e3),
}
"""Headings of differences, and the factors to their units; forces are compared by their ratio."""


def by_design(results: pd.DataFrame, reference: pd.DataFrame) -> pd.DataFrame:
    """Return the columns of the reference that results have, a row for each design of the reference.

    Raises
    ------
    SystemExit
        In words, where the results cannot be matched with the reference.
    """
    if "design_id" not in results:
        raise SystemExit("the results have no column design_id")
    if results.design_id.duplicated().any():
        raise SystemExit(f"design_id {int(results.design_id[results.design_id.duplicated()].iloc[0])} occurs twice")
    known = [name for name in REFERENCE if name in results]
    if "time_to_limit_s" not in known:
        raise SystemExit("the results have no column time_to_limit_s, by which a design overturns or stands")
    return results.set_index("design_id")[known].reindex(reference.design_id)


def score(results: pd.DataFrame, reference: pd.DataFrame) -> dict[str, float]:
    """Compare results with the reference.

    Parameters
    ----------
    results
        Table of a solver with ``design_id`` and any of `REFERENCE`.
    reference
        The file of the benchmark.

    Returns
    -------
    dict
        ``missing``: designs without a row or a rotation; ``unsafe``: designs that overturn and stand in the results;
        ``overcautious``: the reverse; and for each column the largest difference and that which 99 % of the designs
        stay below, in the column's unit, of forces relative to the reference, over the designs on the right side of
        the limit.
    """
    rows, truth = by_design(results, reference), reference.set_index("design_id")
    missing = ~reference.design_id.isin(results.design_id).to_numpy()
    if "max_rotation_deg" in rows:
        missing = missing | rows.max_rotation_deg.isna().to_numpy()
    falls, fell = truth.time_to_limit_s.notna().to_numpy(), rows.time_to_limit_s.notna().to_numpy()
    scores = {
        "missing": float(missing.sum()),
        "unsafe": float((falls & ~fell & ~missing).sum()),
        "overcautious": float((~falls & fell & ~missing).sum()),
    }
    for name in rows:
        off = np.abs(rows[name] - truth[name]) / (truth[name] if name == "peak_force_kN" else 1.0)
        off = off[(falls == fell) & ~missing].dropna()
        scores |= {f"{name} 99 %": float(off.quantile(0.99)), f"{name} largest": float(off.max())}
    return scores


def read(path: Path) -> pd.DataFrame:
    """Read results: a Parquet file, or a folder of parts."""
    if not path.exists():
        raise SystemExit(f"{path}: no such file or folder")
    return pd.read_parquet(path)


def own_results(accuracy: str, reference: pd.DataFrame) -> pd.DataFrame:
    """Run the designs of the benchmark as a user would, with a named accuracy."""
    import boulder_sweep

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        reference.drop(columns=["design_id", *REFERENCE]).to_parquet(folder / "designs.parquet")
        (folder / "grid.yaml").write_text(SETTINGS)
        sweep = boulder_sweep.load(folder / "grid.yaml", overrides=[f"solver.accuracy={accuracy}"])
        boulder_sweep.run(sweep, folder / "boulders.sweep")
        return boulder_sweep.read(folder / "boulders.sweep")


def scores_table(scores: dict[str, dict[str, float]]) -> Table:
    """Return scores of several solvers, a row each: 99 % and the largest of every difference."""
    names = [name for name in REFERENCE if any(f"{name} largest" in one for one in scores.values())]
    header = ["results", "missing", "unsafe", "overcautious"]
    header += [SHOWN[name][0] for name in names]
    table = Table(
        "score",
        "Differences from the reference: 99 % of the designs stay below the first number, all below the second",
        "272 impacts of `benchmarks/boulders/boulders.parquet`",
        header,
    )
    for solver, one in scores.items():
        row = [solver, *(f"{one[name]:.0f}" for name in ("missing", "unsafe", "overcautious"))]
        for name in names:
            pair = [one.get(f"{name} {which}", np.nan) * SHOWN[name][1] for which in ("99 %", "largest")]
            row.append(" / ".join(significant(value, 1) for value in pair))
        table.rows.append(row)
    return table


def main(arguments: list[str]) -> int:
    """Score what is asked for; return the exit code."""
    reference = pd.read_parquet(FILE)
    if arguments:
        scores = {path: score(read(Path(path)), reference) for path in arguments}
    else:
        scores = {f"`{accuracy}`": score(own_results(accuracy, reference), reference) for accuracy in ACCURACIES}
    table = scores_table(scores)
    print(table.markdown())
    if not arguments:
        write_between_markers([table])
    return int(any(one["missing"] or one["unsafe"] or one["overcautious"] for one in scores.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
