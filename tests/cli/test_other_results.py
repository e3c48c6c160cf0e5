"""Commands pointed at results of another version, and at what is no result at all."""

from __future__ import annotations

import pytest

from boulder_sweep.store import read
from boulder_sweep.store.failures import OtherVersionError
from tests.store.folders import OTHER_VERSIONS, rewrite

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
