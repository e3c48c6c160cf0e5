"""How much the shape of a stone decides: what becomes of passes of the M30 grid if the stone is no box."""

from __future__ import annotations

import textwrap
from math import gamma
from pathlib import Path
from typing import NamedTuple

import numpy as np

from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.judged import PASS
from boulder_sweep.settings.model import RESISTANCES, Ground
from boulder_sweep.settings.shape import ProfilePoint, Shape
from boulder_sweep.soils import with_soil
from boulder_sweep.views.pictures import BLUE, caption, figure, headline
from boulder_sweep.views.scene import STYLES
from docs.studies.forms import SPEEDS, drawn_of_grid, grid_evaluation

PIECES = 8
TAPER = (0.7, 1.3)
EDGES, ELLIPSOID = 4.0, 2.0
"""Exponents n of a superellipsoid |x/a|^n + |y/b|^n + |z/c|^n = 1."""
CUT_AT = 0.5
"""Where a foot is cut flat: where it is half as long and half as wide as the largest section."""
DRAWN_M = (1.5, 3.0)
"""Length and height of the box that the stones are drawn beside."""


class Stone(NamedTuple):
    """A stone in place of a box of the same height."""

    name: str
    alike: str
    """What else it has in common with the box."""
    shape: Shape

    @property
    def on_whole_foot(self) -> Shape:
        """The shape with a foot as long as the box, as if the weight were held up there."""
        foot, *above = self.shape.points
        return Shape((ProfilePoint(foot.height, foot.width, 0.5, 0.5), *above))


def shape_of(heights: np.ndarray, sides: np.ndarray) -> Shape:
    """Return the shape with so many times the width and length of the box at heights from 0 to 1, all shape (P,)."""
    return Shape(tuple(ProfilePoint(z, s, 0.5 * s, 0.5 * s) for z, s in zip(heights, sides, strict=True)))


def superellipsoid(n: float, *, same_mass: bool, cut: bool = False) -> Shape:
    """Return a shape whose sections are rectangles of the area of those of a superellipsoid, as for scans.

    Parameters
    ----------
    n
        Exponent.
    same_mass
        Whether it is made as heavy as the box, in place of fitting into it.
    cut
        Whether its foot is cut flat.
    """
    t = np.linspace(np.arcsin(CUT_AT ** (0.5 * n)) if cut else 0.0, np.pi, PIECES + 1)
    z = -np.sign(np.cos(t)) * np.abs(np.cos(t)) ** (2.0 / n)
    heights = (z - z[0]) / (z[-1] - z[0])
    sides = np.sin(t).clip(0.0) ** (2.0 / n) * gamma(1.0 + 1.0 / n) / np.sqrt(gamma(1.0 + 2.0 / n))
    shape = shape_of(heights, sides)
    return shape_of(heights, sides / np.sqrt(shape.filled)) if same_mass else shape


def stones() -> list[Stone]:
    """Return the stones of the study."""
    ends, rounded = np.array([0.0, 1.0]), {"rounded edges": EDGES, "ellipsoid": ELLIPSOID}
    return [
        Stone("wider at the foot", "middle", shape_of(ends, np.array(TAPER[::-1]))),
        Stone("wider at the top", "middle", shape_of(ends, np.array(TAPER))),
        *(
            Stone(name, "mass" if mass else "sides", superellipsoid(n, same_mass=mass))
            for mass in (True, False)
            for name, n in rounded.items()
        ),
        *(
            Stone(f"{name}, foot cut flat", "mass", superellipsoid(n, same_mass=True, cut=True))
            for name, n in rounded.items()
        ),
    ]


def shapes_table(grid: Path) -> Table:
    """Return how many passes of a grid are left, by the shape of the stone."""
    table = Table(("stone, as high as the box", "same", "solidity", "passes kept", "on a foot as long as the box"))
    evaluation, (passes, _) = grid_evaluation(grid), drawn_of_grid(grid, SPEEDS["M30"])
    for stone in stones():
        kept = []
        for shape in (stone.shape, stone.on_whole_foot):
            outlined = passes._replace(table=with_soil(passes.table, RESISTANCES[0], Ground(), shape=shape))
            kept.append(np.mean(evaluation.judged(outlined).verdict == PASS))
        table.add(stone.name, stone.alike, f"{stone.shape.filled:.2f}", *(f"{100.0 * share:.0f} %" for share in kept))
    return table


def draw_shapes(path: Path) -> None:
    """Draw the stones from the side, each beside its box."""
    from matplotlib.patches import Polygon, Rectangle

    (length, height), style = DRAWN_M, STYLES["boulder"]
    with figure(path, 9.6, 3.0) as fig:
        for axes, stone in zip(fig.subplots(1, len(stones())), stones(), strict=True):
            points = stone.shape.points
            outline = [(-point.near, point.height) for point in points] + [(p.far, p.height) for p in points[::-1]]
            axes.add_patch(Polygon(np.array(outline) * DRAWN_M, facecolor=style.fill, edgecolor=style.line))
            axes.add_patch(Rectangle((-0.5 * length, 0.0), length, height, fill=False, edgecolor=BLUE, linestyle="--"))
            axes.set_xlim(-0.75 * length, 0.75 * length)
            axes.set_ylim(-0.05 * height, 1.05 * height)
            axes.set_aspect("equal")
            axes.set_axis_off()
            axes.set_title(textwrap.fill(stone.name, 13) + f"\nsame {stone.alike}", loc="center", fontsize=8.0)
        headline(fig, "Stones of the study, from the side")
        caption(fig, "Dashed: the box in place of which each stands.")
