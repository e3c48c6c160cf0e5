"""What a design chart says of the question."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from boulder_sweep.answers.need import need
from tests.answers.designs import site


@pytest.mark.parametrize(
    ("probability", "words"), [("95 %", "passes with a probability of at least 95 %"), (None, "depth that passes")]
)
def test_the_title_says_for_which_probability(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, probability: str | None, words: str
) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr("boulder_sweep.views.figures.save", lambda fig, target: drawn.append(fig))
    friction = "{mean: 40 deg, sd: 1 deg}" if probability else "40 deg"
    sweep = site(height="[3.2, 3.4] m", site="embedment_depth: [1.9, 2.3] m", friction=friction)
    need(sweep, probability=probability, tolerance="1 cm").plot(tmp_path / "chart.png")
    assert " ".join(drawn[0].texts[0].get_text().split()).endswith(words)
