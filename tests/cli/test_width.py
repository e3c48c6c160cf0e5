"""No command writes a line that is wider than a terminal of 80 columns."""

from __future__ import annotations

from pathlib import Path

import pytest

from boulder_sweep.cli.main import COMMANDS
from docs.studies.example_pulse import example_pulse

CONFIGS = Path(__file__).parents[2] / "configs"
SITE = CONFIGS / "site.yaml"
US = ("--units", "us")
DEEP = "site.embedment_depth=1.9 m"
"""In place of the depth that is to be found."""
WORDS = {
    "new": ("made.yaml",),
    "run": (SITE, "--set", DEEP),
    "check": (CONFIGS / "m30_sizing.yaml",),
    "stone": (CONFIGS.parent / "docs" / "examples" / "rock.ply", "--mass", "23.5 t"),
    "need": (SITE, *US),
    "uncertainty": (CONFIGS / "uncertain_site.yaml", "--half-width", "0.2", *US),
    "capacity": (SITE, *US, "--set", DEEP),
    "simulate": (SITE, "--design", "11", "--set", DEEP),
    "examples": ("configs",),
    "doctor": (),
    "explore": (SITE, "-o", "page.html", "--set", DEEP),
    "plot": ("site.sweep",),
    "report": ("site.sweep",),
    "export": ("site.sweep", "-o", "site.csv"),
    "compare": ("site.sweep", "other.sweep"),
    "tradeoff": (SITE, "--designs", "8", "--seconds", "1e9", "--set", DEEP),
    "validate": (),
    "fit-vehicle": ("pulse.csv", "--mass", "6800 kg"),
}
"""A plain use of every command."""
LONG = ("uncertainty", "tradeoff", "validate")
"""Commands that take seconds; their widths are nightly."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two results and a pulse."""
    from boulder_sweep import load, run

    folder = tmp_path_factory.mktemp("width")
    run(load(SITE, [DEEP]), folder / "site.sweep")
    run(load(SITE, [DEEP, "vehicle.speed=40 mph"]), folder / "other.sweep")
    (folder / "pulse.csv").write_text(example_pulse())
    return folder


@pytest.fixture(autouse=True)
def narrow(folder, monkeypatch):
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("webbrowser.open", lambda _: True)
    monkeypatch.setattr("boulder_sweep.tradeoff.study._SHORTEST_TIMING_S", 1e-9)  # the width is the same
    monkeypatch.setattr("boulder_sweep.cli.output._columns", lambda: 80)  # as if stderr were a terminal


def wide(text):
    return [line for line in text.splitlines() if len(line) > 80]


def test_every_command_is_here():
    assert set(WORDS) == {command.name for command in COMMANDS}


@pytest.mark.parametrize("name", WORDS)
def test_help(sweep, name):
    code, out, err = sweep(name, "--help")
    assert (code, err) == (0, "")
    assert wide(out) == []


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.nightly] if name in LONG else []) for name in WORDS]
)
def test_output(sweep, name):
    words = ("--overwrite",) if name == "run" else ()
    code, out, err = sweep(name, *WORDS[name], *words)
    assert code == 0, err
    assert wide(out) == []
    assert [line for line in wide(err) if " " in line.strip()] == [], "only a path may be longer"
