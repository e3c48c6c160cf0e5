"""What the command line shows on stdout: short tables."""

from __future__ import annotations

import shlex
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from boulder_sweep.columns import BY_NAME, VERDICTS, WAY_OUT
from boulder_sweep.settings.fields import TO_BE_FOUND
from boulder_sweep.settings.model import FOOT_WORDS
from boulder_sweep.settings.units import ShownColumn, shown_column, shown_settings, shown_unit
from boulder_sweep.stones.rock import ROCK_KG_M3
from boulder_sweep.text import counted, duration_text, size_text

if TYPE_CHECKING:
    from boulder_sweep.locations import Location
    from boulder_sweep.runner.progress import Estimate, Summary
    from boulder_sweep.settings import Sweep


def grid_lines(sweep: Sweep) -> list[str]:
    """Return a description of the designs: how many, and over which axes."""
    count = counted(sweep.n_designs, "design")
    soil = sweep.model.ground.words_in(shown_unit("m", sweep.units), shown_unit("kPa", sweep.units))
    ground = [f"  {words}" for words in (soil, sweep.model.shape.words) if words]
    if sweep.depth_sought:
        ground.insert(0, f"  {shown_column('embedment_depth_m', sweep.units).name:<26}{TO_BE_FOUND:>15}")
    if sweep.table is not None:
        carried = f", with {', '.join(sweep.table.labels)}" if sweep.table.labels else ""
        return [f"{sweep.name}: {count} from {sweep.table.file}{carried}", *_uncertain_lines(sweep), *ground]
    lines = [f"{sweep.name}: {count}"]
    for axis in sweep.axes:
        if axis.labels:
            name, noun, words = axis.name, "set", ", ".join(axis.labels)
        else:
            plain = ShownColumn(axis.name, "", 1.0, "")
            shown = shown_column(axis.name, sweep.units) if axis.name in BY_NAME else plain
            least, largest = (f"{end / shown.size:g}" for end in (min(axis.values), max(axis.values)))
            unit = "" if shown.unit in ("", "1") else f" {shown.unit}"
            name, noun = shown.name, "value"
            words = (f"{least} to {largest}" if len(axis) > 1 else least) + unit
        plural = "" if len(axis) == 1 else "s"
        lines.append(f"  {name:<26}{len(axis):>9,} {noun + plural:<8}{words}")
    return [*lines, *_uncertain_lines(sweep), *ground]


def _uncertain_lines(sweep: Sweep) -> list[str]:
    """Return one line for each input that has a distribution."""
    lines = []
    for name, spread in sweep.distributions.items():
        shown = shown_column(name, sweep.units)
        mean = f", mean {sweep.constants[name] / shown.size:.4g}" if name in sweep.constants else ""
        lines.append(f"  {shown.name:<26}uncertain         {spread.words(shown.unit, shown.size)}{mean}")
    return lines


def summary_lines(name: str, summary: Summary) -> list[str]:
    """Return the result of a finished run, where it is and how to open it."""
    return [
        f"{name}: {counted(summary.rows, 'design')}",
        f"  {summary.rows_computed:,} simulated now in {duration_text(summary.seconds)}: "
        f"{summary.rows_per_second:,.0f} per second, {counted(summary.jobs, 'worker')}, {summary.backend}",
        "",
        *verdict_lines(summary.reasons, summary.rows),
        "",
        *robustness_lines(summary.reasons),
        *foot_lines(summary.boulder, summary.reasons),
        accuracy_line(summary.accuracy),
        f"table  {summary.out} ({counted(summary.parts, 'file')}, {size_text(summary.bytes)})",
        f"open   boulder_sweep.read({str(summary.out)!r})",
        f"       pandas.read_parquet({str(summary.out)!r})",
        f"       duckdb: FROM read_parquet('{summary.out}/*.parquet')",
        f"share  {shlex.join(['sweep', 'report', str(summary.out)])}",
    ]


