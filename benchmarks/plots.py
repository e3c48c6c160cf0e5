"""Figures: work against precision, order of convergence, and peers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

if TYPE_CHECKING:
    from .points import Point

STYLES: Mapping[str, dict[str, Any]] = {
    "events located": {"color": "#0b5fa5", "marker": "o"},
    "with error estimate": {"color": "#2a9d6f", "marker": "s"},
    "yield located, too": {"color": "#8a5fbf", "marker": "^", "linestyle": "--"},
}
GUIDES = (1, 3, 5)
"""Orders that thin lines show."""


def plot_steps(points: Sequence[Point], path: Path) -> None:
    """Largest and rms error of the rotation over the CPU time, one panel for each preset."""
    presets = list(dict.fromkeys(p.preset for p in points))
    figure, panels = plt.subplots(1, len(presets), figsize=(6.0 * len(presets), 4.6), sharey=True, squeeze=False)
    for panel, preset in zip(panels[0], presets, strict=True):
        for way, style in STYLES.items():
            these = [p for p in points if p.preset == preset and p.way == way]
            cost = [p.cpu_us for p in these]
            panel.loglog(cost, [p.theta_max_deg for p in these], **style, markersize=4, label=f"{way}: largest")
            panel.loglog(cost, [p.theta_rms_deg for p in these], **style, markersize=4, alpha=0.3)
        for p in points:
            if p.preset == preset and p.way == "events located" and p.step_ms in (16.0, 8.0, 4.0, 2.0, 1.0):
                panel.annotate(f" {p.step_ms:g} ms", (p.cpu_us, p.theta_max_deg), fontsize=7, color="#0b5fa5")
        _finish(panel, f"readings: {preset}", "CPU time per design, one core [us]")
        panel.legend(fontsize=7, title="faint: rms over the designs", title_fontsize=7)
    panels[0][0].set_ylabel("error of the largest rotation [deg]")
    _save(figure, path)


def plot_order(points: Sequence[Point], path: Path) -> None:
    """Rms error of the rotation over the step, with the events located and with the yield of the soil located, too."""
    presets = list(dict.fromkeys(p.preset for p in points))
    figure, panels = plt.subplots(1, len(presets), figsize=(6.0 * len(presets), 4.6), sharey=True, squeeze=False)
    for panel, preset in zip(panels[0], presets, strict=True):
        for way in ("events located", "yield located, too"):
            these = sorted((p for p in points if p.preset == preset and p.way == way), key=lambda p: p.step_ms)
            panel.loglog(
                [p.step_ms for p in these],
                [p.theta_rms_deg for p in these],
                **STYLES[way],
                markersize=4,
                label=way,
            )
        for order in GUIDES:
            steps = [0.5, 16.0]
            panel.loglog(steps, [1e-3 * (h / 16.0) ** order for h in steps], color="0.7", linewidth=0.8, zorder=0)
            panel.annotate(f"order {order}", (0.5, 1e-3 * (0.5 / 16.0) ** order), fontsize=7, color="0.5")
        _finish(panel, f"readings: {preset}", "step [ms]")
        panel.legend(fontsize=8)
    panels[0][0].set_ylabel("rms error of the largest rotation [deg]")
    _save(figure, path)


def plot_peers(series: Mapping[str, Sequence[tuple[float, float]]], path: Path, tolerance_deg: float) -> None:
    """Largest error of the rotation over CPU time, a line for each solver.

    Parameters
    ----------
    series
        By name of the solver: pairs of CPU time per design [us] and largest error [deg].
    path
        Of the PNG file.
    tolerance_deg
        The accuracy at which they are compared.
    """
    figure, panel = plt.subplots(figsize=(8.0, 5.0))
    colours = plt.get_cmap("tab10")
    markers = "osv^D<>phX*"
    for place, (name, points) in enumerate(series.items()):
        panel.loglog(
            [cost for cost, _ in points],
            [error for _, error in points],
            color=colours(place % 10),
            marker=markers[place % len(markers)],
            markersize=4,
            linewidth=2.0 if place == 0 else 1.0,
            label=name,
        )
    panel.axhline(tolerance_deg, color="0.5", linewidth=0.8, linestyle=":")
    panel.annotate(
        f"compared at {tolerance_deg:g} deg", (0.99, tolerance_deg), xycoords=("axes fraction", "data"), ha="right",
        va="bottom", fontsize=7, color="0.4",
    )  # fmt: skip
    _finish(panel, "the same impacts, other solvers", "CPU time per design, one core [us]")
    panel.set_ylabel("largest error of the largest rotation [deg]")
    panel.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.01, 0.5))
    _save(figure, path)


def _finish(panel: Any, title: str, label: str) -> None:
    panel.set_title(title, fontsize=10)
    panel.set_xlabel(label)
    panel.grid(which="major", color="0.9", linewidth=0.6)


def _save(figure: Any, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
