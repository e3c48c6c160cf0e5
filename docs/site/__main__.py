"""Build the documentation site into a folder: python -m docs.site [FOLDER], by default `site`."""

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
    """Build the site in place of a folder, and return the exit code of Zensical, for which a warning is an error."""
    with tempfile.TemporaryDirectory() as place:
        gather(Path(place) / PAGES)
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        text = (ROOT / CONFIGURATION).read_text(encoding="utf-8")
        for name, value in {"root": ROOT.as_posix(), **project["urls"]}.items():
            text = text.replace(f"{{{name}}}", value)
        (Path(place) / CONFIGURATION).write_text(text, encoding="utf-8")
        code = subprocess.run([sys.executable, "-m", "zensical", "build", "--strict"], cwd=place, check=False).returncode
        if code == 0:
            shutil.rmtree(folder, ignore_errors=True)
            shutil.copytree(Path(place) / BUILT, folder)
    return code


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / BUILT))
