"""Many designs side by side: every row is the same whatever its neighbours, bit for bit, and is the impact alone.

An impact that is simulated alone, as the page does, is other machine code of the same source, in which other products
are fused with a sum: it may differ by rounding, and so, at a knife edge of the printed readings or where a proof of
rest only just holds, by more.
"""

from typing import Any

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import OutcomeTable, Status
from boulder_kernels.dynamics import soil_potential
from boulder_kernels.impact import simulate_alone
from boulder_kernels.lanes import LANES
from boulder_kernels.outcomes import STEP, T_END, empty_outcomes, outcome_table, step_errors, write_outcome
from boulder_kernels.pieces import COUNTS, GivenPiece, PiecewiseTable, given_pieces, lanes_count
from boulder_kernels.table import problem_at, some_rows

from .samples import ALL_READINGS, control, layered_constants, random_designs, random_layers, same_bits, table_of

HOW = control(8e-3, 1.0, np.radians(20.0), stop_at_limit=True)
PRESETS = [bk.as_printed(), bk.corrected()]


SOILS = [pytest.param(0, id="uniform"), pytest.param(2, id="layers", marks=pytest.mark.compiled)]
"""Numbers of layers."""


def table_in(layers: int, count: int, seed: int) -> Any:
    """Random designs in a uniform soil, or in so many layers."""
    designs = random_designs(count, seed)
    return random_layers(designs, layers, seed=seed) if layers else table_of(designs)


def assert_same(found: OutcomeTable, known: OutcomeTable, rows: np.ndarray | slice = slice(None)) -> None:
    """Hold every column of one table against rows of another, bit for bit."""
    for name, a, b in zip(OutcomeTable._fields, found, known, strict=True):
        assert same_bits(a, np.ascontiguousarray(b[rows])), name


def assert_alike(found: OutcomeTable, known: OutcomeTable, excused: int) -> None:
    """Hold two tables against each other up to rounding, but for a few rows that rounding decides.

    Of the errors, which sum up differences that are nearly rounding themselves, only the first digits are held.
    """
    unlike = found.status != known.status
    for name, a, b in zip(OutcomeTable._fields[1:], found[1:], known[1:], strict=True):
        assert np.array_equal(np.isnan(a) & ~unlike, np.isnan(b) & ~unlike), name
        within = 0.05 * np.abs(b) if name.endswith("error") else 1e-9 * np.maximum(1.0, np.abs(b))
        unlike |= np.abs(a - b) > within
    assert unlike.sum() <= excused


def with_step(out: np.ndarray, h: float) -> OutcomeTable:
    """Return outcomes as a table, by their step [s]."""
    out[STEP] = np.where(np.isnan(out[T_END]), np.nan, h)
    return outcome_table(out)


def one_by_one(table: Any, readings: bk.Readings, how: bk.Control) -> OutcomeTable:
    """Impacts that are simulated alone, in the columns of a table."""
    out = empty_outcomes(len(table.L))
    for row in range(len(table.L)):
        problem = problem_at(table, row, how)
        found = simulate_alone(problem, readings, how, bk.no_record())
        write_outcome(out, row, found, step_errors(found, problem.design, how.theta_limit, how.horizon))
    return with_step(out, how.h)


@pytest.mark.parametrize("readings", ALL_READINGS)
def test_lanes_are_impacts_alone(readings: bk.Readings) -> None:
    table = table_in(0, 20, seed=121)
    assert_alike(bk.simulate_table(table, readings, HOW), one_by_one(table, readings, HOW), 1)


@pytest.mark.compiled
@pytest.mark.parametrize("h", [1e-3, 8e-3, 2e-2])
@pytest.mark.parametrize("readings", PRESETS, ids=["as_printed", "corrected"])
def test_many_lanes_are_impacts_alone(readings: bk.Readings, h: float) -> None:
    table = table_in(0, 1500, seed=122)
    how = HOW._replace(h=h)
    found = bk.simulate_table(table, readings, how)
    assert_alike(found, one_by_one(table, readings, how), 3)
    assert len(np.unique(found.status)) >= 3


