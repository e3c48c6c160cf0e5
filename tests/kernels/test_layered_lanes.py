"""Soils of layers side by side in lanes: as the impact alone, and every row the same whatever its neighbours."""

from typing import Any

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import OutcomeTable, Status
from boulder_kernels.dynamics import soil_potential
from boulder_kernels.impact import simulate_alone
from boulder_kernels.outcomes import empty_outcomes, step_errors, write_outcome
from boulder_kernels.pieces import COUNTS, GivenPiece, PiecewiseTable, given_pieces, lanes_count
from boulder_kernels.table import LANES, problem_at, some_rows

from .samples import control, layered_constants, random_designs, random_layers
from .test_lanes import PRESETS, assert_alike, assert_same, with_step

HOW = control(8e-3, 1.0, np.radians(20.0), stop_at_limit=True)
READINGS = bk.corrected()


def one_by_one(table: Any, readings: bk.Readings, how: bk.Control) -> OutcomeTable:
    """Impacts that are simulated alone, in the columns of a table."""
    out = empty_outcomes(len(table.L))
    for row in range(len(table.L)):
        problem = problem_at(table, row, how)
        found = simulate_alone(problem, readings, how, bk.no_record())
        write_outcome(out, row, found, step_errors(found, problem.design, how.theta_limit, how.horizon))
    return with_step(out, how.h)


def split(table: PiecewiseTable, m: int) -> PiecewiseTable:
    """Cut the layer m of every design in two of the same soil."""
    twice = np.insert(table.layers, m, table.layers[:, m], axis=1)
    top = table.layers[:, m - 1, 0] if m else np.zeros(len(table.L))
    twice[:, m, 0] = 0.5 * (top + np.minimum(table.layers[:, m, 0], table.d))
    return table._replace(layers=twice)


@pytest.mark.compiled
@pytest.mark.parametrize("count", [2, 3, *(pytest.param(n, marks=pytest.mark.nightly) for n in (1, 5, 8))])
@pytest.mark.parametrize("readings", PRESETS, ids=["as_printed", "corrected"])
def test_lanes_are_impacts_alone(readings: bk.Readings, count: int) -> None:
    """Rounding decides a row now and then, as in uniform soils."""
    table = random_layers(random_designs(300, seed=171), count, seed=count)
    found = bk.simulate_table(table, readings, HOW)
    assert_alike(found, one_by_one(table, readings, HOW), 1)
    assert len(np.unique(found.status)) >= 2


def test_layers_in_lanes_without_the_compiler() -> None:
    """The source of the lanes as plain Python, or the compiled code: a few short impacts."""
    table = random_layers(random_designs(2, seed=172), 2, seed=5)
    short = HOW._replace(horizon=0.1)
    assert_alike(bk.simulate_table(table, READINGS, short), one_by_one(table, READINGS, short), 0)


@pytest.mark.compiled
@pytest.mark.parametrize("n", [0, 1, LANES + 1])
def test_any_number_of_rows(n: int) -> None:
    table = random_layers(random_designs(3 * LANES + 5, seed=173), 2, seed=1)
    whole = bk.simulate_table(table, READINGS, HOW)
    assert_same(bk.simulate_table(some_rows(table, np.arange(n)), READINGS, HOW), whole, slice(n))


@pytest.mark.compiled
def test_order_of_rows() -> None:
    table = random_layers(random_designs(500, seed=174), 2, seed=2)
    for readings in PRESETS:
        known = bk.simulate_table(table, readings, HOW)
        order = np.random.default_rng(1).permutation(500)
        assert_same(bk.simulate_table(some_rows(table, order), readings, HOW), known, order)


