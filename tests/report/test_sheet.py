"""The sheet that a report begins with, and the recommendation that a file of answers keeps for it."""

from __future__ import annotations

import json
import math
import random
import re
import shutil
from datetime import date
from pathlib import Path
from typing import Any

import openpyxl
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.answers.advice import advice, question
from boulder_sweep.answers.need import Need
from boulder_sweep.answers.outputs import AnswerFile
from boulder_sweep.answers.printing import need_screen
from boulder_sweep.errors import ReportError
from boulder_sweep.report import write_report, writing
from boulder_sweep.report.answers import Measure, answer_of, screens
from boulder_sweep.report.rows import read_rows
from boulder_sweep.report.sheet import Sheet, sheet_of
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.sweep import Heading
from tests.answers.designs import UNCERTAIN_FRICTION, bare_need, site
from tests.report.conftest import OTHER_VALUES, places, put
from tests.soils.test_ground import IN_FILE

HEADING = Heading("Main Street", "City", "North gate", "2026-11-28", "A", "C. Day", "E. Fox")


@pytest.fixture(scope="module")
def needs() -> dict[str, Need]:
    """Answers with a recommendation, and without one that qualifies."""
    return {
        "depth": boulder_sweep.need(site(height="[3.0, 3.4, 3.6] m")),
        "height": boulder_sweep.need(
            site(height="[2.6, 3.6] m", friction="[38, 40] deg"), "height", margin=0.1, robust=False
        ),
        "chance": boulder_sweep.need(site(height="3.4 m", **UNCERTAIN_FRICTION), probability=0.9),
        "nearest": boulder_sweep.need(site(height="3.0 m")),
        "soils": boulder_sweep.need(site(height="3.4 m", friction="{from: 34, to: 40, count: 9}")),
        "taken": boulder_sweep.need(site(height="3.4 m", **UNCERTAIN_FRICTION)),
        "stands": boulder_sweep.need(site(height="3.6 m", friction="40 deg"), margin=0.4, robust=False),
        "bare": bare_need(site(height="3.6 m")),
        "never": boulder_sweep.need(site(height="2.0 m", friction="36 deg")),
        "layers": boulder_sweep.need(load(Path("configs/rwg.yaml"), [*IN_FILE, "site.embedment_depth=to be found"])),
    }


