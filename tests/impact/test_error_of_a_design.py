"""The numerical error of one design over time is estimated by the rule of a row of a sweep."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_kernels import corrected, simulate_table
from boulder_kernels._jit import plain
from boulder_kernels.control import control_for
from boulder_kernels.outcomes import FINER, NONE_NEEDED
from boulder_sweep.columns import VERDICTS
from boulder_sweep.impact import simulation
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge import evaluation
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.settings.model import PRESETS

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("change", ["vehicle.spring=1e8 N/m", "soil.subgrade_reaction=60000 MN/m^3"])
def test_error_is_estimated_also_where_the_step_is_shortened(preset: str, change: str) -> None:
    """Both solutions are shortened for a stiff design, and the finer still has a third of the step of the coarser."""
    sweep = boulder_sweep.load(
        CONFIGS / "rwg.yaml", [change, "solver.accuracy=balanced", f"model.readings={preset}", "solver.horizon=1 s"]
    )
    row = evaluation_of(sweep, accuracy_of(sweep))(sweep.block(0, 1))
    found = simulate(sweep)
    assert found.verdict == VERDICTS[row.verdict[0]]
    assert found.row["rotation_error_deg"] == row["rotation_error_deg"][0] > 0.0
    # Drawn beyond the limit the motion may take shorter steps; it is the same to within the error.
    apart = abs(math.degrees(found.motion.outcome.maxima.theta) - row["max_rotation_deg"][0])
    assert apart <= found.row["rotation_error_deg"]


def between_the_peaks_of_the_first_two_solutions() -> boulder_sweep.Sweep:
    """A limit that only the first of the two solutions of a doubtful design reaches."""
    sweep = boulder_sweep.load(CONFIGS / "rwg.yaml", ["solver.accuracy=balanced"])
    control = evaluation_of(sweep, accuracy_of(sweep)).control
    design = designs_of(sweep.block(0, 1), None).table
    hows = [plain(control_for)(solution, control)._replace(error_estimate=False) for solution in (NONE_NEEDED, FINER)]
    peaks = [float(np.degrees(simulate_table(design, corrected(), how).theta_max[0])) for how in hows]
    assert peaks[0] > peaks[1]
    limit = 0.25 * peaks[0] + 0.75 * peaks[1]
    return boulder_sweep.load(
        CONFIGS / "rwg.yaml", ["solver.accuracy=balanced", f"criterion.max_rotation={limit!r} deg"]
    )


def test_error_is_unknown_where_only_one_solution_reaches_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither says by how much it is wrong, and where no finer steps are left nothing is decided."""
    for module in (evaluation, simulation):
        monkeypatch.setattr(module, "finer_controls", lambda control: iter(()))
    between = between_the_peaks_of_the_first_two_solutions()
    row = evaluation_of(between, accuracy_of(between))(between.block(0, 1))
    found = simulate(between)
    assert found.verdict == VERDICTS[row.verdict[0]] == "undecided"
    assert np.isnan(row["displacement_error_m"][0])
    assert found.row["displacement_error_m"] is None
    assert row["step_s"][0] == 0.002


def test_a_limit_between_two_solutions_is_decided_by_finer_ones() -> None:
    between = between_the_peaks_of_the_first_two_solutions()
    row = evaluation_of(between, accuracy_of(between))(between.block(0, 1))
    found = simulate(between)
    assert found.verdict == VERDICTS[row.verdict[0]] == "pass"
    assert row["step_s"][0] < 0.002
    assert 0.0 < row["rotation_error_deg"][0] < 1e-5
