"""One design over time: its arrays obey the equations, its summary agrees with a row of a sweep."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.columns import OUTCOME_COLUMNS
from boulder_sweep.crash_tests.cases import NAMES, crash_test
from boulder_sweep.errors import PictureError
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.impact.trajectory import ENERGY, HISTORY
from boulder_sweep.settings import load_text
from boulder_sweep.settings.model import PRESETS, ReadingChoice
from boulder_sweep.views.time_curves import unreliable_from
from boulder_sweep.views.wording import verdict_line
from tests import oracle
from tests.conftest import Trajectories

CONFIGS = Path(__file__).parents[2] / "configs"
BOTH = [(test, preset) for test in NAMES for preset in PRESETS]
CASES = {"abg": oracle.ABG, "rwg": oracle.RWG}
ORACLE_READINGS = {"as_printed": oracle.AS_PRINTED, "corrected": oracle.CORRECTED}

# case, preset: over 0.5 s max |theta| [deg], its time [s], max x_b [m], max x_v [m], peak F_v [kN]; 20 deg at [s]
KNOWN = {
    ("abg", "as_printed"): (114.258, 0.389, 1.6555, 2.0859, 776.55, 0.0795),
    ("abg", "corrected"): (157.742, 0.407, 1.4096, 3.5016, 855.44, 0.0769),
    ("rwg", "as_printed"): (7.6940, 0.2369, 0.1505, 0.9209, 1079.79, None),
    ("rwg", "corrected"): (13.7612, 0.3039, 0.2820, 1.3243, 1027.73, None),
}


def expected_of(test: str, preset: str) -> tuple[str, str]:
    """Verdict and reason: as printed nothing is proved of a boulder that stands."""
    if test == "abg":
        return "fail", "overturns"
    return ("pass", "") if preset == "corrected" else ("undecided", "horizon")


@pytest.mark.parametrize("key", BOTH)
def test_summary_of_the_crash_tests(trajectories: Trajectories, key: tuple[str, str]) -> None:
    """The motion goes on past the limit; the row ends there."""
    found, outcome = trajectories[key].summary(), trajectories[key].motion.outcome
    maxima = outcome.maxima
    theta, t_theta, x_b, x_v, force, reached = KNOWN[key]
    assert math.degrees(maxima.theta) == pytest.approx(theta, abs=6e-4)
    assert maxima.t_theta == pytest.approx(t_theta, abs=6e-4)
    assert maxima.x_b == pytest.approx(x_b, abs=6e-5)
    assert maxima.x_v == pytest.approx(x_v, abs=6e-5)
    assert maxima.F_v == pytest.approx(1e3 * force, abs=30.0)
    if reached is None:
        assert found["max_rotation_deg"] == pytest.approx(theta, abs=6e-4)
        assert found["time_of_max_rotation_s"] == pytest.approx(t_theta, abs=6e-4)
        assert found["max_displacement_m"] == pytest.approx(x_b, abs=6e-5)
        assert found["max_vehicle_displacement_m"] == pytest.approx(x_v, abs=6e-5)
        assert found["peak_force_kN"] == pytest.approx(force, abs=0.03)
        assert found["time_to_limit_s"] is None
    else:
        assert found["max_rotation_deg"] == pytest.approx(20.0)
        assert found["end_time_s"] == found["time_to_limit_s"] == pytest.approx(reached, abs=6e-5)
        assert outcome.t_limit == pytest.approx(found["time_to_limit_s"], abs=1e-7)
        assert found["time_of_max_rotation_s"] == pytest.approx(found["end_time_s"], abs=1e-9)
        assert found["peak_force_kN"] <= force + 0.03
    assert (found["verdict"], found["reason"]) == expected_of(*key)
    assert found["preset"] == key[1]
    assert 0.0 < found["energy_residual"] < 1e-7
    assert list(found["readings"]) == ["inertia", "impact_arm", "contact", "restoring", "separation"]
    assert set(OUTCOME_COLUMNS) < set(found)
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize("key", BOTH)
def test_time_history_is_that_of_the_oracle(trajectories: Trajectories, key: tuple[str, str]) -> None:
    found = trajectories[key]
    test, preset = key
    known = oracle.simulate(CASES[test], ORACLE_READINGS[preset])
    some = slice(0, 241, 20)  # the first 0.12 s; what comes after 20 deg amplifies every difference
    states = known.states(found.time_s[some])
    names = (
        "boulder_displacement_m",
        "boulder_velocity_m_s",
        "rotation_rad",
        "angular_velocity_rad_s",
        "vehicle_displacement_m",
        "vehicle_velocity_m_s",
        "vehicle_acceleration_m_s2",
    )
    for name, values in zip(names, states, strict=False):
        expected = values
        if name == "vehicle_acceleration_m_s2" and preset == "corrected":
            expected = np.where(found.in_contact[some] == "touching", values, 0.0)
        scale = 1e-6 if "acceleration" not in name else 1e-3
        assert getattr(found, name)[some] == pytest.approx(expected, abs=scale)
    assert found.contact_force_N[some] == pytest.approx(known.force(found.time_s[some]), abs=5.0)


@pytest.mark.parametrize("key", BOTH)
def test_forces_and_moments_give_the_accelerations(trajectories: Trajectories, key: tuple[str, str]) -> None:
    """Newton's second law by central differences, wherever no mode changes between the samples."""
    t = trajectories[key]
    c = t.motion.constants
    step = t.time_s[1] - t.time_s[0]
    force = t.soil_force_N + t.contact_force_N
    moment = t.soil_moment_N_m + t.contact_moment_N_m + t.restoring_moment_N_m
    same = (t.rotation_mode[2:] == t.rotation_mode[:-2]) & (t.in_contact[2:] == t.in_contact[:-2])
    same &= np.abs(np.diff(moment, 2)) < 2e-3 * np.abs(moment).max()  # nor a kink in the soil
    assert same.mean() > 0.9
    a_b = (t.boulder_velocity_m_s[2:] - t.boulder_velocity_m_s[:-2]) / (2 * step)
    alpha = (t.angular_velocity_rad_s[2:] - t.angular_velocity_rad_s[:-2]) / (2 * step)
    assert (c.m_eff * a_b)[same] == pytest.approx(force[1:-1][same], abs=2e-3 * np.abs(force).max())
    assert (c.J_eff * alpha)[same] == pytest.approx(moment[1:-1][same], abs=2e-3 * np.abs(moment).max())
    touching = (t.in_contact == "touching").astype(bool)
    mass = t.motion.design.m_v
    assert t.contact_force_N[touching] == pytest.approx(-mass * t.vehicle_acceleration_m_s2[touching])
    assert np.all(t.contact_force_N[~touching] == 0.0)


