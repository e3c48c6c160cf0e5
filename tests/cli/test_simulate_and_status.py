"""``sweep simulate`` and ``sweep status`` from the command line."""

import json
import os
import re
import shlex
from pathlib import Path

import pytest

import boulder_sweep

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize(
    ("case", "preset", "verdict", "rotation", "displacement"),
    [
        ("rwg", "corrected", "pass", 13.7612, 0.2820),
        ("rwg", "as_printed", "undecided", 7.6940, 0.1505),
        ("abg", "corrected", "fail", 20.0, 0.1924),
        ("abg", "as_printed", "fail", 20.0, 0.2206),
    ],
)
def test_the_crash_tests(sweep, case, preset, verdict, rotation, displacement):
    code, out, err = sweep("simulate", CONFIGS / f"{case}.yaml", "--set", f"model.readings={preset}", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["verdict"] == verdict
    assert found["preset"] == preset
    assert found["max_rotation_deg"] == pytest.approx(rotation, abs=0.02)
    assert found["max_displacement_m"] == pytest.approx(displacement, abs=5e-4)


def test_sentence_and_json_state_the_row_that_run_writes(sweep, tmp_path):
    """A boulder that the horizon of one second finds at 11 deg; it comes to rest in the second after."""
    late = Path(__file__).parents[1] / "judge" / "settles_late.csv"
    (tmp_path / "late.yaml").write_text(f"name: late\ntable: {late}\n")
    assert sweep("run", tmp_path / "late.yaml", "-o", tmp_path / "late.sweep", "-q")[0] == 0
    row = boulder_sweep.read(tmp_path / "late.sweep").iloc[0]
    sentence = "late: PASS, 15.6° of 20° allowed, simulated for 2 s"
    assert sweep("simulate", tmp_path / "late.yaml", "-q")[1].splitlines()[0] == sentence
    found = json.loads(sweep("simulate", tmp_path / "late.yaml", "--json", "-q")[1])
    for name in ("verdict", "max_rotation_deg", "max_displacement_m", "margin", "end_time_s", "step_s"):
        assert found[name] == row[name], name
    assert found["max_rotation_deg"] == pytest.approx(15.562, abs=1e-3)


def test_the_ground_is_named_unless_quiet_is_asked_for(sweep):
    case = (CONFIGS / "rwg.yaml", "--set", "soil.slope=10 deg", "--json")
    _, out, err = sweep("simulate", *case)
    assert "note: ground falling" in err
    assert sweep("simulate", *case, "-q") == (0, out, "")


def test_what_stands_beside_a_pass(sweep):
    case = CONFIGS / "rwg.yaml"
    _, out, _ = sweep("simulate", case, "--set", "vehicle.speed=12.5 m/s")
    assert "a simulation, not a rating by test" in out
    assert "caution" not in out
    _, out, _ = sweep("simulate", case, "--set", "boulder.density=3200 kg/m^3", "-q")
    assert "caution: a density that rock does not have" in out


def test_a_pass_has_its_second_opinion_before_any_caution(sweep, tmp_path):
    robust = sweep("simulate", CONFIGS / "rwg.yaml")[1]
    assert "\nrobust: stands with friction and vertical motion under three laws" in robust
    out = sweep("simulate", CONFIGS / "rwg.yaml", "--set", "soil.friction_angle=41 deg")[1]
    assert out.index("\nsensitive: a second opinion overturns it") < out.index("\ncaution: ")
    wet = sweep("simulate", CONFIGS / "rwg.yaml", "--set", "soil.water_table=1 m")[1]
    assert "\nopen: second opinions know boxes of rock of given density, elastic, dry" in wet
    assert "robust" not in sweep("simulate", CONFIGS / "abg.yaml")[1]


def test_it_begins_with_the_verdict_in_a_sentence_and_raw_columns_are_asked_for(sweep):
    code, out, err = sweep("simulate", CONFIGS / "abg.yaml")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "abg: FAIL, it overturns, past 20° after 0.077 s"
    assert lines[1] == "  rotation: the limit of 20 deg is reached 76.9 ms after contact"
    assert "max_rotation_deg" not in out
    every = sweep("simulate", CONFIGS / "abg.yaml", "--all")[1].splitlines()
    assert every[: len(lines)] == lines
    found = json.loads(sweep("simulate", CONFIGS / "abg.yaml", "--json")[1])
    assert [line.split()[0] for line in every[len(lines) + 1 :] if not line.startswith("  ")] == list(found)


def test_the_sentence_of_a_pass_is_in_the_units_asked_for(sweep):
    out = sweep("simulate", CONFIGS / "rwg.yaml", "--units", "us")[1]
    lines = out.splitlines()
    assert lines[0] == "rwg: PASS, 13.8° of 20° allowed"
    assert "  penetration: -10.58 ft, P1 allows 3.28 ft beyond the far face" in lines
    assert "  displacement: boulder 0.925 ft, truck 4.34 ft; peak force 231 kip" in lines
    assert not re.search(r"\d m\b", out)


def test_a_long_sentence_is_wrapped(sweep):
    out = sweep("simulate", CONFIGS / "rwg.yaml", "--set", "model.readings=as_printed")[1]
    assert out.startswith("rwg: UNDECIDED, nothing proved at the end of the simulated time, 7.7° of 20°\n  allowed\n")


def test_a_design_of_a_list(sweep):
    code, out, err = sweep("simulate", CONFIGS / "crash_tests.yaml", "--design", "1")
    assert (code, err) == (0, "")
    assert out.startswith("crash-tests #1: PASS, ")
    code, out, err = sweep("simulate", CONFIGS / "crash_tests.yaml")
    assert code == 0
    assert "holds 2 designs; this is number 0" in err
    code, out, err = sweep("simulate", CONFIGS / "crash_tests.yaml", "--design", "2")
    assert (code, out) == (2, "")
    assert "there is no 2" in err


def test_plot_and_trajectory_are_written_where_asked(sweep, grid):
    import pandas as pd

    code, _, _ = sweep("simulate", grid, "--design", "14", "--plot", "history.png", "--trajectory", "history.parquet")
    assert code == 0
    assert (grid.parent / "history.png").read_bytes().startswith(b"\x89PNG")
    assert len(pd.read_parquet("history.parquet")) > 100


def test_a_design_that_cannot_be_computed(sweep, grid):
    code, out, err = sweep("simulate", grid, "--design", "4")
    assert (code, out) == (3, "")
    assert err == "design 4 cannot be computed: embedment depth is not less than the boulder's height\n"


def test_numbers_are_shown_also_where_there_is_no_motion_to_draw(sweep, grid):
    code, out, err = sweep(
        "simulate", grid, "-q", "--design", "0", "--set", "vehicle.bumper_height=1.3 m", "--plot", "x.png"
    )
    assert code == 2
    assert out.startswith("small grid #0: FAIL, the truck passes over it\n")
    assert err == "error: there is no motion to draw: the truck passes over the boulder\n"


def test_places_that_cannot_be_written(sweep, grid):
    for option, name in (("--plot", "no/such/folder.png"), ("--trajectory", "no/such/folder.parquet")):
        code, _, err = sweep("simulate", grid, "-q", option, name)
        assert code == 2
        assert "no/such" in err
        assert "internal" not in err
        assert "Errno" not in err


def test_a_folder_in_the_place_of_a_time_history(sweep, grid):
    (grid.parent / "history.parquet").mkdir()
    code, _, err = sweep("simulate", grid, "-q", "--trajectory", "history.parquet")
    assert (code, err) == (2, "error: history.parquet cannot be written: Is a directory\n")


def test_a_time_history_is_not_written_under_the_name_of_another_format(sweep, grid):
    code, _, err = sweep("simulate", grid, "-q", "--trajectory", "history.csv")
    assert code == 2
    assert err == "error: history.csv: a time history is a Parquet file; its name must end in .parquet\n"
    assert not (grid.parent / "history.csv").exists()


@pytest.fixture
def nothing_simulated(monkeypatch):
    monkeypatch.setattr("boulder_sweep.impact.simulation.simulate", lambda *_, **__: pytest.fail("simulated"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("history.csv",), "history.csv: a time history is a Parquet file; its name must end in .parquet"),
        (("no/history.parquet",), "no/history.parquet: the folder {here}/no does not exist"),
        (("folder.parquet",), "folder.parquet cannot be written: Is a directory"),
        (("./history.parquet", "--plot", "history.parquet"), "./history.parquet is named twice; give each output a"),
    ],
)
def test_a_wrong_name_of_a_time_history_is_refused_before_simulating(sweep, grid, nothing_simulated, words, message):
    Path("folder.parquet").mkdir()
    code, out, err = sweep("simulate", grid, "-q", "--trajectory", *words)
    assert (code, out) == (2, "")
    assert message.format(here=Path.cwd()) in err
    assert sorted(path.name for path in Path().iterdir()) == ["folder.parquet", "grid.yaml"]


