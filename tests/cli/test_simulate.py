"""``sweep simulate`` from the command line, and commands pointed at results of another version or at none."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import boulder_sweep
from boulder_sweep.store import read
from boulder_sweep.store.failures import OtherVersionError
from tests.store.folders import OTHER_VERSIONS, rewrite

CONFIGS = Path(__file__).parents[2] / "configs"


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
    assert "caution: rock lighter or heavier than the study's" in out


def test_a_pass_has_its_second_opinion_before_any_caution(sweep, tmp_path):
    robust = sweep("simulate", CONFIGS / "rwg.yaml")[1]
    assert "\nrobust: stands with friction and vertical motion under the weakest of three" in robust
    out = sweep("simulate", CONFIGS / "rwg.yaml", "--set", "soil.friction_angle=41 deg")[1]
    assert out.index("\nsensitive: a second opinion overturns it") < out.index("\ncaution: ")
    wet = sweep("simulate", CONFIGS / "rwg.yaml", "--set", "soil.water_table=1.5 m")[1]
    assert "\nsensitive: a second opinion overturns it" in wet
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


@pytest.fixture
def nothing_simulated(monkeypatch):
    monkeypatch.setattr("boulder_sweep.impact.simulation.simulate", lambda *_, **__: pytest.fail("simulated"))


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


@pytest.fixture
def finished(sweep, possible_grid):
    assert sweep("run", possible_grid, "-q")[0] == 0
    return Path("small-grid.sweep")


def test_a_row_of_a_result_is_told_like_a_design_and_compared_to_the_last_bit(sweep, possible_grid, finished):
    table = boulder_sweep.read(finished)
    number = int(table.design_id[table.verdict == "fail"].iloc[0])
    of_file = sweep("simulate", possible_grid, "--design", number)[1].splitlines()
    code, out, err = sweep("simulate", finished, "--design", number, "--energy", "energy.png")
    assert (code, err) == (0, "written  energy.png\n")
    assert out.splitlines() == [*of_file, "computed again: the same to the last bit"]
    assert Path("energy.png").exists()
    row = json.loads(sweep("simulate", finished, "--design", number, "--json")[1])
    assert {name: row[name] for name in ("verdict", "max_rotation_deg", "boulder_height_m")} == dict(
        table.loc[number, ["verdict", "max_rotation_deg", "boulder_height_m"]]
    )
    assert (row["same_bits"], row["unequal"], row["changed_since"], row["judged_by"]) == (True, {}, [], "")
    every = sweep("simulate", finished, "--design", number, "--all")[1].splitlines()
    assert every[: len(out.splitlines())] == out.splitlines()
    assert [line.split()[0] for line in every[len(out.splitlines()) + 1 :]] == list(row)[:-4]


def test_a_row_that_passes_says_whether_it_was_asked(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for more, words in (
        (("--no-second-opinion",), "open: not asked (--second-opinion asks)"),
        ((), "robust: "),
    ):
        assert sweep("run", CONFIGS / "rwg.yaml", "-q", "--overwrite", "-o", "rwg.sweep", *more)[0] == 0
        out = sweep("simulate", "rwg.sweep")[1]
        assert f"\n{words}" in out
        assert out.endswith("\ncomputed again: the same to the last bit\n")
        assert f"\n{words}" in sweep("simulate", CONFIGS / "rwg.yaml", *more)[1]
        code, _, err = sweep("simulate", "rwg.sweep", "--no-second-opinion")
        assert code == 2
        assert "change the settings of a file" in err


def test_a_row_that_cannot_be_computed(sweep, grid):
    sweep("run", grid, "-q")
    code, out, err = sweep("simulate", "small-grid.sweep", "--design", "4", "--plot", "x.png")
    assert (code, out) == (3, "computed again: the same to the last bit\n")
    assert err == "design 4 cannot be computed: embedment depth is not less than the boulder's height\n"
    assert not Path("x.png").exists()
    row = json.loads(sweep("simulate", "small-grid.sweep", "--design", "4", "--json")[1])
    assert (row["verdict"], row["same_bits"]) == ("error", True)


def test_a_row_whose_uncertain_inputs_are_too_many_to_be_listed_is_refused(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    means = "soil.friction_angle={mean: {from: 36 deg, to: 42 deg, count: 1001}, cov: 5 %}"
    assert sweep("run", CONFIGS / "rwg.yaml", "-q", "-o", "many.sweep", "--set", means)[0] == 0
    code, out, err = sweep("simulate", "many.sweep", "--design", "3")
    assert (code, out) == (2, "")
    assert "the table does not list the values of its uncertain inputs" in err


def test_a_row_that_came_out_otherwise(sweep, finished, monkeypatch):
    monkeypatch.setattr("boulder_sweep.impact.recomputing._same", lambda a, b: isinstance(a, str))
    monkeypatch.setattr("boulder_sweep.store.provenance.kernels_sha256", lambda: "0" * 64)
    code, out, err = sweep("simulate", finished, "-q")
    assert code == 0
    assert err.startswith("note: small-grid.sweep was judged by the rules of version ")
    assert "differs now: max_rotation_deg was " in out
    assert "\nchanged since: kernels_sha256: " in out
    assert "\nas stored, the design was judged by the rules of version " in out
    assert "the same to the last bit" not in out


RESULT = "small-grid.sweep"
COMMANDS = [["simulate", RESULT], ["plot", RESULT], ["export", RESULT, "-o", "t.csv"], ["compare", RESULT, RESULT]]


@pytest.fixture
def result(sweep, possible_grid):
    """Work beside a finished result."""
    assert sweep("run", possible_grid, "-q")[0] == 0
    return possible_grid.parent.joinpath(RESULT).resolve()


def assert_is_of_another_version(answer):
    code, out, err = answer
    assert (code, out) == (4, "")
    assert f"{RESULT} was written by boulder-sweep " in err
    assert "writes into another folder, or into this one once it is empty" in err
    assert "internal" not in err


@pytest.mark.parametrize("version", ["earlier", "later"])
def test_a_result_of_another_version(sweep, result, version):
    rewrite(result, OTHER_VERSIONS[version][0])
    before = {path.name: path.read_bytes() for path in result.iterdir()}
    for words in [
        *COMMANDS,
        ["run", "grid.yaml"],
        ["run", "grid.yaml", "--resume"],
        ["run", "grid.yaml", "--dry-run", "--resume"],
    ]:
        assert_is_of_another_version(sweep(*words, *(["-q"] if words[0] == "run" else [])))
    with pytest.raises(OtherVersionError):
        read(result)
    assert {path.name: path.read_bytes() for path in result.iterdir()} == before
    assert sweep("run", "grid.yaml", "-q", "--overwrite")[0] == 0
    assert sweep("plot", RESULT)[0] == 0


@pytest.mark.parametrize("part", ["control", "readings", "settings"])
def test_settings_that_no_file_gives(sweep, result, part):
    """The records are as they should be, what they say of the computation is not."""
    rewrite(result, lambda said: said.update({part: {"colour": "red"}}))
    for words in (["simulate", RESULT], ["report", RESULT], ["export", RESULT, "-o", "t.csv"]):
        code, _, err = sweep(*words)
        assert (code, err.count("\n")) == (2, 1)
        assert f"holds what no sweep writes ({part}" in err
    code, _, err = sweep("run", "grid.yaml", "-q", "--resume")
    assert code == 0
    assert f"was damaged ({part}" in err


@pytest.mark.parametrize(
    "words",
    [
        ["export", RESULT, "-o", f"{RESULT}/all.parquet"],
        ["need", "grid.yaml", "-q", "-o", f"{RESULT}/need.parquet"],
        ["plot", RESULT, "-o", f"{RESULT}/map.png"],
        ["simulate", "grid.yaml", "-q", "--trajectory", f"{RESULT}/history.parquet"],
    ],
)
def test_no_command_writes_a_file_into_a_result(sweep, result, words):
    before = {path.name: path.read_bytes() for path in result.iterdir()}
    code, _, err = sweep(*words)
    assert code == 2
    assert err == f"error: {words[-1]}: the folder {result} holds the result of a run; name a file outside it\n"
    assert {path.name: path.read_bytes() for path in result.iterdir()} == before


def test_a_file_of_a_result_in_place_of_its_folder(sweep, result):
    (part,) = result.glob("rows-*.parquet")
    for words in (["simulate", part], ["plot", part]):
        code, out, err = sweep(*words)
        assert (code, out) == (2, "")
        assert f"is a file; the result of a run is a folder: name the folder it lies in, {result}" in err


def test_a_file_of_answers_in_place_of_a_result(sweep, possible_grid):
    assert sweep("need", possible_grid, "-q", "-o", "depths.parquet")[0] == 0
    code, out, err = sweep("simulate", "depths.parquet")
    assert (code, out) == (2, "")
    assert err == (
        "error: depths.parquet is a file; the result of a run is a folder; `sweep report`, `plot`, `export` and "
        "`compare` take a file of answers\n"
    )


def test_a_time_history_is_exported_only(sweep, possible_grid):
    assert sweep("simulate", possible_grid, "-q", "--trajectory", "history.parquet")[0] == 0
    for words in (["report"], ["plot"], ["compare", "history.parquet"]):
        code, out, err = sweep(words[0], "history.parquet", *words[1:])
        assert (code, out) == (2, "")
        assert err == "error: history.parquet is a time history; `sweep export` takes it\n"
    assert sweep("export", "history.parquet", "-o", "history.csv")[0] == 0
