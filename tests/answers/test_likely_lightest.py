"""The lightest boulder that passes with a given probability."""

from pathlib import Path

import numpy as np
import pytest

from boulder_sweep import need, uncertainty
from boulder_sweep.answers import probability
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings import load_text

TEXT = """\
name: one
boulder: {length: 1.65 m, width: [1.5, 1.8] m, height: [2.6, 3.6] m, density: 2600 kg/m^3}
site: {embedment_depth: 2.2 m}
soil: {density: 1860 kg/m^3, friction_angle: {mean: 38 deg, sd: 2 deg}, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 28 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""
SIZES = ("boulder_width_m", "boulder_height_m")


def read(text):
    return load_text(text, Path("one.yaml"))


def chance_of(width, height):
    """The probability of passing by another command."""
    text = TEXT.replace("[1.5, 1.8]", f"{width}").replace("[2.6, 3.6]", f"{height}")
    return uncertainty(read(text), half_width=0.004).frame.iloc[0]


@pytest.fixture(scope="module")
def found():
    return need(read(TEXT), "mass", probability=0.9)


def test_the_answer_passes_often_enough_and_lighter_ones_do_not(found):
    row = found.frame.iloc[0]
    assert row.found == "found"
    assert found.probability == 0.9
    chance = chance_of(*(row[name] for name in SIZES))
    assert chance.p_pass_low <= row.p_pass <= chance.p_pass_high
    assert row.p_pass == pytest.approx(0.9, abs=0.01)
    assert row.boulder_mass_kg == pytest.approx(1.65 * 2600 * row.boulder_width_m * row.boulder_height_m)
    rng = np.random.default_rng(1)
    for width in rng.uniform(1.5, 1.8, 12):
        height = 0.99 * row.boulder_width_m * row.boulder_height_m / width
        if 2.6 <= height <= 3.6:
            assert chance_of(width, height).p_pass < 0.9


@pytest.mark.nightly
def test_more_certainty_needs_more_mass(found):
    surer = need(read(TEXT), "mass", probability=0.97).frame.iloc[0]
    assert surer.boulder_mass_kg > 1.01 * found.frame.boulder_mass_kg[0]


def test_what_has_a_distribution_cannot_be_searched():
    text = TEXT.replace("[2.6, 3.6] m", "{mean: 3 m, sd: 0.1 m}")
    with pytest.raises(QuestionError, match=r"searches for boulder\.height, which has a distribution"):
        need(read(text), "mass", probability=0.9)


def test_nothing_that_passes_often_enough():
    row = need(read(TEXT.replace("28 mph", "60 mph")), "mass", probability=0.9).frame.iloc[0]
    assert row.found == "never"
    assert row.p_pass < 0.9


def test_rows_do_not_depend_on_how_many_designs_are_drawn_at_once(found, monkeypatch):
    monkeypatch.setattr(probability, "AT_ONCE", 4096)
    again = need(read(TEXT), "mass", probability=0.9)
    assert again.frame.passes_at[0] == found.frame.passes_at[0]


def test_the_table_shows_the_probability(found):
    from boulder_sweep.answers.printing import need_lines

    lines = need_lines(found)
    lines = lines[lines.index("") + 1 :]
    assert lines[0].split() == ["mass", "L", "W", "H", "depth", "P(pass)", "dig", "fill"]
    assert lines[3].split()[-3] == f"{found.frame.p_pass[0]:.3f}"
