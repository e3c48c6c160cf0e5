"""The bound on the step: no rate of the motion is beyond it, and it shortens ordinary designs little."""

from __future__ import annotations

import numpy as np
import pytest

from boulder_kernels import SIMULATED, Record, Status, constants_of, simulate_design, simulate_table
from boulder_kernels.control import ACCEPTED, Rates, first_step, rates_of, refusal, stable_step
from boulder_kernels.design import design_at
from boulder_kernels.dynamics import Modes, State, acceleration, switches_of
from boulder_sweep.judge.accuracy import STEPS
from docs.studies.random_designs import random_table
from tests.accuracy.box import LIMIT, PRESETS, box_table, how, rows

SAMPLES = 60


def fastest(y: np.ndarray, modes: Modes, readings, c) -> float:
    """Largest modulus of the decaying or oscillating eigenvalues of the motion at a state."""
    switches = switches_of(modes, readings, c)

    def rate(z: np.ndarray) -> np.ndarray:
        k = acceleration(State(*z), switches, c)
        return np.array([z[1], k.a_b, z[3], k.alpha_b, z[5], k.a_v])

    sizes = 1e-6 * np.maximum(np.abs(y), 1e-3)
    columns = [(rate(y + n) - rate(y - n)) / (2.0 * n.max()) for n in np.diag(sizes)]
    values = np.linalg.eigvals(np.array(columns).T)
    bounded = values[(values.real < 0.0) | (np.abs(values.imag) > 1e-6 * np.abs(values))]
    return float(np.abs(bounded).max(initial=0.0))


@pytest.mark.parametrize("preset", PRESETS)
def test_no_rate_along_a_motion_is_beyond_the_stable_step(preset: str) -> None:
    """The negative real axis ends at 3.3, the imaginary one at about 1; sums of both stay below 3.3."""
    readings = PRESETS[preset]
    extreme = box_table(400, 8)
    status = simulate_table(extreme, readings, how()).status
    extreme = rows(extreme, np.isin(status, SIMULATED))
    looked_at = 0
    for table in (random_table(12, 4), rows(extreme, slice(0, 25))):
        for row in range(table.L.size):
            design = design_at(table, row)
            c = constants_of(design, readings, 0)
            h = stable_step(rates_of(LIMIT, c))
            times = np.unique(np.concatenate([np.geomspace(1e-6, 1.0, SAMPLES), np.linspace(0.0, 1.0, SAMPLES)]))
            n = len(times)
            record = Record(
                times, np.full((n, 6), np.nan), np.zeros(n, np.int8), np.zeros(n, np.bool_), np.zeros((n, 4))
            )
            simulate_design(design, readings, how(), record)
            for place in np.flatnonzero(np.isfinite(record.states[:, 0]))[::6]:
                y = record.states[place]
                corner = 1.0 if y[2] < c.theta_corner else -1.0
                modes = Modes(int(record.turning[place]), bool(record.touching[place]), corner, 1.0, 0, 0)
                assert fastest(y, modes, readings, c) * h <= 3.3
                looked_at += 1
    assert looked_at > 100


def test_ordinary_designs_are_shortened_little() -> None:
    """By a third of the steps of the named accuracies at most."""
    table = random_table(300, 6)
    steps = [
        stable_step(rates_of(LIMIT, constants_of(design_at(table, r), PRESETS["corrected"], 0))) for r in range(300)
    ]
    assert min(steps) > 2 / 3 * max(each.step_s for each in STEPS.values())


def test_refusals_go_by_the_largest_rate() -> None:
    calm = Rates(1e2, 1e2, 1e2, 1.0, 1.0)
    assert refusal(0.008, 0.008, 1.0, calm) == ACCEPTED
    for name, status in (
        ("soil", Status.STIFF_SOIL),
        ("truck", Status.STIFF_VEHICLE),
        ("turning", Status.LITTLE_INERTIA),
        ("relaxation", Status.WEAK_DAMPER),
        ("drag", Status.THICK_SOIL),
    ):
        fast = calm._replace(**{name: 1e12 if name in ("soil", "truck", "turning") else 1e7})
        h = min(0.008, stable_step(fast))
        assert refusal(h, 0.008, 1.0, fast) == status
        # Who asks for shorter steps is allowed more of them.
        assert refusal(h, h, 0.1, fast) in (ACCEPTED, Status.STEP_BUDGET)


@pytest.mark.parametrize("stiffness", [1.0, 1e3])
def test_the_finer_step_is_a_third_of_the_coarser_shortened_or_not(stiffness: float) -> None:
    design = design_at(random_table(1, 6), 0)
    c = constants_of(design._replace(k_v=stiffness * design.k_v), PRESETS["corrected"], 0)
    coarse, _ = first_step(how(), LIMIT, c)
    fine, _ = first_step(how()._replace(refined=True), LIMIT, c)
    assert (coarse < how().h) == (stiffness > 1.0)
    assert fine == coarse / 3.0


def test_the_solutions_of_stiff_designs_differ() -> None:
    """A stiff design's two solutions differ, so that its estimated error is not zero by construction."""
    table = box_table(300, 12)
    out = simulate_table(table, PRESETS["corrected"], how(0.02, estimate=True))
    stiff = np.array(
        [
            stable_step(rates_of(LIMIT, constants_of(design_at(table, row), PRESETS["corrected"], 0))) < 0.01
            for row in range(300)
        ]
    )
    computed = stiff & np.isfinite(out.x_error) & (out.x_v_max > 0.0)
    assert computed.sum() > 20
    assert (out.x_error[computed] > 0.0).mean() > 0.9
