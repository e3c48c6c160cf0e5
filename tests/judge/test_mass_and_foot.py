"""Boulders weighed, on no flat foot, or no boxes, and designs whose truth others have told: from file to verdict."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import boulder_sweep
from boulder_kernels import Control, corrected, simulate_table
from boulder_sweep.columns import SHAPES
from boulder_sweep.designs import block_of
from boulder_sweep.errors import QuestionError
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import DESIGNS_A_PIECE, accuracy_of, control_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import PASS
from boulder_sweep.judge.robustness import DECISIVE, ROBUST, SENSITIVE, stands
from boulder_sweep.settings import Sweep, load, load_text
from boulder_sweep.settings.loader import SECOND_OPINION
from boulder_sweep.settings.model import Ground, tapered
from boulder_sweep.settings.problems import SettingsError
from boulder_sweep.soils import SLICES, coefficients, with_soil
from tests.answers.designs import bare_need
from tests.judge.plain import plain_designs

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
    for asked in ("height", "boulder.density"):
        with pytest.raises(QuestionError, match=r"while the file has boulder\.mass"):
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


RWG = Path(__file__).parents[2] / "configs" / "rwg.yaml"
LEANING = (
    "[{height: 0, width: 1.5, length: 1.5}, {height: 1.6, width: 1.8, near: 0.9, far: 0.8}, "
    "{height: 3.44, width: 1.5, near: 0.8, far: 0.5}]"
)


def shaped(tmp_path: Path, entry: str, *more: str) -> Sweep:
    """The granite of the passing test with an entry in place of its sides, or beside them."""
    text = RWG.read_text(encoding="utf-8")
    if entry.startswith("profile"):
        lines = [line for line in text.splitlines() if not line.strip().startswith(("length:", "width:", "height:"))]
        text = "\n".join(lines)
    text = text.replace("boulder:\n", f"boulder:\n  {entry}\n", 1)
    (tmp_path / "stone.yaml").write_text(text, encoding="utf-8")
    return load(tmp_path / "stone.yaml", more)


def table_of(sweep: Sweep, out: Path) -> pd.DataFrame:
    boulder_sweep.run(sweep, out)
    return boulder_sweep.read(out)


@pytest.mark.parametrize(
    "entry",
    [
        "taper: 1",
        "profile: [{height: 0, width: 1.68, length: 1.65}, {height: 3.44, width: 1.68, near: 0.825, far: 0.825}]",
    ],
)
def test_a_box_by_another_name_has_the_bits_of_a_box(tmp_path, entry):
    box, other = table_of(load(RWG), tmp_path / "box"), table_of(shaped(tmp_path, entry), tmp_path / "other")
    pd.testing.assert_frame_equal(other, box, check_exact=True)


@pytest.mark.parametrize(
    ("entry", "angles", "side_by_side"),
    [
        ("taper: 0.8", 2, True),
        (f"profile: {LEANING}", 2 * DESIGNS_A_PIECE - 1, False),
        (f"profile: {LEANING}", 2 * DESIGNS_A_PIECE, True),
    ],
)
def test_lanes_are_for_many_designs_of_several_pieces(tmp_path, entry, angles, side_by_side):
    sweep = shaped(tmp_path, entry, f"soil.friction_angle={{from: 36 deg, to: 44 deg, count: {angles}}}")
    assert control_of(sweep, accuracy_of(sweep)).side_by_side == side_by_side


@pytest.mark.parametrize("entry", ["taper: 0.8", "taper: 1.25", f"profile: {LEANING}"])
@pytest.mark.parametrize(
    "more",
    [(), ("soil.water_table=1 m", "vehicle.speed=12 m/s"), ("model.soil={elements: 400}",)],
    ids=["dry", "wet", "sums"],
)
def test_a_row_is_what_one_impact_gives(tmp_path, entry, more):
    sweep = shaped(tmp_path, entry, *more)
    row = table_of(sweep, tmp_path / "table").iloc[0]
    one = boulder_sweep.simulate(sweep).summary()
    assert row.verdict == one["verdict"] == "pass"
    assert row.solidity == pytest.approx(sweep.model.shape.filled)
    assert row.max_rotation_deg == pytest.approx(one["max_rotation_deg"], abs=row.rotation_error_deg + 1e-9)
    assert row.robustness in ("robust", "sensitive")
    assert recompute(tmp_path / "table", 0).unequal == ()


def test_a_wider_foot_holds_better_than_a_wider_top(tmp_path):
    """With the same volume: tops and feet of 0.8 and 1.25 of one another within the same box."""
    down, up = (table_of(shaped(tmp_path, f"taper: {t}"), tmp_path / str(t)).max_rotation_deg[0] for t in (0.8, 1.25))
    assert down < up


def test_the_law_that_depends_on_the_width_takes_the_local_one():
    """Slice by slice, pressures have the ratio that boxes as wide as the taper there would have."""
    designs, shape = plain_designs().table, tapered(0.5)
    found = with_soil(designs, "width_capped", Ground(), shape=shape).layers[0]
    assert len(found) == SLICES
    heights = (designs.d[0] - (np.arange(SLICES) + 0.5) / SLICES * designs.d[0]) / designs.H[0]
    widths = designs.W[0] * np.interp(heights, [0.0, 1.0], [1.0, 0.5])
    known = np.array([coefficients(designs._replace(W=np.array([width])), "width_capped")[0] for width in widths])
    assert known[0] > known[-1] + 0.1
    np.testing.assert_allclose(found[:, 5] / found[0, 5], known / known[0], rtol=1e-12)


def test_slices_of_that_law_converge(monkeypatch):
    designs, control = plain_designs().table, Control(2e-3, 1.0, 1.0, 0, False)
    ground = Ground()

    def rotation(slices: int) -> float:
        monkeypatch.setattr("boulder_sweep.soils.SLICES", slices)
        table = with_soil(designs, "width_capped", ground, shape=tapered(0.6))
        return float(simulate_table(table, corrected(), control).theta_max[0])

    assert rotation(16) == pytest.approx(rotation(256), rel=1e-3)


def test_outlines_are_shares_of_the_sides():
    table = plain_designs().table
    outline = with_soil(table, "kp_squared", Ground(), shape=tapered(0.5)).outlines[0]
    L, W, H = table.L[0], table.W[0], table.H[0]
    np.testing.assert_allclose(outline, [[0.0, W, L / 2, L / 2], [H, W / 2, L / 4, L / 4]])


def test_the_vehicle_strikes_the_near_face_of_an_outline_at_the_impact_height():
    designs = plain_designs()
    table = designs.table
    shaped = designs._replace(table=with_soil(table, "kp_squared", Ground(), shape=tapered(0.5)))
    assert shaped.length == pytest.approx(table.L * (1.0 - (table.d + table.e) / table.H / 4.0))
    assert shaped.narrowest == pytest.approx(0.5 * table.W)


def test_where_a_boulder_is_narrowest_does_not_depend_on_its_neighbours():
    sweep = sweep_of(f"mass: [{0.6 * 2600 * BOX}, {2600 * BOX}] kg, density: 2600 kg/m^3")
    designs = designs_of(sweep.block(0, 2), model=sweep.model)
    assert designs.taped.tolist() == [True, False]
    assert designs.narrowest[0] < 1.5 < designs.narrowest[1] == 1.68


def test_a_small_foot_is_never_a_pass(tmp_path):
    row = table_of(shaped(tmp_path, "taper: 2.2"), tmp_path / "table").iloc[0]
    assert (row.verdict, row.reason) in {("undecided", "foot"), ("fail", "overturns")}
    row = table_of(shaped(tmp_path, "taper: 2.2", "vehicle.speed=20 mph"), tmp_path / "slow").iloc[0]
    assert (row.verdict, row.reason) == ("undecided", "foot")


def test_a_weighed_boulder_with_a_profile_is_decided(tmp_path):
    """A column holds its mass over the mass of its box, and no box has to stand for it."""
    sweep = shaped(tmp_path, "taper: 0.8\n  mass: 18 t", "vehicle.speed=25 mph")
    density = designs_of(sweep.block(0, 1), model=sweep.model).table.rho_b  # of what is simulated
    assert density * 1.65 * 1.68 * 3.44 * sweep.model.shape.filled == pytest.approx(18000)
    row = table_of(sweep, tmp_path / "table").iloc[0]
    assert row.solidity == pytest.approx(18000 / (2596 * 1.65 * 1.68 * 3.44), rel=1e-9)
    assert row.verdict == "pass"


def test_answers_take_profiles_and_give_their_mass(tmp_path):
    sweep = shaped(tmp_path, "taper: 0.8")
    answer = bare_need(sweep).frame.iloc[0]
    assert answer.boulder_mass_kg == pytest.approx(2596 * 1.65 * 1.68 * 3.44 * tapered(0.8).filled)
    box = bare_need(load(RWG)).frame.iloc[0]
    assert answer.least_embedment_depth_m > box.least_embedment_depth_m
    assert bare_need(sweep, robust=True).frame.iloc[0].least_embedment_depth_m > answer.least_embedment_depth_m


def test_a_taped_boulder_is_robust_if_all_of_its_shapes_stand():
    """Simulated one by one: the last that passes does not make up for the first."""
    masses = [round(share * 2600 * BOX) for share in np.linspace(0.6, 0.94, 12)]
    sweep = sweep_of(f"mass: {masses} kg, density: 2600 kg/m^3")
    evaluation = evaluation_of(sweep, accuracy_of(sweep)).asked()
    judged = evaluation(sweep.block(0, len(masses)))
    passing = np.flatnonzero(judged.verdict == PASS)
    designs = designs_of(sweep.block(0, len(masses)), model=sweep.model).rows(passing)
    assert designs.taped.all()
    model, limits = sweep.model, evaluation.limits
    each = [stands(designs.in_shape(shape, model), DECISIVE, model, limits, 10.0) for shape in range(len(SHAPES))]
    assert np.array_equal(stands(designs, DECISIVE, model, limits, 10.0), np.logical_and.reduce(each))
    expected = np.where(np.logical_and.reduce(each), ROBUST, SENSITIVE)
    assert np.array_equal(judged["robustness"][passing], expected)
    assert set(expected) == {ROBUST, SENSITIVE}
    assert not np.array_equal(each[0], each[2])
    assert np.array_equal(evaluation.stand(sweep.block(0, len(masses)))[passing], expected == ROBUST)


KNOWN = Path(__file__).parent / "known"


@pytest.fixture
def table(tmp_path: Path):
    """Return a function that runs a file of known designs, or a list of them, and returns its rows."""

    def table(name: str, *overrides: str, accuracy: str = "balanced") -> pd.DataFrame:
        file = KNOWN / name
        if file.suffix == ".csv":
            shutil.copy(file, tmp_path)
            (tmp_path / "list.yaml").write_text(f"table: {name}\nsolver: {{accuracy: {accuracy}}}\n")
            file = tmp_path / "list.yaml"
        sweep = boulder_sweep.load(file, overrides)
        boulder_sweep.run(sweep, tmp_path / "table", overwrite=True)
        return boulder_sweep.read(tmp_path / "table")

    return table


def test_what_nobody_has_tested_is_flagged_and_not_robust(table) -> None:
    rows = table("beyond_the_study.csv", SECOND_OPINION).set_index("case_name")
    flags = rows.validity.str.split(";")
    assert len(rows) == 7
    for name, found in flags.items():
        assert ("soil" if name.startswith(("phi", "K_eps")) else "vehicle") in found, name
    assert not rows.robustness.isin(["robust"]).any()
    assert set(rows.verdict) <= {"pass", "undecided", "fail"}


@pytest.mark.parametrize(("accuracy", "within_deg"), [("balanced", 1e-3), ("fine", 2e-4)])
def test_a_boulder_that_the_blow_just_lifts(table, accuracy: str, within_deg: float) -> None:
    by = f"solver.accuracy={accuracy}"
    row = table("barely_lifted.yaml", by).iloc[0]
    assert row.max_rotation_deg == pytest.approx(0.11689, abs=within_deg)
    assert (
        simulate(boulder_sweep.load(KNOWN / "barely_lifted.yaml", [by])).row["max_rotation_deg"] == row.max_rotation_deg
    )
