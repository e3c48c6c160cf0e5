"""What a reader does with the page: chooses axes, types numbers, plays, prints, reads it on a phone."""

import re
from dataclasses import astuple

import pytest

import boulder_sweep
from boulder_sweep.report import write_explorer
from boulder_sweep.settings.problems import SettingsError
from tests.report.conftest import GRID, LIST, SETS, SITE, reported
from tests.soils.test_ground import IN_FILE

STRIP = SITE.replace("height: 3.4 m", "height: {from: 1.8 m, to: 3.6 m, count: 19}")


def test_one_axis_is_a_strip(tmp_path, opened):
    page = opened(reported(STRIP, tmp_path))
    verdicts = boulder_sweep.read(tmp_path / "site.sweep").verdict
    assert page.inner_text("#sweep-words") == f"{(verdicts == 'pass').sum()} of the 19 designs shown pass."
    assert page.evaluate("page.maps.sweep.cells.map((cell) => cell.name.split(':')[0])") == verdicts.tolist()
    assert page.is_visible("#across")
    assert not page.is_visible("#up")
    assert not page.evaluate("page.plots.find('sweep-map-y').visible")
    page.focus("#figure-sweep-map")
    page.keyboard.press("ArrowUp")  # there is nothing above a strip
    page.keyboard.press("ArrowRight")
    assert page.inner_text("#sweep-at").startswith("boulder height 2.8\u00a0m: ")
    page.keyboard.press("Enter")
    assert page.evaluate("page.design.boulder_height_m") == pytest.approx(2.8)
    assert page.complaints == []


@pytest.mark.nightly
def test_no_input_is_both_across_and_up(report, opened):
    page = opened(report)
    for across, up, changed in (("#across", "#up", "sweep"), ("#live-across", "#live-up", "live")):
        before = (page.input_value(across), page.input_value(up))
        shown = page.evaluate(f"page.maps.{changed}.cells.length")
        page.select_option(up, before[0])
        assert (page.input_value(across), page.input_value(up)) == before[::-1]
        page.select_option(across, before[0])
        assert (page.input_value(across), page.input_value(up)) == before
        assert page.evaluate(f"page.maps.{changed}.cells.length") == shown


@pytest.mark.nightly
def test_designs_of_a_list_at_one_place_show_the_worst_of_them(tmp_path, opened):
    places = [(height, depth) for height in (3.2, 3.4) for depth in (1.8, 2.2)]
    lines = [f"{height},{depth},{angle}" for angle in (30, 38, 42) for height, depth in places]
    (tmp_path / "designs.csv").write_text("boulder_height_m,embedment_depth_m,friction_angle_deg\n" + "\n".join(lines))
    page = opened(reported(LIST, tmp_path))
    table = boulder_sweep.read(tmp_path / "site.sweep")
    passing = table.verdict == "pass"
    assert passing.any()
    assert page.inner_text("#sweep-words").startswith(
        f"{passing.sum()} of the 12 designs shown pass. Designs lie on each other: the map has 4 places"
    )
    for cell in page.evaluate("page.maps.sweep.cells.map((cell) => ({ ...cell.pick(), name: cell.name }))"):
        here = table[
            (table.boulder_height_m == cell["boulder_height_m"])
            & (table.embedment_depth_m == cell["embedment_depth_m"])
        ]
        assert (cell["name"] == "pass") == (here.verdict == "pass").all()
        picked = here[here.friction_angle_deg == cell["friction_angle_deg"]]
        assert picked.verdict.tolist() == [cell["name"].split(":")[0]]
    # The mouse and the keys take the same design.
    page.focus("#figure-sweep-map")
    page.keyboard.press("ArrowUp")
    assert "(the worst of 3 designs here)" in page.inner_text("#sweep-at")
    page.keyboard.press("Enter")
    by_keys = page.evaluate("page.design")
    box = page.locator("#figure-sweep-map").bounding_box()
    page.mouse.click(box["x"] + 0.7 * box["width"], box["y"] + 0.2 * box["height"])
    assert page.evaluate("page.design") == by_keys
    page.select_option("#up", "friction_angle_deg")
    page.select_option("#across", "boulder_height_m")
    assert "the map has 6 places" in page.inner_text("#sweep-words")


