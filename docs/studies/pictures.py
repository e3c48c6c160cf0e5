"""The pictures of the documentation, each drawn by the same code that users call."""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image

from boulder_sweep import load, need, read, run
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.crash_tests.fitting import fit_pulse
from boulder_sweep.crash_tests.measured import read_pulse
from boulder_sweep.crash_tests.validation import validate
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.settings.loader import SECOND_OPINION
from boulder_sweep.views.crash_curves import FIGURES, draw_convergence, draw_crash_test, draw_rigid_wall
from boulder_sweep.views.verdict_map import draw_verdict_map
from boulder_sweep.views.wording import terms_line
from docs.studies.answers import SITE
from docs.studies.contents import GRID
from docs.studies.example_pulse import example_pulse
from docs.studies.gallery import draw_sites
from docs.studies.shapes import draw_shapes
from docs.studies.stones import example_stone

FOLDER = Path("docs/images")
STILL_AT_S = 0.06


def draw_all(root: Path) -> list[Path]:
    """Draw every picture of the documentation.

    Parameters
    ----------
    root
        Folder of the repository.

    Returns
    -------
    list of Path
        What was drawn.
    """
    folder = root / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    drawn: list[Path] = []

    def named(name: str) -> Path:
        drawn.append(folder / name)
        return drawn[-1]

    for test in ("abg", "rwg"):
        trajectory = simulate(crash_test(test))
        trajectory.plot(named(f"trajectory_{test}.png"))
        trajectory.plot_energy(named(f"energy_{test}.png"))
        trajectory.plot_side_view(named(f"side_view_{test}.png"), time_s=STILL_AT_S)
    found = validate()
    draw_rigid_wall(found.wall, named("figure_10_rigid_wall.png"))
    draw_convergence(found.convergence, named("convergence.png"))
    for test, (_, name) in FIGURES.items():
        draw_crash_test(test, {p: t for (own, p), t in found.trajectories.items() if own == test}, named(name))
    need(load(root / SITE)).plot(named("design_chart.png"))
    example_stone(root).plot(named("stone.png"))
    draw_shapes(named("shapes.png"))
    with tempfile.TemporaryDirectory() as scratch:
        pulse = Path(scratch) / "pulse.csv"
        pulse.write_text(example_pulse(), encoding="utf-8")
        fit_pulse(read_pulse(pulse), 6800.0).plot(named("vehicle_fit.png"))
        sweep = load(root / GRID, [SECOND_OPINION])
        run(sweep, Path(scratch) / "grid.sweep")
        table, terms = read(Path(scratch) / "grid.sweep"), terms_line(sweep.resolved())
        draw_verdict_map(table, named("m30_sizing.png"), title=sweep.name, terms=terms)
    drawn += draw_sites(root, folder)
    for path in drawn:
        reduce_colours(path)
    return sorted(drawn)


def reduce_colours(path: Path) -> None:
    """Save a picture again with a palette of 256 colours, which takes a third of the bytes."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(256)
    small.save(path, optimize=True)
