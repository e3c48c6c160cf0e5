"""Text of users' files and names on a terminal is text: nothing a terminal acts on comes through."""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import boulder_sweep.cli
from boulder_sweep.cli.main import execute
from boulder_sweep.cli.output import ready_streams, say, show
from boulder_sweep.text import printable
from tests.store.folders import rewrite

HOSTILE = [
    "\x1b]0;title\x07",
    "\x1b[2J",
    "two\nlines",
    "back\rwards",
    "\x9b31m",
    "\u202egnp.exe",
    "zero\u200bwidth",
    "\udcff",
    "\x00",
    "\x7f",
]
ALLOWED = re.compile(r"[^\x00-\x1f\x7f-\x9f\u200b-\u200f\u202a-\u202e\u2060-\u2069\ud800-\udfff]*")


@pytest.mark.parametrize("text", HOSTILE)
def test_what_a_terminal_acts_on_is_escaped(text):
    shown = printable(f"a{text}b")
    assert ALLOWED.fullmatch(shown)
    assert shown.startswith("a")
    assert shown.endswith("b")
    assert "\\" in shown


def test_plain_text_is_left_alone():
    text = "43.2°, K_ε = 1 — <script> 'quoted' \"twice\" =1+1 -x ©"
    assert printable(text) == text


def test_a_line_break_within_a_line_cannot_make_another_line(capsys):
    show("one\ntwo", "three")
    assert capsys.readouterr().out == "one\\ntwo\nthree\n"
    say("first\nsecond \x1b[31m")
    assert capsys.readouterr().err == "first\nsecond \\x1b[31m\n"


def test_the_commands_write_through_these_functions_only():
    """But for the bar and the table of `rich`, and the version, which click prints."""
    for path in Path(boulder_sweep.cli.__file__).parent.glob("*.py"):
        source = path.read_text()
        direct = re.findall(r"(?<![\w.])print\(|click\.echo\(|sys\.std(?:out|err)\.write", source)
        expected = {"output.py": ["print("] * 2}
        assert direct == expected.get(path.name, []), path.name


@pytest.mark.parametrize("text", [text for text in HOSTILE if "\x00" not in text])
def test_hostile_names_of_files_and_options(sweep, grid, text):
    for words in (
        ("run", f"{text}.yaml"),
        ("run", grid, f"--{text}"),
        ("run", grid, "--set", f"{text}=1"),
        ("run", grid, "--set", f"vehicle.speed={text}"),
        ("run", grid, "-o", f"no/{text}"),
        ("plot", f"out{text}"),
        ("simulate", f"out{text}.sweep"),
        (text,),
    ):
        code, out, err = sweep(*words)
        assert code == 2, words
        assert "internal error" not in err
        assert all(ALLOWED.fullmatch(line) for line in (out + err).split("\n")), words


def test_a_folder_and_a_file_whose_names_are_no_unicode(sweep, possible_grid):
    file, out = Path("grid\udcff.yaml"), "out\udcff"
    possible_grid.rename(file)
    assert sweep("run", file, "-o", out)[0] == 0
    code, shown, err = sweep("run", file, "-o", out, "--resume")
    assert (code, err) == (0, "small grid: 18 designs into out\\udcff\n")
    assert "out\\udcff" in shown
    assert sweep("simulate", out, "--design", "3")[0] == 0


@pytest.mark.parametrize("text", HOSTILE)
def test_what_a_stranger_has_written_into_a_part_is_shown_escaped(sweep, possible_grid, text):
    assert sweep("run", possible_grid, "-o", "out")[0] == 0

    def change(said):
        said["settings"]["name"] = said["versions"]["numba"] = text

    rewrite(Path("out"), change)
    for words in (
        ("simulate", "out"),
        ("run", possible_grid, "-o", "out", "--resume"),
        ("run", possible_grid, "-o", "out"),
    ):
        code, out, err = sweep(*words)
        assert code in (0, 2, 4)
        assert ALLOWED.fullmatch((out + err).replace("\n", ""))


PULSE = Path(__file__).parents[2] / "docs" / "examples" / "rigid_wall_pulse.csv"
COMMAND = [sys.executable, "-m", "boulder_sweep"]


def _with_streams(redirection, *words, **environment):
    """Run a command with redirected streams; return the exit code and what came out."""
    script = f'exec "$@" {redirection}'
    done = subprocess.run(
        ["sh", "-c", script, "sh", *COMMAND, *words],
        env={**os.environ, **environment},
        capture_output=True,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    "redirection", [pytest.param(">&-", marks=pytest.mark.nightly), "2>&-", ">&- 2>&-", "2>/dev/full"]
)
def test_closed_and_full_streams_change_no_exit_code(grid, redirection):
    assert _with_streams(redirection, "run", "grid.yaml", "-o", "out.sweep")[0] == 3
    assert len(list(Path("out.sweep").iterdir())) == 1
    code, _, err = _with_streams(redirection, "export", "out.sweep", "-o", "rows.csv")
    assert (code, err) == (0, b"")
    assert len(Path("rows.csv").read_text().splitlines()) == 19
    assert _with_streams(redirection, "check", "nothere.yaml")[0] == 2


SHOWING = (
    ("run", "grid.yaml", "-o", "again.sweep"),
    ("run", "grid.yaml", "--dry-run"),
    ("check", "grid.yaml"),
    ("need", "grid.yaml", "--least", "friction_angle", "-q"),
    ("uncertainty", "grid.yaml", "-q", *("--set", "soil.friction_angle={mean: 40 deg, cov: 5 %}")),
    ("capacity", "grid.yaml", "-q"),
    ("simulate", "grid.yaml", "-q"),
    ("run", "grid.yaml", "-o", "out.sweep", "--resume", "--dry-run"),
    ("compare", "out.sweep", "out.sweep"),
    ("simulate", "out.sweep", "--design", "1", "--all", "-q"),
    ("export", "out.sweep", "-o", "rows.csv"),
    ("fit-vehicle", "pulse.csv", "--mass", "6800 kg"),
    ("--help",),
    ("check", "nothere.yaml"),
)
"""Commands that print tables, and one that is refused."""


@pytest.mark.parametrize(
    "encoding",
    [
        "none: both are closed",
        "ascii",
        *(pytest.param(name, marks=pytest.mark.nightly) for name in ("latin-1", "cp1252")),
    ],
)
def test_no_command_depends_on_what_its_streams_can_carry(sweep, possible_grid, monkeypatch, encoding):
    text = possible_grid.read_text().replace("[1.6, 2.6, 3.5] m", "[2.6, 3.5] m").replace("[60, 95]", "60")
    possible_grid.write_text(text.replace("[0.8, 1.2, 1.5] m", "1.5 m"))
    shutil.copy(PULSE, "pulse.csv")
    assert sweep("run", "grid.yaml", "-q", "-o", "out.sweep")[0] == 0
    for words in SHOWING:
        if encoding.startswith("none"):
            out = err = None  # what Python makes of closed streams
        else:
            out, err = (
                io.TextIOWrapper(io.BytesIO(), encoding, errors=errors) for errors in ("strict", "backslashreplace")
            )
        with monkeypatch.context() as patch:
            patch.setattr("sys.stdout", out)
            patch.setattr("sys.stderr", err)
            ready_streams()
            assert execute(words) == (2 if "nothere.yaml" in words else 0), words
            if out is not None:
                out.flush()
                assert out.buffer.getvalue() or "nothere.yaml" in words, words
                assert words[0] != "need" or b"?" in out.buffer.getvalue(), "what it lacks is replaced"
        shutil.rmtree("again.sweep", ignore_errors=True)