@pytest.mark.parametrize("there", [False, True])
def test_a_time_history_that_may_not_be_written_is_refused_before_simulating(
    sweep, grid, nothing_simulated, monkeypatch, there
):
    history = Path("history.parquet")
    if there:
        history.write_text("of somebody else")
    barred, access = {history if there else Path.cwd()}, os.access

    def barred_to_write(path, mode):
        return not (mode & os.W_OK and Path(path) in barred) and access(path, mode)

    monkeypatch.setattr(os, "access", barred_to_write)
    refused = (2, "", "error: history.parquet cannot be written: Permission denied\n")
    assert sweep("simulate", grid, "-q", "--trajectory", history) == refused
    assert history.exists() == there


def test_status_of_a_finished_run(sweep, possible_grid):
    assert sweep("run", possible_grid, "-q")[0] == 0
    code, out, err = sweep("status", "small-grid.sweep", "--verify")
    assert (code, err) == (0, "")
    assert "finished, 18 of 18 designs (100.0%)" in out
    assert "every part was read and is intact" in out
    code, out, _ = sweep("status", "small-grid.sweep", "--json")
    assert code == 0
    assert json.loads(out)["complete"] is True


def test_status_finds_damage(sweep, possible_grid):
    sweep("run", possible_grid, "-q")
    (part,) = [
        path for path in (possible_grid.parent / "small-grid.sweep").glob("*.parquet") if not path.name.startswith("_")
    ]
    data = bytearray(part.read_bytes())
    data[len(data) // 2] ^= 1
    part.write_bytes(data)
    code, out, _ = sweep("status", "small-grid.sweep", "--verify")
    assert code == 1
    assert f"damaged  {part.name}" in out
    assert "resume   sweep run grid.yaml -o small-grid.sweep --resume" in out


def unfinished(folder):
    """Let a finished run lack its rows."""
    (part,) = [path for path in folder.glob("*.parquet") if not path.name.startswith("_")]
    part.unlink()


def resumed_by(sweep, *words):
    """Return the command that `sweep status` gives, and what it says of it."""
    code, out, _ = sweep("status", *words)
    assert code == 1
    (at, command) = next((at, line) for at, line in enumerate(out.splitlines()) if line.startswith("resume   "))
    return command.removeprefix("resume   "), out.splitlines()[at + 1 :]


@pytest.mark.parametrize("out", ["small-grid.sweep", "runs/first/my out.sweep"])
def test_status_of_a_folder_moved_with_its_settings_file(sweep, possible_grid, monkeypatch, out):
    Path("project/runs/first").mkdir(parents=True)
    possible_grid.rename("project/grid.yaml")
    top = Path.cwd()
    monkeypatch.chdir("project")
    assert sweep("run", "grid.yaml", "-q", "-o", out)[0] == 0
    unfinished(Path(out))
    expected = ["sweep", "run", "grid.yaml", "-o", out, "--resume"]
    assert resumed_by(sweep, out) == (shlex.join(expected), [])
    monkeypatch.chdir(top)
    (top / "project").rename("elsewhere")
    (top / "grid.yaml").write_text("of another sweep")
    command, more = resumed_by(sweep, f"elsewhere/{out}")
    assert shlex.split(command) == ["sweep", "run", "elsewhere/grid.yaml", "-o", f"elsewhere/{out}", "--resume"]
    assert more == []
    assert sweep(*shlex.split(command)[1:], "-q")[0] == 0
    assert sweep("status", f"elsewhere/{out}")[0] == 0
    monkeypatch.chdir(top / "elsewhere" / out)
    unfinished(Path())
    command, more = resumed_by(sweep, ".")
    assert shlex.split(command)[2:5] == [str(top / "elsewhere" / "grid.yaml"), "-o", "."]
    assert more == []


def test_status_of_a_folder_moved_from_its_settings_file(sweep, possible_grid, monkeypatch):
    sweep("run", possible_grid, "-q")
    unfinished(Path("small-grid.sweep"))
    Path("archive").mkdir()
    Path("small-grid.sweep").rename("archive/old.sweep")
    assert resumed_by(sweep, "archive/old.sweep") == ("sweep run grid.yaml -o archive/old.sweep --resume", [])
    monkeypatch.chdir("archive")
    missing = ["note     there is no grid.yaml; give its present path instead"]
    assert resumed_by(sweep, "old.sweep") == ("sweep run grid.yaml -o old.sweep --resume", missing)
    found = json.loads(sweep("status", "old.sweep", "--json")[1])
    assert found["settings_missing"] == "grid.yaml"
    Path("../grid.yaml").replace("grid.yaml")
    assert resumed_by(sweep, "old.sweep") == ("sweep run grid.yaml -o old.sweep --resume", [])


def test_status_of_a_moved_folder_whose_settings_file_was_named_by_its_whole_path(sweep, possible_grid):
    whole = possible_grid.resolve()
    sweep("run", whole, "-q", "-o", whole.parent / "old.sweep")
    unfinished(Path("old.sweep"))
    Path("old.sweep").rename("new.sweep")
    command = f"sweep run {whole} -o new.sweep --resume"
    assert resumed_by(sweep, "new.sweep") == (command, [])
    whole.rename("other.yaml")
    missing = [f"note     there is no {whole}; give its present path instead"]
    assert resumed_by(sweep, "new.sweep") == (command, missing)


@pytest.mark.parametrize("name", ["no.sweep", "."])
def test_status_of_what_is_no_result(sweep, grid, name):
    code, out, err = sweep("status", name)
    assert (code, out) == (2, "")
    assert err
    assert "internal" not in err
