"""A user's crash test over the simulation: what is compared, up to when, and films from the other side."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.soil import closed_form, soil_kinematics
from boulder_sweep.crash_tests.measured import TEST_SIGNALS, TimeHistory, read_history
from boulder_sweep.crash_tests.overlay import Peak, opposed, overlay, peaks_of, simulated_signal
from boulder_sweep.errors import ComparisonError
from tests import oracle
from tests.conftest import Command, Trajectories
from tests.kernels.samples import design_of

CONFIGS = Path(__file__).parents[2] / "configs"


def peaks(trajectories: Trajectories, test: str, measured: TimeHistory) -> list[Peak]:
    """Peaks with corrected readings."""
    return list(peaks_of(measured, {"corrected": trajectories[test, "corrected"]}))


def history(time: np.ndarray, **signals: np.ndarray) -> TimeHistory:
    return TimeHistory(Path("test.csv"), time, signals)


def shifted(trajectories: Trajectories, test: str, offset_deg: float = 0.0) -> TimeHistory:
    """Every tenth sample of a simulation, its rotation with an offset and a gap, its vehicle 10 % further."""
    t = trajectories[test, "corrected"]
    some = slice(0, None, 10)
    rotation = np.degrees(t.rotation_rad[some]) + offset_deg
    rotation[3] = np.nan
    return history(t.time_s[some], rotation=rotation, vehicle_displacement=t.vehicle_displacement_m[some] * 1.1)


def test_peaks_of_known_data(trajectories: Trajectories) -> None:
    rotation, vehicle = peaks(trajectories, "rwg", shifted(trajectories, "rwg", offset_deg=-2.0))
    assert (rotation.signal, rotation.unit, rotation.readings, rotation.until_s) == (
        "rotation",
        "deg",
        "corrected",
        0.5,
    )
    assert rotation.simulated == pytest.approx(13.761, abs=1e-3)
    assert rotation.simulated - rotation.measured == pytest.approx(2.0, abs=1e-3)
    assert rotation.error == pytest.approx(2.0 / (13.761 - 2.0), rel=1e-3)
    assert vehicle.error == pytest.approx(1 / 1.1 - 1.0, abs=1e-4), "between the samples it moves further"


def test_a_test_that_is_the_model_has_no_error(trajectories: Trajectories) -> None:
    t = trajectories["rwg", "corrected"]
    names = [signal.name for signal in TEST_SIGNALS[1:]]
    same = history(t.time_s, **{name: simulated_signal(t, name) for name in names})
    own = peaks(trajectories, "rwg", same)
    assert [peak.signal for peak in own] == names
    assert [peak.error for peak in own] == pytest.approx([0.0] * len(names), abs=1e-9)


def test_nothing_beyond_the_limit_is_compared(trajectories: Trajectories) -> None:
    own = peaks(trajectories, "abg", shifted(trajectories, "abg"))
    assert [round(peak.until_s, 3) for peak in own] == [0.077, 0.077]
    assert max(own[0].measured, own[0].simulated) < 20.0


@pytest.mark.parametrize(
    ("time", "rotation", "until"),
    [
        ([0.0, 0.1, 0.5], [0.0, 10.0, 50.0], 0.2),
        ([-0.1, 0.0, 0.1, 0.2, 0.3], [99.0, 0.0, 10.0, math.nan, 30.0], 0.2),
        ([0.1, 0.2], [-25.0, -30.0], 0.1),
        ([0.0, 0.4], [0.0, 15.0], 0.5),
    ],
)
def test_the_measured_boulder_reaches_the_limit_between_samples(
    trajectories: Trajectories, time: list[float], rotation: list[float], until: float
) -> None:
    (peak,) = peaks(trajectories, "rwg", history(np.array(time), rotation=np.array(rotation)))
    assert peak.until_s == pytest.approx(until)
    assert abs(peak.measured) <= 25.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_signal_that_runs_against_the_simulation_is_told_with_its_sign(
    trajectories: Trajectories, sign: float
) -> None:
    t = trajectories["rwg", "corrected"]
    names = [signal.name for signal in TEST_SIGNALS[1:]]
    file = history(t.time_s, **{name: sign * simulated_signal(t, name) for name in names})
    notes = list(opposed(file, {"corrected": t}))
    assert [note.split()[2] for note in notes] == ([] if sign > 0.0 else names)
    assert all(signal.positive in note for signal, note in zip(TEST_SIGNALS[1:], notes, strict=False))
    assert [peak.error is None for peak in peaks(trajectories, "rwg", file)] == [sign < 0.0] * len(names)
    still = history(t.time_s, rotation=np.zeros_like(t.time_s))
    assert list(opposed(still, {"corrected": t})) == []


FILM = "time [ms],rotation [deg],boulder_displacement [cm]\n0,0,0\n100,4.4,9\n300,,32\n400,12,28\n"


def test_uncertain_inputs_are_at_their_means(tmp_path: Path) -> None:
    film, case = tmp_path / "film.csv", tmp_path / "own.yaml"
    film.write_text(FILM)
    given = "friction_angle: 43.2 deg"
    case.write_text((CONFIGS / "rwg.yaml").read_text().replace(given, "friction_angle: {mean: 43.2 deg, sd: 3 deg}"))
    peak = next(peak for peak in overlay(film, str(case)).peaks if peak.readings == "corrected")
    assert peak.simulated == pytest.approx(13.76, abs=0.01)
    assert peak.measured == 12.0


@pytest.mark.parametrize(
    ("film", "depth", "message"),
    [
        ("time [ms],rotation [deg]\n-2,1\n-1,2\n", "2.03 m", "no measured value lies within.*counts from first touch"),
        (FILM, "3 m", "no motion to compare with: fail, no contact"),
    ],
)
def test_a_test_without_anything_to_compare_is_refused(tmp_path: Path, film: str, depth: str, message: str) -> None:
    (tmp_path / "film.csv").write_text(film)
    case = tmp_path / "own.yaml"
    case.write_text((CONFIGS / "rwg.yaml").read_text().replace("embedment_depth: 2.03 m", f"embedment_depth: {depth}"))
    with pytest.raises(ComparisonError, match=message):
        overlay(tmp_path / "film.csv", str(case))


def test_an_accelerometer_is_read_in_g(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [ms],truck_acceleration [g]\n0,0\n50,-14\n")
    measured = read_history(tmp_path / "a.csv", TEST_SIGNALS)
    assert measured.signals["vehicle_acceleration"].tolist() == [0.0, -14 * 9.80665]


@pytest.mark.usefixtures("known_study")
def test_command_overlays_measured_data(sweep: Command, tmp_path: Path) -> None:
    film = tmp_path / "film.csv"
    film.write_text(FILM)
    code, out, err = sweep("validate", "-o", tmp_path, "--measured", film, "--case", CONFIGS / "rwg.yaml")
    assert (code, err) == (0, "")
    head = next(line for line in out.splitlines() if line.startswith("signal"))
    assert head.split()[1:] == ["readings", "up", "to", "[s]", "measured", "peak", "simulated", "peak", "error"]
    assert [line for line in out.splitlines() if len(line) > 80 and str(tmp_path) not in line] == []
    assert (tmp_path / "measured_film.png").stat().st_size > 10_000


@pytest.mark.usefixtures("known_study")
def test_command_notices_a_mirrored_film(sweep: Command, tmp_path: Path) -> None:
    film = tmp_path / "film.csv"
    film.write_text(FILM.replace(",4.4,", ",-4.4,").replace(",12,", ",-12,"))
    code, out, _ = sweep("validate", "--measured", film, "--case", "rwg", "--json")
    content = json.loads(out)
    assert code == 0
    assert [note.split()[2] for note in content["notes"]] == ["rotation"]
    assert [(peak["signal"], peak["error"] is None) for peak in content["peaks"]] == [
        *[("rotation", True)] * 2,
        *[("boulder_displacement", False)] * 2,
    ]
    _, out, _ = sweep("validate", "--measured", film, "--case", "rwg")
    assert "It counts as positive while the boulder's top moves away from the truck" in " ".join(out.split())


def test_the_pull_of_the_page_gives_the_subgrade_reaction() -> None:
    """docs/measuring.md: beta = F d / (1e6 W tan(phi) (u d^2 / 2 - theta d^3 / 3)), held against the kernels."""
    design = design_of(oracle.RWG)
    c = constants_of(design, bk.corrected(), 0)
    x_b, theta = 2e-3, 1e-3
    state = soil_kinematics(x_b, 0.0, 0.0, math.sin(theta), 1.0 - math.cos(theta), c)
    force = -closed_form(state, c).F
    surface, d = state.A, design.d
    below = surface * d**2 / 2.0 - theta * d**3 / 3.0
    beta = force * d / (1e6 * design.W * math.tan(design.phi) * below)
    assert beta == pytest.approx(design.beta, rel=1e-5)
