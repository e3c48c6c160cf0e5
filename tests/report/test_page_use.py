"""What a reader does with the page: chooses axes, types numbers, plays, prints, reads it on a phone."""

import pytest

import boulder_sweep
from tests.report.conftest import LIST, SITE, reported

STRIP = SITE.replace("height: 3.4 m", "height: {from: 1.8 m, to: 3.6 m, count: 19}")


def test_one_axis_is_a_strip(tmp_path, opened):
    page = opened(reported(STRIP, tmp_path))
    verdicts = boulder_sweep.read(tmp_path / "site.sweep").verdict
    assert page.inner_text("#sweep-words") == f"{(verdicts == 'pass').sum()} of the 19 designs shown pass."
    assert page.evaluate("page.cells.sweep.map((cell) => cell.name.split(':')[0])") == verdicts.tolist()
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
        shown = page.evaluate(f"page.cells.{changed}.length")
        page.select_option(up, before[0])
        assert (page.input_value(across), page.input_value(up)) == before[::-1]
        page.select_option(across, before[0])
        assert (page.input_value(across), page.input_value(up)) == before
        assert page.evaluate(f"page.cells.{changed}.length") == shown


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
    for cell in page.evaluate("page.cells.sweep.map((cell) => ({ ...cell.pick(), name: cell.name }))"):
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


@pytest.mark.nightly
def test_leaving_a_box_shows_what_is_simulated(report, opened):
    page = opened(report)
    box, said = "#in-friction_angle_deg", "#limited-friction_angle_deg"
    page.fill(box, "75")
    assert page.inner_text(said) == "limited to 1 to 60°: 60° is simulated"
    page.press(box, "Tab")
    assert (page.input_value(box), page.evaluate("page.design.friction_angle_deg")) == ("60", 60.0)
    assert page.inner_text(said) == "limited to 1 to 60°: 60° is simulated"
    page.fill(box, "41")
    assert page.inner_text(said) == ""
    page.fill(box, "")
    page.press(box, "Tab")
    assert (page.input_value(box), page.evaluate("page.design.friction_angle_deg")) == ("41", 41.0)
    assert page.inner_text(said) == "not a number: 41° is simulated"
    page.click("#reset")
    assert page.inner_text(said) == ""
    page.select_option("#units", "us")
    page.fill("#in-boulder_height_m", "100")
    page.press("#in-boulder_height_m", "Enter")
    assert float(page.input_value("#in-boulder_height_m")) == pytest.approx(20 / 0.3048, rel=1e-5)
    assert page.inner_text("#limited-boulder_height_m").startswith("limited to 0.03281 to 65.62\u00a0ft: ")


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
@pytest.mark.parametrize(("width", "below"), [(390, True), (1280, False)])
def test_on_a_phone_legends_are_below_their_figures(report, opened, width, below):
    page = opened(report, viewport={"width": width, "height": 844})
    page.wait_until_it_is_true("Bokeh.documents.every((one) => one.is_idle)")
    page.wait_for_frames(10)
    frame = page.evaluate(
        "(() => { const plot = Bokeh.index.find_one_by_id(page.plots.find('live-energy').id);"
        " return [plot.frame.bbox.width, plot.frame.bbox.height]; })()"
    )
    assert frame[0] > 220
    assert frame[1] > 120
    shown = page.evaluate(
        "['right', 'below'].map((side) => page.plots.find('live-energy')[side]"
        ".filter((part) => part.type === 'Legend').map((part) => part.visible)[0])"
    )
    assert shown == [not below, below]
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.complaints == []
