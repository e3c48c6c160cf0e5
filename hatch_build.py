"""A wheel that carries compiled kernels (see boulder_sweep/release.py) is one for its architecture."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class KernelsBuildHook(BuildHookInterface):  # type: ignore[type-arg]
    """Names the architecture and the oldest C library in the name of the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Change what is built, before it is built."""
        if any(Path(self.root, "kernels", "boulder_kernels", "compiled").glob("*/*.so")):
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-manylinux_2_17_{platform.machine()}"
