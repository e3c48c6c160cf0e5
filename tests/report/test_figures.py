"""Figures of the page: the log of a borehole, and colours, which are those of pictures."""

from __future__ import annotations

import copy
import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

from boulder_sweep.report.figures import COLOURS, log_charts
from boulder_sweep.report.writing import write_report
from boulder_sweep.runner.run import run
from boulder_sweep.settings import load
from boulder_sweep.settings.stored import check_stored
from boulder_sweep.views.verdict_map import CLASSES

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def settings():
    """Resolved settings of the example with a log."""
    return load(CONFIGS / "borehole_log.yaml", ["site.embedment_depth=2.55 m"]).resolved()


def test_readings_and_layers_are_those_of_the_log(settings):
    (chart,) = log_charts(settings)
    data = settings["derived"]["soil"][0]
    assert chart.title == "borehole_log.csv, hole BH-2"
    assert chart.quantity == "N"
    assert [(one.depth, one.value) for one in chart.readings] == [
        (one["depth_m"], one["n"]) for one in data["readings"]
    ]
    assert [one.depth for one in chart.readings if one.left_out] == [0.15]
    assert [one.depth for one in chart.readings if one.at_least] == [2.55]
    assert chart.layers == ((0.0, 1.65), (1.65, 4.0))
    assert chart.foot == 2.55
    assert (chart.depths[-1], chart.values[-1]) == (4.0, 50.0)


def test_words_keep_apart_and_stand_in_the_order_of_their_depths(settings):
    crowded = copy.deepcopy(settings)
    soil = crowded["derived"]["soil"][0]
    soil["layers"] = [soil["layers"][0] | {"from_m": 1.6 + 0.3 * k, "to_m": 1.9 + 0.3 * k} for k in range(5)]
    (chart,) = log_charts(crowded)
    assert len(chart.labels) == 6
    wanted = sorted([layer["from_m"] for layer in soil["layers"]] + [2.55])
    assert all(label.at >= depth for label, depth in zip(chart.labels, wanted, strict=True))
    assert min(below.at - above.at for above, below in pairwise(chart.labels)) >= 0.0699 * chart.depths[-1]


@pytest.mark.parametrize("depth", [0.4, 1.0, 2.55, 7.3, 31.0])
def test_axes_end_at_the_first_round_number_beyond_what_is_drawn(settings, depth):
    deep = copy.deepcopy(settings)
    deep["derived"]["soil"][0] |= {"foot_m": 0.1, "readings": [{"n": 3.0, "depth_m": depth}], "layers": []}
    (chart,) = log_charts(deep)
    assert chart.depths[-2] < depth <= chart.depths[-1]
    assert 3 <= len(chart.depths) <= 7
    (in_feet,) = log_charts(deep, "us")
    feet = [depth / 0.3048 for depth in in_feet.depths]
    assert feet == pytest.approx([float(f"{one:.3g}") for one in feet])
    assert in_feet.depths[-2] < depth <= in_feet.depths[-1]


def test_soil_without_a_log_has_no_figure():
    assert log_charts(load(CONFIGS / "borehole.yaml").resolved()) == []
    assert log_charts(load(CONFIGS / "site.yaml").resolved()) == []


def test_the_page_shows_the_figure(tmp_path):
    out = tmp_path / "log.sweep"
    run(load(CONFIGS / "borehole_log.yaml", ["site.embedment_depth=2.55 m"]), out, jobs=1)
    page = write_report(out, tmp_path / "page.html").read_text(encoding="utf-8")
    figure = re.search(r'<figure class="log">.*?</figure>', page, re.DOTALL)
    assert figure is not None
    assert figure[0].count("<circle") == 8
    assert "left out: topsoil" in figure[0]
    assert "nan" not in figure[0]


@pytest.mark.parametrize(
    "change",
    [{"readings": []}, {"readings": [{"n": "3"}]}, {"readings": [{"n": 3.0, "depth_m": None}]}, {"foot_m": "2"}],
)
def test_records_of_a_stranger_that_cannot_be_drawn_are_refused(settings, change):
    broken = json.loads(json.dumps(settings))  # as a file gives them
    check_stored(broken)
    broken["derived"]["soil"][0] |= change
    with pytest.raises(ValueError, match="derived is not what a settings file gives"):
        check_stored(broken)


def test_a_verdict_has_one_colour() -> None:
    for key, colour, _ in CLASSES:
        name = key.replace("/", ": ")
        found = COLOURS.get(name) or COLOURS[name.split(":")[0]]  # as the page's script looks it up
        assert found == colour, key
    assert len(set(COLOURS.values())) == len(COLOURS)
