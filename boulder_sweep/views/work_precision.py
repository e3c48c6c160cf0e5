"""Work and precision: the error of a sample over the CPU time per design, with the Pareto front."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from boulder_sweep.views.pictures import AMBER, BLUE, GREEN, GREY, LIGHT_GREY, ORANGE, PURPLE, SKY, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from boulder_sweep.tradeoff.study import Point, Tradeoff

LEAST_DEG = 1e-11
"""Smaller errors are drawn here, because a logarithmic axis has no zero [deg]."""
COLOURS = (ORANGE, AMBER, PURPLE, GREY, SKY)
MARKERS = "^vDPX"
WORDS = {"as_printed": "as printed", "corrected": "corrected", "mixed": "readings of the file"}


def draw_tradeoff(result: Tradeoff, path: str | Path) -> None:
    """Draw a panel for each reading of the paper."""
    names = list(dict.fromkeys(point.method.readings for point in result.points))
    with figure(path, 5.4 * len(names), 5.0) as fig:
        panels = fig.subplots(1, len(names), sharey=True, squeeze=False)[0]
        for axes, name in zip(panels, names, strict=True):
            _panel(axes, [point for point in result.points if point.method.readings == name])
            this_file = " (this file)" if name == result.sweep.model.preset else ""
            axes.set_title(f"{WORDS.get(name, name)}{this_file}")
            axes.set_xlabel("CPU time per design, one core [µs]")
        panels[0].set_ylabel("error of the largest rotation [deg]\n99 % of designs; thin line up to the largest")
        handles, labels = panels[0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=2 * len(names))


def _panel(axes: Axes, points: list[Point]) -> None:
    """Draw the methods of one reading."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.12)
    if all(p.rotation_max_deg <= LEAST_DEG for p in points):
        axes.set_ylim(0.1 * LEAST_DEG, 10.0 * LEAST_DEG)  # no error at all, as where nothing moves
    front = sorted((p for p in points if p.pareto), key=lambda p: p.cpu_us)
    broad: Any = {"color": LIGHT_GREY, "linewidth": 7.0, "solid_capstyle": "round", "zorder": 1}
    usual = [max(p.rotation_p99_deg, LEAST_DEG) for p in front]
    axes.plot([p.cpu_us for p in front], usual, label="Pareto front", **broad)
    groups: dict[tuple[int, bool, bool], list[Point]] = {}
    for p in points:
        groups.setdefault((p.method.soil_elements, p.method.error_estimate, p.method.locate_yield), []).append(p)
    sums = iter(zip(COLOURS, MARKERS, strict=True))
    for (elements, estimate, located), these in groups.items():
        if elements:
            colour, marker = next(sums)
            words = f"sums over {elements} elements"
        else:
            colour, marker = (GREEN, "s") if estimate else (BLUE, "o")
            words = "error for each design" if estimate else "closed form"
            words += ", yield located" if located else ""
        _method(axes, these, colour, marker, words)


def _method(axes: Axes, points: list[Point], colour: str, marker: str, words: str) -> None:
    """Draw one method over its steps."""
    cost = [p.cpu_us for p in points]
    usual = [max(p.rotation_p99_deg, LEAST_DEG) for p in points]
    largest = [max(p.rotation_max_deg, LEAST_DEG) for p in points]
    face, dashes = ("white", "--") if points[0].method.locate_yield else (colour, "-")
    style: Any = {"markersize": 4.5, "markerfacecolor": face, "linewidth": 1.2, "linestyle": dashes}
    axes.plot(cost, usual, marker=marker, color=colour, label=words, zorder=3, **style)
    axes.vlines(cost, usual, largest, color=colour, linewidth=0.8, alpha=0.6, zorder=2)
    for point, x, y in zip(points, cost, usual, strict=True):
        if point.accuracy or point in (points[0], points[-1]):
            text = point.accuracy or f"{point.method.step_ms:g} ms"
            style = {"fontsize": 7.5, "fontweight": "bold" if point.accuracy else "normal", "color": colour}
            axes.annotate(text, (x, y), xytext=(6, 2), textcoords="offset points", **style)
