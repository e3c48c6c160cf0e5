"""Build the documentation site into `site`, from the root of the repository: python -m docs.site."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from docs.site.pages import ROOT, gather

CONFIGURATION = "zensical.toml"
PAGES, BUILT = "pages", "site"
"""Folders beside the configuration, as it names them."""


def build(folder: Path) -> int:
    """Build the site into a new folder, and return the exit code of Zensical, for which a warning is an error."""
    with tempfile.TemporaryDirectory() as place:
        gather(Path(place) / PAGES)
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        text = (ROOT / CONFIGURATION).read_text(encoding="utf-8")
        for name, value in {"root": ROOT.as_posix(), **project["urls"]}.items():
            text = text.replace(f"{{{name}}}", value)
        (Path(place) / CONFIGURATION).write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "zensical", "build", "--strict"]
        code = subprocess.run(command, cwd=place, check=False).returncode
        if code == 0:
            shutil.copytree(Path(place) / BUILT, folder)
    return code


if __name__ == "__main__":
    shutil.rmtree(ROOT / BUILT, ignore_errors=True)
    sys.exit(build(ROOT / BUILT))
