"""Uncertain inputs at one value each: the unfavourable side is that at which designs are worse off."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import boulder_sweep
from boulder_sweep import at_values, load
from boulder_sweep.errors import QuestionError
from boulder_sweep.judge.quantiles import words_of
from boulder_sweep.store.failures import StoreError

CONFIGS = Path(__file__).parents[2] / "configs"
SITE, SOILS = CONFIGS / "uncertain_site.yaml", CONFIGS / "site.yaml"
PHI, BETA, SPEED = "friction_angle_deg", "subgrade_reaction_MN_m3", "impact_speed_m_s"


def test_values_are_the_quantiles_of_each_distribution() -> None:
    taken = at_values(load(SITE))
    spread = np.log1p(0.4**2)
    assert taken.constants[PHI] == pytest.approx(stats.norm(38, 3).ppf(0.05), rel=1e-9)
    assert taken.constants[BETA] == pytest.approx(
        stats.lognorm(np.sqrt(spread), scale=60 * np.exp(-spread / 2)).ppf(0.05), rel=1e-6
    )
    assert taken.constants[SPEED] == pytest.approx(stats.uniform(12.5, 50 / 3.6 - 12.5).ppf(0.95), rel=1e-9)
    assert taken.taken_at == {
        "soil_density_kg_m3": "p5 low",
        PHI: "p5 low",
        BETA: "p5 low",
        SPEED: "p5 high",
    }
    assert not taken.distributions


@pytest.mark.parametrize(("at", "share"), [("p10", 0.10), ("p2.5", 0.025), ("p50", 0.5)])
def test_another_quantile(at: str, share: float) -> None:
    assert at_values(load(SITE), at).constants[PHI] == pytest.approx(stats.norm(38, 3).ppf(share), rel=1e-6)


def test_the_means_are_those_of_the_file() -> None:
    sweep = load(SITE)
    taken = at_values(sweep, "mean")
    assert taken.constants == sweep.constants
    assert set(taken.taken_at.values()) == {"mean"}


@pytest.mark.parametrize(
    ("entry", "name", "side"),
    [
        ("vehicle.mass={mean: 15000 lb, cov: 5 %}", "vehicle_mass_kg", "high"),
        ("boulder.density={mean: 2600 kg/m^3, cov: 3 %}", "boulder_density_kg_m3", "low"),
        ("boulder.width={mean: 1.68 m, sd: 5 cm}", "boulder_width_m", "low"),
    ],
)
def test_the_unfavourable_side_is_found_by_simulation(entry: str, name: str, side: str) -> None:
    assert at_values(load(SITE, [entry])).taken_at[name] == f"p5 {side}"


@pytest.mark.parametrize("depth", [2.4, 2.6], ids=["passes", "hardly overlaps the bumper"])
def test_a_worse_value_is_never_the_better_one(depth: float) -> None:
    """Each input alone, moved to the other side, turns the boulder less, also where no verdict has a margin."""
    sweep = load(SITE, [f"site.embedment_depth={depth} m"])
    taken = at_values(sweep, "p30")
    rotation = boulder_sweep.simulate(taken).summary()["max_rotation_deg"]
    mirrored = at_values(sweep, "mean")
    for name in sweep.distributions:
        other = 2 * mirrored.constants[name] - taken.constants[name]
        moved = dataclasses.replace(taken, constants=taken.constants | {name: other})
        assert boulder_sweep.simulate(moved).summary()["max_rotation_deg"] < rotation


def test_axes_of_means_and_correlated_inputs() -> None:
    """Every mean of an axis has its own quantile; a correlation has no part in those of single inputs."""
    alone = ["soil.friction_angle={mean: [36, 40] deg, sd: 2 deg}", "soil.correlation=0.3"]
    taken = at_values(load(SITE, alone))
    (axis,) = taken.axes
    assert axis.values == pytest.approx(np.array([36, 40]) - 2 * 1.6448536, rel=1e-7)
    assert taken.constants[BETA] == at_values(load(SITE)).constants[BETA]


def test_named_soils_have_their_own(tmp_path: Path) -> None:
    text = (
        "name: soils\nboulder: {length: 1.65 m, width: 1.68 m, height: 3.2 m, density: 2600 kg/m^3}\n"
        "site: {embedment_depth: 2.2 m}\n"
        "soil:\n"
        "  - {name: sand, density: 1860, subgrade_reaction: 60 MN/m^3, friction_angle: {mean: 38 deg, sd: 3 deg}}\n"
        "  - {name: gravel, density: 1900 kg/m^3, friction_angle: 42 deg, subgrade_reaction: 80 MN/m^3}\n"
        "vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}\n"
    )
    (tmp_path / "soils.yaml").write_text(text)
    taken = at_values(load(tmp_path / "soils.yaml"))
    assert taken.axes[0].sets[PHI] == pytest.approx([stats.norm(38, 3).ppf(0.05), 42.0])


def test_what_was_taken_is_said_and_recorded() -> None:
    taken = at_values(load(SITE))
    assert "soil.friction_angle 33.07 deg (p5 low)" in words_of(taken)
    assert taken.resolved()["taken_at"][PHI] == "p5 low"
    assert taken.resolved()["inputs"][PHI] == taken.constants[PHI]


def test_a_sweep_without_distributions_stays_as_it_is() -> None:
    sweep = load(SOILS)
    assert at_values(sweep) is sweep
    assert "taken_at" not in sweep.resolved()
    with pytest.raises(QuestionError, match="no input has a distribution"):
        at_values(sweep, "p5")


@pytest.mark.parametrize("at", ["p0", "p51", "5", "p", "median", "p100", "-p5"])
def test_other_words_are_refused(at: str) -> None:
    with pytest.raises(QuestionError, match="is not mean, p5 or another quantile"):
        at_values(load(SITE), at)


def test_the_python_functions_take_the_unfavourable_values(tmp_path: Path) -> None:
    sweep = load(SITE)
    boulder_sweep.run(sweep, tmp_path / "table")
    assert boulder_sweep.read(tmp_path / "table")[PHI][0] == at_values(sweep).constants[PHI]
    with pytest.raises(StoreError, match="settings"):
        boulder_sweep.run(at_values(sweep, "mean"), tmp_path / "table", resume=True)
    assert boulder_sweep.need(sweep).frame.equals(boulder_sweep.need(at_values(sweep)).frame)
    assert not boulder_sweep.need(sweep).frame.equals(boulder_sweep.need(at_values(sweep, "mean")).frame)
