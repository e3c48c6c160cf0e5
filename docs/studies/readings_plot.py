"""The readings study as bars: the rotation of the crash test that passed, and the share of a grid that stands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.views import pictures
from boulder_sweep.views.pictures import BLACK, BLUE, ORANGE, PALE_ORANGE, SKY

if TYPE_CHECKING:
    from docs.studies.readings import ReadingsStudy

LIMIT_DEG = 20.0


def draw_readings(study: ReadingsStudy, path: str | Path) -> None:
    """Draw what each reading does.

    Parameters
    ----------
    study
        The study.
    path
        Picture to write (.png, .svg, .pdf).
    """
    labels = [row.label.strip("*").replace("_", " ") for row in study.rows]
    places = [-k - (0.6 if k >= len(labels) // 2 else 0.0) for k in range(len(labels))]
    presets = {"as_printed": (ORANGE, PALE_ORANGE), "corrected": (BLUE, SKY)}
    colours = [presets[row.base][1 if row.switch else 0] for row in study.rows]
    with pictures.figure(path, 9.0, 4.6) as fig:
        rotation, share = fig.subplots(1, 2, sharey=True)
        panels = (
            (rotation, [row.rwg_rotation_deg for row in study.rows], "{:.1f}°"),
            (share, [100.0 * row.share for row in study.rows], "{:.0f} %"),
        )
        for axes, values, words in panels:
            axes.barh(places, values, color=colours, height=0.75)
            for place, value in zip(places, values, strict=True):
                axes.annotate(
                    words.format(value),
                    (value, place),
                    xytext=(3, 0),
                    textcoords="offset points",
                    va="center",
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
                    fontsize=8,
                )
            axes.set_xlim(0.0, 1.14 * max(*values, LIMIT_DEG))
            axes.grid(axis="y", visible=False)
        # Below the numbers, whose white ground keeps it off them.
        rotation.axvline(LIMIT_DEG, color=BLACK, linewidth=1.0, linestyle=":", zorder=1.5)
        rotation.set_yticks(places, labels)
        for tick, row in zip(rotation.get_yticklabels(), study.rows, strict=True):
            tick.set_fontweight("normal" if row.switch else "bold")
        rotation.set_title("Rockville White Granite: largest rotation")
        rotation.set_xlabel("rotation [deg], limit dotted")
        share.set_title(f"Designs of {study.grid} that stand for 1 s")
        share.set_xlabel("share of the designs [%]")
