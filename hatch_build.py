"""What a build adds: the text for a package index."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:|#)([^)]+)\)")
"""A link or picture with a path inside the repository: mark of a picture, text, path."""


class ReadmeHook(MetadataHookInterface):
    """Gives a package index the README, whose links a page outside the repository cannot follow."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the text, with links to the files of this version under the project's source URL."""
        source, version = metadata["urls"]["Source"], metadata["version"]

        def absolute(link: re.Match[str]) -> str:
            """Write out one link: a page of the site for a file, the file itself for a picture."""
            picture, text, path = link.groups()
            return f"{picture}[{text}]({source}/{'raw' if picture else 'blob'}/v{version}/{path})"

        text = LINK.sub(absolute, Path(self.root, "README.md").read_text(encoding="utf-8"))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
