"""Spring and damper from a crash pulse: exact without noise, within the stated errors with it, refused where wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import butter, filtfilt

from boulder_sweep.crash_tests.cases import rigid_wall_test
from boulder_sweep.crash_tests.fitting import VehicleFit, fit_pulse
from boulder_sweep.crash_tests.measured import TimeHistory, pulse_of
from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.errors import FitError
from docs.studies.example_pulse import example_pulse
from tests.conftest import Command
from tests.oracle.vehicle import WallImpact

PAPER = rigid_wall_test()
OVER_DAMPED = replace(PAPER, damper_N_s_m=55e3)
SIGNALS = ("displacement", "velocity", "acceleration")
GRAVITY = 9.80665
SEEDS = 10
RECORD = Path("made_up.csv")


def known(wall: RigidWall, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement, velocity and acceleration by the oracle; before first touch and after separation, too."""
    impact = WallImpact(wall.mass_kg, wall.speed_m_s, wall.spring_N_m, wall.damper_N_s_m)
    end = impact.separation()[0]
    s = np.clip(t, 0.0, end)
    x, v, slope = impact.response(s)
    return x + v * (t - s), v, np.where((t > 0.0) & (t < end), slope, 0.0)


def made(
    wall: RigidWall = PAPER,
    signals: tuple[str, ...] = ("acceleration",),
    *,
    noise: float = 0.02,
    seed: int = 0,
    start: float = -0.05,
    end: float = 0.22,
    step: float = 1e-3,
    late: float = 0.0,
    offset_g: float = 0.0,
    filter_Hz: float | None = None,
    held: bool = False,
) -> TimeHistory:
    """A generated pulse; its times count from `late` seconds after first touch, and noise is a share of the peaks."""
    rng = np.random.default_rng(seed)
    t = np.arange(start, end, step)
    values = dict(zip(SIGNALS, known(wall, t), strict=True))
    sizes = {"displacement": 0.8, "velocity": 15.0, "acceleration": 150.0}
    scatter = {name: rng.normal(0.0, noise * sizes[name], len(t)) for name in SIGNALS}
    if held:  # a crush is not measured before first touch
        values["displacement"] = np.maximum(values["displacement"], 0.0 * t)
    values = {name: values[name] + scatter[name] for name in signals}
    if "acceleration" in values:
        values["acceleration"] = values["acceleration"] + offset_g * GRAVITY
        if filter_Hz is not None:
            values["acceleration"] = filtfilt(*butter(2, 2.0 * filter_Hz * step), values["acceleration"])
    return TimeHistory(RECORD, t - late, values)


EXACT: dict[str, dict[str, Any]] = {
    **{name: {"signals": (name,)} for name in SIGNALS},
    "all": {"signals": SIGNALS},
    "crush": {"signals": ("displacement",), "held": True},
    "offset": {"offset_g": -1.3},
    "late": {"late": 0.012},
    "early": {"late": -0.012},
    "late, cut at its zero": {"late": 0.012, "start": 0.012},
    "late, crush": {"signals": SIGNALS, "late": 0.012, "held": True},
    "no rows before": {"start": 0.0},
    "cut": {"end": 0.06},
}


@pytest.mark.parametrize("wall", [PAPER, OVER_DAMPED], ids=["under-damped", "over-damped"])
@pytest.mark.parametrize("kind", EXACT)
def test_a_clean_record_gives_the_vehicle_back(wall: RigidWall, kind: str) -> None:
    fit = fit_pulse(made(wall, noise=0.0, **EXACT[kind]), wall.mass_kg)
    assert fit.wall.spring_N_m == pytest.approx(wall.spring_N_m, rel=1e-6)
    assert fit.wall.damper_N_s_m == pytest.approx(wall.damper_N_s_m, rel=1e-6)
    assert fit.wall.speed_m_s == pytest.approx(wall.speed_m_s, rel=1e-6)
    assert fit.touch_s == pytest.approx(-EXACT[kind].get("late", 0.0), abs=1e-8)
    if fit.offset_m_s2 is not None:
        assert fit.offset_m_s2 == pytest.approx(EXACT[kind].get("offset_g", 0.0) * GRAVITY, abs=1e-8)
    assert fit.spring_error_N_m < 1e-6 * wall.spring_N_m
    assert not any("is off by" in warning for warning in fit.warnings)


