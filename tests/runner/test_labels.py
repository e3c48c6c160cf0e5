"""Text columns from the settings file, names of soils and IDs, in the result."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from boulder_sweep.runner.run import run
from boulder_sweep.settings import Sweep, load
from boulder_sweep.store import folder, read
from tests.runner.grids import plausible

SOILS = """\
name: soils
boulder: {length: 1.65 m, width: 1.68 m, height: {from: 1.6 m, to: 3.4 m, count: 10}, density: 2596 kg/m^3}
site: {embedment_ratio: 0.6}
soil:
  - {name: loose, density: 1700, friction_angle: 32 deg, subgrade_reaction: 10}
  - {name: dense, density: 1900, friction_angle: 42 deg, subgrade_reaction: 80}
vehicle: {mass: 6800 kg, speed: 13.4 m/s, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
solver: {step: 4 ms}
"""


@pytest.fixture
def soils(tmp_path: Path) -> Sweep:
    (tmp_path / "soils.yaml").write_text(SOILS)
    return load(tmp_path / "soils.yaml")


@pytest.fixture(autouse=True)
def _small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder, "FEWEST_ROWS", 5)


def test_the_name_of_the_soil_is_a_column(soils: Sweep, tmp_path: Path) -> None:
    out = tmp_path / "soils.sweep"
    run(soils, out, simulate=plausible, jobs=1)
    table = read(out)
    assert table.soil.tolist() == ["loose", "dense"] * 10
    assert isinstance(table.soil.dtype, pd.CategoricalDtype)
    assert (table.soil == "dense").equals(table.friction_angle_deg == 42.0)
    assert table.attrs["units"]["soil"] == ""
    assert "settings file" in table.attrs["meanings"]["soil"]
    plain = pd.read_parquet(out)
    assert plain.sort_values("design_id").soil.tolist() == table.soil.tolist()


def test_ids_of_a_table_are_carried_into_the_result(tmp_path: Path) -> None:
    lines = "".join(f"B-{k:03d},{5 + 0.1 * k:.1f}\n" for k in range(30))
    (tmp_path / "designs.csv").write_text("boulder_id,boulder_height_ft\n" + lines)
    start, stop = SOILS.index("soil:"), SOILS.index("vehicle:")
    text = SOILS[:start] + "soil: {density: 1860, friction_angle: 40, subgrade_reaction: 60}\n" + SOILS[stop:]
    text = text.replace(", height: {from: 1.6 m, to: 3.4 m, count: 10}", "") + "table: designs.csv\n"
    (tmp_path / "table.yaml").write_text(text)
    sweep = load(tmp_path / "table.yaml")
    run(sweep, tmp_path / "table.sweep", simulate=plausible, jobs=1)
    table = read(tmp_path / "table.sweep")
    assert table.boulder_id.tolist() == [f"B-{k:03d}" for k in range(30)]
    assert table.boulder_height_m.tolist() == pytest.approx([(5 + 0.1 * k) * 0.3048 for k in range(30)])
