"""From a block of designs to judged rows."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from boulder_kernels import simulate_table
from boulder_sweep.columns import VERDICTS
from boulder_sweep.judge.accuracy import accuracy_of, control_of, readings_of
from boulder_sweep.judge.evaluation import by_kernels, evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.judge.judged import ERROR
from boulder_sweep.settings import load_text
from tests.runner.grids import grid, partly_impossible, plausible


def test_the_kernels_get_si_and_radians():
    sweep = grid()
    block = sweep.block(0, sweep.n_designs)
    table = designs_of(block).table
    assert table.phi == pytest.approx(np.radians(block.columns["friction_angle_deg"].to_numpy()))
    assert table.beta == pytest.approx(block.columns["subgrade_reaction_MN_m3"].to_numpy())
    assert table.e_bumper[0] == 0.5
    assert table.e == pytest.approx(0.5 * (np.minimum(table.H - table.d, 1.4) + 0.5))
    for column in table:
        assert column.dtype == np.float64
        assert column.flags["C_CONTIGUOUS"]
        assert len(column) == sweep.n_designs


def test_readings_and_control_are_those_of_the_settings():
    sweep = grid(soil="{elements: 50}", rotation="10 deg", step="2 ms")
    assert all(readings_of(sweep))
    control = control_of(sweep, accuracy_of(sweep))
    assert control.elements == 50
    assert control.h == 0.002
    assert control.horizon == 1.0
    assert control.theta_limit == pytest.approx(np.radians(10.0))


def test_impossible_rows_never_enter_the_kernels_and_keep_their_place():
    sweep = partly_impossible()
    seen = []

    def watching(table, readings, control):
        seen.append(table)
        return plausible(table, readings, control)

    block = sweep.block(0, sweep.n_designs)
    rows = evaluation_of(sweep, accuracy_of(sweep), watching)(block)
    impossible = block.reasons.codes != 0
    assert 0 < impossible.sum() < len(impossible)
    (table,) = seen
    assert len(table.L) == (~impossible).sum()
    assert (table.d < table.H).all()
    for row in range(0, sweep.n_designs, 7):
        alone = evaluation_of(sweep, accuracy_of(sweep), plausible)(sweep.block(row, row + 1))
        assert alone.row(0) == rows.row(row)
        assert (VERDICTS[alone.verdict[0]] == "error" and bool(block.reasons[row])) == impossible[row]


def test_a_block_of_impossible_rows_only():
    sweep = grid(height="[2 m, 3 m]", site="embedment_depth: 3.5 m")
    rows = evaluation_of(sweep, accuracy_of(sweep), _never)(sweep.block(0, sweep.n_designs))
    assert (rows.verdict == ERROR).all()
    assert all(rows.reasons[code] for code in rows.reason)


def _never(table, readings, control):
    raise AssertionError("nothing to simulate")


def test_an_evaluation_is_sent_by_name_not_as_source():
    evaluation = evaluation_of(grid(), accuracy_of(grid()))
    assert evaluation.simulate is by_kernels
    sent = pickle.dumps(evaluation)
    assert len(sent) < 2_000
    assert pickle.loads(sent) == evaluation


def test_the_plain_function_is_the_kernel():
    sweep = grid()
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    table = designs_of(sweep.block(0, 9)).table
    direct = simulate_table(table, evaluation.readings, evaluation.control)
    for one, other in zip(direct, by_kernels(table, evaluation.readings, evaluation.control), strict=True):
        assert np.array_equal(one, other, equal_nan=True)


HEAVY_TRUCK = """
boulder: {length: 2 m, width: 2.5 m, height: 4 m, density: 2600 kg/m^3}
site: {embedment_ratio: [0.7, 0.75]}
soil: {density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 95 MN/m^3}
vehicle: {mass: 65000 lb, speed: 40 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


def test_a_truck_inside_the_boulder_is_never_a_pass():
    """Crushed by more than the cab is long: neither rotation nor penetration would keep it from a pass."""
    sweep = load_text(HEAVY_TRUCK, Path("heavy.yaml"))
    rows = evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, 2))
    for row in (rows.row(0), rows.row(1)):
        assert (row["verdict"], row["reason"]) == ("undecided", "crush")
        assert row["vehicle_crush_m"] > 2.9
        assert row["max_rotation_deg"] < 20.0
        assert row["penetration_m"] < 1.0
        assert row["margin"] is row["rating"] is None
        assert "crush" in row["validity"].split(";")
