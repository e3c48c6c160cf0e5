"""A front that stiffens against a rigid wall: its exact response, and both springs from a pulse of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from boulder_sweep.cli.main import execute
from boulder_sweep.crash_tests.fit_problem import RESPONSES
from boulder_sweep.crash_tests.fitting import fit_pulse, fit_stages
from boulder_sweep.crash_tests.measured import Pulse
from boulder_sweep.crash_tests.rigid_wall import StiffeningWall
from boulder_sweep.errors import FitError
from boulder_sweep.settings import load

TRUCK = StiffeningWall(6800.0, 13.4, 3103.3e3, 138.91e3, 9e6, 0.5)
TIMES = np.linspace(0.0, 0.16, 161)
NAMES = list(RESPONSES)


def literal(truck: StiffeningWall, times: np.ndarray) -> dict[str, np.ndarray]:
    """Integrate the law itself: the jerk of Eq 45 with the spring of the stage, the kink and the release located."""
    m, v_0, k_v, c, k_2, s_2 = astuple(truck)

    def jerk(k: float) -> Callable[[float, np.ndarray], list[float]]:
        return lambda _t, y: [y[1], y[2], -k / c * y[2] - k / m * y[1]]

    def kink(_t: float, y: np.ndarray) -> float:
        return float(y[0] - s_2)

    def released(_t: float, y: np.ndarray) -> float:
        return float(y[2])

    vars(kink)["terminal"] = vars(released)["terminal"] = True
    vars(released)["direction"] = 1.0
    how = {"rtol": 1e-11, "atol": 1e-12, "dense_output": True}
    one = solve_ivp(jerk(k_v), (0.0, times[-1]), [0.0, v_0, 0.0], events=[kink], **how)
    two = solve_ivp(jerk(k_2), (one.t[-1], times[-1]), one.y[:, -1], events=[released], **how)
    x, v, a = np.where(times < one.t[-1], one.sol(times), two.sol(np.clip(times, one.t[-1], two.t[-1])))
    late = np.maximum(times - two.t[-1], 0.0)
    return {"displacement": x + v * late, "velocity": v, "acceleration": np.where(late > 0.0, 0.0, a)}


def noisy(signals: dict[str, np.ndarray], noise: float, seed: int = 0) -> Pulse:
    rng = np.random.default_rng(seed)
    made = {name: values + rng.normal(0.0, noise * np.ptp(values), len(values)) for name, values in signals.items()}
    return Pulse("made up", TIMES, made)


@pytest.mark.parametrize("damper", [138.91e3, 55e3])
@pytest.mark.parametrize("second", [3103.3e3, 9e6, 5e7])
def test_response_is_that_of_the_law(damper: float, second: float) -> None:
    """Under-damped and over-damped in either stage."""
    truck = StiffeningWall(6800.0, 13.4, 3103.3e3, damper, second, 0.5)
    times = np.linspace(0.0, 0.4, 401)
    known = literal(truck, times)
    for name, values in zip(NAMES, truck.response(times), strict=True):
        assert values == pytest.approx(known[name], abs=1e-9 * np.ptp(known[name])), name
    assert truck.max_displacement_m >= known["displacement"].max() - 1e-9
    assert truck.peak_force == pytest.approx(-6800.0 * known["acceleration"].min(), rel=1e-3)
    assert truck.rebound_speed_m_s <= known["velocity"].min() + 1e-9 or truck.separation_time_s > 0.4


def test_without_reaching_the_second_spring_it_is_the_first_alone() -> None:
    truck = StiffeningWall(6800.0, 13.4, 3103.3e3, 138.91e3, 9e6, 0.9)
    assert truck.stage is None
    for found, known in zip(truck.response(TIMES), truck.first.response(TIMES), strict=True):
        assert np.array_equal(found, known)
    assert truck.max_displacement_m == truck.first.max_displacement_m
    assert truck.peak_force == truck.first.peak_force


@pytest.mark.parametrize("signals", [["velocity"], ["acceleration"], NAMES])
def test_a_pulse_of_the_law_gives_both_springs_back(signals: list[str]) -> None:
    known = literal(TRUCK, TIMES)
    fit = fit_stages(noisy({name: known[name] for name in signals}, 0.0), TRUCK.mass_kg)
    assert astuple(fit.wall) == pytest.approx(astuple(TRUCK), rel=1e-2)
    assert all(fit.misfits[name].rms < 0.01 * fit.one.misfits[name].rms for name in signals)


def test_with_noise_they_lie_within_their_standard_errors() -> None:
    fit = fit_stages(noisy(literal(TRUCK, TIMES), 0.01, seed=3), TRUCK.mass_kg, speed_m_s=13.4)
    assert fit.speed_error_m_s is None
    assert abs(fit.wall.spring_N_m - TRUCK.spring_N_m) < 4.0 * fit.spring_error_N_m
    assert abs(fit.wall.second_spring_N_m - TRUCK.second_spring_N_m) < 4.0 * fit.second_error_N_m
    assert abs(fit.wall.second_spring_from_m - TRUCK.second_spring_from_m) < 4.0 * fit.from_error_m
    assert fit.second_error_N_m < 0.05 * TRUCK.second_spring_N_m
    assert fit.from_error_m < 0.02


@pytest.mark.parametrize(
    ("beyond", "noise"), [(0.9, 0.0), (0.9, 0.02), (5.0, 0.0), pytest.param(5.0, 0.02, marks=pytest.mark.nightly)]
)
def test_a_pulse_without_a_second_stage_is_refused(noise: float, beyond: float) -> None:
    truck = StiffeningWall(6800.0, 13.4, 3103.3e3, 138.91e3, 9e6, beyond)
    pulse = noisy(dict(zip(NAMES, truck.response(TIMES), strict=True)), noise)
    with pytest.raises(FitError, match=r"no second spring found.* 0\.8\d m .*does not reach its second spring"):
        fit_stages(pulse, truck.mass_kg)
    assert fit_pulse(pulse, truck.mass_kg).wall.spring_N_m == pytest.approx(truck.spring_N_m, rel=0.05)


def test_the_command_fits_both(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    velocity = literal(TRUCK, TIMES)["velocity"]
    file = tmp_path / "pulse.csv"
    file.write_text("time [s], velocity [m/s]\n" + "".join(f"{t},{v}\n" for t, v in zip(TIMES, velocity, strict=True)))
    assert execute(["fit-vehicle", str(file), "--mass", "6800 kg", "--stages", "2"]) == 0
    text = capsys.readouterr().out
    assert "second spring           9000.0" in text
    assert "with one spring" in text
    vehicle = text[text.index("vehicle:") :].replace("...", "13.4 m/s")
    rwg = (Path(__file__).parents[2] / "configs" / "rwg.yaml").read_text(encoding="utf-8")
    case = tmp_path / "case.yaml"
    case.write_text(rwg[: rwg.index("vehicle:")] + vehicle)
    found = load(case)
    assert found.constants["vehicle_second_spring_from_m"] == pytest.approx(0.5, rel=1e-3)
    assert found.model.calibrated_crush_m == pytest.approx(TRUCK.max_displacement_m, rel=1e-2)
