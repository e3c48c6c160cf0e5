"""What charts of answers say: of the question, of which design a probability is, and numbers that are small or none."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from boulder_sweep.answers.need import need
from boulder_sweep.answers.uncertainty import Uncertainty, uncertainty
from boulder_sweep.text import chance_text
from tests.answers.designs import site


@pytest.fixture(scope="module")
def found() -> Uncertainty:
    """Probabilities of two designs, asked with a margin."""
    sweep = site(height="[3.2, 3.4] m", site="embedment_depth: 2.2 m", friction="{mean: 38 deg, sd: 3 deg}")
    return uncertainty(sweep, margin="25 %", half_width=0.05)


def changed(found: Uncertainty, p_pass: float, passing: int) -> Uncertainty:
    """Return a result with another probability, and so many samples that pass."""
    distance = np.where(np.arange(len(found.samples)) % 4096 < passing, 1.0, -1.0)
    samples = found.samples.set_column(found.samples.column_names.index("distance"), "distance", pa.array(distance))
    arrow = found.arrow
    for name in ("p_pass", "p_pass_low", "p_pass_high"):
        arrow = arrow.set_column(arrow.column_names.index(name), name, pa.array([p_pass] * len(arrow)))
    return replace(found, arrow=arrow, samples=samples)


def figure_of(found: Uncertainty, path: Path, drawn: list[Figure], design_id: int = 1) -> Figure:
    found.plot(path / "chance.png", design_id)
    FigureCanvasAgg(drawn[-1]).draw()
    return drawn[-1]


@pytest.mark.parametrize(("p_pass", "passing"), [(0.0, 0), (1.0, 4096), (0.0004, 2), (0.9996, 4094), (0.5, 2048)])
def test_probabilities_are_within_their_limits_and_readable(found, tmp_path, drawn, p_pass, passing):
    fig = figure_of(changed(found, p_pass, passing), tmp_path, drawn)
    tornado = fig.axes[1]
    low, high = tornado.get_xlim()
    assert 0.0 <= low < high <= 1.0
    assert high - low >= 0.01 - 1e-12
    assert low <= p_pass <= high
    assert not tornado.xaxis.get_offset_text().get_text()
    labels = [text.get_window_extent() for text in tornado.texts]
    assert labels
    assert not any(one.overlaps(other) for one, other in itertools.combinations(labels, 2))
    assert all(tornado.bbox.x0 <= one.x0 and one.x1 <= tornado.bbox.x1 for one in labels)
    assert not any(one.overlaps(bar.get_window_extent()) for one in labels for bar in tornado.patches)
    if passing == 2:
        assert "P(pass) = 0.00040" in fig.texts[0].get_text()


def test_the_picture_says_of_which_design_it_is(found, tmp_path, drawn):
    titles, captions = [], []
    for design_id in (0, 1):
        title, caption = figure_of(found, tmp_path, drawn, design_id).texts
        titles.append(title.get_text())
        captions.append(" ".join(caption.get_text().split()))
        assert caption.get_window_extent().x1 <= caption.figure.bbox.x1
    assert [title.partition(":")[0] for title in titles] == ["site #0", "site #1"]
    assert "Design #0 of #0 to #1: " in captions[0]
    assert "height 3.2 m" in captions[0]
    assert "height 3.4 m" in captions[1]
    assert "Means of the uncertain inputs: φ′ = 38°." in captions[1]
    assert captions[1].endswith(
        "Pass: rotation up to 20° and rating P1 · readings corrected. Simulation, not a rating by test. "
        "Here a pass also has a margin of at least 25%."
    )


@pytest.mark.parametrize(
    ("chance", "text"),
    [
        (0.0, "0"),
        (1.0, "1"),
        (0.5, "0.500"),
        (0.846, "0.846"),
        (0.0098, "0.0098"),
        (0.00004, "0.000040"),
        (0.99987, "0.99987"),
        (1e-16, "0"),
    ],
)
def test_digits_of_a_probability(chance: float, text: str) -> None:
    assert chance_text(chance) == text


def test_every_curve_with_an_answer_is_in_the_legend_and_whole_numbers_have_whole_ticks(
    tmp_path: Path, drawn: list[Figure]
) -> None:
    sweep = site(height="[10, 11, 12] ft", friction="[20, 36, 37, 38, 39, 40] deg")
    found = need(sweep, margin=0, robust=False, prefer=None)
    found.plot(tmp_path / "chart.png", units="us")
    axes = drawn[0].axes[0]
    answered = sorted(set(found.frame.friction_angle_deg[found.frame.passes_at.notna()]))
    assert len(answered) == 5
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [f"φ′ = {angle:g}°" for angle in answered]
    assert all(tick == round(tick) for tick in axes.get_xticks())


@pytest.mark.parametrize(
    ("probability", "words"), [("95 %", "passes with a probability of at least 95 %"), (None, "depth that passes")]
)
def test_the_title_says_for_which_probability(
    tmp_path: Path, drawn: list[Figure], probability: str | None, words: str
) -> None:
    friction = "{mean: 40 deg, sd: 1 deg}" if probability else "40 deg"
    sweep = site(height="[3.2, 3.4] m", site="embedment_depth: [1.9, 2.3] m", friction=friction)
    need(sweep, probability=probability).plot(tmp_path / "chart.png")
    assert " ".join(drawn[0].texts[0].get_text().split()).endswith(words)
