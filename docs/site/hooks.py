"""Hooks of MkDocs: pages from outside the folder of the documentation, and links between all of them.

The quick start is the README of the repository; benchmarks, changelog and contributing guide are taken from where
they are. Reference pages are made from the code, tutorials from the notebooks with the output they were committed with.
"""

from __future__ import annotations

import os
import posixpath
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from docs.site.notebooks import as_markdown
from docs.site.reference import all_entries, command_help, flags_and_columns, kernel_page, public_names, register

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
RENAMED = {"README.md": "quick_start.md"}
"""Location in the site of files that would be in the way of others at their own."""
TAKEN = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "benchmarks/README.md")
"""Pages from outside the folder of the documentation."""
HOME = "README.md"
"""The landing page, over the whole width."""
MADE = {
    "command_line.md": command_help,
    "settings.md": all_entries,
    "columns.md": flags_and_columns,
    "python.md": public_names,
    "model.md": register,
}
"""Pages that end with what is made from the code."""
ASSETS = ("iframe-worker.js", "tables.css")
"""Files of this folder that `mkdocs.yml` names; the first is for the search on pages opened from disk, in place of one
that the theme would fetch."""
_LINK = re.compile(r"(?P<before>\]\(|\bsrc=\")(?!\w+:|#)(?P<target>[^)\s\"#]+)(?P<anchor>#[^)\s\"]*)?")
_CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not in the folder of the documentation."""
    from mkdocs.structure.files import File

    for name in taken():
        files.append(File.generated(config, in_site(name), abs_src_path=str(ROOT / name)))
    for name in ASSETS:
        files.append(File.generated(config, f"assets/{name}", abs_src_path=str(Path(__file__).with_name(name))))
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        files.append(File.generated(config, f"notebooks/{notebook.stem}.md", content=as_markdown(notebook)))
    files.append(File.generated(config, "reference/kernels.md", content=kernel_page()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, **_: Any) -> str:
    """Turn links between files of the repository into links between pages of the site."""
    here = page.file.src_uri
    if here == HOME:
        page.meta["hide"] = ["navigation", "toc"]
    source = next((name for name in taken() if in_site(name) == here), None)
    if here.startswith("reference/"):
        return markdown
    if here in MADE:
        markdown = f"{markdown}\n{MADE[here]()}"
    if source is None:
        source = here if here.startswith("notebooks/") else f"docs/{here}"
    pieces = _CODE.split(markdown)
    return "".join(piece if _CODE.fullmatch(piece) else relinked(piece, source) for piece in pieces)


def on_post_page(output: str, **_: Any) -> str:
    """Name the search, which the theme leaves without a name for those who hear the page."""
    return output.replace('role="dialog"', 'role="dialog" aria-label="Search"', 1)


@cache
def taken() -> tuple[str, ...]:
    """Return files from elsewhere that belong to the site, as placed in the repository: pages, and what is linked."""
    pages = [*TAKEN, *(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").glob("*.md"))]
    linked = {
        posixpath.normpath(posixpath.join(posixpath.dirname(page), match["target"]))
        for page in pages
        for match in _LINK.finditer(_CODE.sub("", (ROOT / page).read_text(encoding="utf-8")))
    }
    elsewhere = sorted(
        name for name in linked if (ROOT / name).is_file() and not name.startswith(("docs/", "notebooks/"))
    )
    return tuple(dict.fromkeys([*TAKEN, *elsewhere]))


def in_site(name: str) -> str:
    """Return the place in the site of a file of the repository; notebooks become pages."""
    if name.startswith("notebooks/"):
        name = name.replace(".ipynb", ".md")
    return RENAMED.get(name, name.removeprefix("docs/"))


def relinked(text: str, source: str) -> str:
    """Return text from a file of the repository with its links as they must be in the site.

    Parameters
    ----------
    text
        Markdown without code.
    source
        Location of the file in the repository.
    """

    def renewed(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(source), match["target"]))
        path = os.path.relpath(in_site(target), posixpath.dirname(in_site(source)) or ".")
        return f"{match['before']}{path}{match['anchor'] or ''}"

    return _LINK.sub(renewed, text)
