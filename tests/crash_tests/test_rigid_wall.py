"""A vehicle against a rigid wall, and the statements of the paper on its crash tests."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from boulder_sweep.crash_tests.cases import Validation, crash_test, rigid_wall_test, statements
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.impact.simulation import simulate
from tests.conftest import Command
from tests.oracle.vehicle import WallImpact

MASS, SPRING = 6800.0, 3103.3e3
CRITICAL = math.sqrt(MASS * SPRING) / 2
DAMPERS = [2e3, 0.5 * CRITICAL, CRITICAL, 138.91e3, 5 * CRITICAL]


def test_figures_of_the_papers_truck() -> None:
    wall = rigid_wall_test()
    assert wall.a == pytest.approx(-11.170, abs=5e-4)
    assert wall.b == pytest.approx(18.210, abs=5e-4)
    assert wall.max_displacement_m == pytest.approx(0.8267, abs=5e-5)
    assert wall.max_displacement_time_s == pytest.approx(0.1165, abs=5e-5)
    assert wall.peak_force / 1e3 == pytest.approx(1040.8, abs=0.06)
    assert wall.peak_force_time_s == pytest.approx(0.0560, abs=5e-5)
    assert wall.separation_time_s == pytest.approx(0.1725, abs=5e-5)
    assert wall.rebound_speed_m_s == pytest.approx(-1.951, abs=5e-4)


def test_response_is_eq_49_put_right() -> None:
    wall = rigid_wall_test()
    a, b, v_0 = wall.a, wall.b, wall.speed_m_s
    t = np.linspace(0.0, wall.separation_time_s, 60)
    P = (v_0 - 2 * a**2 * v_0 / (a**2 + b**2)) / b
    Q = 2 * a * v_0 / (a**2 + b**2)
    eq_49 = -Q + np.exp(a * t) * (P * np.sin(b * t) + Q * np.cos(b * t))
    assert wall.response(t)[0] == pytest.approx(eq_49, abs=1e-13)


@pytest.mark.parametrize("damper", DAMPERS)
def test_response_is_that_of_the_oracle(damper: float) -> None:
    wall, known = RigidWall(MASS, 13.4, SPRING, damper), WallImpact(MASS, 13.4, SPRING, damper)
    t = np.linspace(0.0, min(wall.separation_time_s, 1.0), 80)
    for found, expected, scale in zip(wall.response(t), known.response(t), (1.0, 10.0, 200.0), strict=True):
        assert found == pytest.approx(expected, abs=1e-12 * scale)
    assert wall.max_displacement_m == pytest.approx(known.largest_displacement()[0], rel=1e-12)
    assert wall.peak_force == pytest.approx(known.peak_force()[0], rel=1e-12)
    assert wall.peak_force_time_s == pytest.approx(known.peak_force()[1], rel=1e-9)
    assert (wall.separation_time_s, wall.rebound_speed_m_s) == pytest.approx(known.separation(), rel=1e-12)


@settings(max_examples=25, deadline=None)
@given(ratio=st.floats(0.01, 50.0), rate=st.floats(1.0, 100.0), speed=st.floats(0.1, 100.0))
def test_response_solves_its_equation(ratio: float, rate: float, speed: float) -> None:
    """m v' = -F, and the spring between the wall and the damper, integrated; both branches and what lies between."""
    wall = RigidWall(MASS, speed, MASS * rate**2, ratio * rate * MASS)
    end = min(wall.separation_time_s, 5.0 / rate)
    t = np.linspace(0.0, end, 20)

    def slope(_t: float, y: np.ndarray) -> list[float]:
        x, v, crushed = y
        force = wall.spring_N_m * (x - crushed)
        return [v, -force / MASS, force / wall.damper_N_s_m]

    solved = solve_ivp(slope, (0.0, end), [0.0, speed, 0.0], t_eval=t, method="Radau", rtol=1e-8, atol=1e-10)
    x, v, acceleration = wall.response(t)
    assert x == pytest.approx(solved.y[0], abs=1e-5 * speed / rate)
    assert v == pytest.approx(solved.y[1], abs=1e-5 * speed)
    force = wall.spring_N_m * (solved.y[0] - solved.y[2])
    assert -MASS * acceleration == pytest.approx(force, abs=1e-4 * MASS * speed * rate)


def test_it_coasts_after_separation() -> None:
    wall = rigid_wall_test()
    t = wall.separation_time_s + np.array([0.0, 0.01, 0.1])
    x, v, acceleration = wall.response(t)
    assert np.all(acceleration == 0.0)
    assert v == pytest.approx(wall.rebound_speed_m_s)
    assert np.diff(x) == pytest.approx(wall.rebound_speed_m_s * np.diff(t))


