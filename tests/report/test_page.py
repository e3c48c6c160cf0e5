"""The page in a browser: it opens from disk, asks for nothing, and simulates what the command line simulates."""

import csv
import math
import re

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.report import example, write_explorer, write_report
from boulder_sweep.settings.model import RESISTANCES
from boulder_sweep.views.wording import LAW_WORDS
from tests.report.conftest import GRID, SETS

SLIDERS = {
    "boulder_length_m": (0.6, 2.0),
    "boulder_width_m": (0.8, 2.5),
    "boulder_height_m": (1.5, 4.0),
    "boulder_density_kg_m3": (2400.0, 3074.0),
    "soil_density_kg_m3": (1520.0, 2240.0),
    "friction_angle_deg": (27.0, 49.0),
    "subgrade_reaction_MN_m3": (2.0, 110.0),
    "strain_rate_factor": (1.0, 1.2),
    "vehicle_mass_kg": (2000.0, 15000.0),
    "impact_speed_m_s": (4.0, 25.0),
    "bumper_height_m": (0.4, 0.7),
    "hood_height_m": (1.3, 1.6),
    "bed_offset_m": (2.5, 3.2),
}
KEPT = {"vehicle_spring_N_m": 3103.3e3, "vehicle_damper_N_s_m": 138.91e3}


@pytest.fixture(scope="module")
def explorer(tmp_path_factory):
    """Page for one design whose impact height follows from the others."""
    folder = tmp_path_factory.mktemp("explorer")
    (folder / "case.yaml").write_text(
        "name: case\nboulder: {length: 1.65 m, width: 1.68 m, height: 3.44 m, density: 2596 kg/m^3}\n"
        "site: {embedment_depth: 2.03 m}\n"
        "soil: {density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 95 MN/m^3}\n"
        "vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}\n"
    )
    return write_explorer(boulder_sweep.load(folder / "case.yaml"), 0, folder / "case.html")


def random_designs(count):
    rng = np.random.default_rng(12)
    for _ in range(count):
        design = {name: float(rng.uniform(*ends)) for name, ends in SLIDERS.items()} | KEPT
        design["embedment_depth_m"] = design["boulder_height_m"] * float(rng.uniform(0.35, 0.75))
        yield design


@pytest.mark.parametrize("kind", ["report", "explorer"])
def test_it_opens_from_disk_without_a_complaint_or_a_request(kind, opened, request):
    file = request.getfixturevalue(kind)
    page = opened(file)
    assert page.complaints == []
    assert [url for url in page.requests if not url.startswith("data:")] == [file.resolve().as_uri()]
    assert not page.is_visible("#failure")
    assert file.stat().st_size < 3_000_000


def test_the_page_forbids_the_network(report, opened):
    page = opened(report)
    # A page that could leak would do so without a word; the browser must refuse.
    outcome = page.evaluate("fetch('http://127.0.0.1:9/').then(() => 'sent', (problem) => problem.name)")
    assert outcome == "TypeError"
    assert any("Content Security Policy" in words for words in page.complaints)
    page.evaluate("document.head.append(Object.assign(document.createElement('script'), { text: 'window.added = 1' }))")
    assert page.evaluate("window.added") is None


@pytest.mark.parametrize("count", [60, pytest.param(200, marks=pytest.mark.nightly)])
def test_random_designs_come_out_as_the_command_line_has_them(explorer, opened, count):
    page = opened(explorer)
    designs = list(random_designs(count))
    code = "(designs) => designs.map((one) => { page.take(one); return page.simulator.whole(page.design).judged; })"
    found = page.evaluate(code, designs)
    seen, flags = set(), set()
    for design, ours in zip(designs, found, strict=True):
        theirs = boulder_sweep.simulate(design).summary()
        seen.add(theirs["reason"])
        flags |= set((theirs["validity"] or "").split(";"))
        for name, value in ours.items():
            if not isinstance(theirs[name], float):
                assert value == theirs[name], name
            elif name.endswith(("error_deg", "error_m")):
                # A difference of two solutions that agree to many digits.
                assert value == pytest.approx(theirs[name], rel=1e-5, abs=1e-11), name
            else:
                assert value == pytest.approx(theirs[name], rel=1e-9), name
    assert seen >= {"", "overturns", "no_contact"}
    assert len(flags) > 3