def said_by_the_command(key, value, *more):
    """Return what the command says of a value that it refuses."""
    with pytest.raises(SettingsError) as refused:
        boulder_sweep.load("configs/rwg.yaml", [*more, f"{key}={value}"])
    return str(refused.value).split(f"{key}: ", 1)[1]


REFUSED = (
    ("friction_angle_deg", "432", "soil.friction_angle", "432"),
    ("friction_angle_deg", "-5", "soil.friction_angle", "-5 deg"),
    ("boulder_length_m", "0", "boulder.length", "0 m"),
    ("impact_speed_m_s", "4469.95", "vehicle.speed", "4469.95"),
    ("vehicle_mass_kg", "1e12", "vehicle.mass", "1e12 kg"),
    ("embedment_depth_m", "", "site.embedment_depth", "''"),
    ("strain_rate_factor", "", "soil.strain_rate_factor", "''"),
)


COUNT_CANVASES = """
window.canvases = 0;
const usual = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (...words) {
  window.canvases += 1;
  return usual.apply(this, words);
};
"""


def test_passes_that_are_not_robust_are_hatched(tmp_path, opened):
    """Of rock lighter than the study's, so that what stands is open."""
    text = GRID.replace("[1.5, 1.9]", "1.9").replace("[36, 40]", "40").replace("2600", "2300")
    page = opened(reported(f"{text}model: {{second_opinion: width_capped}}\n", tmp_path), before=COUNT_CANVASES)
    grades = boulder_sweep.read(tmp_path / "site.sweep").robustness.value_counts()
    sizes = page.evaluate(
        "['cells', 'sensitive', 'open'].map((one) => page.plots.find(`sweep-${one}`).data.left.length)"
    )
    assert sizes == [63, grades["sensitive"], grades["open"]]
    assert min(sizes) > 3
    assert page.evaluate("[...document.querySelectorAll('.legend i.sensitive, .legend i.open')].length") == 2
    # Where patterns differ within one glyph, Bokeh makes twenty for each of some 1200 rectangles.
    assert page.evaluate("window.canvases") < 5000
    assert page.complaints == []


@pytest.fixture(scope="module")
def explorer(tmp_path_factory):
    """Page for the design of a file, whose impact height is given."""
    return write_explorer(boulder_sweep.load("configs/rwg.yaml"), 0, tmp_path_factory.mktemp("page") / "rwg.html")


def check_grades(page, table):
    """Hold what the verdict says of every row against the table; return the rows, and the grades of their passes."""
    names = page.evaluate("page.inputs.map((input) => input.name)")
    rows = [{name: float(table[name][k]) for name in names} for k in range(len(table))]
    grades = table.robustness.astype(object).where(table.verdict == "pass", "").tolist()
    assert page.evaluate("(rows) => rows.map((one) => gradeOf(page.data.rows, page.codes, one))", rows) == grades
    return rows, grades


def test_the_verdict_has_the_grade_of_a_design_that_is_a_row_of_the_table(report, result, opened):
    page = opened(report)
    rows, grades = check_grades(page, boulder_sweep.read(result))
    assert set(grades) == {"robust", "sensitive", ""}
    for grade in ("robust", "sensitive"):
        page.evaluate("(row) => page.take(row)", rows[grades.index(grade)])
        assert page.inner_text("#verdict").startswith("✔ pass")
        assert page.inner_text("#verdict").endswith(f"; {grade} in the table")
    depth = float(page.input_value("#in-embedment_depth_m"))
    page.fill("#in-embedment_depth_m", f"{depth + 0.001:.6g}")
    assert page.inner_text("#verdict").startswith("✔ pass")
    assert "in the table" not in page.inner_text("#verdict")


@pytest.mark.nightly
@pytest.mark.parametrize("text", [SETS, LIST], ids=["named soils", "list"])
def test_rows_of_named_soils_and_of_lists_have_their_grade(text, tmp_path, opened):
    lines = [f"{height},{0.65 * height},{angle}" for height in (3.2, 3.4) for angle in (30, 38, 42)]
    (tmp_path / "designs.csv").write_text("boulder_height_m,embedment_depth_m,friction_angle_deg\n" + "\n".join(lines))
    page = opened(reported(text, tmp_path))
    rows, grades = check_grades(page, boulder_sweep.read(tmp_path / "site.sweep"))
    other = next(row for row, grade in zip(rows, grades, strict=True) if grade) | {"boulder_height_m": 3.31}
    assert page.evaluate("(one) => gradeOf(page.data.rows, page.codes, one)", other) == ""


