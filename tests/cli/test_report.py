"""`sweep report` and `sweep explore` from the command line: what they write, what they open, what they refuse."""

import json
import re
import webbrowser
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.store.folders import parts_of
from tests.waiting import is_running, wait_until


@pytest.fixture
def opened(monkeypatch):
    """Return what a browser was asked to open; none is started."""
    addresses = []
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    return addresses


def test_a_result_becomes_one_file_beside_it(sweep, possible_grid):
    assert sweep("run", possible_grid, "-q")[0] == 0
    code, out, err = sweep("report", "small-grid.sweep", "--units", "us")
    assert (code, err) == (0, "")
    assert out.startswith("small-grid.html: ")
    assert "needs no network" in out
    page = Path("small-grid.html").read_text()
    assert "<h1>small grid</h1>" in page
    assert '"units":"us"' in page


def test_a_page_may_have_the_short_ending(sweep, possible_grid):
    assert sweep("explore", possible_grid, "--design", 3, "--no-open", "-o", "PAGE.HTM")[0] == 0
    assert Path("PAGE.HTM").exists()


def test_one_design_is_written_and_opened(sweep, possible_grid, opened):
    code, out, _ = sweep("explore", possible_grid, "--design", 3)
    assert code == 0
    assert out.startswith("small-grid.html: ")
    assert opened == [Path("small-grid.html").resolve().as_uri()]


def test_without_a_file_it_begins_with_the_second_crash_test(sweep, grid, opened):
    assert sweep("explore", "--no-open", "-o", "first.html")[0] == 0
    assert "<h1>rwg</h1>" in Path("first.html").read_text()
    assert opened == []


def test_a_machine_without_a_browser_says_so(sweep, possible_grid, monkeypatch):
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    code, _, err = sweep("explore", possible_grid, "--design", 3)
    assert code == 0
    assert "no browser" in err


def test_without_the_extra_it_says_what_to_install(sweep, grid, monkeypatch):
    import sys

    sweep("run", grid, "-q")
    monkeypatch.delitem(sys.modules, "boulder_sweep.report.page", raising=False)
    monkeypatch.setitem(sys.modules, "jinja2", None)
    code, _, err = sweep("report", "small-grid.sweep")
    assert (code, err) == (2, "error: reports need jinja2: in a clone of boulder-sweep, pip install '.[report]'\n")


def test_one_design_is_no_plural(sweep, possible_grid):
    text = possible_grid.read_text().replace("[1.6, 2.6, 3.5] m", "2.6 m").replace("[60, 95]", "60")
    possible_grid.write_text(text.replace("[0.8, 1.2, 1.5] m", "1.5 m"))
    sweep("run", possible_grid, "-q")
    assert sweep("export", "small-grid.sweep", "-o", "one.csv") == (0, "one.csv: 1 row\n", "")
    code, _, err = sweep("report", "small-grid.sweep", "--design", 1)
    assert (code, err) == (2, "error: small-grid.sweep has 1 design, numbered from 0; there is no 1\n")
    resumed = sweep("run", possible_grid, "-q", "--resume", "--dry-run")[1]
    assert "would simulate 0 of 1 design into small-grid.sweep" in resumed


def test_a_result_is_exported_and_compared(sweep, possible_grid):
    sweep("run", possible_grid, "-q")
    sweep("run", possible_grid, "-q", "-o", "fast.sweep", "--set", "vehicle.speed=40 mph")
    assert sweep("export", "small-grid.sweep", "-o", "designs.csv", "--units", "us") == (
        0,
        "designs.csv: 18 rows\n",
        "",
    )
    code, out, err = sweep("compare", "small-grid.sweep", "small-grid.sweep")
    assert (code, err) == (0, "")
    assert out.startswith("18 designs in both; 0 only before, 0 only after\n0 of ")
    assert "\n0 verdicts changed\n" in out
    assert "differs" not in out
    code, out, _ = sweep("compare", "small-grid.sweep", "fast.sweep", "--json")
    found = json.loads(out)
    assert (code, found["matched"], found["only_before"], found["only_after"]) == (0, 18, 0, 0)
    assert found["differ"] == ["impact_speed_m_s"]
    assert any("impact_speed_m_s" in line for line in found["changed"])


def test_the_passes_that_are_lost_are_counted_and_listed_with_their_inputs(sweep, grid):
    site = Path(__file__).parents[2] / "configs" / "site.yaml"
    deep = ("--set", "site.embedment_depth=1.9 m")
    sweep("run", site, "-q", "-o", "a.sweep", *deep, "--set", "soil.friction_angle=40 deg")
    sweep("run", site, "-q", "-o", "b.sweep", *deep, "--set", "soil.friction_angle=34 deg")
    code, out, err = sweep("compare", "a.sweep", "b.sweep", "--units", "us")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert "differs  friction angle φ′: 40 -> 34 deg" in lines
    assert "2 of 2 passes in a.sweep do not pass in b.sweep" in lines
    at = lines.index("  design 5 -> 5: pass -> fail, 17.13 -> 20 deg")
    assert lines[at + 1] == "    height 11.81 ft"


