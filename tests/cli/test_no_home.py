"""Every command for a user without a home: HOME is not set, and the system does not know the user."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

DRIVER = """
import pwd, sys

def unknown(user):
    raise KeyError("getpwuid(): uid not found")

pwd.getpwuid = unknown
from boulder_sweep.cli.main import main
main(sys.argv[1:])
"""
SETTINGS = """\
name: stones
boulder: {length: 1.65 m, width: 1.68 m, height: [3 m, 3.2 m], density: 2596 kg/m^3}
site: {embedment_depth: 2 m}
soil: {density: 1859.9 kg/m^3, friction_angle: "{mean: 40 deg, cov: 5 %}", subgrade_reaction: 60 MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
solver: {accuracy: fast}
""".replace('"', "")
COMMANDS = {
    "check": ("check", "s.yaml"),
    "run": ("run", "s.yaml", "-o", "again.sweep"),
    "simulate": ("simulate", "s.yaml", "--plot", "motion.png"),
    "need": ("need", "s.yaml"),
    "capacity": ("capacity", "s.yaml"),
    "uncertainty": ("uncertainty", "s.yaml", "--half-width", "20 %"),
    "tradeoff": ("tradeoff", "s.yaml"),
    "report": ("report", "stones.sweep"),
    "explore": ("explore", "s.yaml", "-o", "page.html"),
    "plot": ("plot", "stones.sweep", "-o", "map.png"),
    "export": ("export", "stones.sweep", "-o", "table.xlsx"),
    "compare": ("compare", "stones.sweep", "stones.sweep"),
    "new": ("new", "n.yaml"),
    "examples": ("examples",),
    "doctor": ("doctor",),
}


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME")}
    command = [sys.executable, "-c", DRIVER, *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("no-home")
    (folder / "s.yaml").write_text(SETTINGS)
    assert run(folder, "run", "s.yaml").returncode == 0
    return folder


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_a_user_without_a_home_is_served(folder: Path, words: tuple[str, ...]) -> None:
    done = run(folder, *words)
    assert done.returncode == 0, done.stderr
    assert "rror" not in done.stderr
