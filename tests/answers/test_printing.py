"""Printed tables: every input that varies is shown, and nothing that only looks like one."""

from __future__ import annotations

import pytest

from boulder_sweep import uncertainty
from boulder_sweep.answers.need import need
from boulder_sweep.answers.printing import HEADS, need_lines, reserve_lines, uncertainty_lines
from boulder_sweep.answers.reserves import reserves
from boulder_sweep.settings.fields import INPUTS
from tests.answers.designs import site

RATIOS = "embedment_ratio: [0.6, 0.65]"
UNCERTAIN = {"friction": "{mean: 38 deg, sd: 2 deg}", "site": RATIOS}


def test_every_input_has_a_head() -> None:
    assert set(HEADS) == {field.name for field in INPUTS}


@pytest.mark.parametrize("key", ["speed", "height", "friction_angle"])
def test_ratios_tell_answers_apart(key: str) -> None:
    found = need(site(site=RATIOS, height="[3, 3.4] m"), key, both_readings=False)
    lines = need_lines(found)
    heads = lines[0].split()
    assert "ratio" in heads
    assert "depth" not in heads, "follows from ratio and height"
    rows = [line.split() for line in lines[3 : 3 + len(found)]]
    inputs = heads.index("mass") - 1  # the answer stands before the mass
    assert len({tuple(row[:inputs]) for row in rows}) == len(rows) == 2 * 2 * 2 / {"speed": 1}.get(key, 2)


def test_ratios_tell_designs_apart_whose_reserves_or_chances_are_shown() -> None:
    lines = reserve_lines(reserves(site(site=RATIOS, height="3 m")))
    assert lines[0].split()[:3] == ["ratio", "φ′", "verdict"]
    assert [line.split()[0] for line in lines[3:7]] == ["0.6", "0.6", "0.65", "0.65"]
    found = uncertainty(site(**UNCERTAIN, height="3 m"), half_width=0.2)
    lines = uncertainty_lines(found)
    assert lines[0].split()[0] == "ratio"
    assert [line.split()[0] for line in lines[3:5]] == ["0.6", "0.65"]


@pytest.mark.parametrize("given", ["embedment_depth: [1.8, 2.0] m", RATIOS])
@pytest.mark.parametrize("key", ["embedment_ratio", "embedment_depth", "mass"])
def test_the_other_measure_of_what_is_asked_for_is_no_input(key: str, given: str) -> None:
    heads = need_lines(need(site(site=given), key, both_readings=False))[0].split()
    assert heads[: 2 if key != "mass" else 1] == (["H", "φ′"] if key != "mass" else ["φ′"])
    assert heads.count("depth") == (0 if key == "embedment_ratio" else 1)
    assert heads.count("ratio") == (0 if key == "mass" else 1)