def test_displacement_of_the_boulders_own_centre(trajectories: Trajectories) -> None:
    """Eqs 53 to 55: a marker on the boulder's centre, followed through translation and rotation of the rigid body."""
    for t in trajectories.values():
        c, design, theta = t.motion.constants, t.motion.design, t.rotation_rad
        # From the common centre of mass, X ahead and Y down; a clockwise turn with Y down is the usual rotation.
        marker = np.array([design.L / 2 - c.c_x, c.c_y - design.H / 2])
        turned = np.cos(theta) * marker[0] - np.sin(theta) * marker[1]
        assert t.boulder_centre_displacement_m == pytest.approx(
            t.boulder_displacement_m + turned - marker[0], abs=1e-12
        )
        radius, angle = math.hypot(*marker), math.atan2(marker[1], marker[0])
        polar = t.boulder_displacement_m + radius * (np.cos(angle + theta) - math.cos(angle))
        assert t.boulder_centre_displacement_m == pytest.approx(polar, abs=1e-12)
        assert t.boulder_centre_displacement_m[0] == 0.0


def test_arrays_have_one_value_per_sample(trajectories: Trajectories) -> None:
    t = trajectories["rwg", "corrected"]
    assert len(t) == 1001
    assert t.time_s[[0, -1]] == pytest.approx([0.0, 0.5], abs=0)
    for name, values in t.columns(energy=True).items():
        assert len(values) == len(t), name
    assert "1001 samples, pass" in repr(t)


