"""Two results of the same designs: which verdicts changed and why, the least depth and mass before and after."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.locations import Location, RemotePath, location_of
from boulder_sweep.store.finished import FinishedRows
from boulder_sweep.store.provenance import differences
from boulder_sweep.store.reader import read

if TYPE_CHECKING:
    import pandas as pd

OUTCOMES = ("verdict", "reason", "margin", "max_rotation_deg")
DIGITS = 12
"""Inputs that agree to this many digits are the same; unit conversions may change the last one."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """What `compare` found.

    Attributes
    ----------
    matched : DataFrame
        Designs of both results: inputs, and outcomes with ``_before`` and ``_after`` behind their names.
    only_before, only_after : int
        Designs without a counterpart in the other result.
    changed : tuple of str
        Settings, versions and hashes that differ, one line each.
    judged_by : tuple of str
        By whose rules each of the two was judged; empty where by those of this version.
    least : dict
        ``mass_kg`` and ``depth_m``: the least of a design that passes, before and after; None where none does.
    """

    matched: pd.DataFrame
    only_before: int
    only_after: int
    changed: tuple[str, ...]
    judged_by: tuple[str, str]
    least: dict[str, tuple[float | None, float | None]]

    @property
    def flipped(self) -> pd.DataFrame:
        """Designs whose verdict changed, sorted by change of rotation, largest first."""
        table = self.matched[self.matched.verdict_before != self.matched.verdict_after]
        change = (table.max_rotation_deg_after - table.max_rotation_deg_before).abs()
        return table.loc[change.sort_values(ascending=False, kind="stable").index]

    def flips(self) -> dict[str, int]:
        """Return the number of designs for each change of verdict and reason."""
        table = self.flipped
        words = [
            table[f"verdict_{when}"] + table[f"reason_{when}"].map(lambda why: f" ({why})" if why else "")
            for when in ("before", "after")
        ]
        counts = (words[0] + " -> " + words[1]).value_counts()
        return {str(change): int(count) for change, count in counts.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the designs as plain data."""
        return {
            "matched": len(self.matched),
            "only_before": self.only_before,
            "only_after": self.only_after,
            "flipped": len(self.flipped),
            "flips": self.flips(),
            "least": {name: list(pair) for name, pair in self.least.items()},
            "changed": list(self.changed),
            "judged_by": list(self.judged_by),
        }


def compare(before: str | Path | RemotePath, after: str | Path | RemotePath) -> Comparison:
    """Compare two results, design by design.

    Parameters
    ----------
    before, after
        Folders that a sweep wrote. Designs are matched by their inputs, whatever their order.

    Returns
    -------
    Comparison
        Of all finished rows.

    Raises
    ------
    StoreError
        There is no result in a folder, or it is damaged.
    """
    tables = [_table(location_of(folder)) for folder in (before, after)]
    keys = [f"key_{name}" for name in INPUT_COLUMNS]
    matched = tables[0].merge(
        tables[1].drop(columns=[*INPUT_COLUMNS, "mass_kg"]), on=[*keys, "nth"], suffixes=("_before", "_after")
    )
    one, other = (FinishedRows(location_of(folder)) for folder in (before, after))
    passing = [table[table.verdict == "pass"] for table in tables]
    return Comparison(
        matched=matched.drop(columns=[*keys, "nth"]),
        only_before=len(tables[0]) - len(matched),
        only_after=len(tables[1]) - len(matched),
        changed=tuple(differences(one.identity, other.identity)),
        judged_by=(one.judged_by, other.judged_by),
        least={
            "mass_kg": (_least(passing[0].mass_kg), _least(passing[1].mass_kg)),
            "depth_m": (_least(passing[0].embedment_depth_m), _least(passing[1].embedment_depth_m)),
        },
    )


def _table(folder: Location) -> pd.DataFrame:
    """Read a result with the keys for matching; repeated designs are numbered."""
    table = read(folder, ["design_id", *INPUT_COLUMNS, *OUTCOMES])
    for name in ("verdict", "reason"):
        table[name] = table[name].astype(str)
    for name in INPUT_COLUMNS:
        table[f"key_{name}"] = table[name].map({value: f"{value:.{DIGITS}g}" for value in table[name].unique()})
    table["nth"] = table.groupby([f"key_{name}" for name in INPUT_COLUMNS]).cumcount()
    table["mass_kg"] = table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
    return table


def _least(values: pd.Series) -> float | None:
    return float(values.min()) if len(values) else None
