"""Boulders as taped and weighed: the shapes that stand for them, and that the worst of these decides a row."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import boulder_sweep
from boulder_kernels import DesignTable, simulate_table
from boulder_kernels.design import body_of_outline, design_at
from boulder_sweep.columns import SHAPES, VERDICTS
from boulder_sweep.designs import some
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import PLAIN_DESIGN, Evaluation, evaluation_of
from boulder_sweep.settings import Sweep, load_text
from boulder_sweep.settings.model import Ground, ProfilePoint, Shape
from boulder_sweep.settings.problems import SettingsError
from boulder_sweep.soils import with_shape, with_soil
from boulder_sweep.stones.taped import taped_profiles
from boulder_sweep.views.side_view import SideView
from tests.answers.designs import bare_need
from tests.outlines.oracle import Stone

BOX = 1.65 * 1.68 * 3.44
FILE = """boulder: {{length: 1.65 m, width: 1.68 m, height: 3.44 m, {boulder}}}
site: {{embedment_depth: {depth}}}
soil: {{density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 95 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""
FILLS = (0.4, 0.5, 0.58, 0.6, 0.75, 0.9, 0.9499)


def sweep_of(boulder: str, depth: str = "2.3 m") -> Sweep:
    return load_text(FILE.format(boulder=boulder, depth=depth), Path("yard.yaml"))


def taped(fills: list[float], depth: str = "2.3 m") -> Sweep:
    return sweep_of(f"mass: {[fill * 2600 * BOX for fill in fills]} kg, density: 2600 kg/m^3", depth)


def evaluation(sweep: Sweep) -> Evaluation:
    return evaluation_of(sweep, accuracy_of(sweep))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("fill", FILLS)
def test_a_shape_has_the_volume_of_the_stone_within_its_sizes_on_a_flat_foot(shape, fill):
    """Volume, sides and sections by quadrature, which shares nothing with the kernels."""
    L, W, H = 1.5, 1.9, 3.1
    height, width, near, far = (taped_profiles(shape, np.array([fill]))[0] * [H, W, L, L]).T
    stone = Stone(height, width, near, far)
    assert stone.integral(lambda z, near, far: near + far) == pytest.approx(fill * L * W * H, rel=1e-12)
    assert (height[0], height[-1]) == (0.0, H)
    plan = min(1.0, fill * 12 / 7)  # share of its rectangle that a section fills, by area
    assert width.max() / W == pytest.approx(plan**0.5, rel=1e-12)
    assert (near + far).max() / L == pytest.approx(plan**0.5, rel=1e-12)
    assert plan >= 0.6
    assert width[0] >= 0.5 * width.max() * (1 - 1e-12)
    ends = {"narrower_downwards": (-1, 0), "narrower_upwards": (0, -1), "barrel": (1, 0)}[shape]
    assert width[ends[0]] > width[ends[1]]
    assert near.tolist() == far.tolist()


@pytest.mark.parametrize("shape", SHAPES)
def test_the_kernels_weigh_a_shape_as_the_crane_does(shape):
    table = DesignTable(*(np.repeat(column, len(FILLS)) for column in PLAIN_DESIGN))
    shaped = with_shape(table, "kp_squared", Ground(), shape, np.array(FILLS))
    for row, fill in enumerate(FILLS):
        body = body_of_outline(design_at(shaped, row), shaped.outlines[row])
        assert body.m_b == pytest.approx(fill * 2600 * 1.5 * 1.5 * 3.0, rel=1e-12)


@pytest.mark.parametrize("law", ["kp_squared", "broms", "width_capped"])
@pytest.mark.parametrize("shape", SHAPES)
def test_many_stones_lie_in_their_soil_as_each_does_by_its_profile(law, shape):
    fills = np.array([0.8, 0.5, 0.8, 0.7])
    table = DesignTable(*(np.repeat(column, 4) for column in PLAIN_DESIGN))._replace(d=np.array([1.5, 1.6, 1.7, 1.8]))
    many = with_shape(table, law, Ground(), shape, fills)
    for row in range(4):
        alone = DesignTable(*(column[row : row + 1] for column in table))
        points = tuple(ProfilePoint(*point) for point in taped_profiles(shape, fills[row : row + 1])[0].tolist())
        one = with_soil(alone, law, Ground(), shape=Shape(points))
        for found, known in zip(many, one, strict=True):
            np.testing.assert_array_equal(found[row], known[0])


@pytest.mark.parametrize(("speed", "deciding"), [("30 mph", {0}), ("15 mph", {0, 1})])
def test_the_worst_of_the_shapes_decides_and_is_named(speed, deciding):
    """Against each shape simulated on its own; depths from too shallow to enough for all."""
    boulder = f"mass: {[fill * 2600 * BOX for fill in (0.5, 0.65, 0.8)]} kg, density: 2600 kg/m^3"
    text = FILE.format(boulder=boulder, depth="[0.9 m, 1.2 m, 1.4 m, 1.7 m, 1.9 m, 2.1 m, 2.3 m, 2.5 m]")
    sweep = load_text(text.replace("30 mph", speed), Path("yard.yaml"))
    judge, block = evaluation(sweep), sweep.block(0, sweep.n_designs)
    rows, designs = judge(block), judge.designs(block)
    one_by_one = replace(judge, control=judge.control._replace(side_by_side=False))
    judges = [judge, one_by_one, judge]  # of the barrel, which has two pieces
    each = [one.judged(designs.in_shape(shape, sweep.model)) for shape, one in enumerate(judges)]
    verdicts, shapes = set(), set()
    for place in range(len(rows)):
        row, alone = rows.row(place), [one.row(place) for one in each]
        fails = [one for one in alone if one["verdict"] == "fail"]
        known = fails[0] if fails else min(alone, key=lambda one: (one["verdict"] == "pass", one["margin"] or 0.0))
        assert row == known
        assert alone[SHAPES.index(row["shape"])] == row
        shapes.add(SHAPES.index(row["shape"]))
        verdicts.add((row["verdict"], tuple(one["verdict"] for one in alone)))
    assert shapes == deciding
    assert {"pass", "fail"} <= {verdict for verdict, _ in verdicts}
    assert any(len(set(alone)) > 1 for _, alone in verdicts)  # the shapes are not all alike


def test_judging_ends_at_the_first_shape_in_which_a_stone_fails():
    sweep, simulated = taped([0.7], "[1 m, 2.5 m]"), []

    def counted(table, readings, control):
        simulated.append(len(table.d))
        return simulate_table(table, readings, control)

    rows = replace(evaluation(sweep), simulate=counted, against_slower=False)(sweep.block(0, 2))
    assert [VERDICTS[code] for code in rows.verdict] == ["fail", "pass"]
    assert simulated[0] == 2
    assert set(simulated[1:-1]) == {1}
    assert simulated[-1] == 0  # boxes


def test_a_row_does_not_depend_on_its_neighbours():
    sweep = taped([1.02, 0.5, 0.96, 0.3, 0.8], "[1.8 m, 2.3 m]")
    judge, block = evaluation(sweep), sweep.block(0, sweep.n_designs)
    whole = judge(block)
    for place in range(len(whole)):
        assert judge(some(block, np.array([place]))).row(0) == whole.row(place)
    shapes = {float(row["solidity"]): row["shape"] for row in map(whole.row, range(len(whole)))}
    assert [fill for fill, shape in sorted(shapes.items()) if shape is None] == pytest.approx([0.3, 0.96, 1.02])


def test_what_fills_its_box_is_that_box_and_what_fills_little_is_undecided():
    box, full, tape, little = (
        evaluation(sweep)(sweep.block(0, 1)).row(0)
        for sweep in (sweep_of("density: 2860 kg/m^3"), *(taped([fill]) for fill in (0.95, 1.1, 0.39)))
    )
    assert full["shape"] is None
    assert tape["max_rotation_deg"] == pytest.approx(box["max_rotation_deg"], rel=1e-12)
    assert (little["verdict"], little["reason"]) == ("undecided", "shape")
    notes = [[note.message for note in taped([fill]).notes] for fill in (1.1, 0.39, 0.7)]
    assert "rounding of the tape" in notes[0][0]
    assert "undecided (shape)" in notes[1][0]
    assert "worst of these shapes: narrower downwards, barrel, narrower upwards" in notes[2][0]


def test_a_history_and_a_stored_row_are_those_of_the_deciding_shape(tmp_path):
    sweep = taped([0.6, 0.9], "[1.9 m, 2.5 m]")
    boulder_sweep.run(sweep, tmp_path / "yard.sweep", jobs=1)
    table = boulder_sweep.read(tmp_path / "yard.sweep")
    for number in range(sweep.n_designs):
        history = simulate(sweep, number)
        assert not recompute(tmp_path / "yard.sweep", number).unequal
        assert history.summary()["shape"] == table["shape"][number]
        profile = taped_profiles(table["shape"][number], table["solidity"][number : number + 1].to_numpy())[0]
        np.testing.assert_allclose(history.motion.outline, profile * [3.44, 1.68, 1.65, 1.65], rtol=1e-12)


def test_the_depth_that_is_needed_is_enough_for_every_shape():
    sweep = taped([0.7])
    depth = float(bare_need(sweep).frame.least_embedment_depth_m[0])
    for at, verdict in ((depth, "pass"), (depth - 0.002, "fail")):
        near = taped([0.7], f"{at!r} m")
        assert evaluation(near)(near.block(0, 1)).row(0)["verdict"] == verdict
    judge = evaluation(near := taped([0.7], f"{depth!r} m"))
    designs = judge.designs(near.block(0, 1))
    for shape in range(len(SHAPES)):
        assert judge.judged(designs.in_shape(shape, near.model)).row(0)["verdict"] == "pass"


@given(st.floats(0.4, 0.9499), st.floats(0.4, 0.9499))
def test_a_heavier_stone_of_one_size_is_nowhere_narrower(one, other):
    light, heavy = sorted((one, other))
    for shape in SHAPES:
        profiles = taped_profiles(shape, np.array([light, heavy]))
        assert (profiles[1, :, 1:] >= profiles[0, :, 1:] - 1e-12).all()
        assert profiles[:, :, 1].max() <= 1.0


def test_a_kind_of_rock_is_an_uncertain_density():
    sweep = sweep_of("mass: 18 t, rock: granite")
    spread = sweep.distributions["boulder_density_kg_m3"]
    assert (spread.kind, spread.low, spread.own_mode, spread.high) == ("triangular", 2500.0, 2640.0, 2810.0)
    assert not sweep.model.rock_assumed
    assert simulate(sweep).summary()["shape"] in SHAPES
    assert 0.0 <= boulder_sweep.uncertainty(sweep).frame.p_pass[0] <= 1.0


@pytest.mark.parametrize(
    ("boulder", "expected"),
    [
        ("rock: granit", r"yard.yaml:1:\d+: boulder.rock: 'granit' is not a kind of rock: .* did you mean granite"),
        ("rock: granite, density: 2600 kg/m^3", r"yard.yaml:1:\d+: boulder.rock: density follows from boulder.rock"),
        ("mass: 30 t, density: 2600 kg/m^3", r"yard.yaml:1:58: boulder.mass: 30000 kg is 1.21 times"),
    ],
)
def test_mistakes_are_reported_where_they_stand(boulder, expected):
    with pytest.raises(SettingsError, match=expected):
        sweep_of(boulder)


def test_a_picture_shows_every_shape():
    history = simulate(taped([0.7]))
    shown = [item for item in SideView(history).ground() if item.style == "initial"]
    assert len(shown) == len(SHAPES)
    for item in shown:
        x, y = np.array(item.points).T
        assert np.ptp(x) == pytest.approx(1.65, rel=1e-9)
        assert (y.min(), y.max()) == pytest.approx((-2.3, 1.14), rel=1e-9)
    assert len({item.points for item in shown}) == len(SHAPES)
    assert len([item for item in SideView(simulate(taped([0.97]))).ground() if item.style == "initial"]) == 1