NOISY: dict[str, dict[str, Any]] = {
    "acceleration with an offset": {"offset_g": 1.0},
    "late": {"late": 0.012},
    "early, filtered": {"late": -0.012, "filter_Hz": 100.0, "step": 5e-4, "noise": 0.06},
    "cut": {"end": 0.09},
    "displacement": {"signals": ("displacement",)},
    "all": {"signals": SIGNALS},
}


def misses(fit: VehicleFit, wall: RigidWall) -> tuple[float, float]:
    """Errors of spring and damper as multiples of what is stated."""
    return (
        (fit.wall.spring_N_m - wall.spring_N_m) / fit.spring_error_N_m,
        (fit.wall.damper_N_s_m - wall.damper_N_s_m) / fit.damper_error_N_s_m,
    )


@pytest.mark.parametrize("kind", NOISY)
def test_errors_are_as_stated(kind: str) -> None:
    """At least 9 of 10 records within the 95 % intervals, which are not far too wide either."""
    fits = [fit_pulse(made(seed=seed, **NOISY[kind]), PAPER.mass_kg) for seed in range(SEEDS)]
    found = np.array([misses(fit, PAPER) for fit in fits])
    assert np.all((np.abs(found) < 1.0).sum(axis=0) >= 9), found
    assert np.all(np.sqrt((found**2).mean(axis=0)) > 0.15), found


def test_a_time_zero_that_is_wrong_is_found_and_said() -> None:
    late = fit_pulse(made(late=0.012), PAPER.mass_kg)
    assert late.wall.max_displacement_m == pytest.approx(PAPER.max_displacement_m, rel=0.02)
    assert any(warning.startswith("the record shows first touch at -12.") for warning in late.warnings)
    cut = fit_pulse(made(late=0.012, start=0.012), PAPER.mass_kg)
    assert cut.wall.max_displacement_m == pytest.approx(PAPER.max_displacement_m, rel=0.05)
    assert any("begins 1" in warning for warning in cut.warnings)
    assert fit_pulse(made(), PAPER.mass_kg).warnings == ()


@pytest.mark.parametrize("speed", [3.7, 12.0, 15.0, 30.0])
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_speed_that_the_record_contradicts_is_refused(signal: str, speed: float) -> None:
    with pytest.raises(FitError, match=rf"the record says 13\.\d ± 0\.\d m/s, --speed {speed:.1f} m/s"):
        fit_pulse(made(signals=(signal,), noise=0.01), PAPER.mass_kg, speed_m_s=speed)


def test_the_right_speed_is_kept_and_helps_a_cut_record() -> None:
    for seed in range(5):
        fit = fit_pulse(made(seed=seed, offset_g=0.5), PAPER.mass_kg, speed_m_s=13.4)
        assert (fit.wall.speed_m_s, fit.speed_error_m_s) == (13.4, None)
    with pytest.raises(FitError, match=r"it ends 0.029 s after first touch\), or --speed"):
        fit_pulse(made(end=0.03), PAPER.mass_kg)
    fit = fit_pulse(made(end=0.03), PAPER.mass_kg, speed_m_s=13.4)
    assert max(abs(miss) for miss in misses(fit, PAPER)) < 1.0
    assert any("before the force peaks" in warning for warning in fit.warnings)


TIMES = np.linspace(0.0, 0.15, 151)


def recorded(signals: dict[str, np.ndarray]) -> TimeHistory:
    return TimeHistory(RECORD, TIMES, signals)


def with_times(scale: float) -> TimeHistory:
    pulse = made(noise=0.0)
    return TimeHistory(RECORD, pulse.time_s * scale, pulse.signals)


def with_size(scale: float) -> TimeHistory:
    pulse = made(noise=0.0)
    return TimeHistory(RECORD, pulse.time_s, {name: scale * values for name, values in pulse.signals.items()})


