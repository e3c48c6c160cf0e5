"""``sweep run`` from the command line: what it writes, prints and returns."""

import errno
import json
import os
import re
import shlex
from pathlib import Path

import pytest

from boulder_sweep.cli import output
from boulder_sweep.errors import Interrupted
from boulder_sweep.runner.progress import Progress
from boulder_sweep.runner.run import resuming
from boulder_sweep.store import folder
from boulder_sweep.text import duration_text


def _counts(out):
    return {word: int(count.replace(",", "")) for word, count in re.findall(r"^  (\w+) +([\d,]+) ", out, re.MULTILINE)}


def test_a_run_and_its_table(sweep, grid):
    code, out, err = sweep("run", grid)
    assert code == 3  # the designs as deep as the boulder is high cannot be computed
    counts = _counts(out)
    assert sum(counts.values()) == 18
    assert counts["error"] == 6
    assert counts["fail"] > 0
    assert "small-grid.sweep" in out
    assert "embedment depth is not less than the boulder's height 6" in out
    assert err.startswith("small grid: 18 designs into small-grid.sweep\n")

    import pandas as pd

    table = pd.read_parquet("small-grid.sweep")
    assert table["design_id"].tolist() == list(range(18))
    assert table["verdict"].value_counts().to_dict() == counts


def test_designs_that_are_not_touched_are_counted(sweep, possible_grid):
    code, out, _ = sweep("run", possible_grid)
    assert code == 0
    assert "no_contact 4" in out
    assert _counts(out)["error"] == 0


def test_a_run_says_that_a_pass_is_no_rating(sweep, possible_grid):
    _, out, _ = sweep("run", possible_grid, "--set", "boulder.height=[3.2, 3.6] m")
    assert "a simulation, not a rating by test" in out


def test_a_run_says_what_is_robust_unless_second_opinions_are_left_out(sweep, possible_grid):
    """And resumes only with what it was asked."""
    heights = ("--set", "boulder.height=[3.2, 3.6] m")
    _, out, _ = sweep("run", possible_grid, *heights, "-o", "asked")
    assert "sensitive (stands under broms) 1" in out
    assert "stands with friction and vertical motion" in " ".join(out.split())
    assert "open: not asked" not in out
    again = [
        sweep("run", possible_grid, *heights, "-o", "asked", "--resume", *more)[0]
        for more in ((), ("--second-opinion",), ("--no-second-opinion",), ("--set", "model.second_opinion=none"))
    ]
    assert again == [0, 0, 4, 4]
    _, out, _ = sweep("run", possible_grid, *heights, "--no-second-opinion", "-o", "not-asked")
    assert "sensitive" not in out
    assert "open: not asked, or outside the ranges of their study" in out
    said = ("--set", "model.second_opinion=none", "--second-opinion")
    assert "sensitive" in sweep("run", possible_grid, *heights, *said, "-o", "asked-anyway")[1]


def test_json_is_one_object_on_stdout(sweep, possible_grid):
    code, out, _ = sweep("run", possible_grid, "-o", "out", "--json", "--quiet")
    assert code == 0
    found = json.loads(out)
    assert out.count("\n") == 1
    assert found["name"] == "small grid"
    assert found["rows"] == 18
    assert sum(found["verdicts"].values()) == 18
    assert found["out"] == "out"


def test_verbose_shows_the_settings(sweep, possible_grid):
    _, _, err = sweep("run", possible_grid, "-v")
    assert "friction_angle_deg" in err
    assert "corrected" in err


def test_an_output_that_exists(sweep, possible_grid):
    assert sweep("run", possible_grid)[0] == 0
    code, out, err = sweep("run", possible_grid)
    assert (code, out) == (4, "")
    assert err.endswith(
        "error: small-grid.sweep exists and is finished: see it with `sweep report small-grid.sweep`, or use "
        "--overwrite to start again\n"
    )
    assert "--resume" not in err
    assert sweep("run", possible_grid, "--resume")[0] == 0
    assert sweep("run", possible_grid, "--overwrite")[0] == 0
    code, _, err = sweep("run", possible_grid, "--resume", "--set", "vehicle.speed=20 mph")
    assert code == 4
    assert "impact_speed_m_s" in err


def test_set_and_accuracy_reach_the_table(sweep, possible_grid):
    from boulder_sweep import read

    words = ["--set", "vehicle.speed=20 mph", "--set", "boulder.height=3 m", "--accuracy", "fast"]
    assert sweep("run", possible_grid, "-o", "out", *words)[0] == 0
    table = read("out")
    assert len(table) == 6
    assert set(table["impact_speed_m_s"]) == {8.9408}
    assert (table["step_s"] == 0.012).all()


def test_a_dry_run_writes_nothing(sweep, grid):
    before = sorted(grid.parent.iterdir())
    code, out, _ = sweep("run", grid, "--dry-run")
    assert code == 0
    assert "small grid: 18 designs" in out
    assert "would simulate 18 of 18 designs into small-grid.sweep" in out
    assert "impact_height_m" in out
    assert sorted(grid.parent.iterdir()) == before
    code, out, _ = sweep("run", grid, "--dry-run", "--json")
    found = json.loads(out)
    assert found["settings"]["n_designs"] == 18
    assert found["estimate"]["rows"] == 18


