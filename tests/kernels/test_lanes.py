"""Many designs side by side: every row is the same whatever its neighbours, bit for bit, and is the impact alone.

An impact that is simulated alone, as the page does, is other machine code of the same source, in which other products
are fused with a sum: it may differ by rounding, and so, at a knife edge of the printed readings or where a proof of
rest only just holds, by more.
"""

import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import Design, OutcomeTable, Status
from boulder_kernels.impact import simulate_uniform
from boulder_kernels.outcomes import STEP, T_END, empty_outcomes, outcome_table, step_errors, write_outcome
from boulder_kernels.table import LANES

from .samples import ALL_READINGS, control, random_designs, same_bits, table_of

HOW = control(8e-3, 1.0, np.radians(20.0), stop_at_limit=True)
PRESETS = [bk.as_printed(), bk.corrected()]


def rows_of(table: bk.DesignTable, rows: np.ndarray | slice) -> bk.DesignTable:
    return bk.DesignTable(*(np.ascontiguousarray(column[rows]) for column in table))


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


def one_by_one(designs: list[Design], readings: bk.Readings, how: bk.Control) -> OutcomeTable:
    """Impacts that are simulated alone, in the columns of a table."""
    out = empty_outcomes(len(designs))
    for row, design in enumerate(designs):
        found = simulate_uniform(design, readings, how, bk.no_record())
        write_outcome(out, row, found, step_errors(found, design, how.theta_limit, how.horizon))
    return with_step(out, how.h)


@pytest.mark.parametrize("readings", ALL_READINGS)
def test_lanes_are_impacts_alone(readings: bk.Readings) -> None:
    designs = random_designs(20, seed=121)
    assert_alike(bk.simulate_table(table_of(designs), readings, HOW), one_by_one(designs, readings, HOW), 1)


@pytest.mark.compiled
@pytest.mark.parametrize("h", [1e-3, 8e-3, 2e-2])
@pytest.mark.parametrize("readings", PRESETS, ids=["as_printed", "corrected"])
def test_many_lanes_are_impacts_alone(readings: bk.Readings, h: float) -> None:
    designs = random_designs(1500, seed=122)
    how = HOW._replace(h=h)
    found = bk.simulate_table(table_of(designs), readings, how)
    assert_alike(found, one_by_one(designs, readings, how), 3)
    assert len(np.unique(found.status)) >= 3


@pytest.mark.parametrize("n", [0, 1, 2, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
def test_any_number_of_rows(n: int) -> None:
    """Rows equal the rows of a longer table: what follows in the lanes, or that nothing does, leaves no trace."""
    table = table_of(random_designs(3 * LANES + 5, seed=123))
    whole = bk.simulate_table(table, bk.corrected(), HOW)
    assert_same(bk.simulate_table(rows_of(table, slice(n)), bk.corrected(), HOW), whole, slice(n))


@pytest.mark.parametrize("readings", PRESETS, ids=["as_printed", "corrected"])
def test_order_of_rows(readings: bk.Readings) -> None:
    table = table_of(random_designs(60, seed=124))
    known = bk.simulate_table(table, readings, HOW)
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(60)
        assert_same(bk.simulate_table(rows_of(table, order), readings, HOW), known, order)


@pytest.mark.compiled
def test_order_of_many_rows() -> None:
    table = table_of(random_designs(3000, seed=125))
    for readings in PRESETS:
        known = bk.simulate_table(table, readings, HOW)
        order = np.random.default_rng(1).permutation(3000)
        assert_same(bk.simulate_table(rows_of(table, order), readings, HOW), known, order)
        start = bk.simulate_table(rows_of(table, slice(1000, 2000)), readings, HOW)
        assert_same(start, known, slice(1000, 2000))


SPOILT = {
    "not a number": ({"phi": np.nan}, Status.INVALID),
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
def test_a_spoilt_row_leaves_its_neighbours_alone(readings: bk.Readings, name: str) -> None:
    """A design that cannot be computed, anywhere in the table, gets a status and NaN; all others keep their bits."""
    change, status = SPOILT[name]
    designs = random_designs(40, seed=126)
    known = bk.simulate_table(table_of(designs), readings, HOW)
    for spoilt in (0, 7, LANES, 39):
        other = list(designs)
        other[spoilt] = designs[spoilt]._replace(**change)
        found = bk.simulate_table(table_of(other), readings, HOW)
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


def test_twice_the_same() -> None:
    table = table_of(random_designs(30, seed=128))
    known = bk.simulate_table(table, bk.corrected(), HOW)
    assert_same(bk.simulate_table(table, bk.corrected(), HOW), known)
