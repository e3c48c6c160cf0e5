"""Words on a terminal: what a cold start waits for, what was written, what decided a row."""

import json

import boulder_sweep


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


def test_a_cold_start_says_so_and_lines_fit_a_terminal(sweep, possible_grid, monkeypatch):
    monkeypatch.setattr("boulder_sweep.cli.console.is_cold", lambda: True)
    code, out, err = sweep("run", possible_grid)
    assert code == 0
    assert "compiling kernels, once on this machine, about 40 s" in err
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