def test_what_the_command_refuses_the_page_refuses_in_the_same_words(explorer, opened):
    page = opened(explorer)
    page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    before, found = page.input_value("#yaml"), page.inner_text("#verdict")
    cells = "page.maps.live.cells.length"
    page.wait_until_it_is_true(f"{cells} > 0")
    for name, typed, key, value in REFUSED:
        page.fill(f"#in-{name}", typed)
        page.press(f"#in-{name}", "Tab")
        words = said_by_the_command(key, value)
        assert page.inner_text(f"#refused-{name}") == words, name
        assert page.input_value(f"#in-{name}") == typed
        assert page.get_attribute(f"#in-{name}", "aria-invalid") == "true"
        assert page.inner_text("#verdict").startswith("! error: ")
        assert page.inner_text("#verdict").endswith(words)
        assert page.input_value("#yaml") == ""
        assert page.evaluate(cells) == 0
        assert page.is_disabled("#copy")
        page.click("#reset")
        assert page.inner_text(f"#refused-{name}") == ""
    assert (page.input_value("#yaml"), page.inner_text("#verdict")) == (before, found)
    assert not page.is_disabled("#copy")
    assert page.complaints == []


@pytest.mark.nightly
def test_values_stay_refused_while_others_change_and_ends_of_ranges_are_admitted(explorer, opened):
    page = opened(explorer)
    page.fill("#in-friction_angle_deg", "432")
    page.fill("#in-embedment_depth_m", "2.2")
    page.press("#in-embedment_depth_m", "Tab")
    assert page.input_value("#in-embedment_depth_m") == "2.2"
    assert page.inner_text("#verdict").startswith("! error: soil friction angle: 432 deg is outside")
    page.focus("#slide-friction_angle_deg")
    page.keyboard.press("End")
    assert page.inner_text("#refused-friction_angle_deg") == ""
    assert page.evaluate("page.design.embedment_depth_m") == 2.2
    page.select_option("#units", "us")
    page.fill("#in-impact_speed_m_s", "9999")
    assert page.inner_text("#refused-impact_speed_m_s") == (
        "9999 mph is outside the admitted range of 0 to 223.694 mph (up to 360 km/h)"
    )
    page.fill("#in-boulder_length_m", "65.6168")
    assert page.inner_text("#refused-boulder_length_m") == ""
    assert page.evaluate("page.design.boulder_length_m") == 20.0
    page.select_option("#units", "si")
    assert page.inner_text("#refused-impact_speed_m_s") == ""
    assert not page.inner_text("#verdict").startswith("! error")


@pytest.mark.nightly
def test_what_does_not_fit_together_is_said_beside_the_field(tmp_path, explorer, opened):
    page = opened(explorer)
    page.fill("#in-embedment_depth_m", "3.5")
    assert page.inner_text("#refused-embedment_depth_m") == "embedment depth is not less than the boulder's height"
    page.fill("#in-embedment_depth_m", "2")
    assert page.inner_text("#refused-embedment_depth_m") == ""
    ground = ("soil.slope=8 deg", "soil.water_table=0.5 m")
    page = opened(write_explorer(boulder_sweep.load("configs/rwg.yaml", ground), 0, tmp_path / "ground.html"))
    page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.fill("#in-soil_density_kg_m3", "900")
    words = "soil of 900 kg/m^3 would float; give the density of the saturated soil below it"
    assert page.inner_text("#refused-soil_density_kg_m3") == words
    with pytest.raises(SettingsError, match=re.escape(words)):
        boulder_sweep.load("configs/rwg.yaml", [*ground, "soil.density=900"])
    page.fill("#in-friction_angle_deg", "8")
    assert page.inner_text("#refused-friction_angle_deg") == "the slope of 8 deg must be less, or the ground slides"
    said = page.inner_text("#verdict")
    assert "soil density: soil of 900 kg/m^3" in said
    assert "soil friction angle: the slope of 8 deg" in said