@pytest.mark.compiled
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("change", [{"phi": np.nan}, {"rho_b": np.inf}, {"e_bumper": 10.0}, {"k_v": 1e18}])
def test_a_spoilt_row_leaves_its_neighbours_alone(change: dict[str, float]) -> None:
    table = random_layers(random_designs(40, seed=175), 2, seed=3)
    known = bk.simulate_table(table, READINGS, HOW)
    for spoilt in (0, LANES, 39):
        other = table._replace(**{name: getattr(table, name).copy() for name in change})
        for name, value in change.items():
            getattr(other, name)[spoilt] = value
        found = bk.simulate_table(other, READINGS, HOW)
        kept = np.arange(40) != spoilt
        assert_same(OutcomeTable(*(column[kept] for column in found)), known, kept)


@pytest.mark.compiled
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_layer_that_is_no_number_is_refused_in_its_row_alone() -> None:
    table = random_layers(random_designs(20, seed=176), 2, seed=3)
    known = bk.simulate_table(table, READINGS, HOW)
    table.layers[3, 1, 3] = np.nan
    found = bk.simulate_table(table, READINGS, HOW)
    kept = np.arange(20) != 3
    assert_same(OutcomeTable(*(column[kept] for column in found)), known, kept)
    assert found.status[3] not in bk.SIMULATED
    assert np.isnan(found.theta_max[3])


@pytest.mark.compiled
def test_the_same_soil_twice_is_one_layer() -> None:
    """However many lanes are compiled for: two layers, and the three of a soil cut in two, of which one is empty."""
    table = random_layers(random_designs(100, seed=177), 2, seed=4)
    known = bk.simulate_table(table, READINGS, HOW)
    for m in range(2):
        assert_alike(bk.simulate_table(split(table, m), READINGS, HOW), known, 1)


@pytest.mark.compiled
def test_more_layers_than_lanes_take_are_simulated_one_by_one() -> None:
    table = random_layers(random_designs(20, seed=178), COUNTS[-1] + 1, seed=5)
    assert lanes_count(COUNTS[-1] + 1) == 0
    assert_same(bk.simulate_table(table, READINGS, HOW), one_by_one(table, READINGS, HOW))


def test_pieces_without_height_are_added_to_the_next_count() -> None:
    table = random_layers(random_designs(3, seed=179), 5, seed=6)
    assert [lanes_count(n) for n in range(1, 10)] == [1, 2, 4, 4, 8, 8, 8, 8, 0]
    given = given_pieces(np.stack(table[:15]), table.layers, table.outlines, 8)
    pieces = given[22:].T.reshape(3, 8, len(GivenPiece._fields))
    assert given.shape == (22 + 64, 3)
    np.testing.assert_allclose(pieces[:, :5, 0], np.minimum(table.layers[:, :, 0] / table.d[:, None], 1.0), rtol=1e-15)
    assert np.array_equal(pieces[:, 5:], np.repeat(pieces[:, 4:5], 3, axis=1))
    assert np.all(pieces[:, :, 6:] == (1.0, 0.0))


@pytest.mark.parametrize("count", [1, 2, 4])
def test_the_bound_of_the_energy_is_above_it(count: int) -> None:
    """Without a logarithm: nowhere less than the energy, and the energy itself where no layer has strength at r = 0."""
    designs = random_designs(3, seed=180)
    table = random_layers(designs, count, seed=7)
    rng = np.random.default_rng(8)
    for design, layers in zip(designs, table.layers, strict=True):
        plain = layers.copy()
        plain[:, 4] = 0.0
        for A, X in rng.normal(0.0, 0.3, (50, 2)):
            p = soil_potential(A, X, layered_constants(design, layers, READINGS, 0))
            assert p.highest >= p.V * (1.0 - 1e-12)
            p = soil_potential(A, X, layered_constants(design, plain, READINGS, 0))
            assert p.highest == pytest.approx(p.V, rel=1e-12)


def test_statuses_of_layers_are_those_of_any_soil() -> None:
    """A design that the truck passes over is not simulated, in layers either."""
    table = random_layers(random_designs(2, seed=181), 2, seed=9)
    table.e_bumper[0] = 10.0
    assert bk.simulate_table(table, READINGS, HOW._replace(horizon=0.02)).status[0] == Status.NO_CONTACT