def test_a_dry_run_says_what_resuming_would_compute(sweep, possible_grid):
    resume = ("run", possible_grid, "-q", "--resume", "--dry-run")
    assert sweep("run", possible_grid, "-q")[0] == 0
    assert "\nwould simulate 0 of 18 designs into small-grid.sweep\n" in sweep(*resume)[1]
    (part,) = Path("small-grid.sweep").glob("rows-*")
    whole = part.read_bytes()
    data = bytearray(whole)
    data[len(data) // 2] ^= 1
    part.write_bytes(data)
    code, out, _ = sweep(*resume)
    assert code == 0
    assert "\nwould simulate 18 of 18 designs into small-grid.sweep\n" in out
    assert f"\ndamaged: {part.name}: changed: its bytes do not have the hash in its name\n" in out
    assert json.loads(sweep(*resume, "--json")[1])["estimate"]["damaged"] == {
        part.name: "changed: its bytes do not have the hash in its name"
    }
    part.write_bytes(whole)
    code, out, err = sweep(*resume, "--set", "vehicle.speed=31 mph")
    assert (code, out) == (4, "")
    assert "was started with other settings" in err
    assert part.read_bytes() == whole


def interrupted(signum):
    def run(settings, out, *, jobs, backend, scheduler, **_):
        raise Interrupted(signum, 5, 18, resuming(settings, out, jobs, backend, scheduler))

    return run


def test_the_command_to_go_on_repeats_every_option(sweep, grid, monkeypatch):
    monkeypatch.setattr("boulder_sweep.runner.run.run", interrupted(2))
    words = ["-o", "my out", "--jobs", "2", "--backend", "dask", "--set", "vehicle.speed=20 mph"]
    words += ["--accuracy", "fine", "--second-opinion"]
    code, _, err = sweep("run", grid, *words)
    assert code == 130
    assert shlex.split(err.partition("Resume with:\n  ")[2]) == ["sweep", "run", "grid.yaml", *words, "--resume"]


def test_an_internal_error_is_one_line_unless_verbose(sweep, grid, monkeypatch):
    def run(*_, **__):
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr("boulder_sweep.runner.run.run", run)
    code, out, err = sweep("run", grid, "-q")
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert "ZeroDivisionError: on purpose" in err
    assert "please report" in err
    code, _, err = sweep("run", grid, "--verbose")
    assert code == 1
    assert "Traceback" in err


def test_progress_without_a_terminal_is_a_plain_line_now_and_then(capsys, monkeypatch):
    clock = {"now": 0.0}
    monkeypatch.setattr(output.time, "monotonic", lambda: clock["now"])
    with output.progress(quiet=False) as show:
        for clock["now"], done in ((1.0, 100), (11.0, 200), (12.0, 300), (30.0, 400)):
            show(Progress(0, done, 1000, done / 50))
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        " 20.0%  200 of 1,000 designs, 50 per second",
        " 40.0%  400 of 1,000 designs, 50 per second",
    ]


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"),
        (3.21, "3.2 s"),
        (59.4, "59 s"),
        (61, "1 min 01 s"),
        (3660, "1 h 01 min"),
        (4e6, "1,111 h 06 min"),
    ],
)
def test_durations(seconds, text):
    assert duration_text(seconds) == text


NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


@pytest.mark.parametrize("number", [*NO_SPACE, errno.EACCES, errno.EROFS, errno.EIO, errno.ECONNREFUSED])
@pytest.mark.parametrize("when", ["opened", "written"])
def test_a_folder_that_the_system_refuses_to_write_is_for_the_user_to_mend(
    sweep, possible_grid, monkeypatch, number, when
):
    def refused(*_, **__):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(*{"opened": (folder, "created"), "written": (os, "rename")}[when], refused)
    code, out, err = sweep("run", possible_grid, "-q", "-o", "out")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: cannot write into out: {os.strerror(number)}")
    assert ("free some space" in err) == (number in NO_SPACE)


@pytest.mark.parametrize("name", ["n" * 300, "grid.yaml/out"])
def test_a_folder_that_cannot_be_made_is_wrong_use(sweep, possible_grid, name):
    code, out, err = sweep("run", possible_grid, "-q", "-o", name)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert name.rpartition("/")[2] in err


@pytest.mark.parametrize(("number", "helps"), [(errno.ENOSPC, True), (errno.EDQUOT, True), (errno.EACCES, False)])
def test_what_helps_is_said_wherever_a_file_cannot_be_written(sweep, tmp_path, monkeypatch, number, helps):
    opened = Path.open

    def refused(self, mode="r", *others, **named):
        if mode == "x":
            raise OSError(number, os.strerror(number), str(self))
        return opened(self, mode, *others, **named)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "open", refused)
    code, out, err = sweep("new", "mine.yaml")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: mine.yaml: {os.strerror(number)}")
    assert ("free some space" in err) == helps
