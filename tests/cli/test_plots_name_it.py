"""A picture names the design that is recommended, in the words of the terminal and of the page."""

from __future__ import annotations

import re
from pathlib import Path

from boulder_sweep.answers.advice import advice
from boulder_sweep.report.answers import answer_of
from boulder_sweep.report.rows import read_rows

CONFIGS = Path(__file__).parents[2] / "configs"


def words_in(picture: Path) -> str:
    """Return what a picture says, line breaks apart: matplotlib notes every text beside its outlines."""
    return " ".join(" ".join(re.findall(r"<!-- (.*?) -->", picture.read_text(encoding="utf-8"), re.DOTALL)).split())


def test_a_chart_of_answers(sweep, tmp_path):
    file, chart = tmp_path / "need.parquet", tmp_path / "need.svg"
    _, out, _ = sweep("need", CONFIGS / "site.yaml", "-q", "-o", file, "--plot", chart)
    assert sweep("plot", file, "-o", tmp_path / "again.svg")[0] == 0
    sentence = " ".join(out.partition("\nShallower")[0].split())
    assert sentence.startswith("Bury the 3.4 m boulder")
    for picture in (chart, tmp_path / "again.svg"):
        words = words_in(picture)
        assert sentence in words.replace("\N{NO-BREAK SPACE}", " ")
        assert "recommended" in words


def test_a_chart_without_a_recommendation_marks_none(sweep, tmp_path):
    sweep("need", CONFIGS / "site.yaml", "-q", "--most", "speed", "--plot", tmp_path / "speed.svg")
    assert "recommended" not in words_in(tmp_path / "speed.svg")


def test_a_map_of_a_run_that_asked_second_opinions(sweep, tmp_path):
    ratios = ["site.embedment_ratio=[0.6, 0.65, 0.7]", "boulder.height=[3.0, 3.4, 3.6] m"]
    options = [word for ratio in ratios for word in ("--set", ratio)]
    for name, asked in (("asked", []), ("not", ["--no-second-opinion"])):
        sweep("run", CONFIGS / "site.yaml", "-q", "-o", tmp_path / f"{name}.sweep", *options, *asked)
        assert sweep("plot", tmp_path / f"{name}.sweep", "-o", tmp_path / f"{name}.svg")[0] == 0
    sentence = advice(answer_of(read_rows(tmp_path / "asked.sweep")).need)[0].replace("\N{NO-BREAK SPACE}", " ")
    assert sentence.startswith("Bury the ")
    assert sentence in words_in(tmp_path / "asked.svg").replace("\N{NO-BREAK SPACE}", " ")
    assert "ury the " not in words_in(tmp_path / "not.svg")
