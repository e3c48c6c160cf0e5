"""Records of the kernels in the memory of the page: numbers in a fixed order, and kernels that take them out of arrays.

WebAssembly has no named tuples, so designs, soils and settings are passed as plain numbers; the order of each is here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from boulder_kernels import Control, Design, DesignTable, OutcomeTable, Readings
from boulder_kernels._jit import inlined
from boulder_kernels.design import FAR
from boulder_kernels.dynamics import State
from boulder_kernels.ground import Ground
from boulder_kernels.numerics import record_type
from boulder_kernels.outcomes import ExchangedEnergies
from boulder_kernels.pieces import PRESSURE_SLOPE, Piece, SoilElements, SoilSums
from boulder_kernels.rules import Course, FlagInputs, Sizes, TestedRange, VerdictLimits

DESIGN = Design._fields
"""Inputs of a design, in this order; SI, phi in rad, beta in MN/m^3."""
DESIGN_COUNT = len(DESIGN)
V_0 = DESIGN.index("v_0")
READINGS_COUNT = len(Readings._fields)
SETTINGS = (*Readings._fields, *Control._fields)
"""Settings of the simulation, in this order; booleans are 0 or 1. Where errors are estimated, ``paired`` says whether
two solutions are computed of all designs, and not only where they are needed."""
SETTINGS_COUNT = len(SETTINGS)
OUTCOME = OutcomeTable._fields
"""Results of a design, in this order; SI, rad."""
OUTCOME_COUNT = len(OUTCOME)
SIZES, FLAG_INPUTS, COURSE = map(record_type, (Sizes, FlagInputs, Course))
"""Records of a design: inputs of the rules, and of the flags, SI but for the friction angle of the flags in degrees;
and what the rules make of it."""
LIMITS = np.dtype((np.record, [("criterion", record_type(VerdictLimits)), ("tested", record_type(TestedRange))]))
"""Limits of the criterion, and what the model was tested on; rad, m, kg/m^3."""
HISTORY = (
    *("x_b", "v_b", "theta_b", "omega_b", "x_v", "v_v"),
    *("touching", "F_v"),
    *("vehicle_kinetic", "boulder_linear", "boulder_angular", "soil_elastic", "crush_spring"),
    *("gravity", "soil_drag", "crush_damper", "pull"),
)
"""Columns of a time history, in this order; m, rad, N, J. The parts of the energy as in `EnergyLedger`."""
HISTORY_COUNT = len(HISTORY)
ENERGY = HISTORY.index("vehicle_kinetic")
"""Index of the first energy."""
GROUND = (*Ground._fields[:-1], "layered", "slices")
"""What lies around the boulders, in this order, the deeper layers apart; SI, rad, kPa. The last two are arguments of
`boulder_kernels.ground.put_soil`."""
GROUND_COUNT = len(GROUND)
BELOW = 5
"""Numbers of a deeper layer."""


TOUCHING, GRAVITY = HISTORY.index("touching"), HISTORY.index("gravity")
LAYER, OUTLINE, STATE, EXCHANGED = PRESSURE_SLOPE + 1, FAR + 1, len(State._fields), len(ExchangedEnergies._fields)
"""Numbers of a layer, of a point of an outline, of a state, and of the exchanged energies of a sample."""


class SoilCall(NamedTuple):
    """The soil as it lies, and room for what follows from it: numbers, and addresses of arrays of doubles."""

    ground: float
    """Numbers in the order of GROUND."""
    below: float
    deeper: float
    """Deeper layers, shape (deeper, BELOW), and their number."""
    profile: float
    points: float
    """Profile of the boulders, shape (points, 4), and its points; none for boxes."""
    layers: float
    m: float
    """Room for the layers of each design, shape (n, m, 6), see `boulder_kernels.pieces`, and their number; none for a
    uniform soil beside boxes."""
    outlines: float
    """Room for the outlines, shape (n, points, 4), see `boulder_kernels.design`."""
    soil: float
    """Room for the soil of one design: PIECE_ROOM numbers for each of its pieces and SUMS_ROOM, or for N soil
    elements ELEMENT_ROOM N."""


class RowsCall(NamedTuple):
    """What `rows` takes: numbers, and addresses of arrays of doubles."""

    designs: float
    n: float
    """Inputs, shape (len(DESIGN), n); K_epsilon is written over."""
    soil: SoilCall
    controls: float
    solutions: float
    """Settings, shape (solutions, len(SETTINGS)): the first, and finer ones in the order of
    `boulder_sweep.judge.accuracy.finer_controls`."""
    sizes: float
    inputs: float
    """Inputs of the rules, n records of `Sizes`, and of the flags, n records of `FlagInputs`."""
    limits: float
    """A record of `LIMITS`."""
    outcomes: float
    room: float
    """Where the results go, shape (len(OUTCOME), n), and room for three times as many."""
    courses: float
    """Where the rules write, n records of `Course`, and room for as many."""
    flags: float
    """Where the flags go, shape (n,)."""


class HistoryCall(NamedTuple):
    """What `history` takes: numbers, and addresses of arrays of doubles."""

    design: float
    """Inputs, shape (len(DESIGN),); K_epsilon is written over."""
    soil: SoilCall
    settings: float
    """Settings of the simulation, shape (len(SETTINGS),)."""
    n: float
    times: float
    """Number and times of the samples, ascending [s], shape (n,)."""
    states: float
    modes: float
    exchanged: float
    """Room for the record, shapes (n, 6), (2, n) and (n, 4)."""
    history: float
    """Where the results go, shape (len(HISTORY), n); NaN where the simulation does not get."""
    centre: float
    """Where c_x and c_y go, the common centre of mass of boulder and soil (Eqs 3, 4)."""


ROWS_CALL, HISTORY_CALL = record_type(RowsCall), record_type(HistoryCall)


@inlined
def readings_from(s: np.ndarray) -> Readings:
    """Return the first numbers of an array as readings."""
    return Readings(s[0] != 0.0, s[1] != 0.0, s[2] != 0.0, s[3] != 0.0, s[4] != 0.0)


@inlined
def table_from(s: np.ndarray) -> DesignTable:
    """Return the rows of an array as a table."""
    return DesignTable(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11], s[12], s[13], s[14])


PIECE_ROOM, SUMS_ROOM, ELEMENT_ROOM = len(Piece._fields), len(SoilSums._fields), len(SoilElements._fields)
"""Numbers for each piece of the soil of a design, once for their sums, and for each of N soil elements."""


@inlined
def elements_from(t: np.ndarray) -> SoilElements:
    """Return the rows of an array as the soil elements of one design."""
    return SoilElements(t[0], t[1], t[2], t[3])
