"""A row computed again from the result alone."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

import boulder_sweep
from boulder_sweep.cli.main import execute
from boulder_sweep.cli.simulate import why_lines
from boulder_sweep.errors import OlderRulesWarning
from boulder_sweep.impact.explanation import explain
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
    out = tmp_path_factory.mktemp("explain") / "narrow.sweep"
    boulder_sweep.run(load(CONFIGS / "m30_sizing.yaml", NARROW), out)
    return out


def test_every_row_gets_the_same_bits(result: Path) -> None:
    table = boulder_sweep.read(result)
    assert set(table.verdict.astype(str)) == {"pass", "fail", "error"}
    for design_id, verdict in zip(table.design_id, table.verdict, strict=True):
        found = explain(result, int(design_id))
        assert found.unequal == ()
        assert found.changed == ()
        assert (found.trajectory is None) == (verdict == "error")


def test_the_time_history_is_that_of_the_row(result: Path) -> None:
    table = boulder_sweep.read(result)
    passing = int(table.design_id[table.verdict == "pass"].iloc[0])
    found = explain(result, passing)
    assert found.trajectory is not None
    assert found.trajectory.summary()["max_rotation_deg"] == pytest.approx(found.stored["max_rotation_deg"], abs=1e-9)


@pytest.mark.parametrize("readings", ["as_printed", "{preset: corrected, inertia: printed}"])
@pytest.mark.parametrize("solver", ["solver.accuracy=fast", "solver.step=3 ms"])
def test_readings_and_steps_are_those_of_the_result(tmp_path: Path, readings: str, solver: str) -> None:
    changes = [*NARROW, f"model.readings={readings}", solver]
    boulder_sweep.run(load(CONFIGS / "m30_sizing.yaml", changes), tmp_path / "out")
    assert explain(tmp_path / "out", 9).unequal == ()


def test_a_flag_of_another_version_is_shown_by_its_name(result: Path) -> None:
    table = boulder_sweep.read(result)
    found = explain(result, int(table.design_id[table.verdict == "pass"].iloc[0]))
    other = dataclasses.replace(found, stored=found.stored | {"validity": "odd;rotation"})
    assert why_lines(other)[-2:] == ["    odd", "    rotation: more rotation than in the test that passed"]


def test_a_change_of_the_kernels_is_told(result: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boulder_sweep.store.provenance.kernels_sha256", lambda: "0" * 64)
    with pytest.warns(OlderRulesWarning):
        assert any(line.startswith("kernels_sha256") for line in explain(result, 0).changed)


def test_a_row_that_does_not_exist(result: Path) -> None:
    with pytest.raises(IndexError, match="numbered from 0"):
        explain(result, 10**6)


def test_the_command(result: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert execute(["explain", str(result), "9", "--trajectory", str(tmp_path / "t.parquet")]) == 0
    assert "the same to the last bit" in capsys.readouterr().out
    assert (tmp_path / "t.parquet").exists()
    assert execute(["explain", str(result), "9", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["same_bits"] is True
    assert execute(["explain", str(result), "999"]) == 2
    assert execute(["explain", str(tmp_path), "0"]) == 2


def test_plain_data_in_us_units_names_what_differs_in_them(result: Path) -> None:
    table = boulder_sweep.read(result)
    found = explain(result, int(table.design_id[table.verdict == "pass"].iloc[0]))
    stored, length = found.stored["max_displacement_m"], found.inputs["boulder_length_m"]
    assert length is not None
    differs = dataclasses.replace(found, recomputed=found.recomputed | {"max_displacement_m": 2.0 * stored})
    data = differs.as_dict("us")
    assert data["unequal"] == {"max_displacement_ft": [stored / 0.3048, 2.0 * stored / 0.3048]}
    assert data["inputs"]["boulder_length_ft"] == length / 0.3048
    assert differs.as_dict()["unequal"] == {"max_displacement_m": [stored, 2.0 * stored]}
    assert differs.as_dict()["inputs"] == found.inputs
