"""Records of the kernels in the memory of the page: numbers in a fixed order, and kernels that take them out of arrays.

WebAssembly has no named tuples, so designs, soils and settings are passed as plain numbers; the order of each is here.
"""

from __future__ import annotations

import numpy as np

from boulder_kernels import Control, Design, DesignTable, OutcomeTable, Readings
from boulder_kernels._jit import inlined
from boulder_kernels.ground import Ground
from boulder_kernels.layered import SoilElements, SoilLayers, SoilSums
from boulder_kernels.outlined import OutlinedElements, OutlinedPieces
from boulder_kernels.rules import Course, FlagInputs, Sizes, Tested, VerdictLimits

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
LIMITS = (*VerdictLimits._fields, *Tested._fields)
"""Limits of the criterion, and what the model was tested on, in this order; rad, m, kg/m^3."""
SIZES = (*Sizes._fields, *FlagInputs._fields)
"""Inputs of the rules, then inputs of the flags; SI, the friction angle of the flags in degrees."""
RULE_LIMITS, RULE_SIZES, SIZES_V_0 = len(VerdictLimits._fields), len(Sizes._fields), SIZES.index("v_0")
RULINGS = (*Course._fields, "flags")
"""What the rules make of a design."""
LIMITS_COUNT, SIZES_COUNT, RULINGS_COUNT = len(LIMITS), len(SIZES), len(RULINGS)
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


@inlined
def readings_from(s: np.ndarray) -> Readings:
    """Return the first numbers of an array as readings."""
    return Readings(s[0] > 0.0, s[1] > 0.0, s[2] > 0.0, s[3] > 0.0, s[4] > 0.0)


@inlined
def table_from(s: np.ndarray) -> DesignTable:
    """Return the rows of an array as a table."""
    return DesignTable(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11], s[12], s[13], s[14])


LAYER_ROOM = len(SoilLayers._fields) - 1 + len(SoilSums._fields)
"""Numbers for each layer of the soil of a design: enough for the layers, and once for their sums."""


PIECE_ROOM = len(OutlinedPieces._fields) - 1
"""The same for each piece of the soil beside a boulder with an outline: of M layers and P points M + P - 2."""
ELEMENT_ROOM = len(SoilElements._fields)
"""The same for each of N soil elements, and one more for the weight beside an outline."""


@inlined
def layers_from(t: np.ndarray, sums: np.ndarray) -> SoilLayers:
    """Return the rows of an array, and the numbers of another, as the layers of one design."""
    return SoilLayers(t[0], t[1], t[2], t[3], t[4], t[5], sums)


@inlined
def elements_from(room: np.ndarray, n: int) -> SoilElements:
    """Return the first numbers of an array as n soil elements of one design."""
    return SoilElements(room[:n], room[n : 2 * n], room[2 * n : 3 * n], room[3 * n : 4 * n])


@inlined
def pieces_from(t: np.ndarray, lean: np.ndarray, outline: np.ndarray) -> OutlinedPieces:
    """Return the rows of an array, and a number of another, as the soil of one design beside an outline."""
    return OutlinedPieces(t[0], t[1], t[2], t[3], t[4], t[5], t[6], lean, outline)


@inlined
def outlined_elements_from(room: np.ndarray, n: int, outline: np.ndarray) -> OutlinedElements:
    """Return the first numbers of an array as n soil elements of one design beside an outline."""
    return OutlinedElements(elements_from(room, n), room[4 * n : 4 * n + 1], outline)
