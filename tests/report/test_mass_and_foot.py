"""Boulders that were weighed, and rounded feet, in the page: verdicts and settings file equal the command's."""

import math
from pathlib import Path

import pytest

import boulder_sweep
from boulder_sweep.report import write_explorer, write_report
from boulder_sweep.report.answers import answer_of
from boulder_sweep.report.rows import read_rows
from boulder_sweep.report.sheet import sheet_of
from boulder_sweep.settings import load_text

FILE = """boulder: {{length: 1.65 m, width: 1.68 m, height: 3.44 m, {boulder}}}
site: {{embedment_depth: 2.3 m}}
soil: {{density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 95 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""


@pytest.mark.parametrize(
    ("boulder", "heaviest"),
    [
        ("mass: 24.5 t", True),
        ("density: 2600 kg/m^3, mass: 9 t", True),
        ("foot: rounded, density: 2600 kg/m^3", False),
    ],
)
def test_the_simulator_judges_weighed_boulders_and_rounded_feet(boulder, heaviest, tmp_path, opened):
    sweep = load_text(FILE.format(boulder=boulder), Path("stone.yaml"))
    page = opened(write_explorer(sweep, 0, tmp_path / "stone.html"))
    found, known = page.evaluate("page.simulator.whole(page.design)")["judged"], boulder_sweep.simulate(sweep).summary()
    for name in ("verdict", "reason", "validity"):
        assert found[name] == known[name]
    for name in ("max_rotation_deg", "solidity"):
        assert found[name] == pytest.approx(known[name], rel=1e-5)
    copied = load_text(page.input_value("#yaml"), Path("copied.yaml"))
    assert copied.constants == pytest.approx(sweep.constants, rel=1e-5)
    assert copied.model == sweep.model
    if heaviest:
        (refused,) = page.evaluate("page.simulator.rows([{ ...page.design, boulder_mass_kg: 3e4 }])")
        assert refused["reason"] == "boulder is heavier than a solid box of its size and rock"
    assert f"Foot: {sweep.model.foot}" in page.content()


def test_the_simulator_refuses_a_boulder_as_taped_in_words(tmp_path, opened):
    """Its row in the command is the worst of several shapes, which the page does not know."""
    sweep = load_text(FILE.format(boulder="density: 2600 kg/m^3, mass: 20 t"), Path("stone.yaml"))
    page = opened(write_explorer(sweep, 0, tmp_path / "stone.html"))
    (refused,) = page.evaluate("page.simulator.rows([page.design])")
    assert refused["verdict"] == "error"
    assert "this page does not know the shapes" in refused["reason"]
    assert "this page does not know the shapes" in page.inner_text("body")
    (box,) = page.evaluate("page.simulator.rows([{ ...page.design, boulder_mass_kg: 24500 }])")
    assert box["verdict"] == "pass"


def test_the_report_of_a_taped_boulder_shows_the_shape_that_decides(tmp_path, opened):
    """Its drawing has that shape, and nothing stands where the page cannot simulate it."""
    found = boulder_sweep.need(load_text(FILE.format(boulder="density: 2600 kg/m^3, mass: 20 t"), Path("stone.yaml")))
    found.write(tmp_path / "depth.parquet")
    rows = read_rows(tmp_path / "depth.parquet")
    sheet = sheet_of(rows, answer_of(rows), "si")
    solidity = 20e3 / (2600 * math.prod(rows.row(0)[f"boulder_{side}_m"] for side in ("length", "width", "height")))
    assert ("fills of its box", f"{solidity:.0%}") in sheet.build
    assert ("drawn: worst of its shapes", rows.row(0)["shape"].replace("_", " ")) in sheet.build
    assert len({x for x, _ in sheet.sketch.corners}) > 2, "a box has two upright sides"
    page = opened(write_report(tmp_path / "depth.parquet", tmp_path / "page.html"))
    page.emulate_media(media="print")
    assert "this page does not know the shapes" not in page.inner_text("body")
