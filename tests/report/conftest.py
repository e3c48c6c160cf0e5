"""A result, its report, and a browser that opens pages from disk with every way to the network closed."""

from collections.abc import Iterator
from typing import Any

import pytest

import boulder_sweep
from boulder_sweep.report import write_report
from tests.waiting import HANG_GUARD_S, wait_until

GRID = """\
name: sizing
boulder: {length: 1.65 m, width: [1.5, 1.9] m, height: {from: 2.0 m, to: 3.6 m, count: 9}, density: 2600 kg/m^3}
site: {embedment_ratio: {from: 0.45, to: 0.75, count: 7}}
soil: {density: 1860 kg/m^3, friction_angle: [36, 40] deg, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""
SITE = """\
name: site
boulder: {length: 1.65 m, width: 1.68 m, height: 3.4 m, density: 2600 kg/m^3}
site: {embedment_ratio: 0.6}
soil: {density: 1860 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""
SETS = """\
name: sites
boulder: {length: 1.65 m, width: 1.68 m, height: [2.4, 3.4] m, density: 2596 kg/m^3}
site: {embedment_ratio: [0.5, 0.6, 0.7]}
soil:
  - {name: loose, density: 1700 kg/m^3, friction_angle: 32 deg, subgrade_reaction: 20 MN/m^3}
  - {name: dense sand, density: 1900 kg/m^3, friction_angle: 42 deg, subgrade_reaction: 90 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""
LIST = """\
name: list
table: designs.csv
boulder: {length: 1.65 m, width: 1.68 m, density: 2600 kg/m^3}
soil: {density: 1860 kg/m^3, subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


OTHER_VALUES = (None, True, -1, 0, 1.5, 1e300, 10**30, "", "x", "table", [], ["x"], [1, "a"], {}, {"a": 1}, "gone")
"""What stands in a damaged place of a file; `gone` takes the place away."""


def places(tree: Any, above: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Every place of plain data; of lists the first two items."""
    keys = tree if isinstance(tree, dict) else range(min(len(tree), 2)) if isinstance(tree, list) else ()
    for key in keys:
        yield (*above, key)
        yield from places(tree[key], (*above, key))


def put(tree: Any, place: tuple[str | int, ...], value: Any) -> None:
    """Put another value in a place of plain data."""
    *above, last = place
    for key in above:
        tree = tree[key]
    if value == "gone":
        del tree[last]
    else:
        tree[last] = value


@pytest.fixture(scope="session")
def result(tmp_path_factory):
    """Folder of a finished run of 252 designs, some of which pass."""
    folder = tmp_path_factory.mktemp("report")
    (folder / "grid.yaml").write_text(GRID)
    out = folder / "sizing.sweep"
    boulder_sweep.run(boulder_sweep.load(folder / "grid.yaml"), out)
    return out


def reported(text, folder, overrides=()):
    """Run a file and return the report of the result."""
    (folder / "site.yaml").write_text(text)
    boulder_sweep.run(boulder_sweep.load(folder / "site.yaml", overrides), folder / "site.sweep")
    return write_report(folder / "site.sweep", folder / "site.html")


@pytest.fixture(scope="session")
def report(result):
    """Return the report of that run."""
    return write_report(result, result.with_name("report.html"), command="sweep report sizing.sweep")


class OpenPage:
    """A page that was opened from disk, and what it said and asked for meanwhile."""

    def __init__(self, browser, file, before="", **options):
        self.context = browser.new_context(accept_downloads=True, **options)
        self.tab = self.context.new_page()
        self.tab.add_init_script(before)
        self.tab.set_default_timeout(1000 * HANG_GUARD_S)  # hang guard
        self.complaints, self.requests, self.dialogs = [], [], []
        self.tab.on("console", lambda message: self._heard(message))
        self.tab.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.on("dialog", lambda dialog: (self.dialogs.append(dialog.message), dialog.dismiss()))
        self.tab.goto(file.resolve().as_uri())
        self.tab.wait_for_selector("html[data-ready]", state="attached")

    def wait_until_it_is_true(self, expression):
        """Evaluate an expression again and again; the page itself may not, by its content security policy."""
        wait_until(lambda: self.tab.evaluate(expression), expression)

    def wait_for_frames(self, number):
        """Wait until the page was drawn so many times more."""
        self.tab.evaluate(
            "(number) => new Promise((done) => {"
            " const next = () => (number-- > 0 ? requestAnimationFrame(next) : done()); next(); })",
            number,
        )

    def _heard(self, message):
        if message.type in ("error", "warning"):
            self.complaints.append(message.text)

    def __getattr__(self, name):
        return getattr(self.tab, name)


@pytest.fixture
def opened(chromium):
    """Return a function that opens a page."""
    pages = []

    def opened(file, **options):
        pages.append(OpenPage(chromium, file, **options))
        return pages[-1]

    yield opened
    for page in pages:
        page.context.close()