def test_it_keeps_its_speed_before_first_touch() -> None:
    wall = rigid_wall_test()
    x, v, acceleration = wall.response(np.array([-0.1, -1e-9]))
    assert x == pytest.approx([-1.34, -13.4e-9])
    assert np.all(v == wall.speed_m_s)
    assert np.all(acceleration == 0.0)


def test_an_over_damped_vehicle_never_comes_off() -> None:
    wall = RigidWall(MASS, 13.4, SPRING, 0.3 * CRITICAL)
    assert wall.over_damped
    assert math.isnan(wall.b)
    assert (wall.separation_time_s, wall.max_displacement_time_s) == (math.inf, math.inf)
    x, v, acceleration = wall.response(np.linspace(0.0, 10.0, 1001))
    assert np.all(v >= 0.0)
    assert np.all(acceleration <= 0.0)
    assert x[-1] == pytest.approx(wall.max_displacement_m, rel=1e-9)


def test_fitting_constants_give_spring_and_damper_back() -> None:
    """Eqs 50 and 51."""
    wall = rigid_wall_test()
    damper = wall.mass_kg * (wall.a**2 + wall.b**2) / (-2.0 * wall.a)
    assert (-2.0 * wall.a * damper, damper) == pytest.approx((wall.spring_N_m, wall.damper_N_s_m))


@pytest.mark.parametrize("damper", [138.91e3, 0.5 * CRITICAL])
def test_a_boulder_that_cannot_move_is_a_rigid_wall(damper: float) -> None:
    """The whole simulation against the exact response: a boulder a million times too dense."""
    heavy = {"boulder_density_kg_m3": 2596e6, "vehicle_damper_N_s_m": damper, "vehicle_mass_kg": MASS}
    found = simulate(crash_test("rwg").constants | heavy, step_s=0.001, horizon_s=0.16)
    wall = RigidWall(MASS, 14.5, SPRING, damper)
    x, v, acceleration = wall.response(found.time_s)
    assert found.vehicle_displacement_m == pytest.approx(x, abs=2e-5)
    assert found.vehicle_velocity_m_s == pytest.approx(v, abs=1e-3)
    assert found.contact_force_N == pytest.approx(-MASS * acceleration, abs=1e-4 * wall.peak_force)
    assert found.summary()["peak_force_kN"] == pytest.approx(wall.peak_force / 1e3, rel=1e-5)


def test_every_statement_of_the_paper_holds_or_cannot_be_checked(found: Validation) -> None:
    assert found.holds
    assert [statement.holds for statement in found.statements].count(True) == 8
    assert [statement.holds for statement in found.statements].count(None) == 3
    assert any("by +0.0023° (as printed); +0.0000° (corrected)" in one.model_gives for one in found.statements)
    assert {statement.section for statement in found.statements} == {"3.1", "3.2", "3.3", "3.4", "4"}


def test_a_contradiction_is_seen(found: Validation) -> None:
    swapped = {
        ("abg" if test == "rwg" else "rwg", preset): trajectory
        for (test, preset), trajectory in found.trajectories.items()
    }
    wrong = statements(swapped, found.wall)
    assert [statement.holds for statement in wrong].count(False) >= 5
    assert not dataclasses.replace(found, statements=wrong).holds


def test_table_shows_both_tests_under_both_presets(found: Validation) -> None:
    table = found.table()
    assert [(row[0], row[1]) for row in table.rows] == [
        ("American Black Granite", "as printed"),
        ("American Black Granite", "corrected"),
        ("Rockville White Granite", "as printed"),
        ("Rockville White Granite", "corrected"),
    ]
    assert "3.5016 *" in found.text()
    assert "* still moving" in found.text()
    json.dumps(found.to_dict(), allow_nan=False)


@pytest.mark.nightly
def test_command_writes_pictures_and_tables(sweep: Command, tmp_path: Path) -> None:
    code, out, err = sweep("validate", "-o", tmp_path / "v")
    assert (code, err) == (0, "")
    assert "measured curves of the paper are in its figures, not in its text" in out
    names = sorted(path.name for path in (tmp_path / "v").iterdir())
    assert names == [
        "figure_10_rigid_wall.png",
        "figures_12_to_14_abg.png",
        "figures_16_to_18_rwg.png",
        "trajectories.parquet",
    ]
    histories = pd.read_parquet(tmp_path / "v" / "trajectories.parquet")
    assert len(histories) == 4 * 1001
    peak = histories.groupby(["test", "preset"], observed=True).rotation_rad.max()
    assert np.degrees(peak["rwg", "corrected"]) == pytest.approx(13.761, abs=1e-3)


def test_command_without_a_folder_writes_nothing(
    sweep: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, _ = sweep("validate", "--json")
    assert code == 0
    assert json.loads(out)["files"] == []
    assert [row["verdict"] for row in json.loads(out)["crash_tests"]] == ["fail", "fail", "undecided", "pass"]
    assert list(tmp_path.iterdir()) == []
