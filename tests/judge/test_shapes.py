"""Boulders with a taper or a profile from a settings file to a judged row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import boulder_sweep
from boulder_kernels import Control, corrected, simulate_table
from boulder_sweep.errors import QuestionError
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.judge.accuracy import OUTLINES_IN_LANES, accuracy_of, control_of
from boulder_sweep.settings import Sweep, load
from boulder_sweep.settings.model import Ground
from boulder_sweep.settings.shape import tapered
from boulder_sweep.soils import SLICES, coefficients, with_soil
from tests.answers.designs import bare_need
from tests.judge.plain import plain_designs

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
        (f"profile: {LEANING}", OUTLINES_IN_LANES - 1, False),
        (f"profile: {LEANING}", OUTLINES_IN_LANES, True),
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
    assert row.robustness == "open"
    assert recompute(tmp_path / "table", 0).unequal == ()


def test_a_wider_foot_holds_better_than_a_wider_top(tmp_path):
    """With the same volume: tops and feet of 0.8 and 1.25 of one another within the same box."""
    down, up = (table_of(shaped(tmp_path, f"taper: {t}"), tmp_path / str(t)).max_rotation_deg[0] for t in (0.8, 1.25))
    assert down < up


def test_the_law_that_depends_on_the_width_takes_the_local_one():
    """Slice by slice: pressures are to each other as those of boxes as wide as the taper is there."""
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


def test_a_small_foot_is_never_a_pass(tmp_path):
    row = table_of(shaped(tmp_path, "taper: 2.2"), tmp_path / "table").iloc[0]
    assert (row.verdict, row.reason) in {("undecided", "foot"), ("fail", "overturns")}
    row = table_of(shaped(tmp_path, "taper: 2.2", "vehicle.speed=20 mph"), tmp_path / "slow").iloc[0]
    assert (row.verdict, row.reason) == ("undecided", "foot")


def test_a_weighed_boulder_with_a_profile_is_decided(tmp_path):
    """Its mass over that of a box of its rock is a column, and no box has to stand for it."""
    sweep = shaped(tmp_path, "taper: 0.8\n  mass: 18 t", "vehicle.speed=25 mph")
    row = table_of(sweep, tmp_path / "table").iloc[0]
    assert row.solidity == pytest.approx(18000 / (2596 * 1.65 * 1.68 * 3.44), rel=1e-9)
    assert row.verdict == "pass"


def test_answers_take_profiles_and_give_their_mass(tmp_path):
    sweep = shaped(tmp_path, "taper: 0.8")
    answer = bare_need(sweep).frame.iloc[0]
    assert answer.boulder_mass_kg == pytest.approx(2596 * 1.65 * 1.68 * 3.44 * tapered(0.8).filled)
    box = bare_need(load(RWG)).frame.iloc[0]
    assert answer.least_embedment_depth_m > box.least_embedment_depth_m
    with pytest.raises(QuestionError, match="second opinions know boxes"):
        bare_need(sweep, robust=True)


def test_side_views_show_the_shape(tmp_path):
    """Corners of the boulder at first touch are those of the profile, where it is struck at x = 0."""
    from boulder_sweep.views.scene import SideView

    sweep = shaped(tmp_path, f"profile: {LEANING}")
    view = SideView(boulder_sweep.simulate(sweep))
    initial = next(shape for shape in view.ground() if shape[1] == "initial")
    heights = sorted({round(y + 2.03, 6) for _, y in initial.points})
    assert heights == [0.0, 1.6, 3.44]
    widths = {}
    for x, y in initial.points:
        widths.setdefault(round(y + 2.03, 6), []).append(x)
    assert [max(xs) - min(xs) for _, xs in sorted(widths.items())] == pytest.approx([1.5, 1.7, 1.3])
