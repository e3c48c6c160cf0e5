"""What a build adds: the text for a package index, and the name of a wheel that carries compiled kernels."""

from __future__ import annotations

import platform
import re
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
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


class KernelsBuildHook(BuildHookInterface[Any]):
    """Names architecture and oldest C library of a wheel with compiled kernels (see boulder_sweep/release.py)."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Change what is built, before it is built."""
        if any(Path(self.root, "kernels", "boulder_kernels", "compiled").glob("*/*.so")):
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-manylinux_2_17_{platform.machine()}"
