"""Measured time histories: as CSV, and over a simulation."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.soil import closed_form, soil_kinematics
from boulder_sweep.crash_tests.measured import PULSE_SIGNALS, TEST_SIGNALS, TimeHistory, read_history
from boulder_sweep.crash_tests.overlay import Peak, opposed, overlay, peaks_of, simulated_signal
from boulder_sweep.errors import ComparisonError
from boulder_sweep.settings import SettingsError
from tests import oracle
from tests.conftest import Command, Trajectories
from tests.kernels.samples import design_of


def write(folder: Path, text: str) -> Path:
    file = folder / "data.csv"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("head", "row", "name", "expected"),
    [
        ("time [ms],displacement [mm]", "10,250", "displacement", 0.25),
        ("time [ms],displacement (in)", "10,10", "displacement", 0.254),
        ("time_ms,displacement_m", "10,0.25", "displacement", 0.25),
        ("t [ms],x [ft]", "10,1", "displacement", 0.3048),
        ("time [ms],velocity [mph]", "10,30", "velocity", 13.4112),
        ("time [ms],speed [km/h]", "10,36", "velocity", 10.0),
        ("time_ms,vehicle_velocity_m_s", "10,12.5", "velocity", 12.5),
        ("Time [ms],Vehicle Acceleration [g]", "10,-20", "acceleration", -196.133),
        ("time [ms],acceleration [m/s^2]", "10,-20", "acceleration", -20.0),
        ("time [ms],acceleration [m/s²]", "10,-20", "acceleration", -20.0),
        ("time_ms,vehicle_acceleration_m_s2", "10,-20", "acceleration", -20.0),
        ("time [ms],acceleration [ft/s2]", "10,-10", "acceleration", -3.048),
        ("time [msec],acceleration [g's]", "10,-20", "acceleration", -196.133),
        ("time [ms],acceleration [m/(s*s)]", "10,-20", "acceleration", -20.0),
        ("time (ms),acceleration (m/(s*s))", "10,-20", "acceleration", -20.0),
        ("time [ms];displacement [m]", "10;0.25", "displacement", 0.25),
        ("time [ms]\tdisplacement [m]", "10\t0.25", "displacement", 0.25),
    ],
)
def test_units_of_the_header(tmp_path: Path, head: str, row: str, name: str, expected: float) -> None:
    sign = next(sign for sign in ",;\t" if sign in head)
    found = read_history(write(tmp_path, f"# a comment\n{head}\n0{sign}0\n\n{row}\n"), PULSE_SIGNALS)
    assert found.time_s == pytest.approx([0.0, 0.01])
    assert found.signals[name] == pytest.approx([0.0, expected])


@pytest.mark.parametrize(
    "text",
    [
        "time [s];acceleration [g]\n-0,05;-0\n1,5e-3;-8,91367e-1\n0,002;-1,21936\n",
        "time [s],acceleration [g],\n-.05,0,\n,,\n1.5e-3,-.891367,\n.002,-1.21936,\n,,\n",
        ",time [s],acceleration [g]\n0,-0.05,0\n1,0.0015,-.891367\n2,0.002,-1.21936\n",
        "time,acceleration\ns,g\n-.05,0\n1.5e-3,-.891367\n.002,-1.21936\n",
        "Time;Acceleration\n[s];[g]\n-0,05;0\n0,0015;-0,891367\n0,002;-1,21936\n",
        "time\tacceleration\n(ms)\t(g)\n-50\t0\n1.5\t-.891367\n2\t-1.21936\n",
    ],
)
def test_curves_as_recorders_and_spreadsheets_write_them(tmp_path: Path, text: str) -> None:
    found = read_history(write(tmp_path, text), PULSE_SIGNALS)
    assert found.time_s == pytest.approx([-0.05, 0.0015, 0.002])
    assert found.signals["acceleration"] == pytest.approx(np.array([0.0, -0.891367, -1.21936]) * 9.80665)


@pytest.mark.parametrize("sign", [",", "\t", ";"])
def test_a_pulse_with_decimal_commas_is_the_one_with_points(tmp_path: Path, sign: str, sweep: Command) -> None:
    """The vehicle of the pulse is the truck of the paper at 13.4 m/s."""
    text = (Path(__file__).parent / "pulses" / "decimal_commas.csv").read_text()
    plain = text if sign == ";" else text.replace(",", ".").replace(";", sign)
    file = write(tmp_path, plain)
    code, out, _ = sweep("fit-vehicle", file, "--mass", "6800 kg", "--json")
    found = json.loads(out)
    assert code == 0
    assert found["vehicle_spring_N_m"] == pytest.approx(3103.3e3, rel=1e-3)
    assert found["vehicle_damper_N_s_m"] == pytest.approx(138.91e3, rel=1e-3)


@pytest.mark.parametrize("cell", ["ax [g]", "ax", "dx [mm]", "vx [m/s]", "displacment [g]"])
def test_no_quantity_of_another_kind_is_suggested(tmp_path: Path, cell: str) -> None:
    with pytest.raises(SettingsError, match="is not known") as refused:
        read_history(write(tmp_path, f"time [ms],{cell}\n0,1\n1,2\n"), PULSE_SIGNALS)
    assert "did you mean" not in str(refused.value)


def test_empty_cells_are_gaps(tmp_path: Path) -> None:
    file = write(tmp_path, "time [s],rotation [rad],boulder_displacement [mm]\n0,,0\n0.1,0.1,\n0.2,0.2,30\n")
    found = read_history(file, TEST_SIGNALS)
    assert np.isnan(found.signals["rotation"][0])
    assert found.signals["rotation"][1:] == pytest.approx(np.degrees([0.1, 0.2]))
    assert found.signals["boulder_displacement"][2] == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("time [ms],weight [kg]\n0,1\n1,2\n", ["1:11: weight [kg]: is not known", "displacement, velocity"]),
        ("time [ms],displacment [mm]\n0,1\n1,2\n", ["did you mean displacement?"]),
        ("time [ms],displacement\n0,1\n1,2\n", ["1:11: displacement: has no unit", "'displacement [m]'"]),
        ("time [ms],displacement [kg]\n0,1\n1,2\n", ["a length is needed"]),
        ("time [ms],acceleration [m/s]\n0,1\n1,2\n", ["an acceleration is needed (m/s^2, ft/s^2 or g)"]),
        ("time [ms],acceleration [furlong]\n0,1\n1,2\n", ["an acceleration is needed (m/s^2, ft/s^2 or g)"]),
        ("velocity [m/s],displacement [m]\n0,1\n1,2\n", ["1:1: has no column of time"]),
        ("time [ms]\n0\n1\n", ["1:1: has nothing beside time"]),
        ("time [ms],x [m],displacement [m]\n0,1,1\n1,2,2\n", ["1:17: displacement: stands in two columns"]),
        ("time [ms],x [m]\n0,1\n0,2\n", ["3:1: time: 0 s comes after 0 s; times must ascend"]),
        ("time [ms],x [m]\n0,1\n,2\n", ["3:1: time: is empty; a number is needed"]),
        ("x [m];time [ms]\n0;1\n12;1\n", ["3:4: time: 0.001 s comes after 0.001 s"]),
        ('time [ms],"x [m]"\n0,1\n"1",two\n', ["3: displacement: 'two' is not a number"]),
        ("time [ms],x [m]\n0,1\n1,two\n", ["3:3: displacement: 'two' is not a number"]),
        (
            "time [ms],x [m]\n0,1\n1,2 mm\n",
            ["3:3: displacement: '2 mm' is not a plain number; a unit belongs in the column's name"],
        ),
        ("time [ms],x [m]\n0,1\n1,nan\n", ["3:3: displacement: 'nan' is not a finite number"]),
        ("time [ms],x [m]\n0,1\n1,1_0\n", ["3:3: displacement:"]),
        ("time [ms],x [m]\n0,1\n1,\u0661\n", ["3:3: displacement: '\u0661' is not a number"]),
        ("time [ms],x [m]\n0,1\n1,2,3\n", ["3:1: has 3 cells; the first line has 2"]),
        ("time [ms],x [m]\n", ["at least two rows"]),
        ("", ["is empty; the first line must hold the column names"]),
        ('time [ms],x [m]\n0,1\n1,"2\n3,4\n', ["3:1: cannot be read as CSV", "is a quotation mark not closed"]),
        (
            "0,0\n0.1,1\n",
            [
                "1:1: the first line holds numbers; write a line of names above it",
                "such as time [s],displacement [m]; known names are time [s], displacement [m], velocity [m/s],",
            ],
        ),
        ("0,001;-1,5\n0,002;-2,5\n", ["1:1: the first line holds numbers", "such as time [s];displacement [m];"]),
        ("time,acceleration\ns,furlong\n0,0\n1,1\n", ["1:1: time: has no unit", "'time [s]'"]),
        ("time,weight\ns,m\n0,0\n1,1\n", ["1:6: weight [m]: is not known"]),
        ("time,acceleration\ns,m\n0,0\n1,1\n", ["1:6: acceleration [m]: ", "an acceleration is needed"]),
    ],
)
def test_mistakes_with_their_place(tmp_path: Path, text: str, messages: list[str]) -> None:
    file = write(tmp_path, text)
    with pytest.raises(SettingsError) as caught:
        read_history(file, PULSE_SIGNALS)
    for message in messages:
        assert message in str(caught.value)
    assert str(caught.value).startswith(str(file))


def test_all_mistakes_at_once(tmp_path: Path) -> None:
    file = write(tmp_path, "time [ms],x [m]\n0,a\n1,b\n2,c\n")
    with pytest.raises(SettingsError) as caught:
        read_history(file, PULSE_SIGNALS)
    assert len(caught.value.problems) == 3


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="there is no such file"):
        read_history(tmp_path / "missing.csv", PULSE_SIGNALS)
    with pytest.raises(SettingsError, match="is a directory"):
        read_history(tmp_path, PULSE_SIGNALS)
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01" * 100)
    with pytest.raises(SettingsError, match="not UTF-8"):
        read_history(binary, PULSE_SIGNALS)


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


def test_command_overlays_measured_data(sweep: Command, tmp_path: Path) -> None:
    film = tmp_path / "film.csv"
    film.write_text(FILM)
    code, out, err = sweep("validate", "-o", tmp_path, "--measured", film, "--case", CONFIGS / "rwg.yaml")
    assert (code, err) == (0, "")
    head = next(line for line in out.splitlines() if line.startswith("signal"))
    assert head.split()[1:] == ["readings", "up", "to", "[s]", "measured", "peak", "simulated", "peak", "error"]
    assert [line for line in out.splitlines() if len(line) > 80 and str(tmp_path) not in line] == []
    assert (tmp_path / "measured_film.png").stat().st_size > 10_000


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
    """docs/validation.md: beta = F d / (1e6 W tan(phi) (u d^2 / 2 - theta d^3 / 3)), held against the kernels."""
    design = design_of(oracle.RWG)
    c = constants_of(design, bk.corrected(), 0)
    x_b, theta = 2e-3, 1e-3
    state = soil_kinematics(x_b, 0.0, 0.0, math.sin(theta), 1.0 - math.cos(theta), c)
    force = -closed_form(state, c).F
    surface, d = state.A, design.d
    below = surface * d**2 / 2.0 - theta * d**3 / 3.0
    beta = force * d / (1e6 * design.W * math.tan(design.phi) * below)
    assert beta == pytest.approx(design.beta, rel=1e-5)