@pytest.mark.nightly
def test_maps_come_out_as_a_sweep_has_them(report, result, opened):
    """Stopped at the limit, as rows are."""
    table = boulder_sweep.read(result)
    page = opened(report)
    inputs = table.iloc[:, 1:18].to_dict("records")
    found = page.evaluate("(designs) => page.simulator.rows(designs)", inputs)
    assert [one["verdict"] for one in found] == table.verdict.tolist()
    for name in ("max_rotation_deg", "max_vehicle_displacement_m", "peak_force_kN", "end_time_s", "margin"):
        ours = np.array([math.nan if one[name] is None else one[name] for one in found])
        np.testing.assert_allclose(ours, table[name].to_numpy(dtype=float), rtol=1e-9)


def test_curves_are_those_of_the_command_line(explorer, opened):
    page = opened(explorer)
    design = next(random_designs(1))
    motion = page.evaluate(
        """(design) => {
          page.take(design);
          const { time, columns } = page.motions.live.motion;
          return { time: [...time], ...Object.fromEntries(Object.entries(columns).map(([k, v]) => [k, [...v]])) };
        }""",
        design,
    )
    trajectory = boulder_sweep.simulate(design, sample_s=1 / 400)
    energy = trajectory.energy()
    theirs = {
        "theta_b": trajectory.rotation_rad,
        "x_v": trajectory.vehicle_displacement_m,
        "F_v": trajectory.contact_force_N,
        **{name.removesuffix("_J"): getattr(energy, name) for name in vars(energy) if name.endswith("_J")},
    }
    assert motion["time"] == pytest.approx(trajectory.time_s)
    for name in set(motion) & set(theirs):
        scale = np.abs(theirs[name]).max()
        np.testing.assert_allclose(motion[name], theirs[name], rtol=0, atol=1e-9 * max(scale, 1e-12), err_msg=name)


@pytest.mark.nightly
def test_a_slider_moves_everything(explorer, opened):
    page = opened(explorer)
    before = page.inner_text("#outcomes")
    page.fill("#in-embedment_depth_m", "1.2")
    assert page.inner_text("#verdict").startswith("✘ fail")
    assert page.inner_text("#outcomes") != before
    page.focus("#slide-friction_angle_deg")
    angle = page.input_value("#in-friction_angle_deg")
    page.keyboard.press("End")
    assert float(page.input_value("#in-friction_angle_deg")) > float(angle)
    page.fill("#in-embedment_depth_m", "3.5")
    assert "embedment depth is not less than the boulder's height" in page.inner_text("#verdict")
    page.click("#reset")
    assert page.inner_text("#outcomes") == before


@pytest.mark.nightly
def test_units_switch_everywhere_and_back(report, opened):
    page = opened(report)
    metric = page.inner_text("main")
    page.select_option("#units", "us")
    depth = float(page.input_value("#in-embedment_depth_m"))
    assert "kip" in page.inner_text("#outcomes")
    assert re.search(r"bury the boulder .* \([\d,]+\slb\)", page.inner_text(".recommendation:visible").lower())
    page.fill("#in-embedment_depth_m", str(depth))
    page.select_option("#units", "si")
    assert float(page.input_value("#in-embedment_depth_m")) == pytest.approx(depth * 0.3048, rel=1e-5)
    page.click("#reset")
    assert page.inner_text("main") == metric


def test_the_copied_file_means_the_same_design(tmp_path, explorer, opened):
    page = opened(explorer)
    design = next(random_designs(1))
    page.evaluate("(design) => page.take(design)", design)
    (tmp_path / "copied.yaml").write_text(page.input_value("#yaml"))
    sweep = boulder_sweep.load(tmp_path / "copied.yaml")
    block = sweep.block(0, 1)
    for name, value in design.items():
        assert block.columns[name].to_numpy()[0] == pytest.approx(value, rel=5e-6), name
    assert sweep.resolved()["solver"] == boulder_sweep.load(explorer.with_name("case.yaml")).resolved()["solver"]


