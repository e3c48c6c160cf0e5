"""Printed tables: every input that varies is shown, and nothing that only looks like one."""

from __future__ import annotations

from pathlib import Path

import pytest

from boulder_sweep import uncertainty
from boulder_sweep.answers.printing import HEADS, need_lines, reserve_lines, uncertainty_lines
from boulder_sweep.answers.reserves import reserves
from boulder_sweep.settings import load_text
from boulder_sweep.settings.fields import INPUTS
from tests.answers.designs import bare_need, site

RATIOS = "embedment_ratio: [0.6, 0.65]"
UNCERTAIN = {"friction": "{mean: 38 deg, sd: 2 deg}", "site": RATIOS}


def test_every_input_has_a_head() -> None:
    assert set(HEADS) == {field.name for field in INPUTS}


@pytest.mark.parametrize("key", ["speed", "height", "friction_angle"])
def test_ratios_tell_answers_apart(key: str) -> None:
    found = bare_need(site(site=RATIOS, height="[3, 3.4] m"), key)
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
    heads = need_lines(bare_need(site(site=given), key))[0].split()
    assert heads[: 2 if key != "mass" else 1] == (["H", "φ′"] if key != "mass" else ["φ′"])
    assert heads.count("depth") == (0 if key == "embedment_ratio" else 1)
    assert heads.count("ratio") == (0 if key == "mass" else 1)


GRID = """\
name: grid
boulder: {length: 1.65 m, width: [1.6, 1.8] m, height: {from: 2.6 m, to: 3.6 m, step: 0.2 m}, density: 2600 kg/m^3}
site: {embedment_depth: 1.9 m}
soil: {density: 1860 kg/m^3, friction_angle: [36, 38, 40, 42] deg, subgrade_reaction: [50, 80] MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


@pytest.fixture(scope="module")
def many():
    """Answers for 12 boulders in 8 soils."""
    return bare_need(load_text(GRID, Path("grid.yaml")))


def test_many_answers_stand_boulder_by_soil_and_none_is_left_out(many) -> None:
    assert len(many) == 96
    lines = need_lines(many)
    assert all(len(line) <= 80 for line in lines)
    tables = "\n".join(lines).split("\n\n")
    assert lines[0].strip() == "least depth [m] by boulder and soil"
    found = {}
    for table in tables:
        rows = table.splitlines()
        (at,) = [place for place, line in enumerate(rows) if line.startswith("─")]
        soils = list(zip(*(line.split()[2:] for line in rows[at - 4 : at - 2]), strict=True))
        assert rows[at - 2].split() == ["W", "H", "mass"]
        for line in rows[at + 1 : at + 13]:
            width, height, mass, *cells = line.split()
            assert float(mass) == pytest.approx(float(width) * float(height) * 1.65 * 2.6, abs=0.06)
            found |= {(width, height, *soil): cell for soil, cell in zip(soils, cells, strict=True)}
    assert len(found) == 96
    for row in many.arrow.to_pylist():
        key = [row[name] for name in ("boulder_width_m", "boulder_height_m")]
        key += [row[name] for name in ("friction_angle_deg", "subgrade_reaction_MN_m3")]
        cell = found[tuple(f"{value:.5g}" for value in key)]
        words = {"blocked_by_overlap": "blocked", "never": "never", "undecided": "undecided"}
        assert cell == words.get(row["found"], f"{row['least_embedment_depth_m'] or 0:.3f}")


def test_of_too_many_answers_whole_tables_are_shown(many, monkeypatch) -> None:
    monkeypatch.setattr("boulder_sweep.answers.printing.MOST_IN_ALL", 20)
    lines = need_lines(many)
    assert sum(line.startswith("─") for line in lines) == 1
    assert "(the first 1 of 2 tables; -o writes all 96 rows)" in lines


def test_many_answers_without_a_soil_that_varies_are_one_table() -> None:
    text = (
        GRID.replace("[36, 38, 40, 42] deg", "40 deg").replace("[50, 80]", "50").replace("step: 0.2 m", "step: 0.04 m")
    )
    lines = need_lines(bare_need(load_text(text, Path("grid.yaml"))))
    assert lines[0].split() == ["W", "H", "depth", "ratio", "above", "mass", "margin", "second", "dig", "fill"]
    assert [line.split()[1] for line in lines[3:55]].count("3.6") == 2


def test_named_soils_are_columns() -> None:
    soils = [
        f"{{name: s{place}, density: 1860 kg/m^3, friction_angle: {36 + place} deg, subgrade_reaction: 60 MN/m^3}}"
        for place in range(4)
    ]
    text = "".join(
        f"soil: [{', '.join(soils)}]\n" if line.startswith("soil") else line for line in GRID.splitlines(keepends=True)
    )
    lines = need_lines(bare_need(load_text(text, Path("grid.yaml"))))
    assert lines[1].split() == ["soil", "s0", "s1", "s2", "s3"]
    assert lines[2].split() == ["φ′", "deg", "36", "37", "38", "39"]