@pytest.fixture(scope="module")
def files(needs: dict[str, Need], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("sheets")
    for name, found in (needs | {"list": boulder_sweep.need(listed(folder))}).items():
        found.write(folder / f"{name}.parquet")
    return {name: folder / f"{name}.parquet" for name in (*needs, "list")}


def listed(folder: Path) -> Sweep:
    """Return a list of granite boulders in the soil of a log."""
    rows = "".join(f"1.7,3,{3.4 + row / 50}\n" for row in range(17))  # more than a table shows
    (folder / "list.csv").write_text(f"boulder_length_m,boulder_width_m,boulder_height_m\n{rows}")
    configs = Path(__file__).parents[2] / "configs"
    shutil.copy(configs / "borehole_log.csv", folder)
    text = (configs / "borehole_log.yaml").read_text()
    text = re.sub(r"(?m)^boulder:.*\n(?: .*\n)*", "table: list.csv\nboulder: {rock: granite}\n", text)
    (folder / "list.yaml").write_text(text)
    return load(folder / "list.yaml")


def sheet(file: Path, units: str = "si") -> Sheet:
    rows = read_rows(file)
    return sheet_of(rows, answer_of(rows), units)


NAMES = ("depth", "height", "chance", "taken", "nearest", "never")


@pytest.mark.parametrize("name", NAMES)
def test_a_file_says_what_the_terminal_said(needs: dict[str, Need], files: dict[str, Path], name: str) -> None:
    found, read = needs[name], AnswerFile(files[name], ReportError).answers()
    assert isinstance(read, Need)
    assert found.recommendation is not None
    assert read.recommendation is not None
    assert read.recommendation.to_dict() == found.recommendation.to_dict()
    for units in ("si", "us"):
        said = advice(found, units)
        words = sheet(files[name]).words[units]
        assert [*words.recommendation, *words.others, *([words.untested] if words.untested else [])] == said != []
        assert words.question == question(found, units)


def test_answers_without_a_recommendation_have_none_in_their_file(tmp_path: Path) -> None:
    boulder_sweep.need(site(height="3.4 m"), most="speed").write(tmp_path / "speed.parquet")
    read = AnswerFile(tmp_path / "speed.parquet", ReportError).answers()
    assert isinstance(read, Need)
    assert read.recommendation is None
    assert b"boulder_sweep.recommendation" not in pq.read_schema(tmp_path / "speed.parquet").metadata
    words = sheet(tmp_path / "speed.parquet").words["si"]
    assert words.question.startswith(
        "What is the largest vehicle speed at which the boulder stops a truck of 6,804\u00a0kg, with"
    )
    assert "largest vehicle speed" in words.recommendation[0]
    assert {name: rest for name, *rest in sheet(tmp_path / "speed.parquet").checks}["rotation, weakest model"][
        2
    ] == "≤ 75 %"
    page = write_report(tmp_path / "speed.parquet", tmp_path / "page.html").read_text()
    assert page.count(words.recommendation[0].partition(":")[0]) == len(("si", "us"))


@pytest.mark.parametrize(
    ("name", "asks"),
    [
        (
            "depth",
            "Which of 3 boulders, buried how deep, stops a truck of 6,804\u00a0kg at 13.41\u00a0m/s in both soils, ",
        ),
        ("height", "How high must the boulder be to stop a truck of "),
        ("chance", "How deep must the boulder be buried to stop a truck of "),
    ],
)
def test_the_question_is_asked_in_words(files: dict[str, Path], name: str, asks: str) -> None:
    assert sheet(files[name]).words["si"].question.startswith(asks)
    assert "15,000\u00a0lb at 30\u00a0mph" in sheet(files[name]).words["us"].question


def test_the_limits_are_those_of_the_case_with_the_least_margin(needs: dict[str, Need], files: dict[str, Path]) -> None:
    found = sheet(files["depth"])
    best = needs["depth"].recommendation
    assert best is not None
    assert best.design is not None
    worst = min(best.design.rows, key=lambda row: row["margin"])
    lines = {name: (computed, allowed, used) for name, computed, allowed, used in found.checks}
    assert lines["rotation"][:2] == (Measure(worst["max_rotation_deg"], "deg"), Measure(20.0, "deg"))
    used = [int(line[2].split()[0]) for line in (lines["rotation"], lines["penetration, rating P1"])]
    assert 100 - max(used) == round(100 * worst["margin"])
    assert f"friction angle φ′ {worst['friction_angle_deg']:g}°" in found.words["si"].governs
    assert len(found.cases["si"].rows) == len(best.design.rows) == 2
    assert ("friction angle φ′, least", Measure(36.0, "deg"), "settings") in found.soil
    assert ("bumper above ground", Measure(0.5, "m"), "default") in found.vehicle
    assert found.grade[0] == "robust"
    assert found.qualifies


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("depth", (Measure(15.0, "deg", "at most "), Measure(20.0, "deg"), "≤ 75 %")),
        ("stands", (Measure(20.0, "deg", "at most "), Measure(20.0, "deg"), "≤ 100 %")),
        ("bare", ("fails", Measure(20.0, "deg"), "–")),
        ("chance", None),
        ("never", None),
    ],
)
def test_a_second_opinion_is_among_the_limits_with_what_it_proves(
    files: dict[str, Path], name: str, line: tuple[str | Measure, Measure, str] | None
) -> None:
    checks = {words: tuple(rest) for words, *rest in sheet(files[name]).checks}
    assert checks.get("rotation, weakest model") == line


def test_what_a_run_that_ended_at_the_limit_says_is_marked_as_a_bound(tmp_path: Path) -> None:
    boulder_sweep.run(site(height="3.4 m", site="embedment_depth: 1.5 m"), tmp_path / "site.sweep")
    checks = {words: tuple(rest) for words, *rest in sheet(tmp_path / "site.sweep").checks}
    assert checks["rotation"] == (Measure(pytest.approx(20.0), "deg", "≥ "), Measure(20.0, "deg"), "≥ 100 %")
    for name in ("displacement", "peak force of the truck"):
        assert checks[name][0].before == "≥ "
    assert checks["penetration, rating P1"] == ("none so far", Measure(1.0, "m"), "–")
    assert checks["overlap, at least"][0].before == ""


