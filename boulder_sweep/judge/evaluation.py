"""One block of designs from inputs to judged rows: the work that workers do.

The columns of a block become the SI table of the kernels, the kernels simulate, the verdicts are given. Rows
that cannot be computed never enter the kernels; they come back with their reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boulder_kernels import Control, DesignTable, OutcomeTable, Readings, simulate_table
from boulder_sweep.judge.judged import OUTCOME_COLUMNS, Judged, joined, not_computed
from boulder_sweep.judge.verdict import Limits, judge

if TYPE_CHECKING:
    from boulder_sweep.designs import DesignBlock
    from boulder_sweep.judge.accuracy import Accuracy
    from boulder_sweep.settings import Sweep

Simulate = Callable[[DesignTable, Readings, Control], OutcomeTable]
"""What simulates a table of designs; always `by_kernels` outside of tests."""


def by_kernels(table: DesignTable, readings: Readings, control: Control) -> OutcomeTable:
    """Simulate with the compiled kernels.

    A plain function, so that worker processes find it by its name and use the compiled code on the disk; the
    kernel itself would be sent as source and compiled again.
    """
    return simulate_table(table, readings, control)


_SOURCES = {
    "L": "boulder_length_m",
    "W": "boulder_width_m",
    "H": "boulder_height_m",
    "rho_b": "boulder_density_kg_m3",
    "d": "embedment_depth_m",
    "e": "impact_height_m",
    "rho_s": "soil_density_kg_m3",
    "phi": "friction_angle_deg",
    "beta": "subgrade_reaction_MN_m3",
    "K_epsilon": "strain_rate_factor",
    "m_v": "vehicle_mass_kg",
    "v_0": "impact_speed_m_s",
    "k_v": "vehicle_spring_N_m",
    "c_v": "vehicle_damper_N_s_m",
    "e_bumper": "bumper_height_m",
}
"""Column of the table that each field of a `DesignTable` comes from; only the angle changes its unit."""


@dataclass(frozen=True)
class Evaluation:
    """How the designs of one sweep are simulated and judged; the same for every row, sent to every worker.

    Parameters
    ----------
    readings
        Which formulas are read as printed.
    control
        How the motion is integrated.
    limits
        What a design must keep to.
    simulate
        What simulates a table of designs.
    """

    readings: Readings
    control: Control
    limits: Limits
    simulate: Simulate = by_kernels

    def __call__(self, block: DesignBlock) -> Judged:
        """Simulate and judge a block.

        Parameters
        ----------
        block
            Inputs of n rows.

        Returns
        -------
        Judged
            n rows, in the same order.
        """
        if not block.reasons.any:
            return self._judged(block, None)
        codes = np.asarray(block.reasons.codes)
        computable = codes == 0
        refused = not_computed(tuple(block.reasons.texts[1:]), codes[~computable] - 1)
        if not computable.any():
            return joined([refused])
        both = joined([self._judged(block, computable), refused])
        # The refused rows stand behind the others in `both`; give every row its own place again.
        place = np.empty(len(codes), dtype=np.int64)
        place[computable] = np.arange(computable.sum())
        place[~computable] = np.arange(computable.sum(), len(codes))
        return Judged(**{name: getattr(both, name)[place] for name in OUTCOME_COLUMNS}, reasons=both.reasons)

    def _judged(self, block: DesignBlock, rows: np.ndarray | None) -> Judged:
        """Simulate and judge some rows of a block, or all."""
        table = design_table(block, rows)
        outcomes = self.simulate(table, self.readings, self.control)
        bed_offset = _values(block, "bed_offset_m", rows)
        return joined([judge(outcomes, table.L, bed_offset, self.limits)])

    def warm_up(self) -> None:
        """Load or compile the kernels by simulating one step of a plain design."""
        one = DesignTable(*(np.array([value]) for value in _PLAIN_DESIGN.values()))
        self.simulate(one, self.readings, self.control._replace(horizon=self.control.h))


_PLAIN_DESIGN = {
    "L": 1.5,
    "W": 1.5,
    "H": 3.0,
    "rho_b": 2600.0,
    "d": 1.5,
    "e": 0.95,
    "rho_s": 1900.0,
    "phi": math.radians(40.0),
    "beta": 60.0,
    "K_epsilon": 1.0,
    "m_v": 6800.0,
    "v_0": 13.4,
    "k_v": 3.1e6,
    "c_v": 1.4e5,
    "e_bumper": 0.5,
}


def design_table(block: DesignBlock, rows: np.ndarray | None = None) -> DesignTable:
    """Return the inputs of the kernels, in their units.

    Parameters
    ----------
    block
        Inputs of n rows under the names and units of the table.
    rows
        Which of them (bool, shape (n,)); all by default.

    Returns
    -------
    DesignTable
        Contiguous float64 arrays; SI, phi in rad, beta in MN/m^3.
    """
    columns = {field: _values(block, source, rows) for field, source in _SOURCES.items()}
    columns["phi"] = np.radians(columns["phi"])
    return DesignTable(**columns)


def evaluation_of(sweep: Sweep, accuracy: Accuracy, simulate: Simulate = by_kernels) -> Evaluation:
    """Return how the designs of a sweep are simulated, with a given accuracy, and judged."""
    return Evaluation(
        readings=readings_of(sweep),
        control=control_of(sweep, accuracy),
        limits=Limits(math.radians(sweep.criterion.max_rotation_deg), sweep.criterion.rating),
        simulate=simulate,
    )


def readings_of(sweep: Sweep) -> Readings:
    """Return the readings of a sweep's model as the kernels name them."""
    return Readings(*sweep.model.readings.corrected)


def control_of(sweep: Sweep, accuracy: Accuracy) -> Control:
    """Return how the motion is integrated for a sweep: step, horizon, limit, soil, error estimate."""
    return Control(
        h=accuracy.steps.step_s,
        horizon=float(sweep.solver.horizon_s),
        theta_limit=math.radians(sweep.criterion.max_rotation_deg),
        elements=int(sweep.model.soil_elements),
        error_estimate=accuracy.error_estimate,
        locate_yield=accuracy.steps.locate_yield,
    )


def _values(block: DesignBlock, name: str, rows: np.ndarray | None) -> np.ndarray:
    """Values of one input column, one a row."""
    column = block.columns[name]
    if rows is None:
        values = column.to_numpy()
    else:
        values = column.values[rows] if column.codes is None else column.values[column.codes[rows]]
    return np.ascontiguousarray(values, dtype=np.float64)
