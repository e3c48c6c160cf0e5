"""Records of the kernels in the memory of the page: numbers in a fixed order, and kernels that take them out of arrays.

WebAssembly has no named tuples, so designs, soils and settings are passed as plain numbers; the order of each is here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_type_hints

import numpy as np

from boulder_kernels import Control, Design, DesignTable, OutcomeTable, Readings
from boulder_kernels._jit import function_of, inlined
from boulder_kernels.control import EVENT_TOLERANCE
from boulder_kernels.ground import Ground
from boulder_kernels.layered import SoilElements, SoilLayers, SoilSums
from boulder_kernels.outlined import OutlinedElements, OutlinedPieces
from boulder_kernels.rules import RULINGS, SIZES, FlagInputs, Tested, VerdictLimits

DESIGN = Design._fields
"""Inputs of a design, in this order; SI, phi in rad, beta in MN/m^3."""
DESIGN_COUNT = len(DESIGN)
V_0, D, H = (DESIGN.index(name) for name in ("v_0", "d", "H"))
SETTINGS = (*Readings._fields, *Control._fields)
"""Settings of the simulation, in this order; booleans are 0 or 1."""
SETTINGS_COUNT = len(SETTINGS)
PAIRED_AT = SETTINGS.index("paired")
CHECKED, PAIRED, ONCE = range(3)
"""What the setting ``paired`` may be in the page, where errors are estimated: two solutions where they are needed, of
all designs, or of none."""
OUTCOME = OutcomeTable._fields
"""Results of a design, in this order; SI, rad."""
LIMITS = (*VerdictLimits._fields, *Tested._fields)
"""Limits of the criterion, and what the model was tested on, in this order; rad, m, kg/m^3."""
FLAG_SIZES = FlagInputs._fields[FlagInputs._fields.index("L") :]
"""Inputs of the flags, behind those of the rules."""
LIMITS_COUNT, SIZES_COUNT, RULINGS_COUNT = len(LIMITS), len(SIZES) + len(FLAG_SIZES), len(RULINGS)
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


def written_out(source: str, **names: Any) -> Callable[..., Any]:
    """Return a kernel of this module by its source text, with the names it refers to."""
    function = function_of(source, **names)
    function.__module__ = __name__
    return inlined(function)


def taking(record: Any, first: int = 0) -> Callable[[np.ndarray], Any]:
    """Return a kernel that takes a record out of the rows of an array, from one on; a boolean is any other than 0."""
    forms = {bool: "s[{}] > 0.0", int: "int(s[{}])"}
    fields = [forms.get(kind, "s[{}]").format(first + k) for k, kind in enumerate(get_type_hints(record).values())]
    return written_out(f"def take(s):\n return Record({', '.join(fields)})", Record=record)


def changing_control(arguments: str, **changed: str) -> Callable[..., Control]:
    """Return a kernel that takes a control c and other arguments, and changes fields to expressions of them."""
    fields = [changed.get(name, f"c.{name}") for name in Control._fields]
    source = f"def change({arguments}):\n return Control({', '.join(fields)})"
    return written_out(source, Control=Control)


readings_from, given_control = taking(Readings), taking(Control, len(Readings._fields))
table_from, outcomes_from = taking(DesignTable), taking(OutcomeTable)
tested_from = taking(Tested, len(VerdictLimits._fields))
outcome_at = written_out(
    f"def take(s, row):\n return OutcomeTable({', '.join(f's[{k}, row]' for k in range(len(OUTCOME)))})",
    OutcomeTable=OutcomeTable,
)
"""The results of one design, numbers in place of columns."""
flag_inputs_at = written_out(
    "def take(o, overlap, s, row):\n return FlagInputs(o.x_b_max, o.crush_max, o.theta_max, overlap, "
    f"{', '.join(f's[{k}, row]' for k in range(len(SIZES), len(SIZES) + len(FLAG_SIZES)))})",
    FlagInputs=FlagInputs,
)
"""What the flags of one design depend on."""
first_control = changing_control("c, refined", refined="refined", paired="False")
"""Control of a solution, with its step or a third of it."""
halved_control = changing_control("c", h="0.5 * c.h", locate_yield="True", event_tolerance=repr(EVENT_TOLERANCE))
"""Control of a second solution, `boulder_kernels.table.halved`."""


@inlined
def copy_row(outcomes: np.ndarray, to: np.ndarray, row: int) -> None:
    """Copy the results of one design, columns of arrays of shape (len(OUTCOME), n)."""
    for column in range(outcomes.shape[0]):
        to[column, row] = outcomes[column, row]


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