def test_results_with_nothing_in_common_are_not_compared(sweep, possible_grid):
    sweep("run", possible_grid, "-q", "-o", "a.sweep")
    sweep("run", possible_grid, "-q", "-o", "b.sweep", "--set", "boulder.height=[1.7, 2.7] m")
    code, out, err = sweep("compare", "a.sweep", "b.sweep")
    assert (code, out) == (2, "")
    assert err.startswith("error: a.sweep and b.sweep have no design in common: boulder height has 3 values")


@pytest.fixture
def headed(possible_grid):
    """Return the grid with a heading in the file."""
    block = "report: {project: Main Street, client: City, date: 2026-11-25}\n"
    possible_grid.write_text(possible_grid.read_text() + block)
    return possible_grid


def heading_of(file):
    found = re.search(r'<dl class="heading">(.*?)</dl>', Path(file).read_text())
    return re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", found[1]) if found else []


def test_the_heading_is_that_of_the_file_unless_an_option_says_otherwise(sweep, headed):
    assert sweep("run", headed, "-q")[0] == 0
    assert sweep("report", "small-grid.sweep")[0] == 0
    assert heading_of("small-grid.html") == [("client", "City"), ("date", "2026-11-25")]
    assert "<h1>Main Street</h1>" in Path("small-grid.html").read_text()
    assert sweep("report", "small-grid.sweep", "--client", "A & B", "--author", "C. Day")[0] == 0
    assert heading_of("small-grid.html") == [("client", "A &amp; B"), ("date", "2026-11-25"), ("author", "C. Day")]


def test_another_client_neither_refuses_a_resume_nor_changes_a_byte(sweep, headed):
    more = ("--set", "site.embedment_depth={from: 0.8 m, to: 1.5 m, count: 50}")
    assert sweep("run", headed, "-q", *more)[0] == 0
    before = parts_of(Path("small-grid.sweep"))
    next(Path("small-grid.sweep").iterdir()).unlink()
    headed.write_text(headed.read_text().replace("City", "County"))
    code, _, err = sweep("run", headed, "--resume", *more)
    assert code == 0, err
    assert "note: the table keeps the heading of its first run; `sweep report` takes another by its options" in err
    assert parts_of(Path("small-grid.sweep")) == before
    assert sweep("report", "small-grid.sweep")[0] == 0
    assert ("client", "City") in heading_of("small-grid.html")
    assert sweep("report", "small-grid.sweep", "--client", "County")[0] == 0
    assert ("client", "County") in heading_of("small-grid.html")


def test_without_a_browser_a_pdf_is_refused_with_what_to_do(sweep, possible_grid, monkeypatch, tmp_path):
    assert sweep("run", possible_grid, "-q")[0] == 0
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setenv("HOME", str(tmp_path / "empty"))
    code, out, err = sweep("report", "small-grid.sweep", "-o", "page.pdf")
    assert (code, out) == (2, "")
    assert err == (
        "error: a PDF is printed by Chromium, which was not found: install Chromium or Chrome, or write the page as "
        ".html and print it from a browser\n"
    )
    assert not Path("page.pdf").exists()


BROWSER = """#!/bin/sh
echo "FATAL: memory is
short" >&2
{more}
exit 5
"""


@pytest.fixture
def browser(monkeypatch, tmp_path) -> Callable[[str], None]:
    """Take a script for the browser, with some lines of its own."""

    def take(more: str) -> None:
        script = tmp_path / "browser"
        script.write_text(BROWSER.format(more=more))
        script.chmod(0o755)
        monkeypatch.setattr("boulder_sweep.report.writing.browser", lambda: str(script))

    return take


def test_a_browser_that_prints_nothing_is_an_error(sweep, possible_grid, browser):
    browser("")
    assert sweep("run", possible_grid, "-q")[0] == 0
    code, _, err = sweep("report", "small-grid.sweep", "-o", "page.pdf")
    assert code == 2
    assert "browser did not print the page (it ended with code 5: FATAL: memory is short); write the page as" in err
    assert "install" not in err
    assert not Path("page.pdf").exists()


@pytest.mark.parametrize("more", ["", "sleep 1000"])
def test_no_process_of_a_browser_is_left(sweep, possible_grid, browser, monkeypatch, more):
    """Neither where it ends before its children, nor where it is ended because it takes too long."""
    browser(f'sleep 1000 & echo $! > "$(dirname "$0")/child"; {more}')
    monkeypatch.setattr("boulder_sweep.report.writing.MOST_SECONDS", 2)
    assert sweep("run", possible_grid, "-q")[0] == 0
    assert sweep("report", "small-grid.sweep", "-o", "page.pdf")[0] == 2
    wait_until(lambda: not is_running(int(Path("child").read_text())), "the child of the browser ends")