@pytest.mark.nightly
def test_the_list_comes_as_csv_with_the_names_of_the_table(explorer, opened, tmp_path):
    page = opened(explorer)
    page.click("#add")
    page.fill("#in-embedment_depth_m", "1.5")
    page.click("#add")
    with page.expect_download() as download:
        page.click("#csv")
    download.value.save_as(tmp_path / "designs.csv")
    with (tmp_path / "designs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["embedment_depth_m"]) for row in rows] == [2.03, 1.5]
    assert set(boulder_sweep.simulate(example()).inputs) <= set(rows[0])
    assert rows[0]["verdict"] == "pass"


@pytest.mark.nightly
def test_the_map_shows_the_rows_and_a_rectangle_can_be_picked(report, result, opened):
    page = opened(report)
    table = boulder_sweep.read(result)
    page.select_option("#across", "boulder_height_m")
    page.select_option("#up", "friction_angle_deg")
    shown = page.evaluate("page.maps.sweep.cells.map((cell) => ({ ...cell.pick(), name: cell.name }))")
    assert len(shown) == 18
    for cell in shown:
        row = table[
            np.isclose(table.boulder_width_m, cell["boulder_width_m"])
            & np.isclose(table.boulder_height_m, cell["boulder_height_m"])
            & np.isclose(table.embedment_depth_m, cell["embedment_ratio"] * cell["boulder_height_m"])
            & np.isclose(table.friction_angle_deg, cell["friction_angle_deg"])
        ]
        assert [cell["name"].split(": ")[0]] == row.verdict.tolist()
    page.evaluate("page.plots.find('sweep-cells').selected.indices = [3]")
    design = page.evaluate("page.design")
    assert design["boulder_height_m"] == pytest.approx(shown[3]["boulder_height_m"])
    assert design["friction_angle_deg"] == pytest.approx(shown[3]["friction_angle_deg"])


@pytest.mark.nightly
def test_named_soils_have_their_names_on_the_slider(tmp_path, opened):
    (tmp_path / "sites.yaml").write_text(SETS)
    boulder_sweep.run(boulder_sweep.load(tmp_path / "sites.yaml"), tmp_path / "out")
    page = opened(write_report(tmp_path / "out", tmp_path / "out.html"))
    assert page.inner_text("#held") == "soil: loose"  # in which the nearest design fails
    page.evaluate("page.take(page.maps.sweep.cells[0].pick())")
    assert page.evaluate("page.design.friction_angle_deg") == 32.0
    assert page.evaluate("page.design.soil_density_kg_m3") == 1700.0


@pytest.mark.nightly
@pytest.mark.parametrize("width", [480, 1280])
def test_nothing_is_wider_than_the_screen(report, opened, width):
    page = opened(report, viewport={"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.nightly
def test_every_control_has_a_name_and_every_picture_words(report, opened):
    page = opened(report)
    nameless = page.evaluate(
        """[...document.querySelectorAll("input, select, button, textarea, svg[role=img]")]
          .filter((one) => !(one.labels?.length || one.getAttribute("aria-label") || one.textContent.trim()))
          .map((one) => one.id)"""
    )
    assert nameless == []


HOSTILE = "<script>alert(1)</script>\"' & \x1b[31m{{ 7 * 7 }} </title><img src=x onerror=alert(2)>"


def test_a_hostile_name_is_only_a_name(tmp_path, opened):
    sweep = example()
    object.__setattr__(sweep, "name", HOSTILE)
    page = opened(write_explorer(sweep, 0, tmp_path / "<b>&.html"))
    assert page.dialogs == []
    assert page.complaints == []
    assert page.inner_text("h1") == re.sub(r"\s+", " ", HOSTILE)
    assert page.evaluate("document.scripts.length") == 3
    assert page.evaluate("document.images.length") == 0
    assert page.evaluate("JSON.parse(document.getElementById('data').textContent).title") == HOSTILE


@pytest.mark.nightly
def test_a_printed_reading_and_fewer_soil_elements_are_said(tmp_path, opened):
    sweep = boulder_sweep.load("configs/rwg.yaml", ["model.readings=as_printed", "model.soil={elements: 5001}"])
    page = opened(write_explorer(sweep, 0, tmp_path / "printed.html"))
    text = page.inner_text("main")
    assert "Readings: as printed." in text
    assert "5,001 soil elements; what is simulated in this page uses 5,000" in text
    assert "strongly discouraged" in text


@pytest.mark.nightly
@pytest.mark.parametrize("law", RESISTANCES[1:])
def test_a_law_of_the_resistance_acts_in_the_simulator_and_is_copied(tmp_path, opened, law):
    sweep = boulder_sweep.load("configs/rwg.yaml", [f"model.resistance={law}"])
    page = opened(write_explorer(sweep, 0, tmp_path / "law.html"))
    found = page.evaluate("page.simulator.whole(page.design).judged")
    theirs = boulder_sweep.simulate(sweep).summary()
    assert found["max_rotation_deg"] == pytest.approx(theirs["max_rotation_deg"], rel=1e-9)
    assert found["verdict"] == theirs["verdict"] == "fail"
    assert f"resistance: {law}" in page.content()
    assert f"Soil model: {LAW_WORDS[law]}" in page.inner_text("main")


@pytest.mark.nightly
def test_a_slope_and_water_at_the_soil_line_act_in_the_simulator_and_are_copied(tmp_path, opened):
    sweep = boulder_sweep.load("configs/rwg.yaml", ["soil.slope=8 deg", "soil.water_table=0", "model.resistance=broms"])
    page = opened(write_explorer(sweep, 0, tmp_path / "ground.html"))
    found = page.evaluate("page.simulator.whole(page.design).judged")
    theirs = boulder_sweep.simulate(sweep).summary()
    assert found["max_rotation_deg"] == pytest.approx(theirs["max_rotation_deg"], rel=1e-9)
    assert "The soil as it lies: water table 0 m down, ground falling by 8°" in page.inner_text("main")
    (tmp_path / "copied.yaml").write_text(page.input_value("#yaml"))
    assert boulder_sweep.load(tmp_path / "copied.yaml").model.ground == sweep.model.ground


@pytest.mark.nightly
def test_print_has_every_section_and_no_switches(report, opened):
    page = opened(report)
    page.emulate_media(media="print")
    assert not page.is_visible("#units")
    assert not page.is_visible("#reset")
    assert page.is_visible("#chosen0-scene")
    assert not page.is_visible("#chosen0-verdict")  # which the first page has
    assert not page.is_visible("#chosen0-outcomes")
    for kept in (".local", ".derived", "#figure-chosen0-energy"):
        assert not any(one.is_visible() for one in page.locator(kept).all())
    assert page.pdf(format="A4").startswith(b"%PDF")


@pytest.mark.nightly
def test_a_design_that_cannot_be_computed_says_why(tmp_path, opened):
    (tmp_path / "grid.yaml").write_text(GRID.replace("{from: 0.45, to: 0.75, count: 7}", "[0.6, 1.0]"))
    boulder_sweep.run(boulder_sweep.load(tmp_path / "grid.yaml"), tmp_path / "out")
    page = opened(write_report(tmp_path / "out", tmp_path / "out.html", designs=[2]))
    assert page.inner_text("#chosen0-verdict") == "! error: embedment depth is not less than the boulder's height"
    assert page.inner_text("#chosen0-caption") == "no time history"
    assert page.complaints == []


@pytest.mark.nightly
def test_chosen_designs_are_those_asked_for(result, tmp_path, opened):
    page = opened(write_report(result, tmp_path / "two.html", designs=(7, 200), units="us"))
    assert page.locator("article h3").all_inner_texts() == ["Design 7 (design 7)", "Design 200 (design 200)"]
    assert page.input_value("#units") == "us"


@pytest.mark.nightly
def test_the_map_is_walked_and_picked_by_keys(report, opened):
    page = opened(report)
    page.focus("#figure-sweep-map")
    names = page.evaluate("[page.data.rows.labels[across.value], page.data.rows.labels[up.value]]")
    page.keyboard.press("ArrowUp")
    first = page.inner_text("#sweep-at")
    assert all(name in first for name in names)
    assert re.search(r": (pass|fail|undecided)", first)
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowRight")
    second = page.inner_text("#sweep-at")
    assert second != first
    page.keyboard.press("Enter")
    verdict = second.rsplit(": ")[-2 if second.count(": ") > 1 else -1]
    assert page.evaluate("page.simulator.whole(page.design).judged.verdict") == verdict
    height = float(re.search(r"boulder height ([\d.]+)", second)[1])
    assert page.evaluate("page.design.boulder_height_m") == pytest.approx(height, rel=1e-3)
    page.evaluate("(clearTimeout(page.waiting), page.showAround())")
    page.focus("#figure-live-map")
    page.keyboard.press("ArrowLeft")
    before = page.evaluate("page.design.embedment_depth_m")
    page.keyboard.press("Enter")
    assert page.evaluate("page.design.embedment_depth_m") < before


KINETIC = "page.motions.live.motion.columns.vehicle_kinetic[0]"


@pytest.mark.nightly
def test_the_energy_follows_when_the_reader_pauses(explorer, opened):
    page = opened(explorer)
    energies = "page.plots.find('live-energies').data.vehicle_kinetic[0]"
    before = page.evaluate(energies)
    assert page.evaluate(f"(() => {{ page.take({{ impact_speed_m_s: 9.0 }}); return {energies}; }})()") == before
    page.wait_until_it_is_true(f"{energies} !== {before}")
    assert page.evaluate(energies) == pytest.approx(page.evaluate(KINETIC) / 1000)
    assert page.evaluate("page.plots.find('live-motion').data.force.length === page.motions.live.motion.time.length")
