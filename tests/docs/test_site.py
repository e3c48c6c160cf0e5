"""The documentation site: built without a warning, every link followed, read and searched without a network."""

from __future__ import annotations

import json
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from docs.site.__main__ import build
from docs.site.notebooks import as_markdown
from docs.site.pages import relinked
from docs.site.reference import command_help

ROOT = Path(__file__).parents[2]


class Page(HTMLParser):
    """Links, resources and anchors of a page."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.resources: list[str] = []
        self.anchors: set[str] = set()
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value for name, value in attrs if value}
        if "id" in values:
            self.anchors.add(values["id"])
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if tag in ("img", "script", "link", "iframe"):
            self.resources += [values[name] for name in ("src", "href") if name in values]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site; a warning is an error."""
    folder = tmp_path_factory.mktemp("site") / "built"
    assert build(folder) == 0
    return folder


def test_every_link_leads_somewhere_and_nothing_is_fetched(site: Path) -> None:
    pages = {file: Page(file) for file in site.rglob("*.html")}
    assert len(pages) > 20
    for file, page in pages.items():
        for target in page.links + page.resources:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                assert target in page.links or parts.scheme == "data", f"{file.name} would fetch {target}"
                continue
            there = (file.parent / unquote(parts.path)) if parts.path else file
            assert there.exists() or file.name == "404.html", f"{file.name}: {target}"
            if parts.fragment and there in pages:
                anchors = pages[there].anchors
                assert unquote(parts.fragment) in anchors | {"__codelineno"} or "__code" in parts.fragment, target


def test_pages_from_elsewhere_are_in_it(site: Path) -> None:
    words = {
        "quick_start.html": "Which boulder, buried how deep",
        "benchmarks/index.html": "plain C, RK4",
        "command_line.html": "sweep fit-vehicle",
        "python.html": "boulder_sweep.runner.run.run",
        "settings.html": "constant of horizontal subgrade reaction of the soil",
        "columns.html": "a verdict that changes with the uncertain inputs",
        "model.html": "tests/kernels/test_vehicle.py::test_lever_of_the_blow",
        "reference/kernels.html": "boulder_kernels.soil.closed_form",
        "notebooks/m30_sizing.html": "configs/m30_sizing.yaml",
    }
    for name, expected in words.items():
        assert expected in (site / name).read_text(encoding="utf-8"), name


def test_the_search_finds_water_on_the_page_of_the_soil(site: Path) -> None:
    found = json.loads((site / "search.json").read_text(encoding="utf-8"))["items"]
    titles = {entry["location"]: entry["title"].lower() for entry in found}
    assert [place for place, title in titles.items() if "water table" in title] == [
        "site.html#water-table-layers-cohesion-slope"
    ]


def test_pages_lead_to_the_source_and_to_the_issues(site: Path) -> None:
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]
    assert {urls["Source"], urls["Issues"]} <= {*Page(site / "answers.html").links}


@pytest.mark.nightly
def test_search_works_from_disk(site: Path, chromium: Any) -> None:
    errors: list[str] = []
    asked: list[str] = []
    page = chromium.new_page()
    page.set_default_timeout(600_000)  # hang guard
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((site / "index.html").as_uri())
    page.click("button.md-search__button")
    page.get_by_placeholder("Search").fill("knife edge")
    page.get_by_text("restoring moment").first.wait_for()
    page.close()
    assert errors == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "about:"))] == []


@pytest.mark.parametrize(
    ("text", "source", "expected"),
    [
        ("[a](docs/model.md#soil)", "README.md", "[a](model.md#soil)"),
        ("![a](docs/images/x.png)", "README.md", "![a](images/x.png)"),
        ("[a](../README.md)", "docs/model.md", "[a](quick_start.md)"),
        ("[a](../benchmarks/README.md#the-gate)", "docs/accuracy.md", "[a](benchmarks/README.md#the-gate)"),
        ("[a](../docs/model.md)", "benchmarks/README.md", "[a](../model.md)"),
        ("[a](figures/x.png)", "benchmarks/README.md", "[a](figures/x.png)"),
        ("[a](https://example.org/x) [b](#c)", "README.md", "[a](https://example.org/x) [b](#c)"),
    ],
)
def test_links_of_the_repository_become_links_of_the_site(text: str, source: str, expected: str) -> None:
    assert relinked(text, source) == expected


FRAME = '<table border="1" class="dataframe">\n</table>'


def test_a_notebook_becomes_a_page(tmp_path: Path) -> None:
    import nbformat
    from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

    cells = [
        new_markdown_cell("# Title"),
        new_code_cell("1 + 1", outputs=[new_output("execute_result", {"text/plain": "2"})]),
        new_code_cell(
            "draw()", outputs=[new_output("display_data", {"image/png": "AAAA\n", "text/plain": "<Figure>"})]
        ),
        new_code_cell("frame", outputs=[new_output("execute_result", {"text/html": FRAME})]),
        new_code_cell("print(3)", outputs=[new_output("stream", text="3\n")]),
    ]
    nbformat.write(new_notebook(cells=cells), tmp_path / "a.ipynb")
    page = as_markdown(tmp_path / "a.ipynb")
    assert page.startswith("# Title\n\n```python\n1 + 1\n```\n\n```text\n2\n```")
    assert 'src="data:image/png;base64,AAAA"' in page
    assert page.endswith("```text\n3\n```\n")
    assert "<table>\n</table>" in page, "as the theme styles tables"
    assert "<Figure>" not in page


def test_tables_on_a_phone_scroll_as_wide_as_their_words(site: Path) -> None:
    """The sheet is with every page, and no cell breaks a name."""
    assert all("assets/tables.css" in page.read_text(encoding="utf-8") for page in site.glob("*.html"))
    assert "max-width: 60em" in (site / "assets" / "tables.css").read_text(encoding="utf-8")


def test_every_command_has_its_reference() -> None:
    from boulder_sweep.cli.main import cli

    page = command_help()
    names = {command.name for command in cli.commands.values()}  # a command may have another name, too
    assert all(f"## sweep {name}\n" in page for name in names)
