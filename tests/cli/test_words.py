"""Words on a terminal: what a cold start waits for, what was written, what decided a row."""

import json
from pathlib import Path

import pytest

import boulder_sweep
from boulder_kernels import _ahead
from boulder_sweep import simulate
from boulder_sweep.cli import progress
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.judge.accuracy import Accuracy, Steps
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.settings import load


def test_explain_tells_what_decided_and_how_near(sweep, possible_grid):
    sweep("run", possible_grid, "-q")
    table = boulder_sweep.read("small-grid.sweep")
    overturned = table[table.reason == "overturns"].iloc[0]
    lines = sweep("explain", "small-grid.sweep", overturned.design_id)[1].splitlines()
    time = f"{1e3 * overturned.time_to_limit_s:.1f} ms"
    assert f"  rotation: the limit of 20 deg is reached {time} after contact" in lines
    assert "  fail: it overturns" in lines
    sweep("run", possible_grid, "-q", "-o", "slow.sweep", "--set", "vehicle.speed=10 mph")
    table = boulder_sweep.read("slow.sweep")
    passed = table[table.verdict == "pass"].iloc[0]
    text = sweep("explain", "slow.sweep", passed.design_id)[1]
    assert f"  rotation: {passed.max_rotation_deg:.4g} deg of 20 deg allowed, " in text
    assert f"  penetration: {passed.penetration_m:.4g} m, P1 allows 1 m beyond the far face" in text


COMPILING = "compiling kernels, once on this machine, about "
CONFIGS = Path(__file__).parents[2] / "configs"
SITE = CONFIGS / "site.yaml"
ONE = ("--set", "boulder.height=3.4 m", "--set", "soil.friction_angle=40 deg")


@pytest.fixture(scope="module")
def compiled():
    """Compile all kernels, where that was not done before."""
    evaluation_of(crash_test("rwg"), Accuracy("", Steps(0.01), error_estimate=False)).warm_up()
    simulate(crash_test("rwg"))


