"""Links of Markdown files to files and headings of this repository."""

from __future__ import annotations

import re
from pathlib import Path

_LINK = re.compile(r"!?\[[^\]]*\]\((?!https?:|mailto:)([^)\s]+)\)")
_CODE = re.compile(r"```.*?```", re.DOTALL)
_HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def broken_links(file: Path) -> list[str]:
    """Return the targets in a Markdown file that lead nowhere: no such file, or no such heading."""
    found = []
    for target in _LINK.findall(_CODE.sub("", file.read_text(encoding="utf-8"))):
        name, _, anchor = target.partition("#")
        page = file.parent / name if name else file
        if not page.exists() or (anchor and anchor not in anchors_of(page)):
            found.append(target)
    return found


def anchors_of(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub and the documentation site make them."""
    headings = _HEADING.findall(_CODE.sub("", page.read_text(encoding="utf-8")))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}
