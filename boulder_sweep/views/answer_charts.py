"""Charts of answers: over the size of the boulder, a curve for each soil, and the chances of one design.

Of `need` the least that passes, with a band between readings; of `capacity` what designs withstand; of `uncertainty`
the probability of passing, and of one design which draws pass over the two inputs that decide most, and what each input
does to the chance.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from boulder_sweep.answers.advice import advice
from boulder_sweep.columns import BY_NAME as COLUMNS
from boulder_sweep.columns import INPUT_COLUMNS, OPTIONAL_COLUMNS
from boulder_sweep.errors import PictureError
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.text import chance_text
from boulder_sweep.views import pictures
from boulder_sweep.views.pictures import AMBER, BLACK, BLUE, GREEN, GREY, LIGHT_GREY, ORANGE, PALE_ORANGE, PURPLE, SKY
from boulder_sweep.views.wording import (
    RATIO,
    USUAL,
    keep_together,
    label,
    name_of,
    size_of,
    sized,
    terms_line,
    value_text,
    with_unit,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from boulder_sweep.answers.need import Need
    from boulder_sweep.answers.reserves import Reserves
    from boulder_sweep.answers.uncertainty import Uncertainty
    from boulder_sweep.settings import Sweep

ACROSS = (
    *("boulder_height_m", "boulder_width_m", "boulder_length_m", "impact_speed_m_s", "vehicle_mass_kg"),
    *(RATIO, "embedment_depth_m", "friction_angle_deg", "subgrade_reaction_MN_m3"),
)
CURVES = ("friction_angle_deg", "subgrade_reaction_MN_m3", "boulder_width_m", "impact_speed_m_s")
"""What is across and what tells curves apart: the first of each that varies."""
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER, BLACK)
"""Colours of as many curves as there are of values; of more named soils or vehicles the dashes differ."""
ANSWERS = {
    "withstands_speed_m_s": ("largest impact speed", "m/s"),
    "withstands_mass_kg": ("largest mass of the truck", "kg"),
    "withstands_friction_angle_deg": ("smallest friction angle", "deg"),
    "p_pass": ("probability of passing", "1"),
}
"""Columns of answers that are drawn, each with its words and unit."""
DASHES = ("-", "--", "-.", (0, (1, 1)))
FIFTHS = 5
LEAST_RANGE = 0.01
"""Least width of the axis of probabilities."""


def draw_design_chart(need: Need, path: str | Path, *, units: str = "si") -> None:
    """Draw the answers to a question; refused where nothing varies, or there is no answer to draw."""
    frame, sets, across, over, held = _shown(need.sweep, need.frame, (need.key.name, *need.derived))
    if frame[need.key.answer].isna().all():
        raise PictureError("there is nothing to draw: nothing passes in the range that was searched")
    with pictures.figure(path, 7.2, 4.8) as fig:
        axes = fig.subplots()
        passing = frame if over is None else frame[frame[over].isin(frame[over][frame[need.key.answer].notna()])]
        for words, rows, style in _curves(passing, over, sets, units):
            if len(rows):
                _curve(axes, need, rows.sort_values(across), across, style, words, units)
        _across(axes, frame, across, units)
        axes.set_ylabel(with_unit(_words(need), sized(need.key.field.unit, units)[0]))
        _mark(axes, need, across, held, units)
        axes.legend(loc="best")
        pictures.headline(fig, f"{need.sweep.name}: {_title(need)}")
        parts = [
            f"{name}: {one}" if isinstance(one, str) else value_text(name, one, units) for name, one in held.items()
        ]
        if need.least_margin:
            parts.append(f"margin {need.least_margin:.0%} or more")
        parts.append("hollow: passes in the whole range searched; no point: nothing passes")
        pictures.caption(fig, "\n".join([*advice(need, units)[:1], "; ".join(parts)]))


def draw_answers(answers: Reserves | Uncertainty, path: str | Path, *, units: str = "si") -> None:
    """Draw what several designs withstand, or their probabilities of passing with the intervals.

    Refused where nothing varies.
    """
    names = {name: spec for name, spec in ANSWERS.items() if name in answers.arrow.column_names}
    given, listed = answers.sweep.plan.given, answers.sweep.table is not None
    derived = [name for name in ("embedment_depth_m", "impact_height_m") if name not in given]
    what = "what designs withstand" if len(names) > 1 else "probability of passing"
    # The designs of a list stand side by side.
    shown = (
        ChartRows(answers.frame, {}, "design_id", None, {}) if listed else _shown(answers.sweep, answers.frame, derived)
    )
    frame, sets, across, over, held = shown
    with pictures.figure(path, 3.4 * len(names) + 1.6 * (len(names) == 1), 4.0) as fig:
        panels = fig.subplots(1, len(names), squeeze=False)[0]
        for axes, (name, (words, unit)) in zip(panels, names.items(), strict=True):
            printed, size = sized(unit, units)
            for curve, rows, (colour, dashes) in _curves(frame, over, sets, units):
                rows = rows.sort_values(across)
                x = rows[across].to_numpy(dtype=float) / size_of(across, units)
                line = {"color": colour, "linestyle": "" if listed else dashes, "markersize": 4}
                axes.plot(x, rows[name].to_numpy(dtype=float) / size, marker="o", label=curve or None, **line)
                if f"{name}_low" in rows:
                    axes.fill_between(x, rows[f"{name}_low"], rows[f"{name}_high"], color=colour, alpha=0.15, lw=0)
            _across(axes, frame, across, units)
            if listed:
                axes.set_xlabel("design")
            axes.set_ylabel(with_unit(words, printed))
        if over is not None:
            panels[0].legend(loc="best")
        pictures.headline(fig, f"{answers.sweep.name}: {what}")
        parts = [one if isinstance(one, str) else value_text(name, one, units) for name, one in held.items()]
        none = "no point: passes at no value tried" if len(names) > 1 else "band: interval of the probability"
        pictures.caption(fig, "; ".join([*parts, none]) + f"\n{terms_line(answers.sweep.resolved())}")


class ChartRows(NamedTuple):
    """What a chart shows: its rows, named sets, what is across, what tells curves apart, and what is held."""

    frame: pd.DataFrame
    sets: dict[str, tuple[str, ...]]
    across: str
    over: str | None
    held: dict[str, float | str]


def _shown(sweep: Sweep, frame: pd.DataFrame, searched: Sequence[str]) -> ChartRows:
    """Choose what a chart shows."""
    sets = {axis.name: axis.labels for axis in sweep.axes if axis.labels}
    open_ = [name for name in sweep.plan.columns if name not in searched]
    if RATIO in sweep.plan.given and RATIO not in searched:  # the table holds depths
        frame = frame.assign(**{RATIO: (frame["embedment_depth_m"] / frame["boulder_height_m"]).round(9)})
        open_.append(RATIO)
    varying = [name for name in open_ if BY_NAME[name].section not in sets and len(frame[name].unique()) > 1]
    one = next(name for name in ACROSS if name not in searched)  # a question with one answer is drawn as a point
    across = next((name for name in ACROSS if name in varying), next(iter(varying), one))
    over = next(iter(sets), None) or next((name for name in CURVES if name in varying and name != across), None)
    held: dict[str, float | str] = {}
    for name, names in sets.items():
        if name != over:
            held[name] = names[len(names) // 2]
            frame = frame[frame[name].astype(str) == held[name]]
    for name in varying:
        if name not in (across, over):
            levels = np.unique(frame[name].astype(float))
            held[name] = levels[len(levels) // 2]
            frame = frame[frame[name].astype(float) == held[name]]
    return ChartRows(frame, sets, across, over, held)


def _across(axes: Axes, frame: pd.DataFrame, across: str, units: str) -> None:
    """Name the axis of what is across; whole numbers have no ticks between them."""
    values = frame[across].to_numpy(dtype=float) / size_of(across, units)
    if np.allclose(values, np.rint(values), rtol=0.0, atol=1e-6):
        axes.locator_params("x", integer=True)
    axes.set_xlabel(label(across, units))


def _curves(
    frame: pd.DataFrame, over: str | None, sets: Mapping[str, Sequence[str]], units: str
) -> Iterator[tuple[str, pd.DataFrame, tuple[str, Any]]]:
    """Yield words, rows, and colour and dashes of each curve: of every named set, or of some values of an input."""
    if over is None:
        curves = [("", frame)]
    elif over in sets:
        curves = [(name, frame[frame[over].astype(str) == name]) for name in sets[over]]
    else:
        levels = frame[over].astype(float)
        values = np.unique(levels)
        if len(values) > len(COLOURS):
            values = values[np.linspace(0, len(values) - 1, len(COLOURS)).round().astype(int)]
        curves = [(value_text(over, value, units), frame[levels == value]) for value in values]
    for index, (words, rows) in enumerate(curves):
        yield words, rows, (COLOURS[index % len(COLOURS)], DASHES[index // len(COLOURS) % len(DASHES)])


def _curve(
    axes: Axes, need: Need, rows: pd.DataFrame, across: str, style: tuple[str, Any], words: str, units: str
) -> None:
    """Draw the answers of one soil."""
    colour, dashes = style
    size = sized(need.key.field.unit, units)[1]
    x = rows[across].to_numpy(dtype=float) / size_of(across, units)
    y = rows[need.key.answer].to_numpy(dtype=float) / size
    bound = (rows["found"] == "always").to_numpy()
    axes.plot(x, y, color=colour, linestyle=dashes, label=words or need.sweep.model.preset.replace("_", " "))
    axes.plot(x[~bound], y[~bound], "o", color=colour, markersize=4)
    axes.plot(x[bound], y[bound], "o", color=colour, markersize=4, markerfacecolor="white")


def _mark(axes: Axes, need: Need, across: str, held: Mapping[str, float | str], units: str) -> None:
    """Mark the design that is recommended, where the chart shows its boulder."""
    found = need.recommendation
    design = None if found is None else found.design
    if design is None or across not in design.sizes:
        return
    if any(design.sizes.get(name, value) != value for name, value in held.items()):
        return
    value = design.rows[0].get(need.key.name, design.sizes.get(need.key.name))
    if value is not None:
        at = design.sizes[across] / size_of(across, units), value / sized(need.key.field.unit, units)[1]
        axes.plot(*at, "*", color=BLACK, markersize=12, label="recommended", zorder=5)


def _title(need: Need) -> str:
    word = "largest" if need.key.most else "smallest"
    sure = "" if need.probability is None else f" with a probability of at least {100.0 * need.probability:.10g} %"
    return f"{word} {_words(need)} that passes{sure}"


def _words(need: Need) -> str:
    name = need.key.name
    return name_of(name) if name in COLUMNS else name.rpartition("_")[0].replace("_", " ")


def draw_uncertainty(result: Uncertainty, path: str | Path, *, design_id: int = 0, units: str = "si") -> None:
    """Draw one design of a result; refused where no samples are kept of it."""
    samples = result.samples.to_pandas()
    samples = samples[samples.design_id == design_id]
    if samples.empty:
        raise PictureError(f"no samples of design {design_id} are kept; take a file with fewer designs, or one of them")
    row = result.arrow.slice(design_id, 1).to_pylist()[0]
    names = [name for name in samples.columns if name not in ("design_id", "distance")]
    changes = {name: _by_fifths(samples, name) for name in names}
    order = sorted(names, key=lambda name: float(np.ptp(changes[name])), reverse=True)
    with pictures.figure(path, 9.6, 4.9) as fig:
        left, right = fig.subplots(1, 2, width_ratios=(1.1, 1.0))
        _scatter(left, samples, order, units)
        _tornado(right, changes, order, row["p_pass"])
        name = result.sweep.name if len(result) == 1 else f"{result.sweep.name} #{design_id}"
        chance, low, high = (chance_text(row[key]) for key in ("p_pass", "p_pass_low", "p_pass_high"))
        pictures.headline(fig, f"{name}: P(pass) = {chance} ({low} to {high})")
        pictures.caption(fig, _design_caption(result, row, names, units))


def _design_caption(result: Uncertainty, row: Mapping[str, Any], uncertain: Sequence[str], units: str) -> str:
    """Say which design it is, with the means of its uncertain inputs, and what a pass means."""
    sets = [f"{axis.name}: {row[axis.name]}" for axis in result.sweep.axes if axis.labels]
    follows = () if "impact_height_m" in result.sweep.plan.given else ("impact_height_m",)
    values = {
        name: keep_together(value_text(name, row[name], units))
        for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS)
        if row.get(name) is not None and name not in follows and (name, row[name]) not in USUAL
    }
    design = ", ".join([*map(keep_together, sets), *(words for name, words in values.items() if name not in uncertain)])
    means = ", ".join(values[name] for name in uncertain if name in values)
    of = f"Design #{row['design_id']} of #0 to #{len(result) - 1}" if len(result) > 1 else "Design"
    least = json.loads(result.arrow.schema.metadata[b"boulder_sweep.question"])["margin"]
    margin = f" Here a pass also has a margin of at least {least:.0%}." if least else ""
    return (
        f"{of}: {design}. Means of the uncertain inputs: {means}.\n{terms_line(result.sweep.resolved(), units)}{margin}"
    )


def _by_fifths(samples: pd.DataFrame, name: str) -> np.ndarray:
    """Share that passes in each fifth of an input, from the lowest to the highest."""
    order = np.argsort(samples[name].to_numpy(), kind="stable")
    passes = samples.distance.to_numpy()[order] > 0.0
    return np.array([part.mean() for part in np.array_split(passes, FIFTHS)])


def _scatter(axes: Axes, samples: pd.DataFrame, order: list[str], units: str) -> None:
    """Draw the samples over the two inputs that decide most; over one and its margin where there is one only."""
    passes = samples.distance.to_numpy() > 0.0
    x = samples[order[0]].to_numpy() / size_of(order[0], units)
    y = samples[order[1]].to_numpy() / size_of(order[1], units) if len(order) > 1 else samples.distance.to_numpy()
    for rows, colour, words in ((~passes, ORANGE, "does not pass"), (passes, BLUE, "passes")):
        axes.plot(x[rows], y[rows], ".", color=colour, markersize=2.2, alpha=0.6, label=words, rasterized=True)
    axes.set_xlabel(label(order[0], units))
    axes.set_ylabel(label(order[1], units) if len(order) > 1 else "margin (below 0: does not pass)")
    axes.set_title("designs drawn")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, markerscale=4)


def _tornado(axes: Axes, changes: dict[str, np.ndarray], order: list[str], p_pass: float) -> None:
    """Draw the chance where an input lies in its lowest and in its highest fifth."""
    for position, name in enumerate(reversed(order)):
        low, high = changes[name][0], changes[name][-1]
        for value, colour, words in ((low, PALE_ORANGE, "lowest fifth (low)"), (high, BLUE, "highest fifth (high)")):
            bar = "" if position else words
            axes.barh(position, value - p_pass, left=p_pass, height=0.55, color=colour, label=bar)
        axes.annotate(
            f"low {chance_text(low)}, high {chance_text(high)}",
            (0.02, position + 0.3),
            xycoords=("axes fraction", "data"),
            va="bottom",
            fontsize=8,
            color=GREY,
        )
    axes.axvline(p_pass, color=LIGHT_GREY, zorder=0)
    axes.set_yticks(range(len(order)), [name_of(name) for name in reversed(order)])
    axes.set_xlim(*_range([p_pass, *(end for change in changes.values() for end in change[[0, -1]])]))
    axes.set_ylim(-0.5, len(order) - 0.3)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("P(pass) where the input lies in its lowest or highest fifth")
    axes.set_title("what each input does")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)


def _range(chances: Sequence[float]) -> tuple[float, float]:
    """Return limits around some probabilities: within 0 and 1, and never closer than `LEAST_RANGE`."""
    room = 0.08 * (max(chances) - min(chances))
    low = max(min(chances) - room, 0.0)
    high = min(max(max(chances) + room, low + LEAST_RANGE), 1.0)
    return min(low, high - LEAST_RANGE), high
