"""Pages of the documentation site: from `docs`, from elsewhere in the repository, and made from the code.

The quick start is the README of the repository; benchmarks, changelog and contributing guide are taken from where
they are. Reference pages are made from the code, tutorials from the notebooks with the output they were committed with.
"""

from __future__ import annotations

import os
import posixpath
import re
import shutil
from functools import cache
from pathlib import Path

from docs.site.notebooks import as_markdown
from docs.site.reference import all_entries, command_help, flags_and_columns, kernel_page, public_names, register

ROOT = Path(__file__).parents[2]
RENAMED = {"README.md": "quick_start.md"}
"""Location in the site of files that would be in the way of others at their own."""
TAKEN = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "benchmarks/README.md")
"""Pages from outside the folder of the documentation."""
LEFT_OUT = ("studies/", "site/", "paper/")
"""Folders of the documentation that are no pages."""
MADE = {
    "docs/command_line.md": command_help,
    "docs/settings.md": all_entries,
    "docs/columns.md": flags_and_columns,
    "docs/python.md": public_names,
    "docs/model.md": register,
}
"""Pages that end with what is made from the code."""
ASSETS = ("iframe-worker.js", "tables.css")
"""Files of this folder that `zensical.toml` names; the first is for the search on pages opened from disk, in place of
one that the theme would fetch."""
_LINK = re.compile(r"(?P<before>\]\(|\bsrc=\")(?!\w+:|#)(?P<target>[^)\s\"#]+)(?P<anchor>#[^)\s\"]*)?")
_CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)


def gather(folder: Path) -> None:
    """Write all pages and files of the site, as Zensical reads them, into an empty folder."""
    for name in (*_own(), *taken()):
        source, target = ROOT / name, folder / in_site(name)
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.suffix == ".md":
            made = f"\n{MADE[name]()}" if name in MADE else ""
            target.write_text(relinked(source.read_text(encoding="utf-8") + made, name), encoding="utf-8")
        else:
            shutil.copyfile(source, target)
    pages = {f"notebooks/{path.stem}.md": as_markdown(path) for path in sorted((ROOT / "notebooks").glob("*.ipynb"))}
    pages = {name: relinked(text, name) for name, text in pages.items()} | {"reference/kernels.md": kernel_page()}
    pages |= {f"assets/{name}": Path(__file__).with_name(name).read_text(encoding="utf-8") for name in ASSETS}
    for name, text in pages.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def _own() -> list[str]:
    """Return the files of the documentation that belong to the site, as placed in the repository."""
    docs = ROOT / "docs"
    names = sorted(path.relative_to(docs).as_posix() for path in docs.rglob("*") if path.is_file())
    return [f"docs/{name}" for name in names if not name.startswith(LEFT_OUT) and "__pycache__" not in name]


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
    """Return Markdown with links between files of the repository as links between pages of the site.

    Parameters
    ----------
    text
        Markdown; code in it stays.
    source
        Location of the file in the repository.
    """

    def renewed(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(source), match["target"]))
        path = os.path.relpath(in_site(target), posixpath.dirname(in_site(source)) or ".")
        return f"{match['before']}{path}{match['anchor'] or ''}"

    pieces = _CODE.split(text)
    return "".join(piece if _CODE.fullmatch(piece) else _LINK.sub(renewed, piece) for piece in pieces)