def test_maxima_do_not_depend_on_the_samples() -> None:
    coarse, fine = (simulate(crash_test("rwg"), sample_s=dt).summary() for dt in (0.05, 0.0005))
    assert coarse.pop("energy_residual") <= fine.pop("energy_residual")  # the largest over the samples there are
    assert coarse == fine


LATE = Path(__file__).parents[1] / "judge" / "late_designs.csv"
"""Shallow boulders that rock for seconds; see `tests.judge.test_refinement`."""
SETTLES_LATE = LATE.with_name("settles_late.csv")
"""It has turned by 11 deg after one second, and by 15.562 deg, the most, within the next."""


OVERTURNS_LATE = """
name: late
boulder: {length: 2 m, width: 2.4 m, height: 2 m, density: 2600 kg/m^3}
site: {embedment_depth: 0.6 m}
soil: {density: 1860 kg/m^3, friction_angle: 32 deg, subgrade_reaction: 30 MN/m^3}
vehicle: {mass: 15000 lb, speed: 12.6 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""
"""Two independent integrators find that it passes 20 deg after 3.5564 s."""


def late_rows(folder: Path) -> boulder_sweep.Sweep:
    grid = folder / "grid.yaml"
    grid.write_text(f"name: shallow\ntable: {LATE}\n")
    return boulder_sweep.load(grid)


@pytest.mark.parametrize("which", ["grid", "late"])
def test_what_is_said_is_the_row_of_the_table(tmp_path: Path, which: str) -> None:
    """Bit for bit, but for the second opinions, which a table has where they were asked for."""
    changes = ["boulder.height={from: 1.8 m, to: 3.6 m, step: 0.6 m}", "site.embedment_ratio=[0.3, 0.45, 0.6]"]
    narrow = [*changes, "boulder.width=1.9 m", "soil.friction_angle=[32, 40] deg", "soil.subgrade_reaction=90 MN/m^3"]
    sweep = late_rows(tmp_path) if which == "late" else boulder_sweep.load(CONFIGS / "m30_sizing.yaml", narrow)
    boulder_sweep.run(sweep, tmp_path / "out")
    table = boulder_sweep.read(tmp_path / "out")
    compared = 0
    for number in range(sweep.n_designs):
        if table.verdict[number] == "error":
            continue
        found = simulate(sweep, number)
        for name, value in found.row.items():
            if name not in ("robustness", "stands_under"):
                stored = table[name][number]
                assert value == (None if pd.isna(stored) else stored), (number, name)
        compared += 1
        assert (len(found) == 0) == (found.reason == "no_contact")
    assert compared == sweep.n_designs if which == "late" else compared > 15


def test_a_boulder_that_settles_late_has_its_maxima_in_the_row_and_in_the_history() -> None:
    found = simulate(pd.read_csv(SETTLES_LATE).iloc[0])
    summary = found.summary()
    assert summary["max_rotation_deg"] == pytest.approx(15.562, abs=1e-3)
    assert found.time_s[-1] == summary["end_time_s"] > summary["time_of_max_rotation_s"] > 1.0
    assert np.degrees(np.abs(found.rotation_rad).max()) == pytest.approx(summary["max_rotation_deg"], abs=0.02)
    assert verdict_line(found) == "design: PASS, 15.6° of 20° allowed, simulated for 2 s"


def test_a_late_overturn_is_seen() -> None:
    late = load_text(OVERTURNS_LATE, Path("late.yaml"))
    found = simulate(late)
    reached = found.row["time_to_limit_s"]
    assert verdict_line(found) == "late: FAIL, it overturns, past 20° after 3.556 s"
    assert reached == found.row["end_time_s"] == pytest.approx(3.5564, abs=2e-4)
    assert found.time_s[-1] > reached + 0.2
    assert np.degrees(np.interp(reached, found.time_s, found.rotation_rad)) == pytest.approx(20.0, abs=0.05)
    assert np.degrees(found.rotation_rad.max()) > 20.5
    assert unreliable_from(found) == (reached, "shaded: beyond 20° the model no longer holds")
    short = simulate(late, horizon_s=0.1)
    assert short.time_s[-1] >= short.row["end_time_s"] > 0.1


def test_a_design_may_be_a_file_a_mapping_or_a_row_of_a_table(tmp_path: Path) -> None:
    sweep = boulder_sweep.load(CONFIGS / "crash_tests.yaml")
    from_sweep = simulate(sweep, 1).summary()
    from_file = simulate(str(CONFIGS / "crash_tests.yaml"), 1).summary()
    assert from_file == from_sweep
    boulder_sweep.run(sweep, tmp_path / "out")
    row = boulder_sweep.read(tmp_path / "out").iloc[1]
    of_row = simulate(row).summary()
    assert of_row["max_rotation_deg"] == from_sweep["max_rotation_deg"]
    assert of_row["verdict"] == row["verdict"]
    plain = {name: value for name, value in from_sweep_inputs(sweep).items() if name != "embedment_depth_m"}
    ratio = simulate(plain | {"embedment_ratio": 2.03 / 3.44}).summary()
    assert ratio["max_rotation_deg"] == pytest.approx(from_sweep["max_rotation_deg"], rel=1e-9)


def from_sweep_inputs(sweep: boulder_sweep.Sweep) -> dict[str, float]:
    return {name: float(column.to_numpy()[0]) for name, column in sweep.block(1, 2).columns.items()}


def test_a_mapping_that_lacks_something_is_refused() -> None:
    with pytest.raises(ValueError, match="boulder_height_m"):
        simulate({"boulder_length_m": 1.0})


@pytest.mark.parametrize(
    ("key", "meant"),
    [("hieght", "boulder_height_m"), ("speed", "impact_speed_m_s"), ("hood_hieght_m", "hood_height_m")],
)
def test_a_key_that_is_nearly_a_column_is_refused_and_labels_are_not(key: str, meant: str) -> None:
    row = from_sweep_inputs(boulder_sweep.load(CONFIGS / "crash_tests.yaml"))
    assert simulate(row | {"boulder_id": 3, "remark": "dry"}).summary() == simulate(row).summary()
    with pytest.raises(ValueError, match=f"'{key}' is no column of a design; did you mean {meant}\\?"):
        simulate(row | {key: 3.0})


def test_a_step_in_words_is_refused() -> None:
    with pytest.raises(TypeError, match="step_s must be a number of seconds, not '4 ms'"):
        simulate(crash_test("rwg"), step_s="4 ms")  # a string as people write it


def test_readings_soil_step_and_horizon_can_be_changed() -> None:
    sweep = crash_test("rwg")
    single = simulate(sweep, readings=ReadingChoice(impact_arm="printed"))
    assert single.summary()["max_rotation_deg"] == pytest.approx(6.772, abs=6e-4)
    assert single.summary()["preset"] == "mixed"
    sums = simulate(sweep, readings="as_printed", soil_elements=2000, step_s=0.002)
    assert sums.summary()["max_rotation_deg"] == pytest.approx(7.6997, abs=6e-5)
    assert sums.summary()["soil"] == 2000
    short = simulate(sweep, readings="corrected", horizon_s=0.1)  # by a given step, so nothing confirms what follows
    assert (short.verdict, short.reason) == ("undecided", "horizon")
    assert short.row["end_time_s"] == short.time_s[-1] == 0.1


@pytest.mark.parametrize(
    "wrong",
    [
        {"readings": "right"},
        {"soil_elements": -1},
        {"step_s": 0.0},
        {"horizon_s": -1.0},
        {"horizon_s": math.nan},
        {"sample_s": 0.0},
        {"sample_s": 1e-9},
        {"sample_s": math.nan},
    ],
)
def test_what_makes_no_sense_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        simulate(crash_test("rwg"), **wrong)


def test_a_truck_that_passes_over_leaves_no_samples() -> None:
    low = simulate(crash_test("rwg").constants | {"boulder_height_m": 2.5})
    assert len(low) == 0
    found = low.summary()
    assert (found["verdict"], found["reason"]) == ("fail", "no_contact")
    assert found["max_rotation_deg"] is None
    assert found["time_of_max_rotation_s"] is None
    assert math.isnan(low.energy().largest_residual)
    assert low.to_arrow(energy=True).num_rows == 0


def test_an_impossible_design_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match=r"cannot be computed: .*embedment"):
        simulate(crash_test("rwg").constants | {"embedment_depth_m": 5.0})
    with pytest.raises(IndexError):
        simulate(crash_test("rwg"), 7)


def test_parquet_holds_units_meanings_and_settings(trajectories: Trajectories, tmp_path: Path) -> None:
    t = trajectories["rwg", "corrected"]
    t.to_parquet(tmp_path / "plain.parquet")
    t.to_parquet(tmp_path / "energy.parquet", energy=True)
    table = pq.read_table(tmp_path / "energy.parquet")
    assert table.column_names == [spec.name for spec in (*HISTORY, *ENERGY)]
    assert pq.read_schema(tmp_path / "plain.parquet").names == [spec.name for spec in HISTORY]
    for spec in (*HISTORY, *ENERGY):
        metadata = table.schema.field(spec.name).metadata
        assert metadata == {b"unit": spec.unit.encode(), b"meaning": spec.meaning.encode()}
    assert table["rotation_rad"].to_numpy() == pytest.approx(t.rotation_rad, abs=0)
    settings = json.loads(table.schema.metadata[b"boulder_sweep.settings"])
    assert settings["model"]["preset"] == "corrected"


def test_crash_tests_are_those_of_the_settings_files() -> None:
    for test in NAMES:
        file = boulder_sweep.load(CONFIGS / f"{test}.yaml").resolved()
        assert crash_test(test).resolved()["inputs"] == file["inputs"]
        assert file["solver"]["horizon_s"] == crash_test(test).solver.horizon_s


EXTREMES = {
    "at rest": {"impact_speed_m_s": 0.0},
    "a touch": {"impact_speed_m_s": 1e-3},
    "thrown over": {"boulder_density_kg_m3": 300.0, "impact_speed_m_s": 60.0},
    "a splinter": {"boulder_length_m": 0.01, "boulder_width_m": 0.01},
    "a mountain": {"boulder_density_kg_m3": 1e9},
    "a rigid damper": {"vehicle_damper_N_s_m": 1e12},
    "on the ground": {"embedment_depth_m": 1e-3},
    "in mud": {"subgrade_reaction_MN_m3": 1e-3},
}


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("name", EXTREMES)
def test_extremes_have_a_history_that_adds_up(name: str, preset: str) -> None:
    found = simulate(crash_test("rwg").constants | EXTREMES[name], readings=preset, horizon_s=0.5)
    assert found.verdict in ("pass", "fail", "undecided")
    for values in found.columns(energy=True).values():
        assert values.dtype == object or np.isfinite(values).all()
    assert found.energy().largest_residual < 1e-4
    json.dumps(found.summary(), allow_nan=False)


def test_a_design_that_cannot_be_integrated_says_why() -> None:
    found = simulate(crash_test("rwg").constants | {"vehicle_damper_N_s_m": 1.0}, soil_elements=16)
    assert (found.verdict, len(found)) == ("error", 0)
    assert "damper" in found.reason
    assert found.summary()["max_rotation_deg"] is None


def test_a_design_simulated_as_a_last_resort_has_its_row_and_no_samples(tmp_path: Path) -> None:
    found = simulate(crash_test("rwg").constants | {"vehicle_spring_N_m": 1e14})
    summary = found.summary()
    assert (found.verdict, len(found)) == ("pass", 0)
    assert 0.0 < summary["time_of_max_rotation_s"] < summary["end_time_s"]
    with pytest.raises(PictureError, match="needs more steps than are allowed"):
        found.plot(tmp_path / "x.png")
