"""Two results of designs that share inputs: which verdicts changed and why, least depth and mass before and after."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from boulder_sweep.answers.need import Need
from boulder_sweep.answers.outputs import MARKS, NEED, RUN, UNCERTAINTY, AnswerFile, answered, result_of
from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.errors import ReportError
from boulder_sweep.locations import Location, location_of
from boulder_sweep.settings.sweep import IMPACT_HEIGHT_RULE, units_in
from boulder_sweep.settings.units import SYSTEMS
from boulder_sweep.store.provenance import differences
from boulder_sweep.store.reading import FinishedRows, read
from boulder_sweep.text import counted
from boulder_sweep.views.wording import RATIO, name_of, unit_of

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
        Designs of both results: inputs, and outcomes with ``_before`` and ``_after`` behind their names; so have the
        inputs in `differ`, those that follow from other inputs, and the mass.
    differ : tuple of str
        Columns of inputs of which the two results have no value in common. Designs are matched by all others, and
        their values of these in order.
    varying : tuple of str
        Columns of the given inputs that tell designs of one result apart.
    only_before, only_after : int
        Designs without a counterpart in the other result.
    changed : tuple of str
        Settings, versions and hashes that differ, one line each.
    judged_by : tuple of str
        Whose rules judged each of the two; empty where this version's did.
    least : dict
        ``mass_kg`` and ``depth_m``: the least of a design that passes, before and after; None where none does.
    kind : str
        The command that wrote both results.
    answers : dict of str to str
        Columns of answers, each with its unit; none for the results of runs.
    units : str
        In which the later result is shown, ``si`` or ``us``.
    """

    matched: pd.DataFrame
    differ: tuple[str, ...]
    varying: tuple[str, ...]
    only_before: int
    only_after: int
    changed: tuple[str, ...]
    judged_by: tuple[str, str]
    least: dict[str, tuple[float | None, float | None]]
    kind: str = RUN
    answers: Mapping[str, str] = field(default_factory=dict)
    units: str = SYSTEMS[0]

    @property
    def flipped(self) -> pd.DataFrame:
        """Designs whose verdict changed, sorted by change of rotation, largest first."""
        table = self.matched[self.matched.verdict_before != self.matched.verdict_after]
        change = (table.max_rotation_deg_after - table.max_rotation_deg_before).abs()
        return table.loc[change.sort_values(ascending=False, kind="stable").index]

    def turned(self) -> dict[str, int]:
        """Return how many matched designs pass before, how many of these no longer do, and how many others do now."""
        before, after = (self.matched[f"verdict_{when}"] == "pass" for when in ("before", "after"))
        counts = {"passes": before, "passes_lost": before & ~after, "passes_gained": after & ~before}
        return {name: int(mask.sum()) for name, mask in counts.items()}

    def moved(self, name: str) -> pd.Series:
        """Return by how much an answer changed in the designs where it did, largest change first."""
        change = (self.matched[f"{name}_after"] - self.matched[f"{name}_before"]).dropna()
        change = change[change != 0.0]
        return change.loc[change.abs().sort_values(ascending=False, kind="stable").index]

    def values(self, name: str) -> list[tuple[float, float]]:
        """Return the pairs of values of an input that differs, before and after, in order."""
        return sorted(set(zip(self.matched[f"{name}_before"], self.matched[f"{name}_after"], strict=True)))

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
            "differ": list(self.differ),
            **self.turned(),
            "flipped": len(self.flipped),
            "flips": self.flips(),
            "least": {name: list(pair) for name, pair in self.least.items()},
            **({"answers": {name: self._moves(name) for name in self.answers}} if self.answers else {}),
            "changed": list(self.changed),
            "judged_by": list(self.judged_by),
        }

    def _moves(self, name: str) -> dict[str, Any]:
        """Return how many values of an answer are larger, smaller and equal after, and the ends of the change."""
        both = int((self.matched[f"{name}_before"].notna() & self.matched[f"{name}_after"].notna()).sum())
        change = self.moved(name)
        counts = {"larger": int((change > 0).sum()), "smaller": int((change < 0).sum()), "equal": both - len(change)}
        ends = (float(change.min()), float(change.max())) if len(change) else (0.0, 0.0)
        return {**counts, "least_change": ends[0], "largest_change": ends[1], "unit": self.answers[name]}


