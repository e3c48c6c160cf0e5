"""One impact and a row of a table are the same to the last bit: 2,000 designs of every kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from benchmarks import flips
from benchmarks.flips import Case
from boulder_kernels import SIMULATED, Status, no_record, simulate
from boulder_kernels._jit import plain
from boulder_kernels.control import control_for
from boulder_kernels.outcomes import NONE_NEEDED, OUTCOME_FIELDS, T_END
from boulder_kernels.table import problem_at, solve
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of

pytestmark = pytest.mark.compiled

STIFF = {"subgrade_reaction_MN_m3": (1e3, 1e6), "vehicle_damper_N_s_m": (0.1, 1e4)}


KINDS = {
    "balanced": Case(400, ""),
    "fast": Case(200, "solver: {accuracy: fast}"),
    "fine": Case(200, "solver: {accuracy: fine}"),
    "as printed": Case(250, "model: {readings: as_printed}"),
    "layers": Case(150, f"soil: {{{flips.LAYERS}}}"),
    "water and slope": Case(150, f"soil: {{{flips.WATER}, slope: 10 deg}}"),
    "taper": Case(150, "boulder: {taper: 0.7}"),
    "taper, as printed": Case(50, "boulder: {taper: 0.7}\nmodel: {readings: as_printed}"),
    "pieces": Case(50, flips.PROFILE, outlined=True),
    "elements": Case(20, "model: {soil: {elements: 50}}"),
    "slow": Case(150, "", {"impact_speed_m_s": (0.5, 3.0)}),
    "fast trucks": Case(150, "", {"impact_speed_m_s": (30.0, 60.0)}),
    "refused": Case(150, "", STIFF),
}


def test_there_are_two_thousand() -> None:
    assert sum(case.designs for case in KINDS.values()) >= 2000


@pytest.mark.parametrize("name", KINDS)
def test_one_impact_is_a_row_of_a_table(name: str, tmp_path: Path) -> None:
    """Status, maxima, time of the limit and of the end; whatever lies beside the row in its table."""
    case = KINDS[name]
    flips.drawn(name, case).to_parquet(tmp_path / "some.parquet", index=False)
    (tmp_path / "some.yaml").write_text(f"name: some\ntable: some.parquet\n{case.settings}\n")
    sweep = boulder_sweep.load(tmp_path / "some.yaml")
    evaluation = evaluation_of(sweep, accuracy_of(sweep))
    table = evaluation.designs(sweep.block(0, case.designs)).table
    readings, control = evaluation.readings, plain(control_for)(NONE_NEEDED, evaluation.control)
    out, _ = solve(table, readings, control)
    for row, known in enumerate(out[: T_END + 1].T):
        one = simulate(problem_at(table, row, control), readings, control, no_record())
        m = one.maxima
        found = [one.status, m.theta, m.x_b, m.x_v, m.F_v, m.crush, one.t_limit, one.t_end]
        assert np.array_equal(found, known, equal_nan=True), [*zip(OUTCOME_FIELDS, found, known, strict=False)]
    if name == "refused":
        assert np.isin(out[0], (Status.STIFF_SOIL, Status.WEAK_DAMPER)).any()
    else:
        assert np.isin(out[0], SIMULATED).any()
