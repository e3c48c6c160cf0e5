"""Boulders that were weighed, and boulders that do not stand on a flat foot: from the file to the verdict."""

from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.designs import block_of
from boulder_sweep.errors import QuestionError
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.settings import Sweep, load_text
from boulder_sweep.settings.problems import SettingsError
from tests.answers.designs import bare_need

BOX = 1.65 * 1.68 * 3.44
FILE = """boulder: {{length: 1.65 m, width: 1.68 m, height: 3.44 m, {boulder}}}
site: {{embedment_depth: 2.3 m}}
soil: {{density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 95 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""


def sweep_of(boulder: str) -> Sweep:
    return load_text(FILE.format(boulder=boulder), Path("grid.yaml"))


def rows_of(boulder: str) -> list[dict]:
    sweep = sweep_of(boulder)
    judged = evaluation_of(sweep, accuracy_of(sweep)).asked()(sweep.block(0, sweep.n_designs))
    return [judged.row(place) for place in range(len(judged))]


def test_a_weighed_boulder_moves_as_the_box_of_its_mass():
    weighed, box = rows_of("mass: 24 t, density: 2600 kg/m^3")[0], rows_of(f"density: {24000 / BOX!r} kg/m^3")[0]
    assert weighed["max_rotation_deg"] == pytest.approx(box["max_rotation_deg"], rel=1e-12)
    assert weighed["solidity"] == pytest.approx(24000 / (2600 * BOX), rel=1e-12)
    assert box["solidity"] == 1.0


def test_a_boulder_that_no_shape_stands_for_is_undecided_and_one_too_heavy_is_no_boulder():
    masses = np.array([0.3, 0.3999, 0.9501, 1.0, 1.1499, 1.1501]) * 2600 * BOX
    rows = rows_of(f"mass: {masses.tolist()} kg, density: 2600 kg/m^3")
    assert [(row["verdict"], row["reason"]) for row in rows[:5]] == [("undecided", "shape")] * 2 + [("pass", "")] * 3
    assert rows[5]["verdict"] == "error"
    assert rows[5]["reason"].startswith("boulder is heavier")
    assert rows[0]["margin"] is None
    assert rows[5]["solidity"] is None


def test_where_the_truck_passes_over_or_the_boulder_overturns_its_shape_does_not_matter():
    shallow = FILE.format(boulder="mass: 12 t").replace("2.3 m", "[0.6 m, 3.2 m]")
    sweep = load_text(shallow, Path("grid.yaml"))
    judged = evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, 2))
    assert [judged.row(k)["reason"] for k in range(2)] == ["overturns", "no_contact"]


def test_without_the_density_of_the_rock_no_pass_is_robust():
    known, assumed = rows_of("mass: 25 t, density: 2650 kg/m^3")[0], rows_of("mass: 25 t")[0]
    assert (known["verdict"], known["robustness"]) == ("pass", "robust")
    assert (assumed["verdict"], assumed["robustness"], assumed["stands_under"]) == ("pass", "open", None)
    assert assumed["max_rotation_deg"] == known["max_rotation_deg"]
    sweep = sweep_of("mass: 25 t")
    assert sweep.constants["boulder_density_kg_m3"] == 2650.0
    assert sweep.resolved()["model"]["rock_assumed"] is True
    assert "rock_assumed" not in sweep_of("mass: 25 t, density: 2650 kg/m^3").resolved()["model"]
    assert any("2650 kg/m^3, which is assumed" in note.message for note in sweep.notes)
    with pytest.raises(QuestionError, match="rock of given density"):
        bare_need(sweep, robust=True)


def test_a_rounded_foot_is_never_a_pass():
    flat, rounded = rows_of("density: 2600 kg/m^3, foot: flat")[0], rows_of("density: 2600 kg/m^3, foot: rounded")[0]
    assert flat["verdict"] == "pass"
    assert (rounded["verdict"], rounded["reason"], rounded["margin"]) == ("undecided", "foot", None)
    assert rounded["max_rotation_deg"] == flat["max_rotation_deg"]
    assert sweep_of("density: 2600 kg/m^3").resolved()["model"]["foot"] == "flat"


@pytest.mark.parametrize(
    ("boulder", "expected"),
    [
        ("mass: 30 t", r"grid.yaml:1:58: boulder.mass: 30000 kg is 1.19 times .* 25269.6 kg .* 2650 kg/m\^3 assumed"),
        ("mass: 29 t, density: 2600 kg/m^3", "1.17 times"),
        ("mass: [30 t, 31 t]", "30000 kg is 1.19 times"),
        ("foot: round, mass: 25 t", "grid.yaml:1:64: boulder.foot: .*flat, rounded"),
        ("foot: flat", "boulder.density: is required and missing"),
    ],
)
def test_mistakes_are_reported_where_they_stand(boulder, expected):
    with pytest.raises(SettingsError, match=expected):
        sweep_of(boulder)


def test_a_search_for_another_boulder_is_refused_beside_a_mass():
    sweep = sweep_of("mass: 25 t, density: 2600 kg/m^3")
    for asked in ("mass", "height", "boulder.density"):
        with pytest.raises(QuestionError, match=r"beside boulder\.mass"):
            bare_need(sweep, least=asked)
    found = bare_need(sweep, least="embedment_depth").frame
    assert found.boulder_mass_kg[0] == 25000.0
    assert found.columns.tolist().count("boulder_mass_kg") == 1
    assert 0.0 < found.least_embedment_depth_m[0] < 2.3


def test_one_design_over_time_and_a_row_of_a_table_agree():
    sweep = sweep_of("mass: 24 t")
    history = simulate(sweep)
    row = rows_of("mass: 24 t")[0]
    assert history.summary()["solidity"] == row["solidity"]
    again = simulate({**history.inputs})
    assert again.summary()["max_rotation_deg"] == history.summary()["max_rotation_deg"]
    passing = {**history.inputs, "boulder_mass_kg": 25000.0}
    without = {name: value for name, value in passing.items() if name != "boulder_density_kg_m3"}
    assert (simulate(passing).summary()["robustness"], simulate(without).summary()["robustness"]) == ("robust", "open")


def test_a_list_of_designs_is_refused_row_by_row():
    given = {name: np.array([value, value]) for name, value in sweep_of("density: 2600 kg/m^3").constants.items()}
    block = block_of(given | {"boulder_mass_kg": np.array([24000.0, 30000.0])})
    assert [bool(block.reasons[k]) for k in range(2)] == [False, True]
    assert designs_of(block).table.rho_b[0] == 24000.0 / (1.65 * 1.68 * 3.44)


def test_explaining_a_row_gives_its_bits(tmp_path):
    boulder_sweep.run(sweep_of("mass: [18 t, 24 t]"), tmp_path / "mass.sweep", jobs=1)
    for number in range(2):
        assert not recompute(tmp_path / "mass.sweep", number).unequal
