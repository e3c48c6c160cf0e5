"""The pictures of the documentation, each drawn by the same code that users call."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

from boulder_sweep import load, need, read, run, uncertainty
from boulder_sweep.crash_tests.cases import crash_test, validate
from boulder_sweep.crash_tests.fitting import fit_pulse
from boulder_sweep.crash_tests.measured import read_pulse
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.report import write_report
from boulder_sweep.report.writing import browser
from boulder_sweep.settings.sweep import Heading
from boulder_sweep.stones.weighing import scanned
from boulder_sweep.views.crash_curves import FIGURES, draw_crash_test
from boulder_sweep.views.verdict_map import draw_verdict_map
from boulder_sweep.views.wording import terms_line
from docs.studies.answers import SITE, UNCERTAIN
from docs.studies.contents import GRID
from docs.studies.example_pulse import example_pulse

FOLDER = Path("docs/images")
STILL_AT_S = 0.06
ROCK, ROCK_KG = Path("docs/examples/rock.ply"), 23_500.0
FILM = "film_rwg.gif"
"""A boulder that holds, on the first screen of the README."""
SHEETS = {
    "site": (
        SITE,
        "si",
        Heading("Main Street", "City of Springfield", "North gate", "2026-11-28", "A", "C. Day", "E. Fox"),
    ),
    "borehole": (
        Path("configs/borehole_log.yaml"),
        "us",
        Heading("Harbor plaza", "Port authority", "Pier 4, landward side", "2026-10-09", "B", "R. Moore", "L. Hale"),
    ),
    "stone": (
        Path("configs/quarry_stone.yaml"),
        "si",
        Heading("Castle car park", "County museum", "Upper drive", "2026-09-17", "0", "J. Reed", "M. Stone"),
    ),
}
"""Answers whose sheet to sign is shown, their units and headings."""
GRID_HEADING = Heading("Embassy row", "Ministry of Works", "East forecourt", "2026-11-12", "A", "P. Lane", "S. Birch")
"""Heading of the sheet of a run."""
MARGIN = 20
"""Beside a photographed sheet [px]."""


def draw_all(root: Path, chromium: Browser) -> list[Path]:
    """Draw every picture of the documentation.

    Parameters
    ----------
    root
        Folder of the repository.
    chromium
        Photographs the report. Given, because Playwright runs only once in a process.

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

    overturned, held = (simulate(crash_test(test)) for test in ("abg", "rwg"))
    overturned.plot_energy(named("energy_abg.png"))
    held.plot_energy(named("energy_rwg.png"))
    held.plot(named("trajectory_rwg.png"))
    held.plot_side_view(named("side_view_rwg.png"), time_s=STILL_AT_S)
    held.animate(named(FILM))
    found = validate()
    for test, (_, name) in FIGURES.items():
        draw_crash_test(test, {p: t for (own, p), t in found.trajectories.items() if own == test}, named(name))
    need(load(root / SITE)).plot(named("design_chart.png"))
    uncertainty(load(root / UNCERTAIN)).plot(named("uncertain_site.png"))
    scanned(root / ROCK, mass_kg=ROCK_KG).plot(named("stone.png"))
    with tempfile.TemporaryDirectory() as scratch:
        pulse = Path(scratch) / "pulse.csv"
        pulse.write_text(example_pulse(), encoding="utf-8")
        fit_pulse(read_pulse(pulse), 6800.0).plot(named("vehicle_fit.png"))
        sweep = load(root / GRID)
        run(sweep, Path(scratch) / "grid.sweep")
        table, terms = read(Path(scratch) / "grid.sweep"), terms_line(sweep.resolved())
        draw_verdict_map(table, named("m30_sizing.png"), title=sweep.name, terms=terms)
        for name, (file, units, heading) in SHEETS.items():
            need(load(root / file)).write(Path(scratch) / f"{name}.parquet")
            page = write_report(
                Path(scratch) / f"{name}.parquet", Path(scratch) / "page.html", units=units, heading=heading
            )
            photograph(chromium, page, named(f"report_{name}.png"))
        page = write_report(Path(scratch) / "grid.sweep", Path(scratch) / "page.html", units="si", heading=GRID_HEADING)
        photograph(chromium, page, named("report_grid.png"))
    for path in drawn:
        if path.name != FILM:
            reduce_colours(path)
    return sorted(drawn)


@contextmanager
def opened_chromium() -> Iterator[Browser]:
    """Open the browser that the reports are printed with."""
    sandbox = [] if getattr(os, "geteuid", lambda: 1)() else ["--no-sandbox"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=browser(), args=sandbox)
        yield chromium
        chromium.close()


def photograph(chromium: Browser, page: Path, picture: Path) -> None:
    """Take a picture of the first sheet of a page as it is printed, but for the footer."""
    tab = chromium.new_page(viewport={"width": 1200, "height": 900}, device_scale_factor=1.5, color_scheme="light")
    tab.goto(page.resolve().as_uri())
    tab.wait_for_selector("html[data-ready]", state="attached")
    tab.evaluate("dispatchEvent(new Event('beforeprint'))")
    tab.emulate_media(media="print")
    tab.evaluate(f"document.body.style.paddingTop = '{2 * MARGIN}px'")
    code = """(margin) => {
      const places = ["header", ".sheet"].map((place) => document.querySelector(place));
      const [head, sheet] = places.map((place) => place.getBoundingClientRect());
      const [x, y] = [head.left - margin, head.top - margin];
      return { x, y, width: sheet.width + 2 * margin, height: sheet.bottom + margin - y };
    }"""
    tab.screenshot(path=picture, full_page=True, clip=tab.evaluate(code, MARGIN))
    tab.close()


def reduce_colours(path: Path) -> None:
    """Save a picture again with a palette of 256 colours, which takes a third of the bytes."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(256)
    small.save(path, optimize=True)