def stiffening(t: np.ndarray, k: float = 3e5, k_3: float = 8e6, damper: float = 1.2e5) -> np.ndarray:
    """Acceleration of a front whose spring hardens, in series with a damper."""

    def slope(_t: float, y: np.ndarray) -> list[float]:
        u = y[0] - y[2]
        force = k * u + k_3 * u**3
        return [y[1], -force / 6800.0, force / damper]

    return np.gradient(solve_ivp(slope, (0.0, t[-1]), [0.0, 13.4, 0.0], t_eval=t, rtol=1e-9).y[1], t)


@pytest.mark.parametrize(
    ("pulse", "message"),
    [
        (made(end=0.02), "does not determine the damper: .*To do: give a record until the vehicle leaves the wall"),
        (
            made(replace(PAPER, damper_N_s_m=1e9)),
            "does not determine the damper: a spring alone fits as well, since .*To do: ",
        ),
        (
            recorded({"velocity": replace(PAPER, spring_N_m=1e12).response(TIMES)[1]}),
            "does not determine the spring: a damper alone",
        ),
        (with_times(1e3), r"the fitted speed of 1\d{4} m/s is far outside .*crushed by .* more than it is long"),
        (with_times(1e-3), r"the fitted spring of 3\.10\d*e\+09 kN/m is far outside what vehicles have"),
        (with_size(100.0), "the fitted speed of 1340 m/s is far outside what vehicles have, 4 to 25 m/s"),
        (with_size(1e-3), r"the fitted speed of 0\.0134 m/s is far outside"),
        (recorded({"acceleration": np.full(151, -100.0)}), "far outside|does not determine"),
        (recorded({"displacement": 13.4 * TIMES}), "does not determine"),
        (
            recorded({"acceleration": np.random.default_rng(0).normal(-5, 50, 151)}),
            "does not determine",
        ),
        (
            TimeHistory(
                RECORD, TIMES, dict(zip(SIGNALS, (0.1 * known(PAPER, TIMES)[0], *known(PAPER, TIMES)[1:]), strict=True))
            ),
            "no spring and damper in series come near it: the .* is off by",
        ),
    ],
    ids=lambda value: "" if isinstance(value, TimeHistory) else value[:30],
)
def test_a_result_that_no_vehicle_has_is_refused(pulse: TimeHistory, message: str) -> None:
    with pytest.raises(FitError, match=message):
        fit_pulse(pulse, PAPER.mass_kg)


@pytest.mark.parametrize(
    ("mass", "speed", "message"),
    [
        (0.0, None, "the mass of the vehicle must be positive"),
        (float("nan"), None, "must be positive"),
        (6800.0, -3.0, "the speed of the vehicle must be positive"),
        (6.8e6, None, r"--mass: 6\.8e\+06 kg is far outside what vehicles have, 1000 to 30000 kg; check its unit"),
        (6800.0, 0.01, "--speed: 0.01 m/s is far outside"),
    ],
)
def test_impossible_vehicles_are_refused(mass: float, speed: float | None, message: str) -> None:
    with pytest.raises(FitError, match=message):
        fit_pulse(made(), mass, speed_m_s=speed)


def test_a_front_that_stiffens_is_named() -> None:
    fit = fit_pulse(recorded({"acceleration": stiffening(TIMES, k=1e4, k_3=3e7)}), 6800.0)
    assert fit.touch_s == pytest.approx(0.0147, abs=1e-3)
    assert any("stiffens as it is crushed" in warning for warning in fit.warnings)


def test_a_record_that_is_noisy_or_of_another_front_is_named() -> None:
    fit = fit_pulse(made(noise=0.25), PAPER.mass_kg)
    assert fit.misfits["acceleration"].share > 0.05
    assert any(warning.startswith("the acceleration is off by ") for warning in fit.warnings)


def test_an_accelerometer_without_rows_before_first_touch_is_named() -> None:
    assert any("zero of the accelerometer" in text for text in fit_pulse(made(start=0.0), PAPER.mass_kg).warnings)
    both = fit_pulse(made(start=0.0, signals=("displacement", "acceleration")), PAPER.mass_kg)
    assert both.offset_m_s2 is None
    assert both.warnings == ()


def test_the_first_rows_of_an_impact_are_not_taken_for_a_zero_offset() -> None:
    wall = RigidWall(6800.0, 10.164, 6800.0 * 18.125**2, 1.347 * 18.125 * 6800.0)
    fit = fit_pulse(made(wall, start=0.0, seed=1034), 6800.0)
    assert fit.offset_m_s2 is None
    assert abs(fit.touch_s) < 1e-3
    assert fit.wall.speed_m_s == pytest.approx(wall.speed_m_s, rel=0.03)


