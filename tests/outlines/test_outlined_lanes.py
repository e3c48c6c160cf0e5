"""Boulders with an outline side by side in lanes: as the impact alone, every row the same whatever is beside it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import OutcomeTable
from boulder_kernels._jit import plain
from boulder_kernels.design import Body, Design
from boulder_kernels.dynamics import (
    constants_in,
    drag_power,
    least_couple,
    lift_of,
    profile_of,
    soil_potential,
    soil_reaction,
)
from boulder_kernels.lanes import LANES
from boulder_kernels.pieces import COUNTS, GivenPiece, PiecewiseTable, constants_of_few, given_pieces, uniform_layers
from boulder_kernels.table import is_layered, is_paired, simulate_table, some_rows
from tests.kernels.samples import control, random_designs, random_layers, random_state, table_of
from tests.kernels.test_lanes import PRESETS, assert_alike, assert_same, one_by_one
from tests.kernels.test_soil import lines
from tests.outlines.stones import SHAPES, box, crooked, superellipsoid, taper

HOW = control(8e-3, 1.0, np.radians(20.0), stop_at_limit=True)
READINGS = bk.corrected()


def outlined(designs: list[Design], shape: Callable[[Design], np.ndarray], layers: int = 0, seed: int = 0) -> Any:
    """Return designs of a shape, in layers or in their own soil."""
    if layers:
        soil = random_layers(designs, layers, seed=seed).layers
    else:
        soil = np.stack([uniform_layers(design) for design in designs])
    return PiecewiseTable(*table_of(designs), soil, np.stack([shape(design) for design in designs]))


def constants_of_lanes(table: PiecewiseTable, row: int, count: int) -> Any:
    """Return the constants that a lane works out, in as many pieces."""
    designs = np.stack(table[: len(Design._fields)])
    given = given_pieces(designs, table.layers, table.outlines, count)[:, row]
    body, pieces = np.split(given[len(Design._fields) :], [len(Body._fields)])
    pieces = tuple(GivenPiece(*piece) for piece in pieces.reshape(-1, len(GivenPiece._fields)))
    return plain(constants_of_few)(Design(*given[: len(Design._fields)]), READINGS, Body(*body), pieces)


@pytest.mark.parametrize(
    ("shape", "layers", "count"),
    [("widens downwards", 0, 1), ("widens upwards", 0, 1), ("widens upwards", 0, 2), ("crooked", 2, 8)],
)
def test_soils_of_lanes_are_those_of_single_impacts(shape: str, layers: int, count: int) -> None:
    """Constants, force and moment, energy with its slopes, power of the drag, and what the weight does."""
    designs = random_designs(4, seed=190)
    table = outlined(designs, SHAPES[shape], layers, seed=3)
    rng = np.random.default_rng(5)
    for row, design in enumerate(designs):
        profile = profile_of(table.layers[row], 0, table.outlines[row])
        known, c = constants_in(design, READINGS, 0, profile), constants_of_lanes(table, row, count)
        np.testing.assert_allclose(c[:-1], known[:-1], rtol=1e-12)
        assert least_couple(c) == pytest.approx(least_couple(known), rel=1e-12)
        assert lift_of(0.1, 0.01, c) == pytest.approx(lift_of(0.1, 0.01, known), rel=1e-12)
        for _ in range(30):
            k = lines(random_state(rng), known)
            np.testing.assert_allclose(soil_reaction(k, c), soil_reaction(k, known), rtol=1e-9, atol=1e-6)
            mine, theirs = soil_potential(k.A, k.slope_x, c), soil_potential(k.A, k.slope_x, known)
            np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-6)
            assert mine.highest >= mine.V * (1.0 - 1e-12)
            assert drag_power(k, c) == pytest.approx(drag_power(k, known), rel=1e-9)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("shape", "layers"),
    [
        ("widens upwards", 0),
        ("crooked", 0),
        *(pytest.param(*each, marks=pytest.mark.nightly) for each in [("widens downwards", 1), ("crooked", 4)]),
    ],
)
def test_lanes_are_single_impacts(shape: str, layers: int) -> None:
    """Rounding decides a row now and then, as in uniform soils."""
    table = outlined(random_designs(300, seed=191), SHAPES[shape], layers, seed=4)
    for readings in PRESETS:
        found = simulate_table(table, readings, HOW)
        assert_alike(found, one_by_one(table, readings, HOW), 1)
        assert len(np.unique(found.status)) >= 2


@pytest.mark.compiled
@pytest.mark.parametrize("shape", [taper, crooked])
def test_any_order_and_any_number_of_rows(shape: Callable[[Design], np.ndarray]) -> None:
    table = outlined(random_designs(3 * LANES + 5, seed=192), shape)
    known = simulate_table(table, READINGS, HOW)
    order = np.random.default_rng(1).permutation(len(table.L))
    assert_same(simulate_table(some_rows(table, order), READINGS, HOW), known, order)
    for n in (0, 1, LANES + 1):
        assert_same(simulate_table(some_rows(table, np.arange(n)), READINGS, HOW), known, slice(n))


@pytest.mark.compiled
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("shape", [taper, crooked])
def test_a_spoilt_row_leaves_its_neighbours_alone(shape: Callable[[Design], np.ndarray]) -> None:
    table = outlined(random_designs(20, seed=193), shape)
    known = simulate_table(table, READINGS, HOW)
    other = table._replace(outlines=table.outlines.copy(), rho_b=table.rho_b.copy())
    other.outlines[3, 0, 1], other.rho_b[9] = np.nan, np.inf
    found = simulate_table(other, READINGS, HOW)
    kept = ~np.isin(np.arange(20), (3, 9))
    assert_same(OutcomeTable(*(column[kept] for column in found)), known, kept)
    assert not np.isin(found.status[~kept], bk.SIMULATED).any()


@pytest.mark.compiled
def test_a_taper_that_does_not_taper_is_the_box() -> None:
    """And a point of the outline that changes nothing changes nothing."""
    designs = random_designs(100, seed=194)
    known = simulate_table(table_of(designs), READINGS, HOW)
    assert_alike(simulate_table(outlined(designs, box), READINGS, HOW), known, 1)

    def cut(design: Design) -> np.ndarray:
        """A box with a point in the middle."""
        ends = box(design)
        return np.insert(ends, 1, 0.5 * (ends[0] + ends[1]), axis=0)

    assert_alike(simulate_table(outlined(designs, cut), READINGS, HOW), known, 1)


@pytest.mark.compiled
def test_more_pieces_than_lanes_take_are_simulated_one_by_one() -> None:
    table = outlined(random_designs(10, seed=195), superellipsoid)
    assert table.outlines.shape[1] - 1 > COUNTS[-1]
    assert_same(simulate_table(table, READINGS, HOW), one_by_one(table, READINGS, HOW))


@pytest.mark.compiled
def test_designs_are_simulated_one_by_one_where_that_is_asked_for() -> None:
    table = outlined(random_designs(10, seed=196), crooked)
    apart = HOW._replace(side_by_side=False)
    assert_same(simulate_table(table, READINGS, apart), one_by_one(table, READINGS, apart))
    assert not len(simulate_table(some_rows(table, np.arange(0)), READINGS, apart).status)


def test_a_taper_is_solved_once_for_its_error() -> None:
    """All of its soil yields at one displacement; beside more pieces, and with cohesion, it does not."""
    designs = random_designs(3, seed=196)
    how = HOW._replace(error_estimate=True)
    table = outlined(designs, taper)
    with_cohesion = table._replace(layers=table.layers + np.array([0.0, 0.0, 0.0, 0.0, 1e3, 0.0]))
    for some, layered in ((table, False), (with_cohesion, True), (outlined(designs, crooked), True)):
        assert is_layered(some) == layered
        assert is_paired(READINGS, how, layered=is_layered(some)) == layered


@pytest.mark.compiled
@pytest.mark.parametrize(("share", "count"), [pytest.param(0.6, 3000, marks=pytest.mark.nightly), (0.8, 1500)])
def test_the_error_of_one_solve_covers_what_is_wrong(share: float, count: int) -> None:
    """It covers 99.9 % of the rotations of boulders that stay upright, like boxes; fewer stay so on a narrow foot."""
    designs = random_designs(count, seed=197)
    how = control(12e-3, 1.0, np.radians(20.0), stop_at_limit=True)._replace(error_estimate=True)
    for shape in (lambda design: taper(design, 1.0, share), lambda design: taper(design, share, 1.0)):
        table = outlined(designs, shape)
        found = simulate_table(table, READINGS, how)
        fine = simulate_table(table, READINGS, how._replace(h=5e-4, error_estimate=False, locate_yield=True))
        stand = np.isfinite(found.theta_max) & (fine.theta_max < how.theta_limit)
        assert stand.sum() > 100
        covered = np.abs(found.theta_max - fine.theta_max) <= found.theta_error
        assert covered[stand].mean() > 0.998
