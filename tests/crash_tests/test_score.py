"""A user's crash test against the forms of the model: what is scored, up to when, and on which side the model errs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels.design import constants_of
from boulder_kernels.soil import closed_form, soil_kinematics
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.crash_tests.measured import TEST_SIGNALS, TimeHistory, read_history
from boulder_sweep.crash_tests.score import (
    Form,
    by_the_paper,
    forms_of,
    score_table,
    scores,
    simulated_signal,
    time_of_limit,
)
from boulder_sweep.settings import Sweep, load
from tests import oracle
from tests.conftest import Trajectories
from tests.kernels.samples import design_of

RWG = Path(__file__).parents[2] / "configs" / "rwg.yaml"
PAPER = ["paper's law, as printed", "paper's law, corrected"]


def history(**signals: list[float]) -> TimeHistory:
    time = np.array(signals.pop("time"))
    return TimeHistory(Path("test.csv"), time, {name: np.array(values) for name, values in signals.items()})


def line(name: str, slope: float, t_limit: float = math.nan, end: float = 1.0) -> Form:
    """A form whose rotation grows in proportion to time [deg/s], and whose boulder moves 0.1 m/s."""
    time = np.linspace(0.0, end, 101)
    signals = {"rotation": slope * time, "boulder_displacement": 0.1 * time}
    return Form(name, time, signals, t_limit)


def forms_for(sweep: Sweep, horizon: float = 0.5) -> list[Form]:
    trajectories = {preset: by_the_paper(sweep, preset, horizon) for preset in ("as_printed", "corrected")}
    return forms_of(sweep, trajectories, horizon)


def test_the_time_of_the_limit_is_linear_between_samples() -> None:
    measured = history(time=[-0.1, 0.0, 0.1, 0.2, 0.3], rotation=[99.0, 0.0, 10.0, math.nan, 30.0])
    assert time_of_limit(measured, 20.0) == pytest.approx(0.2)
    assert time_of_limit(measured, 10.0) == pytest.approx(0.1)
    assert math.isnan(time_of_limit(measured, 31.0))
    assert time_of_limit(history(time=[0.0, 0.1], rotation=[-25.0, -30.0]), 20.0) == 0.0
    assert math.isnan(time_of_limit(history(time=[0.0, 0.1], boulder_displacement=[0.0, 1.0]), 20.0))


def test_scores_of_known_lines() -> None:
    measured = history(time=[0.0, 0.5, 1.0], rotation=[0.0, 5.0, 10.0], boulder_displacement=[0.0, 0.06, 0.12])
    time, peak, curve, moved, _ = scores([line("more", 12.0)], measured, 20.0)
    assert (time.measured, time.simulated, time.error, time.side) == (None, None, None, "")
    assert (peak.quantity, peak.unit, peak.measured, peak.simulated) == ("peak rotation", "deg", 10.0, 12.0)
    assert (peak.error, peak.side) == (pytest.approx(0.2), "safe")
    assert curve.simulated == pytest.approx(math.sqrt((0.0 + 1.0 + 4.0) / 3.0))
    assert curve.error == pytest.approx(curve.simulated / 10.0)
    assert (moved.error, moved.side) == (pytest.approx(0.1 / 0.12 - 1.0), "unsafe")


@pytest.mark.parametrize(
    ("rotation", "t_limit", "values", "side"),
    [
        ([0.0, 40.0], 0.4, (0.5, 0.4, -0.2), "safe"),
        ([0.0, 40.0], 0.6, (0.5, 0.6, 0.2), "unsafe"),
        ([0.0, 40.0], math.nan, (0.5, None, None), "unsafe"),
        ([0.0, 10.0], 0.4, (None, 0.4, None), "safe"),
    ],
)
def test_a_limit_that_is_reached_earlier_is_on_the_safe_side(rotation, t_limit, values, side) -> None:
    measured = history(time=[0.0, 1.0], rotation=rotation)
    found = scores([line("one", 30.0, t_limit)], measured, 20.0)[0]
    assert (found.measured, found.simulated, found.error) == pytest.approx(values)
    assert found.side == side


def test_nothing_beyond_the_limit_is_compared() -> None:
    time = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    measured = history(time=time, rotation=[0.0, 10.0, 20.0, 30.0, 40.0, 90.0])
    _, peak, _ = scores([line("one", 45.0, 20.0 / 45.0)], measured, 20.0)
    assert peak.measured == 20.0
    assert peak.simulated == pytest.approx(45.0 * 0.4)
    late = history(time=[2.0, 3.0], rotation=[1.0, 2.0])
    assert [own.quantity for own in scores([line("one", 1.0)], late, 20.0)] == ["time to the limit"]


def test_the_paper_alone_where_the_file_asks_for_nothing_else(trajectories: Trajectories) -> None:
    forms = forms_for(crash_test("rwg"))
    assert [form.name for form in forms] == PAPER
    corrected = trajectories["rwg", "corrected"]
    assert np.abs(forms[1].signals["rotation"]).max() == pytest.approx(np.degrees(corrected.rotation_rad).max(), 1e-9)


def test_what_else_the_file_asks_for(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(RWG.read_text() + "\nmodel: {resistance: broms, second_opinion: [broms, width_capped]}\n")
    forms = forms_for(load(file))
    opinions = ["second opinion, broms", "second opinion, width capped"]
    assert [form.name for form in forms] == [*PAPER, "the file's model: corrected, broms", *opinions]
    plain = forms_for(load(RWG))
    assert np.array_equal(forms[1].signals["rotation"], plain[1].signals["rotation"]), "the paper's law stays"
    peaks = [np.abs(form.signals["rotation"]).max() for form in forms]
    # The figures of docs/forms.md, which a study computes by itself.
    assert peaks[3:] == pytest.approx([13.0, 19.1], abs=0.06)
    assert math.isnan(forms[3].t_limit_s)
    assert forms[2].t_limit_s < 0.4


def test_a_second_opinion_that_overturns_has_its_time() -> None:
    sweep = load(RWG.with_name("abg.yaml"), ["model.second_opinion=width_capped"])
    own = forms_for(sweep, 0.2)[-1]
    reached = float(np.interp(20.0, own.signals["rotation"], own.time_s))
    assert own.t_limit_s == pytest.approx(reached, abs=1e-4)
    assert own.signals["vehicle_acceleration"].min() < -90.0


def test_a_test_that_is_the_model_has_no_error(trajectories: Trajectories) -> None:
    t = trajectories["rwg", "corrected"]
    names = ("rotation", "boulder_displacement", "vehicle_displacement", "vehicle_acceleration")
    measured = TimeHistory(Path("film.csv"), t.time_s, {name: simulated_signal(t, name) for name in names})
    own = [one for one in scores(forms_for(crash_test("rwg")), measured, 20.0) if one.form == PAPER[1]]
    assert len(own) == 1 + 2 * len(names)
    assert [one.error for one in own[1:]] == pytest.approx([0.0] * 2 * len(names), abs=1e-9)
    text = score_table(own).text()
    assert "never" in text
    assert max(map(len, text.splitlines())) <= 80


def test_an_accelerometer_is_read_in_g(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [ms],truck_acceleration [g]\n0,0\n50,-14\n")
    found = read_history(tmp_path / "a.csv", TEST_SIGNALS)
    assert found.signals["vehicle_acceleration"].tolist() == [0.0, -14 * 9.80665]


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