@pytest.mark.nightly
@pytest.mark.parametrize("units", ["si", "us"])
def test_the_copied_file_is_in_the_units_shown_to_six_digits(units, tmp_path, opened):
    ground = [*IN_FILE, "model.resistance=broms", "criterion.min_overlap=1 ft", "boulder.width=1.71234567 m"]
    sweep = boulder_sweep.load("configs/rwg.yaml", ground)
    page = opened(write_explorer(sweep, 0, tmp_path / "page.html", units=units))
    text = page.input_value("#yaml")
    numbers = re.findall(r"(?<![\w.])\d+\.?\d*(?:e[+-]\d+)?", text)
    assert max(len(number.split("e")[0].replace(".", "").lstrip("0")) for number in numbers) == 6
    assert ("ft" in text) == ("pcf" in text) == ("mph" in text) == (units == "us")
    (tmp_path / "copied.yaml").write_text(text)
    copied = boulder_sweep.load(tmp_path / "copied.yaml")
    assert copied.constants == pytest.approx(sweep.constants, rel=1e-5)
    assert copied.criterion.min_overlap_m == pytest.approx(0.3048, rel=1e-5)
    assert copied.model.resistance == "broms"
    for ours, theirs in zip(copied.model.ground.layers, sweep.model.ground.layers, strict=True):
        assert astuple(ours) == pytest.approx(astuple(theirs), rel=1e-5)


OWN_CLOCK = """(() => {
    const draw = window.requestAnimationFrame.bind(window);
    window.milliseconds = 0;
    performance.now = () => window.milliseconds;
    window.requestAnimationFrame = (next) => draw(() => next(window.milliseconds));
})()"""


@pytest.mark.nightly
def test_one_player_that_pauses(report, opened):
    page = opened(report)
    page.evaluate(OWN_CLOCK)
    play, time = "#live-play", "page.players.live"
    page.click(play)
    assert page.inner_text(play) == "Pause"
    page.evaluate("window.milliseconds = 300")
    page.wait_until_it_is_true(f"{time}.slider.value > 0")
    page.click(play)
    assert page.inner_text(play) == "Play"
    paused = int(page.input_value("#live-time"))
    assert 0 < paused < int(page.get_attribute("#live-time", "max"))
    page.evaluate("window.milliseconds = 500")
    page.wait_for_frames(3)
    assert int(page.input_value("#live-time")) == paused
    page.click(play)
    page.wait_for_frames(3)
    assert int(page.input_value("#live-time")) == paused  # it goes on from there
    page.evaluate("window.milliseconds = 600")
    page.wait_until_it_is_true(f"{time}.slider.value > {paused}")
    page.focus("#live-time")
    page.keyboard.press("Home")
    assert page.inner_text(play) == "Play"
    assert page.evaluate(f"{time}.frame") == 0
    assert page.inner_text("#live-caption").startswith("0 ms")
    page.click(play)
    page.fill("#in-embedment_depth_m", "1.5")  # another motion
    assert page.inner_text(play) == "Play"
    page.evaluate(f"{time}.slider.value = {time}.slider.max - 2, {time}.left = true")
    page.click(play)
    page.evaluate("window.milliseconds += 100_000")
    page.wait_until_it_is_true(f"{time}.frame === 0")
    assert page.input_value("#live-time") == page.get_attribute("#live-time", "max")
    assert page.complaints == []


@pytest.mark.nightly
def test_the_colours_of_legends_are_printed(report, opened):
    page = opened(report)
    page.emulate_media(media="print")
    for legend in ("sweep-legend", "live-legend"):
        style = page.evaluate(f"getComputedStyle(document.querySelector('#{legend} i')).printColorAdjust")
        assert style == "exact"


@pytest.mark.nightly
@pytest.mark.parametrize("width", [390, 1280])
def test_legends_leave_room_for_their_figures(report, opened, width):
    page = opened(report, viewport={"width": width, "height": 844})
    page.wait_until_it_is_true("Bokeh.documents.every((one) => one.is_idle)")
    page.wait_for_frames(10)
    frame = page.evaluate(
        "(() => { const plot = Bokeh.index.find_one_by_id(page.plots.find('live-energy').id);"
        " return [plot.frame.bbox.width, plot.frame.bbox.height]; })()"
    )
    assert frame[0] > 220
    assert frame[1] > 120
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.complaints == []
