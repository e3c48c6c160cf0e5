"""Printed tables: every input that varies is shown, and nothing that only looks like one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boulder_sweep.answers.printing import need_lines
from boulder_sweep.settings import load_text
from tests.answers.designs import bare_need, site

RATIOS = "embedment_ratio: [0.6, 0.65]"
UNCERTAIN = {"friction": "{mean: 38 deg, sd: 2 deg}", "site": RATIOS}


def table_of(lines: list[str]) -> list[str]:
    """Return lines from the head of the table on."""
    return lines[lines.index("") + 1 :]


@pytest.mark.parametrize("key", ["speed", "height", "friction_angle"])
def test_ratios_tell_answers_apart(key: str) -> None:
    found = bare_need(site(site=RATIOS, height="[3, 3.4] m"), key)
    lines = table_of(need_lines(found, table=True))
    heads = lines[0].split()
    assert "ratio" in heads
    assert "depth" not in heads, "follows from ratio and height"
    rows = [line.split() for line in lines[3 : 3 + len(found)]]
    inputs = heads.index("mass") - 1  # the answer stands before the mass
    assert len({tuple(row[:inputs]) for row in rows}) == len(rows) == 2 * 2 * 2 / {"speed": 1}.get(key, 2)


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


def test_boulders_stand_with_the_depth_that_all_soils_need(many) -> None:
    assert len(many) == 96
    lines = table_of(need_lines(many))
    assert all(len(line) <= 80 for line in lines)
    assert lines[0].split() == ["W", "H", "mass", "all", "passes"]
    assert lines[1].split() == ["m", "m", "t", "m", "in,", "of", "8"]
    frame = many.frame.groupby(["boulder_width_m", "boulder_height_m"]).least_embedment_depth_m
    needed, count = frame.max().where(frame.count() == 8), frame.count()
    shown = [line.replace("→", " ").split() for line in lines[3:15]]
    assert len(shown) == len(needed) == 12
    assert {cells[3] for cells in shown} > {"-"}
    for width, height, mass, depth, passing in shown:
        size = float(width), float(height)
        assert float(mass) == pytest.approx(size[0] * size[1] * 1.65 * 2.6, abs=0.06)
        assert depth == ("-" if np.isnan(needed[size]) else f"{needed[size]:.3f}")
        assert int(passing) == count[size]


def test_soils_that_fit_are_columns() -> None:
    found = bare_need(load_text(GRID.replace("[36, 38, 40, 42]", "[36, 42]"), Path("grid.yaml")))
    lines = table_of(need_lines(found))
    assert lines[0].split() == ["W", "H", "mass", "all", *(["φ′", "36°"] * 2), *(["φ′", "42°"] * 2)]
    assert lines[1].split() == ["m", "m", "t", "m", "β", "50", "β", "80", "β", "50", "β", "80"]
    rows, words = found.arrow.to_pylist(), {"blocked_by_overlap": "blocked", "never": "never", "undecided": "undecided"}
    cells = [words.get(row["found"], f"{row['least_embedment_depth_m'] or 0:.3f}") for row in rows]
    assert [cell for line in lines[3:15] for cell in line.replace("→", " ").split()[4:]] == cells


def test_the_boulder_that_is_recommended_is_marked(many) -> None:
    lines = table_of(need_lines(many))
    sizes = many.recommendation.design.sizes
    (marked,) = (line.split()[1:3] for line in lines if "→" in line)
    assert [float(cell) for cell in marked] == [sizes["boulder_width_m"], sizes["boulder_height_m"]]