def test_every_layer_and_the_water_stand_in_the_tables(files: dict[str, Path], tmp_path: Path, opened: Any) -> None:
    page = opened(write_report(files["layers"], tmp_path / "page.html"))
    assert page.locator(".layers tr").all_text_contents() == [
        "fromφ′ρβc",
        "0.5\u00a0m36°2,000\u00a0kg/m³40\u00a0MN/m³2\u00a0kPa",
        "1.2\u00a0m40°2,100\u00a0kg/m³80\u00a0MN/m³0\u00a0kPa",
    ]
    assert sheet(files["layers"]).soil[-2:] == (
        ("cohesion", Measure(4.0, "kPa"), "settings"),
        ("water table below ground", Measure(0.8, "m"), "settings"),
    )
    assert "no ground water" not in sheet(files["layers"]).words["si"].ground
    page = opened(write_report(files["depth"], tmp_path / "page.html"))
    assert page.locator(".layers").count() == 0
    assert page.locator(".section figcaption").inner_text() == (
        "Recommended design, to scale; drawn in the worst of 2 cases: friction angle φ′ 36°"
    )
    assert (
        "Soil: level, the same at every depth, without cohesion; no ground water assumed; strain rate factor 1.0. "
        in page.locator(".basis").inner_text()
    )


def test_the_depth_to_build_is_a_least_and_a_greatest(needs: dict[str, Need], files: dict[str, Path]) -> None:
    for name in ("depth", "chance", "never"):
        best, built = needs[name].recommendation, dict(sheet(files[name]).build)
        assert best is not None
        most = "robust to" if best.design is not None and best.design.grade == "robust" else "at most"
        depths = [built.get(f"depth, {end}") for end in ("at least", most)]
        least = None if best.design is None else Measure(best.design.sizes["embedment_depth_m"], "m", up=1)
        assert depths == [least, None if best.deepest_m is None else Measure(best.deepest_m, "m", up=-1)]
        assert (best.deepest_m is None) == (name != "depth")


def test_the_drawing_is_as_deep_as_the_headline_says(files: dict[str, Path], tmp_path: Path, opened: Any) -> None:
    for units in ("si", "us"):
        page = opened(write_report(files["depth"], tmp_path / "page.html", units=units))
        (deep,) = re.findall(r"([0-9.]+\u00a0(?:m|ft)) deep", sheet(files["depth"]).words[units].recommendation[0])
        drawn = page.locator(".section svg").text_content()
        assert f"d = {deep}" in drawn


def test_one_answer_is_not_shown_again(files: dict[str, Path]) -> None:
    for name, lines in (("taken", None), ("soils", 1), ("never", 1)):
        rows = read_rows(files[name])
        shown = screens(rows, answer_of(rows))
        assert (len(shown["si"].rows) if shown else None) == lines


def test_what_does_not_qualify_is_not_recommended(files: dict[str, Path]) -> None:
    for name in ("nearest", "never"):
        found = sheet(files[name])
        assert not found.qualifies
        assert found.title == "Nearest design, which does not qualify"
        assert "does not pass" in found.words["si"].recommendation[0]


@pytest.mark.parametrize(("name", "printed"), [("depth", False), ("soils", True), ("grid", True), ("list", False)])
def test_a_map_is_printed_only_where_no_table_says_the_same(
    files: dict[str, Path], result: Path, name: str, printed: bool, tmp_path: Path, opened: Any
) -> None:
    page = opened(write_report(files.get(name, result), tmp_path / "page.html"))
    assert page.is_visible("#figure-sweep-map")
    page.emulate_media(media="print")
    assert page.is_visible("#figure-sweep-map") == printed


