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
