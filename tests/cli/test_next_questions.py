"""What `sweep need` suggests to ask next is a whole command, and leads on: every one is run here, where it was said."""

from __future__ import annotations

import re
import shlex
import shutil
from itertools import pairwise
from pathlib import Path

import pytest

CONFIGS = Path(__file__).parents[2] / "configs"
LOW = ("--set", "boulder.height=[2.6 m, 3 m]")
ASKED = {
    "less margin, and another boulder": ("site", *LOW),
    "all that was asked is kept": ("site", *LOW, "--units", "us", "--prefer", "depth", "--set", "vehicle.speed=31 mph"),
    "another margin": ("site", *LOW, "--margin", "35%"),
    "without a grade": ("site", *LOW, "--margin", "40%", "--any"),
    "nothing passes at any margin": ("abg",),
    "at the unfavourable ends": ("uncertain_site", "--at", "p10"),
    "a depth between": ("site", *LOW, "--between", "1.5 m", "1.8 m"),
    "the mass, at the depth of the file": ("site", "--least", "mass"),
    "the height, at the depth of the file": ("site", "--least", "height", "--units", "us"),
    "the mass in ranges that are wide, and a fast truck": (
        *("site", "--least", "mass", "--set", "boulder.height=[3 m, 4 m]", "--set", "boulder.width=[1.68 m, 2.5 m]"),
        *("--set", "site.embedment_ratio=[0.35, 0.75]", "--set", "vehicle.speed=45 mph", "--margin", "75 %"),
        *("--set", "soil.friction_angle=40 deg"),
    ),
}
KEPT = ("--units", "--prefer", "--at", "--probability")


def suggested(out: str) -> list[list[str]]:
    """Return the commands that an answer suggests, each of which has a line of its own after words."""
    lines = out.splitlines()
    return [shlex.split(line) for before, line in pairwise(lines) if before.startswith("next, ")]


@pytest.mark.parametrize("words", ASKED.values(), ids=ASKED)
def test_every_command_is_run_and_leads_on(sweep, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / f"{words[0]}.yaml", "my site.yaml")
    code, out, _ = sweep("need", "my site.yaml", "-q", *words[1:])
    commands = suggested(out)
    assert code == 0
    assert commands
    assert out.count("sweep ") == len(commands), "nothing else looks like a command"
    for program, *command in commands:
        assert program == "sweep"
        options = [word for word in command if word.startswith("--") and word != "--set"]
        assert len(options) == len(set(options))
        assert not {"--robust", "--any"} <= set(options)
        assert sorted(command) != sorted(["need", "my site.yaml", *words[1:]])
        for option, value in pairwise(words):
            if option in KEPT:
                assert command[command.index(option) + 1] == value
            if option == "--set" and not value.startswith(("boulder.", "site.")):
                assert value in command
        code, answer, err = sweep(*command, "-q")
        assert (code, err) == (0, "")
        assert re.search(r"\b[Bb]ury\s+the ", answer)


def test_a_probability_is_kept(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(CONFIGS / "uncertain_site.yaml", "site.yaml")
    asked = ("--probability", "90 %", "--set", "boulder.height=2.6 m")
    (command,) = suggested(sweep("need", "site.yaml", "-q", *asked)[1])
    code, out, _ = sweep(*command[1:], "-q")
    assert code == 0
    assert out.startswith("Bury ")
    assert "with a probability of 90." in out


def test_where_something_qualifies_nothing_is_asked_next(sweep):
    _, out, _ = sweep("need", CONFIGS / "site.yaml", "-q")
    assert suggested(out) == []
    assert "sweep " not in out