@pytest.mark.parametrize(
    ("height", "asks", "rows"),
    [
        ("3.4 m", "Which speed, which truck and which soil does the boulder withstand?", 2),
        ("{from: 2.4 m, to: 4.4 m, count: 25}", "Which of 25 designs is to be built, and which speed, truck ", 40),
    ],
)
def test_a_sheet_of_capacity_names_a_design_and_what_it_withstands(
    height: str, asks: str, rows: int, tmp_path: Path
) -> None:
    asked = boulder_sweep.capacity(site(height=height, site="embedment_depth: 2.6 m"))
    asked.write(tmp_path / "capacity.parquet")
    words = sheet(tmp_path / "capacity.parquet").words["us"]
    assert words.question.startswith(asks)
    assert words.recommendation[0].startswith("Bury the ")
    where = r"In the worst of 2 cases \(friction angle φ′ 36°\) it withstands a speed of [\d.]+ mph or less, "
    assert re.match(
        f"{where}a truck of \\d+,\\d+ lb or less and a friction angle of [\\d.]+° or more, ", words.recommendation[1]
    )
    read = read_rows(tmp_path / "capacity.parquet")
    answer = answer_of(read)
    shown = screens(read, answer)["si"]
    assert len(shown.rows) == rows
    best = answer.need.recommendation
    assert best is not None
    assert best.design is not None
    (_, mark), *_ = shown.columns
    marked = [row["design_id"] for row in shown.rows if mark(row) == "→"]
    assert marked == [row["design_id"] for row in best.design.rows]
    if rows < len(asked):  # the marked ones first, then what passes, the lightest robust ones before others
        assert [row["design_id"] for row in shown.rows[:2]] == marked
        assert shown.part == "40 of 50 rows, the best first"
        others = [
            (row["verdict"] != "pass", row["robustness"] != "robust", row["boulder_mass_kg"]) for row in shown.rows
        ]
        assert others[2:] == sorted(others[2:])


def test_the_first_page_names_where_soil_and_boulders_come_from(files: dict[str, Path]) -> None:
    assert (
        sheet(files["list"]).words["si"].ground.endswith(", from borehole_log.csv, hole BH-2. Boulders: from list.csv")
    )


def test_a_table_of_a_list_shows_every_row_and_explains_its_words(
    files: dict[str, Path], needs: dict[str, Need], tmp_path: Path, opened: Any
) -> None:
    read = read_rows(files["list"])
    shown = screens(read, answer_of(read))["si"]
    assert (len(shown.rows), shown.part) == (17, "")
    page = opened(write_report(files["nearest"], tmp_path / "page.html"))
    page.emulate_media(media="print")
    signs = page.locator(".signs:visible").all_inner_texts()
    assert [words.partition(":")[0] for words in signs] == ["blocked"]
    several = boulder_sweep.need(site(height="{from: 2.8 m, to: 3.4 m, count: 5}"))
    assert several.recommendation is not None
    n = several.recommendation.qualified
    assert 1 < n < 4
    left = f"of the {5 - n + 1} left out, 1 have one"
    assert need_screen(several, most=n - 1).part == f"{n - 1} of 5, the best of the {n} with an answer first; {left}"
    assert need_screen(several, most=4).part.endswith(f"the {n} with an answer first; those left out have none")


def test_the_first_page_has_both_ends_of_a_mass_that_is_uncertain(files: dict[str, Path]) -> None:
    built = dict(sheet(files["list"]).build)
    low, high = (built[f"mass, {end} end"] for end in ("low", "high"))
    assert low.value < high.value
    assert "density of granite, low end" in built


def test_a_spreadsheet_says_what_is_recommended(needs: dict[str, Need], files: dict[str, Path], tmp_path: Path) -> None:
    boulder_sweep.export(files["depth"], tmp_path / "depth.xlsx", units="us")
    book = openpyxl.load_workbook(tmp_path / "depth.xlsx")
    said = advice(needs["depth"], "us")
    assert [row[0] for row in book["about"].iter_rows(max_row=len(said), values_only=True)] == said


