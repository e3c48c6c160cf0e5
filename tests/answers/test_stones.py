"""Questions about tapered boulders: the lightest one, the fastest truck, the chances."""

from __future__ import annotations

from pathlib import Path

import pytest

import boulder_sweep
from boulder_sweep.settings.shape import tapered
from tests.answers.designs import DEPTH, bare_need, passes, site

SPEED = "impact_speed_m_s"
TAPERED = {"height": "3.4 m, taper: 0.8", "friction": "38 deg"}


@pytest.mark.nightly
def test_the_lightest_tapered_boulder_is_lighter_than_any_of_the_grid(tmp_path: Path) -> None:
    sweep = site(
        height="{from: 2.6 m, to: 3.4 m, step: 0.1 m}, taper: 0.8",
        site="embedment_ratio: {from: 0.55, to: 0.75, step: 0.02}",
        friction="40 deg",
    )
    boulder_sweep.run(sweep, tmp_path / "grid")
    table = boulder_sweep.read(tmp_path / "grid")
    filled = tapered(0.8).filled
    volume = table.boulder_length_m.astype(float) * table.boulder_width_m.astype(float) * filled
    mass = (volume * table.boulder_height_m.astype(float) * table.boulder_density_kg_m3.astype(float))[
        table.verdict == "pass"
    ]
    found = bare_need(sweep, "mass")
    row = found.frame.iloc[0]
    assert 0.9 * mass.min() < row.boulder_mass_kg <= mass.min()
    volume = row.boulder_length_m * row.boulder_width_m * row.boulder_height_m * filled
    assert row.boulder_mass_kg == pytest.approx(volume * row.boulder_density_kg_m3)
    assert passes(found, found.frame, found.frame[DEPTH], DEPTH).all()


def test_the_fastest_truck_that_a_tapered_boulder_withstands() -> None:
    found = bare_need(site(**TAPERED), most="speed")
    assert passes(found, found.frame, found.frame.passes_at, SPEED).all()
    assert not passes(found, found.frame, found.frame.fails_at, SPEED).any()
    assert (found.frame.fails_at - found.frame.passes_at).between(0.0, 0.01).all()