def compare(before: str | Location, after: str | Location) -> Comparison:
    """Compare two results, design by design.

    Parameters
    ----------
    before, after
        Folders that a sweep wrote, or two files of answers of one command. Designs are matched by their inputs,
        whatever their order. An input of which the two have no value in common is left out of that, and its values are
        matched in order, the least with the least.

    Returns
    -------
    Comparison
        Of all finished rows.

    Raises
    ------
    ReportError
        No design of one has a counterpart in the other, or two commands wrote them.
    StoreError
        There is no result in a folder, or it is damaged.
    """
    locations = [location_of(folder) for folder in (before, after)]
    one, other = (result_of(location, ReportError) for location in locations)
    asked = [_asked(result) for result in (one, other)]
    if asked[0][:2] != asked[1][:2]:
        said = [
            f"{name} is of `sweep {question.command}` ({', '.join(question.answers) or 'verdicts'})"
            for name, question in zip((before, after), asked, strict=True)
        ]
        raise ReportError(f"{' and '.join(said)}: compare two results of one command and question")
    answers, searched = asked[0].answers, {*asked[0].searched, *asked[1].searched}
    tables = [_table(location, result, answers) for location, result in zip(locations, (one, other), strict=True)]
    follow = _following(one.identity["settings"]["inputs"], other.identity["settings"]["inputs"])
    names = [name for name in (*INPUT_COLUMNS, RATIO) if name not in (*follow, *searched)]
    differ = [name for name in names if not set(tables[0][_key(name)]) & set(tables[1][_key(name)])]
    as_many = _values_in_order(tables, differ)
    same = [name for name in names if name not in differ]
    shared = [_key(name) for name in same] + ["rank"]
    for table in tables:
        table["nth"] = table.groupby(shared).cumcount()  # repeated designs
    matched = tables[0].merge(tables[1].drop(columns=same), on=[*shared, "nth"], suffixes=("_before", "_after"))
    if matched.empty or not as_many:
        raise ReportError(f"{before} and {after} have no design in common{_apart(tables, differ)}")
    passing = [table[table.verdict == "pass"] for table in tables]
    return Comparison(
        matched=matched.drop(columns=[name for name in matched if name.startswith("key_")] + ["rank", "nth"]),
        differ=tuple(differ),
        varying=tuple(name for name in names if any(len(set(table[_key(name)])) > 1 for table in tables)),
        only_before=len(tables[0]) - len(matched),
        only_after=len(tables[1]) - len(matched),
        changed=tuple(differences(_whole_identity(one), _whole_identity(other))),
        judged_by=(one.judged_by, other.judged_by),
        least={
            "mass_kg": (_least(passing[0].mass_kg), _least(passing[1].mass_kg)),
            "depth_m": (_least(passing[0].embedment_depth_m), _least(passing[1].embedment_depth_m)),
        },
        kind=asked[0].command,
        answers=answers,
        units=units_in(other.identity["settings"]),
    )


def _whole_identity(result: FinishedRows | AnswerFile) -> dict[str, Any]:
    """Return what decided the rows of a result, and what was asked."""
    return result.identity | ({"question": result.question} if isinstance(result, AnswerFile) else {})


class Query(NamedTuple):
    """What a result answers: the command, the columns of its answers with their units, the inputs searched for."""

    command: str
    answers: dict[str, str]
    searched: tuple[str, ...]


def _asked(result: FinishedRows | AnswerFile) -> Query:
    """Return what a result answers."""
    if not isinstance(result, AnswerFile):
        return Query(RUN, {}, ())
    if result.kind == NEED:
        need = result.answers()
        assert isinstance(need, Need)
        return Query(NEED, {need.key.answer: need.key.field.unit}, (need.key.name, *need.derived))
    names = MARKS[result.kind][: 1 if result.kind == UNCERTAINTY else None]
    units = {name: (result.table.schema.field(name).metadata or {}).get(b"unit", b"") for name in names}
    return Query(result.kind, {name: unit.decode() for name, unit in units.items()}, ())


def _table(location: Location, result: FinishedRows | AnswerFile, answers: Iterable[str]) -> pd.DataFrame:
    """Read a result with the keys for matching."""
    columns = ["design_id", *INPUT_COLUMNS, *OUTCOMES, "solidity", *answers]
    if isinstance(result, AnswerFile):
        table = (answered(result.table) if result.kind == NEED else result.table).select(columns).to_pandas()
    else:
        table = read(location, columns)
    for name in ("verdict", "reason"):
        table[name] = table[name].astype(str)
    table["mass_kg"] = table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
    table["mass_kg"] *= table.solidity.fillna(1.0)  # unknown of rows that cannot be computed
    table[RATIO] = table.embedment_depth_m / table.boulder_height_m
    for name in (*INPUT_COLUMNS, RATIO, "mass_kg"):
        table[_key(name)] = table[name].map({value: f"{value:.{DIGITS}g}" for value in table[name].unique()})
    table[RATIO] = table[_key(RATIO)].astype(float)
    return table


def _key(name: str) -> str:
    return f"key_{name}"


def _following(*inputs: Mapping[str, Any]) -> list[str]:
    """Return the columns that follow from others in both results, by what their settings give."""
    columns = ["embedment_depth_m" if all(RATIO in given for given in inputs) else RATIO]
    if all(given.get("impact_height_m") == IMPACT_HEIGHT_RULE for given in inputs):
        columns.append("impact_height_m")
    return columns


def _values_in_order(tables: Sequence[pd.DataFrame], differ: Sequence[str]) -> bool:
    """Number the values of the inputs that differ, in order, as the column ``rank``; whether both have as many."""
    for table in tables:
        table["rank"] = table.groupby(list(differ)).ngroup() if differ else 0
    counts = [[table[name].nunique() for name in (*differ, "rank")] for table in tables]
    return counts[0] == counts[1]


def _apart(tables: Sequence[pd.DataFrame], differ: Sequence[str]) -> str:
    """Say why two results have no design in common, and what helps."""
    if not differ:
        return ": every single value occurs in both, but no design does"
    reasons = []
    for name in differ:
        unit = f" {unit_of(name)}".rstrip()
        held = [
            f"{counted(table[name].nunique(), 'value')} ({table[name].min():.6g} to {table[name].max():.6g}{unit})"
            for table in tables
        ]
        reasons.append(f"{name_of(name)} has {held[0]} in one and {held[1]} in the other")
    return (
        f": {'; '.join(reasons)}. Values that differ are paired in order, so give both as many of them, or one value "
        f"in common"
    )


def _least(values: pd.Series) -> float | None:
    return float(values.min()) if len(values) else None
