"""A row computed again from the result alone."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import boulder_sweep
from boulder_sweep.errors import OlderRulesWarning
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.settings import load

CONFIGS = Path(__file__).parents[2] / "configs"
NARROW = [
    "boulder.width=1.9 m",
    "boulder.height={from: 1.8 m, to: 3.6 m, step: 0.6 m}",
    "site.embedment_ratio=[0.5, 0.7, 1.0]",
    "soil.friction_angle=40 deg",
    "soil.subgrade_reaction=90 MN/m^3",
]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("again") / "narrow.sweep"
    boulder_sweep.run(load(CONFIGS / "m30_sizing.yaml", NARROW), out)
    return out


def test_every_row_gets_the_same_bits(result: Path) -> None:
    table = boulder_sweep.read(result)
    assert set(table.verdict.astype(str)) == {"pass", "fail", "error"}
    for design_id, verdict in zip(table.design_id, table.verdict, strict=True):
        found = recompute(result, int(design_id))
        assert found.unequal == ()
        assert found.changed == ()
        assert (found.trajectory is None) == (verdict == "error")


def test_the_time_history_is_that_of_the_row(result: Path) -> None:
    table = boulder_sweep.read(result)
    passing = int(table.design_id[table.verdict == "pass"].iloc[0])
    found = recompute(result, passing)
    assert found.trajectory is not None
    assert found.trajectory.summary()["max_rotation_deg"] == pytest.approx(found.stored["max_rotation_deg"], abs=1e-9)


@pytest.mark.parametrize("readings", ["as_printed", "{preset: corrected, inertia: printed}"])
@pytest.mark.parametrize("solver", ["solver.accuracy=fast", "solver.step=3 ms"])
def test_readings_and_steps_are_those_of_the_result(tmp_path: Path, readings: str, solver: str) -> None:
    changes = [*NARROW, f"model.readings={readings}", solver]
    boulder_sweep.run(load(CONFIGS / "m30_sizing.yaml", changes), tmp_path / "out")
    assert recompute(tmp_path / "out", 9).unequal == ()


def test_a_change_of_the_kernels_is_told(result: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boulder_sweep.store.provenance.kernels_sha256", lambda: "0" * 64)
    with pytest.warns(OlderRulesWarning):
        assert any(line.startswith("kernels_sha256") for line in recompute(result, 0).changed)


def test_a_row_that_does_not_exist(result: Path) -> None:
    with pytest.raises(IndexError, match="numbered from 0"):
        recompute(result, 10**6)


def test_plain_data_in_us_units_names_what_differs_in_them(result: Path) -> None:
    table = boulder_sweep.read(result)
    found = recompute(result, int(table.design_id[table.verdict == "pass"].iloc[0]))
    stored = found.stored["max_displacement_m"]
    differs = dataclasses.replace(found, recomputed=found.recomputed | {"max_displacement_m": 2.0 * stored})
    in_feet = pytest.approx([stored / 0.3048, 2.0 * stored / 0.3048], rel=1e-13)
    assert differs.compared("us")["unequal"] == {"max_displacement_ft": in_feet}
    assert differs.compared()["unequal"] == {"max_displacement_m": [stored, 2.0 * stored]}