@pytest.mark.parametrize("name", ["depth", "chance", "nearest"])
def test_a_damaged_recommendation_ends_in_words(files: dict[str, Path], name: str, tmp_path: Path) -> None:
    """Or in a sheet, where the place holds what a recommendation may say."""
    table, chance, said = pq.read_table(files[name]), random.Random(name), list[str]()
    key = b"boulder_sweep.recommendation"
    for _ in range(40):
        tree = json.loads(table.schema.metadata[key])
        place, value = chance.choice([*places(tree)]), chance.choice((*OTHER_VALUES, math.nan))
        put(tree, place, value)
        metadata = table.schema.metadata | {key: json.dumps(tree).encode()}
        pq.write_table(table.replace_schema_metadata(metadata), tmp_path / "changed.parquet")
        try:
            assert sheet(tmp_path / "changed.parquet").words["si"].recommendation, (place, value)
        except ReportError as problem:
            said.append(str(problem))
    assert len(said) > 10
    assert all("changed.parquet is damaged; write it again with `sweep need`" in words for words in said)


@pytest.mark.parametrize("name", ["depth", "chance", "nearest"])
def test_no_null_in_a_recommendation_is_said(files: dict[str, Path], name: str, tmp_path: Path) -> None:
    table, changed, refused = pq.read_table(files[name]), tmp_path / "changed.parquet", list[tuple[str | int, ...]]()
    key = b"boulder_sweep.recommendation"
    for place in places(json.loads(table.schema.metadata[key])):
        if 1 in place[:-1]:
            continue  # a second soil is read as the first
        tree = json.loads(table.schema.metadata[key])
        put(tree, place, None)
        metadata = table.schema.metadata | {key: json.dumps(tree).encode()}
        pq.write_table(table.replace_schema_metadata(metadata), changed)
        try:
            found = AnswerFile(changed, ReportError).answers()
            assert isinstance(found, Need)
            assert "None" not in " ".join(advice(found, "us")), place
        except ReportError:
            refused.append(place)
    assert {last for *_, last in refused} >= {
        "boulder_density_kg_m3",
        "boulder_mass_kg",
        "verdict",
        "conditions",
        "rows",
    }


