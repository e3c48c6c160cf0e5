"""Three doubts: parted as they should be, and the mixed readings between the presets."""

from __future__ import annotations

import numpy as np
import pytest

from boulder_sweep.answers.doubts import INPUTS, LAW, NUMERICAL, READINGS, doubts, parted
from boulder_sweep.answers.need import need
from boulder_sweep.answers.trials import every_reading
from boulder_sweep.errors import QuestionError
from tests.answers.designs import site

UNCERTAIN = {"height": "3.2 m", "site": "embedment_depth: 2.2 m", "friction": "{mean: 38 deg, sd: 3 deg}"}


def test_made_up_margins_are_parted_exactly() -> None:
    r, law, drawn = np.arange(4.0), np.array([0.0, 1.0]), np.linspace(-1.0, 1.0, 50)
    margins = 2.0 * r[:, None, None] + law[None, :, None] + drawn[None, None, :]
    parts = {own.cause: own for own in parted(margins)}
    for cause, values in ((READINGS, 2.0 * r), (LAW, law), (INPUTS, drawn)):
        assert parts[cause].alone == pytest.approx(values.var() / margins.var())
        assert parts[cause].total == pytest.approx(parts[cause].alone), "what is added does not act upon the rest"
    assert sum(own.alone for own in parts.values()) == pytest.approx(1.0)


def test_products_act_upon_each_other() -> None:
    margins = np.multiply.outer(np.array([-1.0, 1.0]), np.ones((2, 1)) * np.linspace(-1.0, 1.0, 51))
    parts = {own.cause: own for own in parted(margins)}
    assert parts[READINGS].alone == pytest.approx(0.0)
    assert parts[READINGS].total == pytest.approx(1.0)


def test_every_reading_once() -> None:
    readings = {sweep.model.readings for sweep in every_reading(site())}
    assert len(readings) == 32


@pytest.mark.parametrize("drawn", [128, pytest.param(512, marks=pytest.mark.nightly)])
def test_readings_outweigh_the_numerical_error(drawn: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boulder_sweep.answers.doubts.DRAWN", drawn)
    parts = {own.cause: own for own in doubts(site(**UNCERTAIN))}
    assert list(parts) == [INPUTS, READINGS, LAW, NUMERICAL]
    assert parts[READINGS].alone > 0.3
    assert parts[LAW].alone > 0.01
    assert parts[NUMERICAL].total < 1e-6
    assert all(own.alone <= own.total + 1e-12 for own in parts.values())


@pytest.mark.nightly
def test_open_readings_need_another_depth() -> None:
    sweep = site(**UNCERTAIN)
    closed = need(sweep, probability=0.9, both_readings=True).frame.iloc[0]
    open_ = need(sweep, probability=0.9, open_readings=True).frame.iloc[0]
    depths = sorted([closed.passes_at, closed.least_embedment_depth_m_as_printed, open_.passes_at])
    assert open_.found == "found"
    assert open_.passes_at != closed.passes_at
    assert depths[0] < open_.passes_at
    assert open_.p_pass >= 0.9
    with pytest.raises(QuestionError, match="--open-readings needs --probability"):
        need(site(), open_readings=True)
