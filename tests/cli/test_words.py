"""Words on a terminal: what a cold start waits for, what was written, what decided a row."""

import json
from pathlib import Path

import pytest

from boulder_kernels import _jit
from boulder_sweep import simulate
from boulder_sweep.cli import output
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.judge.accuracy import Accuracy, Steps
from boulder_sweep.judge.evaluation import evaluation_of

COMPILING = "compiling kernels, once on this machine, about "
KERNEL = "a_kernel"
CONFIGS = Path(__file__).parents[2] / "configs"
SITE = CONFIGS / "site.yaml"
ONE = ("--set", "boulder.height=3.4 m", "--set", "soil.friction_angle=40 deg")


def after_compiling(kernel):
    """Return what calls kernels, the first one after it has been compiled."""
    call, begun = _jit.Kernel.__call__, []

    def cold(*given, **named):
        if not begun:
            begun.append(kernel)
            with _jit.announce(kernel):
                pass
        return call(*given, **named)

    return cold


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
    again = ["--overwrite"] if words[0] == "run" else []
    sweep(*words)
    assert COMPILING not in sweep(*words, *again)[2]
    monkeypatch.setattr(_jit.Kernel, "__call__", after_compiling(KERNEL))
    remembered = {}
    monkeypatch.setattr(output, "_remember", remembered.__setitem__)
    code, _, err = sweep(*words, *again)
    assert code == 0
    assert err.count(f"{COMPILING}20 s") == 1
    assert list(remembered) == [KERNEL]


def test_the_time_of_a_compilation_is_remembered_for_the_next_kernels(sweep, monkeypatch, tmp_path):
    """By the kernel that it begins with, beside the folders of all versions of the kernels."""
    monkeypatch.setattr("boulder_kernels._cache.CACHE_FOLDER", str(tmp_path / "kernels-1" / "native-1"))
    (tmp_path / f"{KERNEL}-and-more-in-seconds").write_text("12.3")
    monkeypatch.setattr(_jit.Kernel, "__call__", after_compiling(KERNEL))
    assert f"{COMPILING}12 s" in sweep("simulate", SITE, *ONE)[2]
    assert float((tmp_path / f"{KERNEL}-and-more-in-seconds").read_text()) < 12.3
    monkeypatch.setattr(_jit.Kernel, "__call__", after_compiling("another"))
    assert f"{COMPILING}20 s" in sweep("simulate", SITE, *ONE)[2]


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
    assert "\nimpact_speed_mph" in sweep("simulate", "small-grid.sweep", "--all", "--units", "us")[1]
    metric = json.loads(sweep("simulate", "small-grid.sweep", "--json")[1])
    us = json.loads(sweep("simulate", "small-grid.sweep", "--json", "--units", "us")[1])
    assert us["impact_speed_mph"] == pytest.approx(30.0)
    assert us["max_displacement_ft"] == metric["max_displacement_m"] / 0.3048
    assert "max_displacement_m" not in us
