"""Names of files and folders to write: none is empty or given twice, and all are checked before the computing."""

from __future__ import annotations

from pathlib import Path

import click
import pytest

from boulder_sweep.cli.main import COMMANDS
from boulder_sweep.cli.options import OutputPath

CASE = Path(__file__).parents[2] / "configs" / "rwg.yaml"
NAMES = ("output", "plot", "trajectory", "energy", "animate")
OUTPUTS = [
    (command, option)
    for command in COMMANDS
    for option in command.params
    if isinstance(option, click.Option) and {f"--{name}" for name in NAMES} & set(option.opts)
]
REST = {"compare": ("x",), "fit-vehicle": ("--mass", "6800 kg")}


@pytest.mark.parametrize(("command", "option"), OUTPUTS)
def test_an_empty_name_is_refused(sweep, tmp_path, monkeypatch, command, option):
    monkeypatch.chdir(tmp_path)
    assert isinstance(option.type, OutputPath)
    source = () if command.name == "validate" else (CASE,)
    code, out, err = sweep(command.name, *source, *REST.get(command.name, ()), option.opts[0], "")
    assert (code, out) == (2, "")
    assert "the name is empty" in err
    assert not list(tmp_path.iterdir())


def test_an_empty_name_of_a_new_file_is_refused(sweep):
    code, _, err = sweep("new", "", "--yes")
    assert code == 2
    assert "the name is empty" in err


@pytest.fixture
def nothing_computed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for place in ("simulation.simulate", "recomputing.recompute"):
        monkeypatch.setattr(f"boulder_sweep.impact.{place}", lambda *_, **__: pytest.fail("computed"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--plot", "x.png", "--energy", "x.png"), "x.png is named twice"),
        (("--plot", "x.png", "--energy", "../{folder}/x.png"), "is named twice"),
        (("--trajectory", "t.csv"), "its name must end in .parquet"),
        (("--energy", "e.bmp"), "must end in .png, .svg, .pdf"),
        (("--animate", "film.png"), "must end in .gif"),
        (("--plot", "x.png", "--animate", "no/film.gif"), "does not exist"),
    ],
)
def test_outputs_are_checked_before_simulating(sweep, nothing_computed, words, message):
    code, out, err = sweep("simulate", CASE, *(word.format(folder=Path.cwd().name) for word in words))
    assert (code, out) == (2, "")
    assert message in err
    assert not list(Path.cwd().iterdir())


def test_outputs_are_checked_before_a_row_is_computed_again(sweep, nothing_computed):
    for words in (("--plot", "x.bmp"), ("--trajectory", "t.csv")):
        code, out, err = sweep("simulate", "out.sweep", *words)
        assert (code, out) == (2, "")
        assert "must end in" in err
