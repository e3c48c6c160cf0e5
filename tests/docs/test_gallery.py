"""The gallery: every site has a settings file, a picture and a command that runs and says what the page says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from boulder_sweep import load
from boulder_sweep.cli.main import cli
from docs.studies.contents import compute
from docs.studies.documents import blocks
from docs.studies.drift import drift
from docs.studies.gallery import SITES, draw_sites

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
NAMES = [site.name for site in SITES]
MOST_BYTES = 150_000
SAID = {
    "embassy_street": r"→ +1\.8 +3\.4 +2\.41\d +0\.\d+ +0\.98 +29\.2 .*robust",
    "wet_backfill": r"pass +\d+",
    "clayey_terrace": r"PASS, 16\.8° of 20°",
    "embankment": r"2\.3 +3 +13\.97",
    "quarry_stone": r"\(23\.0 t\)\s+2\.424 m deep",
    "uncertain_site": r"2\.322",
}
"""What the commands print of the answer."""


def section(name: str) -> str:
    """Return the part of the page that holds the block of a site."""
    return next(part for part in PAGE.split("\n## ") if f"<!-- {block(name)} -->" in part)


def block(name: str) -> str:
    return f"gallery-{name.replace('_', '-')}"


@pytest.mark.compiled
@pytest.mark.parametrize("name", NAMES)
def test_the_answer_on_the_page_is_that_of_the_file(name: str) -> None:
    (written,) = [own.text for own in blocks(ROOT) if own.name == block(name)]
    assert drift(written, compute(ROOT, [block(name)])[block(name)]) == []
    assert len(re.findall(r"\.(?:\s|$)", written)) == 2, "two sentences"


@pytest.mark.compiled
@pytest.mark.parametrize("name", NAMES)
def test_the_commands_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"^\$ sweep (.*)$", section(name), re.MULTILINE)
    assert commands
    printed = ""
    for command in commands:
        done = CliRunner().invoke(cli, shlex.split(command))
        assert done.exit_code == 0, done.output
        printed += done.output
    assert re.search(SAID[name], printed), printed
    assert (tmp_path / f"{name}.png").stat().st_size > 10_000


@pytest.mark.compiled
@pytest.mark.parametrize("name", NAMES)
def test_the_head_of_the_file_names_commands_of_the_page(name: str) -> None:
    head = (ROOT / "configs" / f"{name}.yaml").read_text(encoding="utf-8").split("\nname:")[0]
    assert load(ROOT / "configs" / f"{name}.yaml").name == name.replace("_", "-")
    shown = re.findall(r"^\$ (sweep .*)$", section(name), re.MULTILINE)
    assert any(command in head for command in shown)


@pytest.mark.nightly
def test_pictures_are_drawn(tmp_path: Path) -> None:
    assert [path.name for path in draw_sites(ROOT, tmp_path)] == [f"{name}.png" for name in NAMES]
