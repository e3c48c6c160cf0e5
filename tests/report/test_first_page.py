"""The first page of a report: heading, section to scale, the map of the recommended design, and the page as a PDF."""

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.errors import ReportError
from boulder_sweep.report import write_report, writing
from boulder_sweep.settings.sweep import Heading
from tests.report.conftest import SITE, reported

LAYER = "{from: 0.5 m, density: 1900 kg/m^3, friction_angle: 36 deg, subgrade_reaction: 40 MN/m^3}"


def test_the_map_is_that_of_the_recommended_design_in_its_worst_soil(report, result, opened):
    page = opened(report)
    table = boulder_sweep.read(result)
    table["embedment_ratio"] = table.embedment_depth_m / table.boulder_height_m
    first = page.evaluate("page.data.chosen[0]")
    assert first["title"] == "Recommended design"
    values, held = page.evaluate("page.data.rows.values"), page.evaluate("page.held")
    for name in values:
        assert values[name][held[name]] == pytest.approx(table[name][first["number"]], rel=1e-12)
    assert table.friction_angle_deg[first["number"]] == table.friction_angle_deg.min()
    assert page.complaints == []


def test_the_section_has_its_dimensions_layers_and_water_in_the_units_chosen(tmp_path, opened):
    page = opened(reported(SITE, tmp_path, [f"soil.layers=[{LAYER}]", "soil.water_table=0.8 m"]))
    words = " ".join(page.locator(".section svg text").all_text_contents())
    for said in (
        "d = 2.04",
        "above 1.36",
        "H = 3.4",
        "W = 1.68",
        "L = 1.65",
        "bumper 0.5",
        "water table 0.8",
        "φ′ 36",
        "β 40",
    ):
        assert said in words
    sides = page.locator(".section .boulder").get_attribute("points").split()
    corners = np.array([[float(number) for number in side.split(",")] for side in sides])
    np.testing.assert_allclose(np.ptp(corners, axis=0), [1.65, 3.4])
    assert page.locator(".section rect:is(.soil, .wedge)").count() == 3  # two layers, and the plan
    plan = {side: float(page.locator(".section .rock").get_attribute(side)) for side in ("width", "height")}
    assert plan == pytest.approx({"width": 1.65, "height": 1.68})
    page.select_option("#units", "us")
    assert "L = 5.41" in " ".join(page.locator(".section svg text").all_text_contents())


def test_all_of_a_report_in_us_units_is_in_them_and_says_what_uncertain_inputs_were_taken_at(tmp_path):
    uncertain = ["soil.friction_angle={mean: 40 deg, cov: 5 %}", "soil.water_table=0.8 m", "soil.cohesion=4 kPa"]
    (tmp_path / "site.yaml").write_text(SITE)
    sweep = boulder_sweep.at_values(boulder_sweep.load(tmp_path / "site.yaml", uncertain), "mean")
    boulder_sweep.run(sweep, tmp_path / "site.sweep")
    text = write_report(tmp_path / "site.sweep", tmp_path / "site.html", units="us").read_text()
    for said in (
        "water table 2.625 ft down",
        "cohesion 83.54 psf",
        "water_table_ft: 2.62467",
        "boulder_length_ft: 5.413",
    ):
        assert said in text
    assert "Uncertain inputs are taken at φ′ = 40° (mean)." in text


@pytest.mark.nightly
def test_the_page_is_printed_to_a_pdf(result, tmp_path, chromium):
    file = write_report(result, tmp_path / "page.pdf", heading=Heading(client="City", author="Ö"))
    content = file.read_bytes()
    assert content.startswith(b"%PDF")
    assert b"/Title (sizing: boulder-sweep)" in content
    assert b"/Author <feff00d6>" in content[content.index(b"%%EOF") :]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.pdf"]


def test_a_page_that_is_not_ready_is_not_printed(monkeypatch, chromium):
    """As on a busy machine: nothing has filled it, and nothing has changed its title."""
    monkeypatch.setattr(writing, "SETTLED_MS", (100, 200))
    with pytest.raises(ReportError, match=r"the page was not ready when .* printed it; write the page as \.html"):
        writing.printed("<html><head><title>site</title></head><body>empty</body></html>")
    ready = "<title>site</title><script>document.title = 'site'</script>"
    assert writing.printed(f"<html><head>{ready}</head><body>filled</body></html>").startswith(b"%PDF")