@pytest.mark.parametrize(
    "words",
    [
        ("run", SITE, *ONE),
        ("simulate", SITE, *ONE),
        ("need", SITE, *ONE),
        ("capacity", SITE, *ONE),
        ("uncertainty", SITE, *ONE, "--half-width", "0.2", "--set", "vehicle.speed={mean: 30 mph, cov: 5 %}"),
        ("tradeoff", SITE, *ONE, "--seconds", "0"),
    ],
)
def test_every_command_that_compiles_says_so_first(compiled, sweep, words, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert COMPILING not in sweep(*words)[2]
    monkeypatch.setattr("boulder_sweep.cli.progress.cold_start", lambda kernels: f"{COMPILING}7 s")
    remembered = {}
    monkeypatch.setattr("boulder_sweep.cli.progress._remember", remembered.__setitem__)
    code, _, err = sweep(*words, *(["--overwrite"] if words[0] == "run" else []))
    assert code == 0
    assert f"{COMPILING}7 s" in err
    assert list(remembered) == ["design" if words[0] == "simulate" else "table"]


@pytest.mark.parametrize("words", [("need", SITE, "--least", "phi"), ("uncertainty", SITE)])
def test_a_wrong_question_is_refused_before_anything_is_compiled(sweep, words, monkeypatch):
    compiled = []
    monkeypatch.setattr(Evaluation, "warm_up", compiled.append)
    assert sweep(*words)[0] == 2
    assert not compiled


def test_the_time_of_a_compilation_is_remembered_for_the_next_kernels(monkeypatch, tmp_path):
    folder = tmp_path / "kernels-1"
    folder.mkdir()
    monkeypatch.setattr("boulder_kernels._cache.CACHE_FOLDER", str(folder))
    assert progress.cold_start("table") == f"{COMPILING}15 s"
    progress._remember("table", 12.3)
    assert progress.cold_start("table") == f"{COMPILING}12 s"
    assert progress.cold_start("design") == f"{COMPILING}20 s"
    compiled = _ahead.folder()
    compiled.mkdir()
    (compiled / "lanes-run_lanes-0.json").write_text('{"types": "f82,f81,boulder_kernels.lanes:Queue"}')
    assert progress.cold_start("table") is None
    assert progress.cold_start("design") is not None


def test_compiled_kernels_are_those_that_are_looked_for(compiled):
    assert progress.cold_start("table") is None
    assert progress.cold_start("design") is None


SPRING = "vehicle.spring=[{stiffness: 3103 kN/m}, {beyond: 0.5 m, stiffness: 9000 kN/m}]"


@pytest.mark.parametrize(
    ("overrides", "kernels"),
    [
        ((), ("table", "design")),
        (("model.soil={elements: 50}",), ("elements-table", "design")),
        ((SPRING,), ("springs-table", "springs-design")),
        (("soil.cohesion=5 kPa",), ("layers-table", "layers-design")),
        (("soil.slope=10 deg",), ("table", "design")),
        (("model.unloading=plastic", SPRING), ("plastic-table", "plastic-design")),
    ],
)
def test_kernels_are_named_by_what_the_file_asks_for(overrides, kernels):
    sweep = load(CONFIGS / "rwg.yaml", overrides)
    assert (progress.kernels_for(sweep), progress.kernels_for(sweep, "design")) == kernels


@pytest.mark.nightly
@pytest.mark.parametrize(
    "override", ["model.soil={elements: 50}", SPRING, "soil.cohesion=5 kPa", "model.unloading=plastic"]
)
def test_kernels_of_other_laws_are_announced_until_they_are_compiled(sweep, override, tmp_path):
    case = (CONFIGS / "rwg.yaml", "--set", override)
    of_file = load(CONFIGS / "rwg.yaml", [override])
    assert sweep("run", *case, "-o", tmp_path / "one.sweep")[0] == 0
    assert sweep("simulate", *case)[0] == 0
    assert progress.cold_start(progress.kernels_for(of_file)) is None
    assert progress.cold_start(progress.kernels_for(of_file, "design")) is None
    assert COMPILING not in sweep("run", *case, "-o", tmp_path / "two.sweep")[2]


def test_a_run_ends_with_how_to_read_its_table(sweep, possible_grid):
    code, out, _ = sweep("run", possible_grid)
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    assert "FROM read_parquet('small-grid.sweep/*.parquet')" in out
    code, _, err = sweep("simulate", possible_grid, "--design", 1, "--trajectory", "one.parquet")
    assert err.splitlines()[-1] == "written  one.parquet"


def test_values_are_shown_in_us_units_where_asked(sweep, possible_grid):
    metric = json.loads(sweep("simulate", possible_grid, "--design", 1, "--json", "-q")[1])
    code, out, _ = sweep("simulate", possible_grid, "--design", 1, "--json", "-q", "--units", "us")
    us = json.loads(out)
    assert code == 0
    assert us["max_displacement_ft"] == metric["max_displacement_m"] / 0.3048
    assert us["peak_force_kip"] == metric["peak_force_kN"] / 4.4482216152605
    assert us["max_rotation_deg"] == metric["max_rotation_deg"]
    assert us["verdict"] == metric["verdict"]
    sweep("run", possible_grid, "-q")
    assert "  impact_speed_mph" in sweep("explain", "small-grid.sweep", 0, "--units", "us")[1]
    metric = json.loads(sweep("explain", "small-grid.sweep", 0, "--json")[1])
    us = json.loads(sweep("explain", "small-grid.sweep", 0, "--json", "--units", "us")[1])
    assert us["inputs"]["impact_speed_mph"] == pytest.approx(30.0)
    assert us["outcomes"]["max_displacement_ft"] == metric["outcomes"]["max_displacement_m"] / 0.3048
    assert "max_displacement_m" not in us["outcomes"]
    sweep("run", possible_grid, "-o", "again.sweep", "-q")
    code, out, err = sweep("compare", "small-grid.sweep", "again.sweep", "--json", "--units", "us")
    assert (code, out) == (2, "")
    assert "--json is in SI units" in err