def test_a_pdf_has_todays_date_and_a_page_only_a_given_one(
    files: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pages: list[str] = []
    monkeypatch.setattr(writing, "printed", lambda text: pages.append(text) or b"%PDF")

    class FixedDate(date):
        @classmethod
        def today(cls) -> FixedDate:
            return cls(2031, 2, 3)

    monkeypatch.setattr(writing, "date", FixedDate)
    write_report(files["depth"], tmp_path / "page.pdf")
    write_report(files["depth"], tmp_path / "page.pdf", heading=HEADING)
    assert "<dt>date</dt><dd>2031-02-03</dd>" in pages[0]
    assert "2031-02-03" not in pages[1]
    assert "2031-02-03" not in write_report(files["depth"], tmp_path / "page.html").read_text()
    for words in ("<dt>checker</dt><dd>E. Fox</dd>", "<dt>revision</dt><dd>A</dd>", "Author C. Day", "Checker E. Fox"):
        assert words in pages[1]


def test_the_name_of_a_project_stays_text_in_the_footer(files: dict[str, Path], tmp_path: Path) -> None:
    name = '"; } </style><script>alert(1)</script>'
    page = write_report(files["depth"], tmp_path / "page.html", heading=HEADING._replace(project=name)).read_text()
    (footer,) = re.findall(r'@bottom-left \{ content: "(.*?)"; \}', page)
    plain = re.sub(r"\\([0-9a-f]+) ", lambda code: chr(int(code[1], 16)), footer)
    assert plain.startswith(f"{name} · site · revision A · 2026-11-28 · boulder-sweep ")
    assert "<" not in footer


@pytest.mark.parametrize(("name", "units"), [("depth", "si"), ("chance", "us"), ("nearest", "us"), ("layers", "us")])
def test_the_sheet_fits_on_one_page(files: dict[str, Path], name: str, units: str, tmp_path: Path, opened: Any) -> None:
    page = opened(write_report(files[name], tmp_path / "page.html", units=units, heading=HEADING))
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    head, body = (page.locator(place).bounding_box() for place in ("header", ".sheet"))
    paper = page.evaluate("({ width: PAPER.width, height: PAPER[page.data.units] })")
    assert body["width"] == pytest.approx(paper["width"], abs=2)
    assert body["y"] + body["height"] - head["y"] <= paper["height"] + 12  # the page has that much more
    inner = page.evaluate(
        "(({ scrollHeight, clientHeight }) => scrollHeight - clientHeight)(document.querySelector('.sheet'))"
    )
    assert inner <= 1  # nothing hangs out of it
    drawn = page.locator(".section svg").bounding_box()
    assert drawn["height"] > 150
    sizes = page.evaluate(
        "[...document.querySelectorAll('.section svg text')].map((one) => one.getBoundingClientRect().height)"
    )
    assert min(sizes) >= 10.6  # 8 pt
    assert page.complaints == []


def test_what_is_written_beside_figures_is_printed_in_8_pt(files: dict[str, Path], tmp_path: Path, opened: Any) -> None:
    page = opened(write_report(files["depth"], tmp_path / "page.html", heading=HEADING))
    written = """
        page.plots.document.roots().flatMap((figure) => [...figure.left, ...figure.below, ...figure.right])
            .flatMap((one) => one.type === "Legend" ? [one.label_text_font_size]
                : [one.axis_label_text_font_size, one.major_label_text_font_size])
            .map((size) => parseFloat(size.value ?? size) * page.shrunk)
    """
    assert min(page.evaluate(written)) < 10.6  # as on the screen
    page.tab.goto(f"{(tmp_path / 'page.html').as_uri()}#paper")
    page.tab.reload()
    page.wait_for_selector("html[data-ready]", state="attached")
    assert min(page.evaluate(written)) >= 10.6  # 8 pt
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    assert min(page.evaluate(written)) >= 10.6
    beside = page.evaluate(
        "[...document.querySelectorAll('.chosen .scene svg text, .legend li, .section figcaption, caption, .plots h3')]"
        ".filter((one) => one.getClientRects().length && one.textContent.trim() && !one.matches('.hidden'))"
        ".map((one) => one.matches('svg *') ? one.getBoundingClientRect().height"
        "    : parseFloat(getComputedStyle(one).fontSize) * page.shrunk)"
    )
    assert len(beside) > 5
    assert min(beside) >= 10.6
    assert page.complaints == []


def test_no_words_of_a_drawing_are_cut_at_its_frame(tmp_path: Path, opened: Any) -> None:
    large = site(length="7 ft", width="8 ft", height="10 ft", site="embedment_depth: 6 ft", friction="38 deg")
    boulder_sweep.run(large, tmp_path / "large.sweep")
    page = opened(write_report(tmp_path / "large.sweep", tmp_path / "page.html", units="us"))
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    cut = page.evaluate("""
        [...document.querySelectorAll(".chosen .scene svg, .section svg")].map((svg) => {
            const { x, y, width, height } = svg.viewBox.baseVal;
            return [...svg.querySelectorAll("text")].filter((text) => {
                const box = text.getBBox();
                return box.x < x || box.x + box.width > x + width || box.y < y || box.y + box.height > y + height;
            }).map((text) => text.textContent);
        })
    """)
    assert cut == [[], []]
    touching = page.evaluate("""
        [...document.querySelectorAll(".sheet tr")].filter((row) => {
            const boxes = [...row.cells].filter((cell) => cell.textContent.trim()).map((cell) => {
                const words = document.createRange();
                words.selectNodeContents(cell);
                return words.getBoundingClientRect();
            });
            return boxes.some((box, k) => k > 0 && box.left < boxes[k - 1].right + 2);
        }).map((row) => row.textContent)
    """)
    assert touching == []
    # No heading parts from its figures, no name from its value.
    for whole in (".chosen", ".settings span"):
        assert page.evaluate(f"getComputedStyle(document.querySelector('{whole}')).breakInside") == "avoid"
    assert "step_s: not given" in page.locator(".settings span").all_text_contents()[-2]


def test_the_browser_that_prints_writes_for_paper(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "browser", lambda: "chromium")
    opened: list[str] = []

    def ended(_: str, words: list[str], said: Path) -> tuple[int, str]:
        opened.append(words[-1])
        (said.parent / "page.pdf").write_bytes(b"%PDF")
        return 0, ""

    monkeypatch.setattr(writing, "_ended", ended)
    assert writing.printed("<title>site</title>") == b"%PDF"
    (address,) = opened
    assert address.endswith("page.html#paper")
