"""The report of every shape of result: it opens without a complaint, and what it says is what the table says."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import boulder_sweep
from boulder_sweep.report import write_report
from boulder_sweep.settings import load_text
from tests.report.conftest import LIST, SETS, SITE, reported

HEIGHTS, RATIOS = "boulder.height=[2.8, 3.4] m", "site.embedment_ratio=[0.55, 0.6, 0.65]"
LAYER = "{from: 0.5 m, density: 1900 kg/m^3, friction_angle: 36 deg, subgrade_reaction: 40 MN/m^3}"
RUNS = {
    "no axis": (),
    "no axis, fails": ("site.embedment_ratio=0.4",),
    "no axis, no impact": ("boulder.height=1 m",),
    "axes of one value": ("boulder.height=[3.4] m", "site.embedment_ratio=[0.6]"),
    "1 axis": ("boulder.height={from: 2.4 m, to: 3.6 m, count: 6}",),
    "2 axes": (HEIGHTS, RATIOS),
    "5 axes": (
        HEIGHTS,
        RATIOS,
        "boulder.width=[1.5, 1.7] m",
        "soil.friction_angle=[36, 42]",
        "vehicle.speed=[25, 30] mph",
    ),
    "water": (RATIOS, "soil.water_table=0.8 m"),
    "soil elements": (RATIOS, "model.soil={elements: 50}"),
    "soil elements, layers, water": (
        *(RATIOS, "model.soil={elements: 50}"),
        *(f"soil.layers=[{LAYER}]", "soil.water_table=1 m"),
    ),
    "layers and cohesion": (RATIOS, f"soil.layers=[{LAYER}]", "soil.cohesion=4 kPa"),
}
UNCERTAIN = {
    "uncertainty, no axis": SITE.replace("angle: 40 deg", "angle: {mean: 40 deg, cov: 5 %}"),
    "uncertainty, 1 axis": SITE.replace("angle: 40 deg", "angle: {mean: [36, 40] deg, cov: 5 %}"),
    "uncertainty, shipped": Path("configs/uncertain_site.yaml").read_text(),
}
IN_EVERY_RUN = ("no axis", "1 axis", "uncertainty, no axis", "soil elements")


def made(shape, folder):
    """Return the report of a result of this shape, and its rows."""
    if shape in UNCERTAIN:
        found = boulder_sweep.uncertainty(load_text(UNCERTAIN[shape], folder / "site.yaml"), half_width=0.2)
        found.write(folder / "site.parquet")
        return write_report(folder / "site.parquet", folder / "site.html"), found.frame
    if shape == "list":
        places = [f"{height},{height * 0.65},{angle}" for height in (3.2, 3.4) for angle in (30, 38, 42)]
        columns = "boulder_height_m,embedment_depth_m,friction_angle_deg"
        (folder / "designs.csv").write_text("\n".join([columns, *places]))
    text = {"list": LIST, "named soils": SETS}.get(shape, SITE)
    file = reported(text, folder, RUNS.get(shape, ()))
    return file, boulder_sweep.read(folder / "site.sweep")


SHAPES = [*RUNS, "list", "named soils", *UNCERTAIN]


@pytest.mark.parametrize(
    "shape", [pytest.param(one, marks=[] if one in IN_EVERY_RUN else pytest.mark.nightly) for one in SHAPES]
)
def test_it_opens_without_a_complaint_and_says_what_the_table_says(shape, tmp_path, opened):
    file, table = made(shape, tmp_path)
    table = table.astype({"verdict": str, "reason": str}).reset_index(drop=True)
    page = opened(file)
    assert page.complaints == []
    assert not page.is_visible("#failure")
    check_answer(page, table)
    check_map(page, table)
    check_designs(page, table)
    page.fill("#in-embedment_depth_m", "0.9")
    assert page.inner_text("#verdict").startswith(("✘ fail", "! error"))
    page.select_option("#units", "us")
    assert page.complaints == []


def check_answer(page, table):
    """Hold every number of designs in the answer against the table."""
    passing = table.verdict == "pass"
    if len(table) == 1:
        said, first = page.inner_text(".sheet"), table.iloc[0]
        if "p_pass" in table:  # nobody asked how probable it must be
            assert f"The boulder passes with a probability of {first.p_pass:.1%} (" in said
            return
        enough = first.verdict == "pass" and first.margin >= 0.25
        assert ("bury the boulder" in said.lower(), "The boulder does not pass" in said) == (enough, not enough)
        if enough:
            assert f"{100 * first.margin:.0f}\u00a0% to spare" in said
        return
    said = page.inner_text(".answer")
    counts = re.search(r"^(\d+) of (\d+) designs pass(?:es)? \((.*)%\)", said, re.MULTILINE)
    assert [int(counts[1]), int(counts[2])] == [passing.sum(), len(table)]
    assert float(counts[3]) == pytest.approx(100 * passing.mean(), abs=0.05)
    others = re.search(r"^Of the others, (.*)\.$", said, re.MULTILINE)
    found = [int(count) for count in re.findall(r"(?:^|; )(\d+) ", others[1])] if others else []
    assert sorted(found) == sorted(table[~passing].groupby(["verdict", "reason"]).size().tolist())


def check_map(page, table):
    """Hold the map, its legend and its sentence against the rows that it shows."""
    if page.query_selector("#across") is None:
        assert "No input differs between designs, so there is no map." in page.inner_text("main")
        return
    told = table.reason
    if "robustness" in table:
        told = told.where(
            table.verdict != "pass", table.robustness.astype(object).fillna("")
        )  # none where none was asked for
    verdicts = (table.verdict + told.where(told == "", ": " + told)).to_numpy()
    rows = page.evaluate("({ grid: page.data.rows.grid, values: page.data.rows.values, held: page.held })")
    if rows["grid"]:
        shown = (page.input_value("#across"), page.input_value("#up"))
        held = tuple(slice(None) if name in shown else rows["held"][name] for name in rows["values"])
        verdicts = verdicts.reshape([len(values) for values in rows["values"].values()])[held].ravel()
    passing, total = sum(one.startswith("pass") for one in verdicts), len(verdicts)
    assert page.inner_text("#sweep-words").startswith(f"{passing} of the {total} designs shown pass")
    cells = page.evaluate("page.maps.sweep.cells.flatMap((cell) => cell.names ?? [cell.name])")
    assert sorted(cells) == sorted(verdicts)
    legend = re.findall(r"\((\d+)\)", page.inner_text("#sweep-legend"))
    assert sum(map(int, legend)) == page.evaluate("page.maps.sweep.cells.length")


def check_designs(page, table):
    """Hold the simulator against every row, and the designs shown in full against theirs."""
    names = page.evaluate("page.inputs.map((input) => input.name)")
    rows = [{name: float(table[name][k]) for name in names} for k in range(len(table))]
    found = page.evaluate("(designs) => page.simulator.rows(designs)", rows)
    assert [one["verdict"] for one in found] == table.verdict.tolist()
    assert [one["reason"] for one in found] == table.reason.tolist()
    for name in ("margin", "max_rotation_deg", "penetration_m"):
        ours = np.array([one[name] for one in found], dtype=float)
        np.testing.assert_allclose(ours, table[name].to_numpy(dtype=float), rtol=1e-9, err_msg=name)
    for place, number in enumerate(page.evaluate("page.data.chosen.map((one) => one.number)")):
        words = page.inner_text(f"#chosen{place}-verdict")
        assert words[2:].startswith(table.verdict[number])
        margin = table.margin[number]
        assert (f"margin {100 * margin:.1f} %" in words) if pd.notna(margin) else ("margin" not in words)
