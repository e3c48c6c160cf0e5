"""The worked sites: the commands in the head of each settings file run, and say what they should."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from boulder_sweep import load
from boulder_sweep.cli.main import cli

ROOT = Path(__file__).parents[2]
START = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
SAID = {
    "embassy_street": r"→ +1\.8 +3\.4 +2\.41\d +0\.\d+ +0\.98 +29\.2 .*robust",
    "wet_backfill": r"pass +\d+",
    "clayey_terrace": r"PASS, 16\.8° of 20°",
    "embankment": r"2\.3 +3 +12\.76",
    "quarry_stone": r"\(23\.0 t\)\s+2\.609 m\s+deep",
    "uncertain_site": r"2\.322",
}
"""What the commands print of the answer."""


def test_the_start_lists_the_sites() -> None:
    assert re.findall(r"^\| `(\w+)\.yaml` \|", START, re.MULTILINE) == list(SAID)


@pytest.mark.compiled
@pytest.mark.parametrize("name", SAID)
def test_the_commands_in_its_head_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("configs", "docs"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    head = (ROOT / "configs" / f"{name}.yaml").read_text(encoding="utf-8").split("\nname:")[0]
    commands = re.findall(r"^#   sweep (.*?)(?:  +#.*)?$", head, re.MULTILINE)
    assert commands
    assert load(ROOT / "configs" / f"{name}.yaml").name == name.replace("_", "-")
    monkeypatch.chdir(tmp_path)
    printed = ""
    for command in commands:
        done = CliRunner().invoke(cli, shlex.split(command))
        assert done.exit_code == 0, done.output
        printed += done.output
    assert re.search(SAID[name], printed), printed
