"""Notebooks as pages: the cells with the output they were committed with; nothing is run."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import nbformat

_TABLE = re.compile(r"<table[^>]*>")
"""Tables with attributes of their own are neither styled by the theme nor scrolled on a narrow screen."""


def as_markdown(notebook: Path) -> str:
    """Return a notebook as Markdown, pictures inside."""
    parts = []
    for cell in nbformat.read(notebook, as_version=4).cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
        elif cell.cell_type == "code" and cell.source.strip():
            parts.append(f"```python\n{cell.source}\n```")
            parts += [text for output in cell.outputs if (text := _shown(output))]
    return "\n\n".join(parts) + "\n"


def _shown(output: Any) -> str:
    """Return one output of a cell: a picture, a table or text; empty where there is none of these."""
    if output.output_type == "stream":
        return f"```text\n{output.text.rstrip()}\n```"
    data = output.get("data", {})
    if "image/png" in data:
        return f'<img alt="output" src="data:image/png;base64,{data["image/png"].strip()}">'
    if "text/html" in data:
        shown = "\n".join(line.strip() for line in data["text/html"].splitlines() if line.strip())
        return _TABLE.sub("<table>", shown)
    if "text/plain" in data:
        return f"```text\n{data['text/plain']}\n```"
    return ""
