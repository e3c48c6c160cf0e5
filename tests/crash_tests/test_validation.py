"""`sweep validate`: the statements of the paper, the files it writes, and measured data laid over the simulation."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from boulder_sweep.crash_tests.cases import convergence, statements
from boulder_sweep.crash_tests.measured import TEST_SIGNALS, TimeHistory
from boulder_sweep.crash_tests.score import compare, deviation_table, opposed, simulated_signal
from boulder_sweep.crash_tests.validation import Validation, validate
from boulder_sweep.errors import ComparisonError
from tests.conftest import Command, Trajectories


@pytest.fixture(scope="session")
def found() -> Validation:
    return validate()


@pytest.fixture
def known_study(found: Validation, monkeypatch: pytest.MonkeyPatch) -> None:
    """Element sums that were computed already; the tests of the statements and of the files compute them."""
    monkeypatch.setattr("boulder_sweep.crash_tests.validation.convergence", lambda: found.convergence)


def test_every_statement_of_the_paper_holds_or_cannot_be_checked(found: Validation) -> None:
    assert found.holds
    assert [statement.holds for statement in found.statements].count(True) == 8
    assert [statement.holds for statement in found.statements].count(None) == 3
    assert {statement.section for statement in found.statements} == {"3.1", "3.2", "3.3", "3.4", "4"}


def test_a_contradiction_is_seen(found: Validation) -> None:
    swapped = {
        ("abg" if test == "rwg" else "rwg", preset): trajectory
        for (test, preset), trajectory in found.trajectories.items()
    }
    wrong = statements(swapped, found.convergence, found.wall)
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


def test_element_sums_approach_the_closed_form(found: Validation) -> None:
    study = found.convergence
    assert study.order("rwg", "as_printed") == pytest.approx(1.0, abs=0.05)
    assert study.order("rwg", "corrected") == pytest.approx(2.0, abs=0.1)
    assert study.rotation_deg["rwg", "as_printed", 5000] == pytest.approx(7.6963, abs=6e-5)
    assert study.rotation_deg["rwg", "as_printed", 2000] == pytest.approx(7.6997, abs=6e-5)
    assert study.rotation_deg["rwg", "as_printed", 0] == pytest.approx(7.6940, abs=6e-5)
    assert convergence([50]).elements == (50,)


@pytest.mark.nightly
def test_command_writes_pictures_and_tables(sweep: Command, tmp_path: Path) -> None:
    code, out, err = sweep("validate", "-o", tmp_path / "v")
    assert (code, err) == (0, "")
    assert "measured curves of the paper are in its figures, not in its text" in out
    names = sorted(path.name for path in (tmp_path / "v").iterdir())
    assert names == [
        "convergence.parquet",
        "convergence.png",
        "crash_tests.parquet",
        "figure_10_rigid_wall.png",
        "figures_12_to_14_abg.png",
        "figures_16_to_18_rwg.png",
        "statements.parquet",
        "trajectories.parquet",
    ]
    histories = pd.read_parquet(tmp_path / "v" / "trajectories.parquet")
    assert len(histories) == 4 * 1001
    peak = histories.groupby(["test", "preset"], observed=True).rotation_rad.max()
    assert np.degrees(peak["rwg", "corrected"]) == pytest.approx(13.761, abs=1e-3)
    rows = pd.read_parquet(tmp_path / "v" / "crash_tests.parquet")
    assert list(rows.verdict) == ["fail", "fail", "undecided", "pass"]


@pytest.mark.usefixtures("known_study")
def test_command_without_a_folder_writes_nothing(
    sweep: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, _ = sweep("validate", "--json")
    assert code == 0
    assert json.loads(out)["files"] == []
    assert list(tmp_path.iterdir()) == []


def measured(trajectories: Trajectories, test: str, offset_deg: float = 0.0) -> TimeHistory:
    t = trajectories[test, "corrected"]
    some = slice(0, None, 10)
    rotation = np.degrees(t.rotation_rad[some]) + offset_deg
    rotation[3] = np.nan
    vehicle = t.vehicle_displacement_m[some] * 1.1
    return TimeHistory(Path("test.csv"), t.time_s[some], {"rotation": rotation, "vehicle_displacement": vehicle})


def test_deviations_of_known_data(trajectories: Trajectories) -> None:
    t = trajectories["rwg", "corrected"]
    rotation, vehicle = compare(t, measured(trajectories, "rwg", offset_deg=-2.0))
    assert (rotation.signal, rotation.unit, rotation.samples) == ("rotation", "deg", 100)
    assert rotation.rms == pytest.approx(2.0)
    assert rotation.largest == pytest.approx(2.0)
    assert rotation.peak_error == pytest.approx(2.0 / (13.761 - 2.0), rel=1e-3)
    assert vehicle.peak_error == pytest.approx(1 / 1.1 - 1.0, abs=1e-4), "between the samples it moves further"
    assert vehicle.largest == pytest.approx(-0.1 * t.vehicle_displacement_m.max(), rel=1e-3)


def test_beyond_the_limit_is_told_apart(trajectories: Trajectories) -> None:
    found = compare(trajectories["abg", "corrected"], measured(trajectories, "abg"))
    assert [(d.signal, round(d.until_s, 3)) for d in found] == [
        ("rotation", 0.5),
        ("rotation", 0.077),
        ("vehicle_displacement", 0.5),
        ("vehicle_displacement", 0.077),
    ]
    assert found[1].measured_peak < 20.0 < found[0].measured_peak
    assert "0.077" in deviation_table({"corrected": found}).text()


def test_data_outside_of_the_simulated_time_are_refused(trajectories: Trajectories) -> None:
    late = TimeHistory(Path("late.csv"), np.array([5.0, 6.0]), {"rotation": np.array([1.0, 2.0])})
    with pytest.raises(ComparisonError, match="counts from first touch"):
        compare(trajectories["rwg", "corrected"], late)


@pytest.mark.usefixtures("known_study")
def test_command_overlays_measured_data(sweep: Command, tmp_path: Path) -> None:
    case = Path(__file__).parents[2] / "configs" / "rwg.yaml"
    file = tmp_path / "film.csv"
    file.write_text("time [ms],rotation [deg],boulder_displacement [cm]\n0,0,0\n100,4.4,9\n300,,32\n400,12,28\n")
    code, out, err = sweep("validate", "-o", tmp_path, "--measured", file, "--case", case)
    assert (code, err) == (0, "")
    signals = next(line for line in out.splitlines() if line.startswith("signal"))
    assert signals.split()[1:] == ["rotation", "boulder", "rotation", "boulder", "displacement"], "one of them wrapped"
    assert [line for line in out.splitlines() if len(line) > 80 and str(tmp_path) not in line] == []
    assert (tmp_path / "measured_film.png").stat().st_size > 10_000
    code, out, _ = sweep("validate", "--measured", file, "--case", "rwg", "--json")
    content = json.loads(out)["measured"]["corrected"]
    assert [d["signal"] for d in content] == ["rotation", "boulder_displacement"]
    assert content[0]["measured_peak"] == 12.0


def film(folder: Path, rotation: float, boulder: float) -> Path:
    """A track of half a second whose peaks are given [deg, mm]."""
    time = np.arange(0.0, 0.5, 0.002)
    shape = np.sin(np.pi * np.clip(time / 0.6, 0.0, 1.0))
    rows = (f"{1e3 * t:g},{rotation * s:g},{boulder * s:g}\n" for t, s in zip(time, shape, strict=True))
    file = folder / "film.csv"
    file.write_text("time [ms],rotation [deg],boulder_displacement [mm]\n" + "".join(rows))
    return file


@pytest.mark.usefixtures("known_study")
@pytest.mark.parametrize(
    ("rotation", "boulder", "mirrored"),
    [
        (13.0, 250.0, []),
        (-13.0, -250.0, ["rotation", "boulder_displacement"]),
        (-13.0, 250.0, ["rotation"]),
        (13.0, -250.0, ["boulder_displacement"]),
    ],
)
def test_a_mirrored_film_is_noticed_and_all_tables_say_the_same(
    sweep: Command, tmp_path: Path, rotation: float, boulder: float, mirrored: list[str]
) -> None:
    file = film(tmp_path, rotation, boulder)
    code, out, _ = sweep("validate", "--case", "rwg", "--measured", file, "--json")
    content = json.loads(out)
    assert code == 0
    assert [note.split()[2] for note in content["notes"]] == mirrored
    assert all("as in a mirrored film" in note for note in content["notes"])
    peaks = {
        (own["form"].split(", ")[1].replace(" ", "_"), own["quantity"][5:].replace(" ", "_")): own
        for own in content["scores"]
        if own["quantity"].startswith("peak")
    }
    for preset, deviations in content["measured"].items():
        for own in deviations:
            peak = peaks[preset, own["signal"]]
            assert (peak["measured"], peak["simulated"]) == (own["measured_peak"], own["simulated_peak"])
            assert peak["error"] == own["peak_error"]
            assert (peak["side"] == "") is (own["peak_error"] is None) is (own["signal"] in mirrored)
    _, out, _ = sweep("validate", "--case", "rwg", "--measured", file)
    words = " ".join(out.split())
    assert ("It counts as positive while the boulder's top moves away from the truck" in words) is (rotation < 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_signal_that_runs_against_the_simulation_is_told_with_its_sign(
    trajectories: Trajectories, sign: float
) -> None:
    t = trajectories["rwg", "corrected"]
    names = [signal.name for signal in TEST_SIGNALS[1:]]
    file = TimeHistory(Path("test.csv"), t.time_s, {name: sign * simulated_signal(t, name) for name in names})
    notes = opposed([t], file)
    assert [note.split()[2] for note in notes] == ([] if sign > 0.0 else names)
    assert all(signal.positive in note for signal, note in zip(TEST_SIGNALS[1:], notes, strict=False))
    still = TimeHistory(Path("test.csv"), t.time_s, {"rotation": np.zeros_like(t.time_s)})
    assert opposed([t], still) == []


def test_what_is_compared_ends_where_the_measured_boulder_reaches_the_limit(trajectories: Trajectories) -> None:
    t = trajectories["rwg", "corrected"]
    time = np.linspace(0.0, 0.5, 251)
    found = compare(t, TimeHistory(Path("test.csv"), time, {"rotation": 100.0 * time}))
    assert [d.until_s for d in found] == pytest.approx([0.5, 0.2])
    assert found[1].measured_peak == pytest.approx(20.0)


@pytest.mark.usefixtures("known_study")
def test_the_command_scores_a_test(sweep: Command, tmp_path: Path) -> None:
    rwg = (Path(__file__).parents[2] / "configs" / "rwg.yaml").read_text()
    film = tmp_path / "film.csv"
    film.write_text(
        "time [ms],rotation [deg],boulder_displacement [cm],vehicle_displacement [m],vehicle_acceleration [g]\n"
        "0,0,0,0,0\n30,0.5,1,0.4,-11\n60,2,4,0.7,-14\n100,4.4,9,1.0,-9\n300,,28,,0\n400,12,27,,0\n"
    )
    case = tmp_path / "own.yaml"
    case.write_text(
        rwg.replace("friction_angle: 43.2 deg", "friction_angle: {mean: 43.2 deg, sd: 3 deg}")
        + "\nmodel: {second_opinion: [broms]}\n"
    )
    code, out, _ = sweep("validate", "--measured", film, "--case", case, "--json")
    content = json.loads(out)
    forms = list(dict.fromkeys(own["form"] for own in content["scores"]))
    assert code == 0
    assert forms == ["paper's law, as printed", "paper's law, corrected", "second opinion, broms"]
    peak = next(
        own
        for own in content["scores"]
        if own["form"] == "paper's law, corrected" and own["quantity"] == "peak rotation"
    )
    assert peak["simulated"] == pytest.approx(13.76, abs=0.01), "at the means, not at the unfavourable quantile"
    assert (peak["measured"], peak["side"]) == (12.0, "safe")
    _, out, _ = sweep("validate", "--measured", film, "--case", case)
    assert "scores, up to the limit of the rotation:" in out
    assert [text for text in out.splitlines() if len(text) > 80 and str(tmp_path) not in text] == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--measured", "x.csv"], "go together"),
        (["--case", "rwg"], "go together"),
        (["--measured", "missing.csv", "--case", "rwg"], "there is no such file"),
        (["--measured", "film.csv", "--case", "missing.yaml"], "missing.yaml"),
        (["--measured", "film.csv", "--case", "m30"], "holds 107,008 designs"),
    ],
)
def test_command_refuses_wrong_use(
    sweep: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], message: str
) -> None:
    grid = Path(__file__).parents[2] / "configs" / "m30_sizing.yaml"
    monkeypatch.chdir(tmp_path)
    Path("film.csv").write_text("time [ms],rotation [deg]\n0,0\n100,4.4\n")
    code, out, err = sweep("validate", *(str(grid) if word == "m30" else word for word in words))
    assert (code, out) == (2, "")
    assert message in err