def test_gaps_are_left_out() -> None:
    pulse = made(signals=("displacement", "acceleration"))
    pulse.signals["displacement"][np.arange(len(pulse.time_s)) % 10 != 0] = np.nan
    pulse.signals["acceleration"][100:130] = np.nan
    assert max(abs(miss) for miss in misses(fit_pulse(pulse, PAPER.mass_kg), PAPER)) < 1.5


def history(**signals: np.ndarray) -> TimeHistory:
    return TimeHistory(Path("pulse.csv"), np.linspace(-0.02, 0.16, 91), signals)


def test_a_deceleration_changes_its_sign_and_rows_before_zero_stay() -> None:
    found = pulse_of(history(deceleration=np.full(91, 100.0)))
    assert list(found.signals) == ["acceleration"]
    assert np.all(found.signals["acceleration"] == -100.0)
    assert found.time_s[0] == -0.02


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        ({"acceleration": np.full(91, 100.0)}, "name the column deceleration"),
        ({"acceleration": np.full(91, -1.0), "deceleration": np.full(91, 1.0)}, "both acceleration and deceleration"),
        ({"velocity": np.full(91, np.nan)}, "fewer than 8"),
        (
            {"displacement": np.zeros(91)},
            r"pulse.csv: the displacement does not change; it must show how the wall stop",
        ),
        ({"displacement": np.full(91, 0.005)}, "the displacement does not change"),
        ({"velocity": np.full(91, 13.4)}, "the velocity does not change"),
        ({"acceleration": np.zeros(91)}, "the acceleration does not change"),
        ({"displacement": np.linspace(0.0, -0.9, 91)}, "displacement is negative at first; it counts as positive tow"),
        ({"velocity": np.linspace(-13.0, 2.0, 91)}, "the velocity is negative at first"),
        (
            {"displacement": np.linspace(0.0, 1e200, 91)},
            r"reaches 1e\+200 m, which no impact reaches; check the",
        ),
        ({"acceleration": np.linspace(-1e308, -9e307, 91)}, r"reaches 1e\+308 m/s\^2, which no impact reaches"),
        ({"deceleration": np.linspace(1e-200, 2e-200, 91)}, r"reaches 2e-200 m/s\^2, which no impact reaches"),
    ],
)
def test_signals_without_the_motion_of_an_impact_are_refused(signals: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(FitError, match=message):
        pulse_of(history(**signals))


def test_signs_are_read_from_the_impact_alone() -> None:
    """Not from an offset, noise, the way to the wall or the rebound."""
    for seed, end in [(seed, end) for seed in range(5) for end in (0.2, 1.5)]:
        pulse = made(signals=SIGNALS, noise=0.05, seed=seed, end=end, offset_g=1.0)
        assert pulse_of(TimeHistory(Path("pulse.csv"), pulse.time_s, pulse.signals)).signals == pulse.signals
        for name in SIGNALS:
            against = {name: -pulse.signals[name]}
            with pytest.raises(FitError, match=f"the {name} is (negative at first|positive, as if)"):
                pulse_of(TimeHistory(Path("pulse.csv"), pulse.time_s, against))


def test_command_prints_the_result_and_a_line_for_a_settings_file(sweep: Command, tmp_path: Path) -> None:
    file = tmp_path / "pulse.csv"
    file.write_text(example_pulse(), encoding="utf-8")
    code, out, err = sweep("fit-vehicle", file, "--mass", "15000 lb", "--plot", tmp_path / "fit.png")
    assert (code, err) == (0, "")
    first, second = out.splitlines()[-2:]
    assert first == "vehicle: {mass: 6803.89 kg, speed: ...,"
    assert second.startswith("          spring: 30")
    assert second.endswith(" kN*s/m}")
    assert (tmp_path / "fit.png").stat().st_size > 10_000
    code, out, _ = sweep("fit-vehicle", file, "--mass", "6800 kg", "--speed", "48.24 km/h", "--json")
    assert code == 0
    assert '"impact_speed_m_s": 13.4' in out