@pytest.mark.parametrize("layers", SOILS)
@pytest.mark.parametrize("n", [0, 1, 2, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
def test_any_number_of_rows(n: int, layers: int) -> None:
    """Rows equal the rows of a longer table: what follows in the lanes, or that nothing does, leaves no trace."""
    table = table_in(layers, 3 * LANES + 5, seed=123)
    whole = bk.simulate_table(table, bk.corrected(), HOW)
    assert_same(bk.simulate_table(some_rows(table, np.arange(n)), bk.corrected(), HOW), whole, slice(n))


@pytest.mark.parametrize("layers", SOILS)
@pytest.mark.parametrize("readings", PRESETS, ids=["as_printed", "corrected"])
def test_order_of_rows(readings: bk.Readings, layers: int) -> None:
    table = table_in(layers, 60, seed=124)
    known = bk.simulate_table(table, readings, HOW)
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(60)
        assert_same(bk.simulate_table(some_rows(table, order), readings, HOW), known, order)


@pytest.mark.compiled
@pytest.mark.parametrize("layers", SOILS)
def test_order_of_many_rows(layers: int) -> None:
    table = table_in(layers, 3000, seed=125)
    for readings in PRESETS:
        known = bk.simulate_table(table, readings, HOW)
        middle = np.arange(1000, 2000)
        for order in (np.random.default_rng(1).permutation(3000), middle):
            assert_same(bk.simulate_table(some_rows(table, order), readings, HOW), known, order)


SPOILT = {
    "not a number": ({"rho_b": np.nan}, Status.INVALID),
    "infinite": ({"rho_b": np.inf}, Status.INVALID),
    "no mass": ({"m_v": 0.0}, Status.INVALID),
    "as high as it is deep": ({"H": 1.0, "d": 1.0}, Status.NO_CONTACT),
    "passed over": ({"e_bumper": 10.0}, Status.NO_CONTACT),
    "spring of the stars": ({"k_v": 1e18}, None),
    "a speck of a boulder": ({"L": 1e-6, "W": 1e-6, "H": 2e-6, "d": 1e-6, "e": 5e-7, "e_bumper": 0.0}, None),
    "impact of light": ({"v_0": 3e8}, None),
}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", SPOILT)
@pytest.mark.parametrize("readings", PRESETS, ids=["as_printed", "corrected"])
@pytest.mark.parametrize("layers", SOILS)
def test_a_spoilt_row_leaves_its_neighbours_alone(layers: int, readings: bk.Readings, name: str) -> None:
    """A design that cannot be computed, anywhere in the table, gets a status and NaN; all others keep their bits."""
    change, status = SPOILT[name]
    table = table_in(layers, 40, seed=126)
    known = bk.simulate_table(table, readings, HOW)
    for spoilt in (0, 7, LANES, 39):
        other = some_rows(table, np.arange(40))
        for column, value in change.items():
            getattr(other, column)[spoilt] = value
        found = bk.simulate_table(other, readings, HOW)
        kept = np.arange(40) != spoilt
        assert_same(OutcomeTable(*(column[kept] for column in found)), known, kept)
        if status is not None:
            assert found.status[spoilt] == status
        computed = found.status[spoilt] in bk.SIMULATED
        assert np.isfinite(found.theta_max[spoilt]) == computed
        assert np.isfinite(found.t_end[spoilt]) == computed


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_table_of_nothing_but_spoilt_rows() -> None:
    designs = [d._replace(phi=np.nan) for d in random_designs(LANES + 3, seed=127)]
    found = bk.simulate_table(table_of(designs), bk.corrected(), HOW)
    assert np.all(found.status == Status.INVALID)
    assert all(np.all(np.isnan(column)) for column in found[1:])


def split(table: PiecewiseTable, m: int) -> PiecewiseTable:
    """Cut the layer m of every design in two of the same soil."""
    twice = np.insert(table.layers, m, table.layers[:, m], axis=1)
    top = table.layers[:, m - 1, 0] if m else np.zeros(len(table.L))
    twice[:, m, 0] = 0.5 * (top + np.minimum(table.layers[:, m, 0], table.d))
    return table._replace(layers=twice)


@pytest.mark.compiled
@pytest.mark.parametrize("count", [2, 3, *(pytest.param(n, marks=pytest.mark.nightly) for n in (1, 5, 8))])
@pytest.mark.parametrize("readings", PRESETS, ids=["as_printed", "corrected"])
def test_layers_in_lanes_are_impacts_alone(readings: bk.Readings, count: int) -> None:
    """Rounding decides a row now and then, as in uniform soils."""
    table = random_layers(random_designs(300, seed=171), count, seed=count)
    found = bk.simulate_table(table, readings, HOW)
    assert_alike(found, one_by_one(table, readings, HOW), 1)
    assert len(np.unique(found.status)) >= 2


def test_layers_in_lanes_without_the_compiler() -> None:
    """The source of the lanes as plain Python, or the compiled code: a few short impacts."""
    table = random_layers(random_designs(2, seed=172), 2, seed=5)
    short = HOW._replace(horizon=0.1)
    assert_alike(bk.simulate_table(table, bk.corrected(), short), one_by_one(table, bk.corrected(), short), 0)


@pytest.mark.compiled
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_layer_that_is_no_number_is_refused_in_its_row_alone() -> None:
    table = random_layers(random_designs(20, seed=176), 2, seed=3)
    known = bk.simulate_table(table, bk.corrected(), HOW)
    table.layers[3, 1, 3] = np.nan
    found = bk.simulate_table(table, bk.corrected(), HOW)
    kept = np.arange(20) != 3
    assert_same(OutcomeTable(*(column[kept] for column in found)), known, kept)
    assert found.status[3] not in bk.SIMULATED
    assert np.isnan(found.theta_max[3])


@pytest.mark.compiled
def test_the_same_soil_twice_is_one_layer() -> None:
    """However many lanes are compiled for: two layers, and the three of a soil cut in two, of which one is empty."""
    table = random_layers(random_designs(100, seed=177), 2, seed=4)
    known = bk.simulate_table(table, bk.corrected(), HOW)
    for m in range(2):
        assert_alike(bk.simulate_table(split(table, m), bk.corrected(), HOW), known, 1)


@pytest.mark.compiled
def test_more_layers_than_lanes_take_are_simulated_one_by_one() -> None:
    table = random_layers(random_designs(20, seed=178), COUNTS[-1] + 1, seed=5)
    assert lanes_count(COUNTS[-1] + 1) == 0
    assert_same(bk.simulate_table(table, bk.corrected(), HOW), one_by_one(table, bk.corrected(), HOW))


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
            p = soil_potential(A, X, layered_constants(design, layers, bk.corrected(), 0))
            assert p.highest >= p.V * (1.0 - 1e-12)
            p = soil_potential(A, X, layered_constants(design, plain, bk.corrected(), 0))
            assert p.highest == pytest.approx(p.V, rel=1e-12)


def test_statuses_of_layers_are_those_of_any_soil() -> None:
    """A design that the truck passes over is not simulated, in layers either."""
    table = random_layers(random_designs(2, seed=181), 2, seed=9)
    table.e_bumper[0] = 10.0
    assert bk.simulate_table(table, bk.corrected(), HOW._replace(horizon=0.02)).status[0] == Status.NO_CONTACT
