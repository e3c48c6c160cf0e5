"""What commands print for the files of the documentation, and what a partial factor is worth."""

from __future__ import annotations

import tempfile
import textwrap
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from boulder_sweep import load, need, uncertainty
from boulder_sweep.answers.advice import Again
from boulder_sweep.answers.printing import need_lines, reserve_lines, uncertainty_lines
from boulder_sweep.answers.reserves import capacity
from boulder_sweep.cli.quality import fit_lines
from boulder_sweep.crash_tests.fitting import fit_pulse
from boulder_sweep.crash_tests.measured import read_pulse
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.settings import Sweep
from boulder_sweep.settings.model import Distribution, SetDistributions
from boulder_sweep.settings.sweep import DesignList, derived_words
from boulder_sweep.views.log_text import log_lines
from docs.studies.example_pulse import example_pulse

SITE = Path("configs/site.yaml")
GRID = Path("configs/m30_sizing.yaml")
UNCERTAIN = Path("configs/uncertain_site.yaml")
BOREHOLE, BOREHOLE_LOG = Path("configs/borehole.yaml"), Path("configs/borehole_log.yaml")
FACTORS = (1.0, 1.05, 1.1, 1.15, 1.2, 1.25)
TARGETS = (0.9, 0.95)
"""Chances for which a factor is told."""


def least_of_site(root: Path) -> str:
    """Return the least depth without margin and second opinion as a terminal shows it."""
    sweep = load(root / SITE, ["boulder.height=3.4 m"])
    found = need(sweep, margin=0.0, robust=False)
    typed = (("--margin", "0"), ("--any",), ("--set", "boulder.height=3.4 m"))
    return _fenced(need_lines(found, again=Again(str(SITE), typed), table=True))


def capacity_of_site(root: Path) -> str:
    """Return what the designs of the site withstand at one depth as a terminal shows it."""
    chosen = ["site.embedment_depth=1.9 m", "boulder.height=[3.4, 3.6] m"]
    return _fenced(reserve_lines(capacity(load(root / SITE, chosen))))


def uncertainty_of_site(root: Path) -> str:
    """Return the chances of the uncertain site as a terminal shows them."""
    return _fenced(uncertainty_lines(uncertainty(load(root / UNCERTAIN))))


def need_with_probability(root: Path) -> str:
    """Return the depth for a chance of 95 % as a terminal shows it."""
    return _fenced(
        need_lines(
            need(load(root / UNCERTAIN), probability=0.95), again=Again(str(UNCERTAIN), (("--probability", "0.95"),))
        )
    )


def partial_factors(root: Path) -> str:
    """Return what chance of passing designs have whose depth is just enough with a partial factor on their soil."""
    table = Table(("partial factor on tan φ′", "designs", "mean P(pass)", "least", "largest"))
    means = []
    for factor in FACTORS:
        chances = chances_with_factor(root, factor)
        means.append(chances.mean())
        shown = (f"{own:.3f}" for own in (means[-1], chances.min(), chances.max()))
        table.add(f"{factor:g}", f"{len(chances):,}", *shown)
    wanted = np.interp(ndtri(TARGETS), ndtri(means), FACTORS)
    (low, high), (first, second) = wanted, TARGETS
    words = f"a mean probability of {first:.0%} needs a factor of {low:.2f}, one of {second:.0%} needs {high:.2f}"
    return f"{table.markdown()}\n\nBy interpolation, {words}."


def chances_with_factor(root: Path, factor: float) -> np.ndarray:
    """Return the chances of all boulders and soils of the M30 grid whose depth is just enough with a partial factor."""
    one_depth = "site.embedment_depth=2 m"
    unfactored = load(root / GRID, [one_depth])
    factored = load(root / GRID, [one_depth, f"partial_factor.friction_angle={factor}"])
    frame = need(factored, margin=0.0, robust=False).frame
    found = (frame.found == "found").to_numpy()
    rows = {name: values[found] for name, values in unfactored.plan.given_rows(0, unfactored.n_designs).items()}
    rows["embedment_depth_m"] = frame.passes_at.to_numpy()[found]
    spread: dict[str, Distribution | SetDistributions] = {
        "friction_angle_deg": Distribution("normal", 1.0, 60.0, cov=0.05)
    }
    sweep = Sweep("factor", None, (), {}, DesignList("designs", rows), distributions=spread)
    return uncertainty(sweep, half_width=0.03).frame.p_pass.to_numpy()


def _fenced(lines: list[str]) -> str:
    return "\n".join(["```text", *lines, "```"])


def notes_of_borehole(root: Path) -> str:
    """Return how the inputs of the example follow, as every command prints it."""
    notes = (f"note: {words}" for words in derived_words(load(root / BOREHOLE).derived))
    return _fenced([line for note in notes for line in textwrap.wrap(note, 80, subsequent_indent="  ")])


def drawing_of_log(root: Path) -> str:
    """Return the log of the example as `sweep check` draws it."""
    (log,) = load(root / BOREHOLE_LOG).derived["soil"]
    return _fenced(log_lines(log))


def vehicle_fit(_: Path) -> str:
    """Return what ``sweep fit-vehicle`` prints for the example."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "pulse.csv"
        file.write_text(example_pulse(), encoding="utf-8")
        return _fenced(fit_lines(fit_pulse(read_pulse(file), 6800.0)))
