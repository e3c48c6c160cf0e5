"""Uncertain inputs where one value is needed: rows are judged at both ends and at the mean, and the worst counts."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import boulder_sweep
from boulder_sweep import at_values, load
from boulder_sweep.errors import QuestionError
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.judge.quantiles import words_of
from boulder_sweep.store.failures import StoreError
from tests.answers.designs import bare_need

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
    assert taken.taken_at == {"soil_density_kg_m3": "p5 low", PHI: "p5 low", BETA: "p5 low", SPEED: "p5 high"}
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
        ("vehicle.bumper_height={mean: 0.5 m, sd: 2 cm}", "bumper_height_m", "high"),
        ("soil.strain_rate_factor={mean: 1.1, sd: 0.03}", "strain_rate_factor", "low"),
    ],
)
def test_the_unfavourable_side_is_a_fixed_table(entry: str, name: str, side: str) -> None:
    taken = at_values(load(SITE, [entry]))
    other = {"low": "high", "high": "low"}[side]
    assert [one.taken_at[name] for one in (taken, *taken.cases)] == [f"p5 {side}", "mean", f"p5 {other}"]
    ends = [one.constants[name] for one in (taken, *taken.cases)]
    assert (sorted(ends) if side == "low" else sorted(ends, reverse=True)) == ends


def test_an_input_without_a_sense_is_taken_at_both_ends_in_turn() -> None:
    damper, spring = "vehicle_damper_N_s_m", "vehicle_spring_N_m"
    one = at_values(load(SITE, ["vehicle.damper={mean: 138.91 kN*s/m, cov: 10 %}"]))
    ends = [(case.taken_at[PHI], case.taken_at[damper]) for case in (one, *one.cases)]
    weak, strong = ([(f"p5 {side}", f"p5 {end}") for end in ("low", "high")] for side in ("low", "high"))
    assert ends == [weak[0], ("mean", "mean"), weak[1], *strong]
    both = at_values(
        load(
            SITE,
            [
                f"vehicle.{name}={{mean: {mean}, cov: 10 %}}"
                for name, mean in (("damper", "138.91 kN*s/m"), ("spring", "3103.3 kN/m"))
            ],
        )
    )
    assert len(both.cases) == 1 + 2 * 4 - 1
    assert len({(case.taken_at[damper], case.taken_at[spring]) for case in (both, *both.cases)}) == 5


def test_one_input_without_a_sense_alone() -> None:
    text = {"friction_angle": "38 deg", "density": "1860 kg/m^3", "subgrade_reaction": "60 MN/m^3"}
    entries = [f"soil.{name}={value}" for name, value in text.items()]
    entries += ["vehicle.speed=30 mph", "vehicle.damper={mean: 138.91 kN*s/m, cov: 10 %}"]
    taken = at_values(load(SITE, entries))
    assert [case.taken_at for case in taken.cases] == [
        {"vehicle_damper_N_s_m": "mean"},
        {"vehicle_damper_N_s_m": "p5 high"},
    ]


def rows(text: str, folder: Path, *, at: str | None = None) -> list[dict[str, Any]]:
    """Run a file; return its rows."""
    (folder / "site.yaml").write_text(text)
    sweep = load(folder / "site.yaml")
    boulder_sweep.run(sweep if at is None else at_values(sweep, at), folder / "table", overwrite=True)
    return boulder_sweep.read(folder / "table").to_dict("records")


BROAD = (
    "name: broad\nboulder: {length: 1.65 m, width: 1.2 m, height: 2.4 m, density: 2600 kg/m^3}\n"
    "site: {embedment_depth: 0.6 m}\n"
    "soil: {density: 1860 kg/m^3, friction_angle: {mean: 38 deg, sd: 3 deg}, subgrade_reaction: 60 MN/m^3}\n"
    "vehicle: {mass: 6804 kg, speed: 15 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}\n"
)
"""It passes in the weak soil, sliding, and overturns in the mean soil."""
WIDE = (
    "name: wide\nboulder: {length: 2.2 m, width: 2.4 m, height: 2.4 m, density: 2600 kg/m^3}\n"
    "site: {embedment_depth: 0.84 m}\n"
    "soil: {density: 1860 kg/m^3, friction_angle: {mean: 38 deg, sd: 3 deg}, subgrade_reaction: 60 MN/m^3}\n"
    "vehicle: {mass: 6804 kg, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}\n"
)
"""It passes in the weak soil and in the strong, and overturns between."""


@pytest.mark.parametrize("text", [BROAD, WIDE], ids=["fails at the mean", "passes at both ends"])
def test_a_design_that_overturns_in_the_mean_soil_is_no_pass(text: str, tmp_path: Path) -> None:
    (row,) = rows(text, tmp_path)
    assert (row["verdict"], row["reason"]) == ("fail", "overturns")
    assert "changes_side" in row["validity"].split(";")
    (mean,) = rows(text, tmp_path, at="mean")
    assert (mean["verdict"], mean["reason"]) == ("fail", "overturns")
    assert row["time_to_limit_s"] <= mean["time_to_limit_s"]
    assert "changes_side" not in mean["validity"].split(";")


def test_a_row_has_the_worst_of_its_cases(tmp_path: Path) -> None:
    """Over depths on both sides of the limit: against each case run alone, as a file of that soil."""
    grid = WIDE.replace("0.84 m", "{from: 0.7 m, to: 1.5 m, count: 17}")
    found = rows(grid, tmp_path)
    sweep = load(tmp_path / "site.yaml")
    taken = at_values(sweep)
    alone = []
    for case in (dataclasses.replace(taken, cases=()), *taken.cases):
        boulder_sweep.run(case, tmp_path / "case", overwrite=True)
        alone.append(boulder_sweep.read(tmp_path / "case").to_dict("records"))
    rank = {"fail": 0, "error": 1, "undecided": 2, "pass": 3}
    for row, *cases in zip(found, *alone, strict=True):
        verdicts = [case["verdict"] for case in cases]
        assert row["verdict"] == min(verdicts, key=rank.__getitem__)
        assert ("changes_side" in row["validity"]) == (len(set(verdicts)) > 1)
        if row["verdict"] == "pass":
            assert row["margin"] == min(case["margin"] for case in cases)
    assert {row["verdict"] for row in found} >= {"pass", "fail"}


def test_need_never_answers_a_depth_that_fails_in_one_of_the_soils(tmp_path: Path) -> None:
    (tmp_path / "site.yaml").write_text(WIDE)
    sweep = load(tmp_path / "site.yaml")
    taken = at_values(sweep)
    answers = [
        bare_need(case).frame["least_embedment_depth_m"][0]
        for case in (dataclasses.replace(taken, cases=()), *taken.cases)
    ]
    (answer,) = bare_need(sweep).frame["least_embedment_depth_m"]
    assert answer >= max(answers) - 1e-9


def test_axes_of_means_and_correlated_inputs() -> None:
    """Every mean of an axis has its own quantile; a correlation has no part in the quantiles of single inputs."""
    alone = ["soil.friction_angle={mean: [36, 40] deg, sd: 2 deg}", "soil.correlation=0.3"]
    taken = at_values(load(SITE, alone))
    (axis,) = taken.axes
    assert axis.values == pytest.approx(np.array([36, 40]) - 2 * 1.6448536, rel=1e-7)
    assert [case.axes[0].values.tolist() for case in taken.cases] == [
        [36.0, 40.0],
        pytest.approx([36 + 2 * 1.6448536, 40 + 2 * 1.6448536], rel=1e-7),
    ]
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
    assert [case[PHI] for case in taken.resolved()["judged_at"]] == [case.constants[PHI] for case in taken.cases]
    assert "the worst verdict" in words_of(taken)
    assert "the worst verdict" not in words_of(at_values(load(SITE), "mean"))


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
    assert bare_need(sweep).frame.equals(bare_need(at_values(sweep)).frame)
    assert not bare_need(sweep).frame.equals(bare_need(at_values(sweep, "mean")).frame)


@pytest.mark.parametrize(
    "site",
    ["{embedment_depth: {from: 0.7 m, to: 1.5 m, count: 5}}", "{embedment_ratio: {mean: [0.35, 0.7], sd: 0.02}}"],
)
def test_a_row_of_a_table_is_judged_again_in_all_its_cases(site: str, tmp_path: Path) -> None:
    text = WIDE.replace("{embedment_depth: 0.84 m}", site)
    assert len({row["verdict"] for row in rows(text, tmp_path)}) >= 2
    for number in range(load(tmp_path / "site.yaml").n_designs):
        assert recompute(tmp_path / "table", number).unequal == ()