def robustness_lines(reasons: Mapping[str, int]) -> list[str]:
    """Return what ``robust`` means, and how to ask where that is open; nothing where nothing passes."""
    from boulder_sweep.judge.robustness import IN_WORDS  # only where there is a result: the kernels are heavy
    from boulder_sweep.judge.validity import NOT_A_RATING

    if not any(key.startswith("pass/") for key in reasons):
        return []
    lines = [f"pass   is {NOT_A_RATING}", *_indented(f"robust: {IN_WORDS}")]
    if "pass/open" in reasons:
        lines += _indented("open: not asked, or outside the ranges of their study (docs/confidence.md)")
    return lines


def foot_lines(boulder: Mapping[str, Any], reasons: Mapping[str, int]) -> list[str]:
    """Return on which foot the boulders stand, of what rock if that is assumed, and what to do about their reasons."""
    lines = [FOOT_WORDS[boulder["foot"]].replace("foot: ", "foot   ")] if boulder else []
    if boulder.get("rock_assumed"):
        lines.append(f"rock   {ROCK_KG_M3:g} kg/m^3 assumed (boulder.density); no pass is robust")
    for reason, advice in WAY_OUT.items():
        if f"undecided/{reason}" in reasons or f"fail/{reason}" in reasons:
            lines += _indented(f"{reason}: {advice}")
    return lines


def _indented(text: str) -> list[str]:
    return textwrap.wrap(text, 80, initial_indent=7 * " ", subsequent_indent=7 * " ")


def accuracy_line(accuracy: Mapping[str, Any]) -> str:
    """Return the accuracy of a sweep."""
    steps = f"step {1e3 * accuracy['step_s']:g} ms"
    if accuracy["reported_step_s"] != accuracy["step_s"]:
        steps += f" and {1e3 * accuracy['reported_step_s']:g} ms"
    if accuracy["yield_located"]:
        steps += ", yield located"
    return f"steps  {accuracy['asked']}: {steps}, verdicts {accuracy['verdicts']}"


def dry_run_lines(sweep: Sweep, out: Location, effort: Estimate, objection: str) -> list[str]:
    """Return what a run would do, and the time and space it needs."""
    return [
        *grid_lines(sweep),
        "",
        *value_lines(shown_settings(sweep.resolved(), sweep.units)),
        "",
        f"would simulate {effort.rows_to_compute:,} of {counted(effort.rows, 'design')} into {out}",
        f"about {duration_text(effort.seconds)} with {counted(effort.jobs, 'worker')}, "
        f"{size_text(effort.disk_bytes)} on disk",
        *(f"damaged: {name}: {what}" for name, what in effort.damaged.items()),
        *([f"does not fit: {objection}"] if objection else []),
    ]


def verdict_lines(reasons: Mapping[str, int], rows: int) -> list[str]:
    """Return one line per verdict with its reasons; `reasons` counts rows by ``verdict/reason``."""
    lines = []
    for verdict in VERDICTS:
        of_verdict = {key: count for key, count in reasons.items() if key.split("/")[0] == verdict}
        total = sum(of_verdict.values())
        named = {key.partition("/")[2]: count for key, count in of_verdict.items() if "/" in key and count}
        detail = ", ".join(f"{reason} {count:,}" for reason, count in sorted(named.items(), key=lambda i: -i[1]))
        lines.append(f"  {verdict:<10}{total:>13,}{total / max(rows, 1):>8.1%}   {detail}".rstrip())
    return lines


def value_lines(values: Mapping[str, Any], indent: str = "") -> list[str]:
    """Return one line per name and value; the names include the units."""
    lines = []
    width = max((len(name) for name in values), default=0) + 2
    for name, value in values.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{name}", *value_lines(value, indent + "  ")]
        else:
            lines.append(f"{indent}{name:<{width}}{_shown(value)}".rstrip())
    return lines


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        shown = [_shown(item) for item in value]
        return ", ".join(shown if len(shown) <= 8 else [*shown[:3], "...", *shown[-2:]])
    return str(value)
