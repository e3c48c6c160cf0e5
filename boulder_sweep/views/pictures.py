"""Common to all pictures: making and saving figures, colours, fonts, error messages.

Every picture is written to a path (.png, .svg, .pdf), with units ``si`` or ``us`` where they differ, or refused by a
`PictureError`: nothing to draw, an unknown kind, a path that cannot be written, or no matplotlib.
"""

from __future__ import annotations

import warnings
from bisect import bisect_left
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boulder_sweep.errors import PictureError
from boulder_sweep.locations import replacing
from boulder_sweep.store.folder import check_target
from boulder_sweep.text import NO_BREAK_SPACE, install, printable, why

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Colours of Okabe and Ito: distinct for every kind of colour vision, and in grey.
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
SKY, YELLOW, AMBER, BLACK = "#56B4E9", "#F0E442", "#E69F00", "#222222"
PALE_ORANGE = "#EDB08A"
GREY, LIGHT_GREY, DARK_GREY = "#6E6E6E", "#D9D9D9", "#444444"
VERDICTS = {
    "pass": BLUE,
    "undecided": AMBER,
    "fail": PALE_ORANGE,
    "fail: penetration": PURPLE,
    "fail: no_contact": LIGHT_GREY,
    "error": DARK_GREY,
}
"""Colours of verdicts, and of reasons that have their own, in pictures and on pages. Passes differ from all others for
every kind of colour vision and in grey; errors can be seen on a dark page, too."""

STYLE: Any = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.dpi": 110,
    "savefig.dpi": 110,
    "savefig.facecolor": "white",
    "svg.hashsalt": "boulder-sweep",
}
KINDS, ANIMATED = (".png", ".svg", ".pdf"), (".gif",)
MARGIN = 0.01
"""Beside titles and captions, as a share of the width."""


def require_matplotlib() -> None:
    """Raise a `PictureError` where matplotlib is not installed."""
    from importlib.util import find_spec  # matplotlib is an extra: tables and verdicts do not need it

    if find_spec("matplotlib") is None:
        raise PictureError(f"pictures need matplotlib, which is not installed: {install('plot')}")


def checked_kind(path: str | Path, kinds: tuple[str, ...] = KINDS) -> Path:
    """Return the path of a picture, refused if its kind is unknown or its folder is missing or holds a run's result."""
    target = Path(path)
    if target.suffix.lower() not in kinds:
        raise PictureError(f"{path}: the name of a picture must end in {', '.join(kinds)}")
    check_target(target, PictureError)
    return target


def make_folder(folder: Path) -> None:
    """Make a folder for pictures, or raise a `PictureError`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise PictureError(f"the folder {folder} cannot be made: {why(problem)}") from problem


@contextmanager
def figure(path: str | Path, width: float, height: float) -> Iterator[Figure]:
    """Yield an empty figure of a size in inches, and save it at the end."""
    target = checked_kind(path)
    require_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    # Not a figure of pyplot: no window and no global state that could disturb a user's own plots.
    with matplotlib.rc_context(STYLE):
        fig = Figure(figsize=(width, height), layout="constrained")
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"Glyph .* missing from", UserWarning)  # drawn as a box
            yield fig
            save(fig, target)


def save(fig: Figure, target: Path) -> None:
    """Write a figure; the same figure gives the same file."""
    _keep_text_plain(fig)
    undated = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    try:
        with replacing(target) as file:
            fig.savefig(file, format=target.suffix[1:].lower(), metadata=undated[target.suffix.lower()])
    except OSError as problem:
        raise PictureError(f"{target} cannot be written: {why(problem)}") from problem


def _keep_text_plain(fig: Figure) -> None:
    """Draw texts as they are: no formulas but at ticks, and nothing that a picture file cannot hold."""
    from matplotlib.text import Text

    both = (axis for axes in fig.axes for axis in (axes.xaxis, axes.yaxis))
    ticks = {label for axis in both for label in axis.get_ticklabels(which="both")}
    for text in fig.findobj(Text):
        if text not in ticks:
            text.set_parse_math(False)
            text.set_text("\n".join(map(printable, text.get_text().split("\n"))))


def headline(fig: Figure, words: str, beside_in: float = 0.0, size: float = 11.5) -> str:
    """Write the title of a picture at the left, in lines that leave some inches at the right; return it as written."""
    style: Any = {"fontsize": size, "fontweight": "bold"}
    title = break_lines(fig, words, (1.0 - 2.0 * MARGIN) * fig.get_figwidth() - beside_in, **style)
    fig.suptitle(title, x=MARGIN, ha="left", **style)
    return title


def caption(fig: Figure, words: str, size: float = 8.0, colour: str = GREY) -> None:
    """Write the caption of a picture below it, in lines that fit."""
    text = break_lines(fig, words, (1.0 - 2.0 * MARGIN) * fig.get_figwidth(), fontsize=size)
    fig.supxlabel(text, x=MARGIN, ha="left", fontsize=size, color=colour)


def break_lines(fig: Figure, words: str, inches: float, **style: Any) -> str:
    """Break words into lines of at most so many inches: at spaces, and within a word where it is longer."""
    from matplotlib.text import Text

    text = Text(parse_math=False, **style)
    text.set_figure(fig)

    def fits(line: str) -> bool:
        text.set_text(line)
        return bool(text.get_window_extent().width <= inches * fig.dpi)

    return "\n".join(part for line in words.split("\n") for part in _parts(line, fits))


def _parts(line: str, fits: Callable[[str], bool]) -> Iterator[str]:
    """Yield a line in parts that fit."""
    while not fits(line):
        # The most characters that fit, at least one.
        most = max(1, bisect_left(range(1, len(line)), True, key=lambda count: not fits(line[:count])))
        cut = max(line.rfind(" ", 1, most + 1), 0) or max(line.rfind(NO_BREAK_SPACE, 1, most + 1), 0) or most
        if cut >= len(line):
            break
        yield line[:cut]
        line = line[cut:].lstrip(f" {NO_BREAK_SPACE}")
    yield line


def time_axis(axes: Axes, end_s: float) -> None:
    """Let the horizontal axis be the time from first touch to an end."""
    axes.set_xlim(0.0, end_s)
    axes.set_xlabel("time since first touch [s]")


def limit_y(axes: Axes, low: float, high: float) -> None:
    """Set the range of the vertical axis, never an empty one."""
    axes.set_ylim(low, high if high > low else low + 1.0)


def note_line(axes: Axes, words: str, at: float, value: float, **style: Any) -> None:
    """Write words on a horizontal line at a value, at a share of the width of the axes."""
    place: Any = {"xycoords": ("axes fraction", "data"), "xytext": (0, 3), "textcoords": "offset points"}
    axes.annotate(words, (at, value), fontsize=8.5, **place, **style)


def mark_peak(axes: Axes, time: float, value: float, text: str, colour: str, *, below: bool = False) -> None:
    """Mark a peak with a dot and its value, above or below it, on the side with more room."""
    axes.plot([time], [value], "o", color=colour, markersize=4.5, zorder=5, clip_on=False)
    left, right = axes.get_xlim()
    beyond_middle = time > left + 0.62 * (right - left)
    axes.annotate(
        text,
        (time, value),
        xytext=(-6 if beyond_middle else 0 if below else 6, -9 if below else 5),
        textcoords="offset points",
        ha="right" if beyond_middle else "center" if below else "left",
        va="top" if below else "bottom",
        fontsize=8.5,
        color=colour,
    )
