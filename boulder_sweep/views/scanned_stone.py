"""A scanned stone from the side, to scale: as it is, and as the profile that is computed with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.errors import PictureError
from boulder_sweep.views.pictures import BLACK, BLUE, GREY, caption, figure, headline
from boulder_sweep.views.side_view import STYLES, Window

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from boulder_sweep.answers.placing import Placing
    from boulder_sweep.stones.standing import Standing
    from boulder_sweep.stones.weighing import ScannedStone

PANEL_IN = 3.1
ROOM_M = 0.25
"""Room around the largest boulder of a picture [m]."""


def draw_stone(scan: ScannedStone, path: str | Path) -> None:
    """Draw a boulder with each of its six ends up."""
    shown = [next(s for s in scan.standings if s.up == up) for up in dict.fromkeys(s.up for s in scan.standings)]
    with figure(path, 3 * PANEL_IN, 2 * PANEL_IN + 0.9) as fig:
        panels = list(fig.subplots(2, 3).flat)
        _same_scale(panels, _view_of(shown, [0.0] * len(shown)))
        for axes, standing in zip(panels, shown, strict=True):
            draw_standing(axes, standing)
            cut = f"cut {standing.cut_m:.2f} m" if standing.cut_m else "no cut"
            foot = cut if standing.has_foot else "rounded foot"
            axes.set_title(f"{standing.up} up, {standing.facing} to the vehicle: {foot}")
        headline(fig, f"{scan.file}: {scan.mass_kg / 1e3:.3g} t")
        caption(
            fig,
            "From the side, the vehicle coming from the left. Grey: the boulder as scanned, dashed what is cut off; "
            "blue: the profile, whose sections are rectangles of the same area. Dot: centre of mass. Metres.",
        )


def draw_placing(placing: Placing, path: str | Path) -> None:
    """Draw the ways in which a boulder passes at the least depth, in the ground; refused where no way passes."""
    best = placing.passing[: placing.shown]
    if not best:
        raise PictureError("no way to stand passes at any depth, so there is nothing to draw")
    view = _view_of([way.standing for way in best], [way.depth_m or 0.0 for way in best])
    with figure(path, len(best) * PANEL_IN, view.height_in(PANEL_IN) + 1.3) as fig:
        panels = list(np.atleast_1d(fig.subplots(1, len(best))))
        _same_scale(panels, view)
        for axes, way in zip(panels, best, strict=True):
            standing, ground_m = way.standing, way.depth_m or 0.0
            axes.axhspan(axes.get_ylim()[0], 0.0, facecolor=STYLES["soil"].fill, edgecolor="none", zorder=0)
            axes.axhline(0.0, color=STYLES["wedge"].line, linewidth=1.2, zorder=1)
            draw_standing(axes, standing, ground_m)
            axes.set_title(f"{standing.up} up, {standing.facing} to the vehicle:\n{ground_m:.3f} m deep")
        headline(fig, f"{placing.found.file}: {placing.found.mass_kg / 1e3:.3g} t")
        caption(
            fig,
            "From the side, the vehicle coming from the left, each at its least depth. Dashed: what is cut off for a "
            "flat foot; blue: the profile, whose sections are rectangles of the same area. Metres.",
        )


def draw_standing(axes: Axes, standing: Standing, ground_m: float = 0.0) -> None:
    """Draw one stone; the ground is at this height over its foot [m]."""
    from matplotlib.patches import Polygon

    style = STYLES["boulder"]
    height, near, far = standing.outline.T
    outline = np.concatenate([np.stack([-near, height], axis=1), np.stack([far, height], axis=1)[::-1]])
    axes.add_patch(Polygon(outline - (0.0, ground_m), facecolor="none", edgecolor=style.line, linestyle="--", lw=0.9))
    above = outline[outline[:, 1] >= 0.0] - (0.0, ground_m)
    axes.add_patch(Polygon(above, facecolor=style.fill, edgecolor=style.line, linewidth=1.0))
    profile = standing.profile
    sides = [np.stack([side, profile.height - ground_m], axis=1) for side in (-profile.near, profile.far)]
    axes.add_patch(Polygon(np.concatenate([sides[0], sides[1][::-1]]), facecolor="none", edgecolor=BLUE, linewidth=1.6))
    axes.plot(standing.centre[0], standing.centre[1] - ground_m, "o", color=BLACK, markersize=4.0)


def _view_of(shown: Sequence[Standing], grounds_m: Sequence[float]) -> Window:
    """Return a view with room for the largest stone; the ground is at these heights over the feet."""
    outlines = [standing.outline - (ground_m, 0.0, 0.0) for standing, ground_m in zip(shown, grounds_m, strict=True)]
    height, *sides = np.concatenate(outlines).T
    low, high, (near, far) = height.min(), height.max(), (side.max() for side in sides)
    return Window(-near - ROOM_M, far + ROOM_M, low - ROOM_M, high + ROOM_M)


def _same_scale(panels: Sequence[Axes], view: Window) -> None:
    """Give all panels one view."""
    for axes in panels:
        view.show(axes)
        axes.tick_params(colors=GREY, labelsize=7.5)
