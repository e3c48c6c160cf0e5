"""Spring and damper from a crash pulse: recovered from noise, with honest standard errors and cautions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from boulder_sweep.crash_tests.cases import rigid_wall_test
from boulder_sweep.crash_tests.fit_problem import RESPONSES
from boulder_sweep.crash_tests.fitting import VehicleFit, fit_pulse
from boulder_sweep.crash_tests.measured import Pulse, TimeHistory, pulse_of, read_pulse
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.errors import FitError
from docs.studies.example_pulse import example_pulse
from tests.conftest import Command

PAPER = rigid_wall_test()
OVER_DAMPED = RigidWall(6800.0, 13.4, 3103.3e3, 55e3)
SIGNALS = list(RESPONSES)


def pulse(wall: RigidWall, signals: list[str], noise: float, seed: int = 0, end: float = 0.16, n: int = 161) -> Pulse:
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, end, n)
    made = {}
    for name in signals:
        values = RESPONSES[name](wall, time)
        made[name] = values + rng.normal(0.0, noise * np.ptp(values), n)
    return Pulse("made up", time, made)


def offsets(fit: VehicleFit, wall: RigidWall) -> tuple[float, float, float]:
    """Errors of spring, damper and speed as multiples of their standard errors."""
    assert fit.speed_error_m_s is not None
    return (
        (fit.wall.spring_N_m - wall.spring_N_m) / fit.spring_error_N_m,
        (fit.wall.damper_N_s_m - wall.damper_N_s_m) / fit.damper_error_N_s_m,
        (fit.wall.speed_m_s - wall.speed_m_s) / fit.speed_error_m_s,
    )


@pytest.mark.parametrize("wall", [PAPER, OVER_DAMPED], ids=["under-damped", "over-damped"])
@pytest.mark.parametrize("signals", [*([name] for name in SIGNALS), SIGNALS])
def test_exact_pulse_gives_the_vehicle_back(wall: RigidWall, signals: list[str]) -> None:
    fit = fit_pulse(pulse(wall, signals, 0.0), wall.mass_kg)
    assert fit.wall.spring_N_m == pytest.approx(wall.spring_N_m, rel=1e-6)
    assert fit.wall.damper_N_s_m == pytest.approx(wall.damper_N_s_m, rel=1e-6)
    assert fit.wall.speed_m_s == pytest.approx(wall.speed_m_s, rel=1e-6)
    assert fit.wall.over_damped == wall.over_damped
    assert fit.warnings == ()


@pytest.mark.parametrize(
    "signals", [["velocity"], pytest.param(["displacement", "acceleration"], marks=pytest.mark.nightly)]
)
def test_standard_errors_are_those_of_repeated_fits(signals: list[str]) -> None:
    scatter = np.array(
        [offsets(fit_pulse(pulse(PAPER, signals, 0.02, seed), PAPER.mass_kg), PAPER) for seed in range(20)]
    )
    spread = scatter.std(axis=0)
    assert np.all(spread > 0.6)
    assert np.all(spread < 1.5)
    assert np.all(np.abs(scatter.mean(axis=0)) < 0.7)


def test_correlated_noise_widens_the_standard_errors() -> None:
    """The same noise, once fresh in every sample, once held for several, as a slow filter does."""
    time = np.linspace(0.0, 0.16, 321)
    clean = PAPER.velocity(time)
    rng = np.random.default_rng(3)
    fresh = rng.normal(0.0, 0.2, time.size)
    held = np.repeat(rng.normal(0.0, 0.2, time.size // 8 + 1), 8)[: time.size]
    independent, filtered = (
        fit_pulse(Pulse("", time, {"velocity": clean + noise}), PAPER.mass_kg).spring_error_N_m
        for noise in (fresh, held)
    )
    assert filtered > 2.0 * independent


def test_a_given_speed_is_kept() -> None:
    fit = fit_pulse(pulse(PAPER, ["acceleration"], 0.02), PAPER.mass_kg, speed_m_s=13.4)
    assert fit.wall.speed_m_s == 13.4
    assert fit.speed_error_m_s is None
    assert abs(fit.wall.spring_N_m - PAPER.spring_N_m) < 4 * fit.spring_error_N_m


def test_gaps_are_left_out() -> None:
    made = pulse(PAPER, ["velocity"], 0.01)
    made.signals["velocity"][20:60] = np.nan
    fit = fit_pulse(made, PAPER.mass_kg)
    assert max(abs(value) for value in offsets(fit, PAPER)) < 4.0
    assert np.isnan(fit.residuals["velocity"][20:60]).all()


def test_noise_alone_is_no_reason_to_warn() -> None:
    for seed in range(5):
        assert fit_pulse(pulse(PAPER, SIGNALS, 0.04, seed), PAPER.mass_kg).warnings == ()


def test_a_front_that_stiffens_is_named() -> None:
    """A spring that hardens with crush, as real chassis do, is no Maxwell element."""
    time = np.linspace(0.0, 0.15, 151)

    def slope(_t: float, y: np.ndarray) -> list[float]:
        x = max(y[0], 0.0)
        return [y[1], -(2e5 * x + 8e6 * x**5) / 6800.0]

    made = solve_ivp(slope, (0.0, 0.15), [0.0, 13.4], t_eval=time, rtol=1e-8).y
    fit = fit_pulse(Pulse("", time, {"displacement": made[0], "velocity": made[1]}), 6800.0)
    assert any("not a spring and a damper" in warning for warning in fit.warnings)


def test_a_pure_spring_leaves_the_damper_open() -> None:
    wall = RigidWall(6800.0, 13.4, 3e6, 1e9)
    fit = fit_pulse(pulse(wall, ["velocity"], 0.01, end=0.14), 6800.0)
    assert any("no lasting crush" in warning for warning in fit.warnings)
    assert fit.wall.spring_N_m == pytest.approx(3e6, rel=0.05)


def test_a_pure_damper_leaves_the_spring_open() -> None:
    wall = RigidWall(6800.0, 13.4, 1e12, 1.5e5)
    fit = fit_pulse(pulse(wall, ["velocity"], 0.01), 6800.0)
    assert any("spring" in warning and "determine" in warning for warning in fit.warnings)
    assert fit.wall.damper_N_s_m == pytest.approx(1.5e5, rel=0.05)


def test_a_pulse_that_ends_too_early_is_named() -> None:
    before_peak = fit_pulse(pulse(PAPER, ["acceleration"], 0.01, end=0.04), 6800.0)
    assert any("before the force peaks" in warning for warning in before_peak.warnings)
    before_stop = fit_pulse(pulse(PAPER, ["acceleration"], 0.01, end=0.09), 6800.0)
    assert any("before the vehicle stops" in warning for warning in before_stop.warnings)


@pytest.mark.parametrize(("mass", "speed"), [(0.0, None), (-1.0, None), (float("nan"), None), (6800.0, -3.0)])
def test_impossible_vehicles_are_refused(mass: float, speed: float | None) -> None:
    with pytest.raises(FitError, match="must be positive"):
        fit_pulse(pulse(PAPER, ["velocity"], 0.0), mass, speed_m_s=speed)


def history(**signals: np.ndarray) -> TimeHistory:
    return TimeHistory(Path("pulse.csv"), np.linspace(-0.02, 0.16, 91), signals)


def test_time_before_first_touch_is_left_out() -> None:
    found = pulse_of(history(velocity=np.linspace(13.0, -2.0, 91)))
    assert found.time_s[0] == pytest.approx(0.0, abs=1e-12)
    assert len(found.time_s) == 81


def test_a_deceleration_changes_its_sign() -> None:
    found = pulse_of(history(deceleration=np.full(91, 100.0)))
    assert list(found.signals) == ["acceleration"]
    assert np.all(found.signals["acceleration"] == -100.0)


def test_signals_that_contradict_an_impact_are_refused() -> None:
    with pytest.raises(FitError, match="name the column deceleration"):
        pulse_of(history(acceleration=np.full(91, 100.0)))
    with pytest.raises(FitError, match="both acceleration and deceleration"):
        pulse_of(history(acceleration=np.full(91, -1.0), deceleration=np.full(91, 1.0)))
    with pytest.raises(FitError, match="fewer than 8"):
        pulse_of(history(velocity=np.full(91, np.nan)))


@pytest.mark.parametrize(
    ("signal", "values", "message"),
    [
        ("displacement", np.zeros(91), r"pulse.csv: the displacement does not change; it must show how the wall stops"),
        ("displacement", np.full(91, 0.005), "the displacement does not change"),
        ("velocity", np.full(91, 13.4), "the velocity does not change"),
        ("acceleration", np.zeros(91), "the acceleration does not change"),
        (
            "displacement",
            np.linspace(0.0, -0.9, 91),
            "displacement is negative at first; it counts as positive towards the wall",
        ),
        ("velocity", np.linspace(-13.0, 2.0, 91), "the velocity is negative at first"),
        ("displacement", np.linspace(0.0, 1e200, 91), r"reaches 1e\+200 m, which is not that of an impact; check the"),
        ("acceleration", np.linspace(-1e308, -9e307, 91), r"reaches 9.89e\+307 m/s\^2, which is not that of an impact"),
        ("deceleration", np.linspace(1e-200, 2e-200, 91), r"reaches 2e-200 m/s\^2, which is not that of an impact"),
    ],
)
def test_signals_without_the_motion_of_an_impact_are_refused(signal: str, values: np.ndarray, message: str) -> None:
    with pytest.raises(FitError, match=message):
        pulse_of(history(**{signal: values}))


def test_rebound_and_noise_are_not_taken_for_motion_against_the_drive() -> None:
    for name, end in (("displacement", 0.2), ("displacement", 1.5), ("velocity", 0.2), ("velocity", 1.5)):
        for seed in range(10):
            made = pulse(PAPER, [name], 0.05, seed, end)
            taken = pulse_of(TimeHistory(Path("pulse.csv"), made.time_s, made.signals))
            assert np.array_equal(taken.signals[name], made.signals[name])
            against = {name: -made.signals[name]}
            with pytest.raises(FitError, match=f"the {name} is negative at first"):
                pulse_of(TimeHistory(Path("pulse.csv"), made.time_s, against))


def test_the_example_of_the_documentation(tmp_path: Path) -> None:
    """It says what a fit has to find; the fit finds it within its standard errors."""
    (tmp_path / "pulse.csv").write_text(example_pulse(), encoding="utf-8")
    fit = fit_pulse(read_pulse(tmp_path / "pulse.csv"), 6800.0)
    assert max(abs(value) for value in offsets(fit, PAPER)) < 3.0
    assert fit.warnings == ()
    # Noise of 5 mm and 0.8 g, as its comment says.
    assert fit.misfits["displacement"].rms == pytest.approx(0.005, rel=0.25)
    assert fit.misfits["acceleration"].rms == pytest.approx(0.8 * 9.80665, rel=0.25)


def test_command_prints_the_result_and_a_line_for_a_settings_file(sweep: Command, tmp_path: Path) -> None:
    file = tmp_path / "pulse.csv"
    file.write_text(example_pulse(), encoding="utf-8")
    code, out, err = sweep("fit-vehicle", file, "--mass", "15000 lb", "--plot", tmp_path / "fit.png")
    assert (code, err) == (0, "")
    first, second = out.splitlines()[-2:]
    assert first == "vehicle: {mass: 6803.89 kg, speed: ...,"
    assert second.startswith("          spring: 31")
    assert second.endswith(" kN*s/m}")
    assert (tmp_path / "fit.png").stat().st_size > 10_000
    code, out, _ = sweep("fit-vehicle", file, "--mass", "6800 kg", "--speed", "48.24 km/h", "--json")
    assert code == 0
    assert '"impact_speed_m_s": 13.4' in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--mass", "6800"], "write the unit too"),
        (["--mass", "6800 m"], "a mass is needed"),
        (["--mass", "-5 kg"], "must be positive"),
        (["--mass", "heavy"], "not a number"),
        (["--mass", "6800 kg", "--speed", "30 deg"], "a speed is needed"),
        ([], "Missing option '--mass'"),
        (["--mass", "6800 kg", "--plot", "fit.jpeg"], "must end in .png"),
    ],
)
def test_command_refuses_wrong_use(sweep: Command, tmp_path: Path, words: list[str], message: str) -> None:
    file = tmp_path / "pulse.csv"
    file.write_text(example_pulse(), encoding="utf-8")
    code, out, err = sweep("fit-vehicle", file, *words)
    assert (code, out) == (2, "")
    assert message in err
