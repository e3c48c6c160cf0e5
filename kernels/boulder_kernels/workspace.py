"""The numbers of many lanes in one flat array, field by field.

A loop over lanes is vectorised only where the compiler can see that no store touches a later load. One array with
constant offsets shows it; separate arrays do not. A field occupies LANES consecutive places, so that neighbouring
lanes are neighbours in memory. The functions below are the only ones that know where a field lies.
"""

from __future__ import annotations

import numpy as np

from ._jit import inlined
from .design import Constants
from .dynamics import Acceleration, State
from .gaps import GapFactors
from .modes import Modes, Switches
from .outcomes import Maxima

LANES = 8
"""Designs that are integrated side by side: one vector of eight doubles. More of them hide no more latency and take
more of the fastest memory (measured: 2 to 5 % slower with 16 or 32)."""

_FIELDS = {
    "constants": len(Constants._fields),
    "switches": len(Switches._fields),
    "factors": len(GapFactors._fields),
    "state": len(State._fields),
    "start": len(Acceleration._fields),
    "end_state": len(State._fields),
    "end": len(Acceleration._fields),
    "step": 1,
    "step_full": 1,
    "time": 1,
    "compression": 2,
    "barrier": 1,
    "maxima": 4,
    "attention": 1,
    "modes": len(Modes._fields),
    "attempts_left": 1,
}


def _offset(field: str) -> int:
    names = list(_FIELDS)
    return LANES * sum(_FIELDS[name] for name in names[: names.index(field)])


SIZE = LANES * sum(_FIELDS.values())
CONSTANTS = _offset("constants")
SWITCHES = _offset("switches")
FACTORS = _offset("factors")
STATE = _offset("state")
START = _offset("start")
END_STATE = _offset("end_state")
END = _offset("end")
STEP = _offset("step")
"""Length of the next step [s]."""
STEP_FULL = _offset("step_full")
"""Length of a step that nothing shortens [s]."""
TIME = _offset("time")
COMPRESSION = _offset("compression")
"""Compression of the vehicle's spring at the start of the step [m], and its rate [m/s]."""
BARRIER = _offset("barrier")
"""Energy below which the motion has settled [J], see `boulder_kernels.settling`."""
MAXIMA = _offset("maxima")
"""Largest |theta_b|, x_b, x_v, F_v."""
ATTENTION = _offset("attention")
"""1.0 where a step needs more than to be taken over."""
MODES = _offset("modes")
ATTEMPTS_LEFT = _offset("attempts_left")


@inlined
def field(ws: np.ndarray, block: int, index: int, lane: int) -> float:
    """Return number ``index`` of a block of fields for one lane."""
    return ws[block + index * LANES + lane]


@inlined
def put(ws: np.ndarray, block: int, index: int, lane: int, value: float) -> None:
    """Write number ``index`` of a block of fields for one lane."""
    ws[block + index * LANES + lane] = value


@inlined
def load_constants(ws: np.ndarray, lane: int) -> Constants:
    """Constants of the design in a lane; lanes know the closed form of the soil only."""
    return Constants(
        field(ws, CONSTANTS, 0, lane),
        field(ws, CONSTANTS, 1, lane),
        field(ws, CONSTANTS, 2, lane),
        field(ws, CONSTANTS, 3, lane),
        field(ws, CONSTANTS, 4, lane),
        field(ws, CONSTANTS, 5, lane),
        field(ws, CONSTANTS, 6, lane),
        field(ws, CONSTANTS, 7, lane),
        field(ws, CONSTANTS, 8, lane),
        0,
        field(ws, CONSTANTS, 10, lane),
        field(ws, CONSTANTS, 11, lane),
        field(ws, CONSTANTS, 12, lane),
        field(ws, CONSTANTS, 13, lane),
        field(ws, CONSTANTS, 14, lane),
        field(ws, CONSTANTS, 15, lane),
        field(ws, CONSTANTS, 16, lane),
        field(ws, CONSTANTS, 17, lane),
        field(ws, CONSTANTS, 18, lane),
        field(ws, CONSTANTS, 19, lane),
        field(ws, CONSTANTS, 20, lane),
        field(ws, CONSTANTS, 21, lane),
        field(ws, CONSTANTS, 22, lane),
    )


@inlined
def store_constants(ws: np.ndarray, lane: int, c: Constants) -> None:
    """Put the constants of a design into a lane."""
    put(ws, CONSTANTS, 0, lane, c.m_eff)
    put(ws, CONSTANTS, 1, lane, c.J_eff)
    put(ws, CONSTANTS, 2, lane, c.inverse_m_eff)
    put(ws, CONSTANTS, 3, lane, c.inverse_J_eff)
    put(ws, CONSTANTS, 4, lane, c.c_x)
    put(ws, CONSTANTS, 5, lane, c.c_y)
    put(ws, CONSTANTS, 6, lane, c.l_n)
    put(ws, CONSTANTS, 7, lane, c.z_0)
    put(ws, CONSTANTS, 8, lane, c.d)
    put(ws, CONSTANTS, 10, lane, c.K_soil)
    put(ws, CONSTANTS, 11, lane, c.R_soil)
    put(ws, CONSTANTS, 12, lane, c.x_yield)
    put(ws, CONSTANTS, 13, lane, c.h)
    put(ws, CONSTANTS, 14, lane, c.g_x)
    put(ws, CONSTANTS, 15, lane, c.k_v)
    put(ws, CONSTANTS, 16, lane, c.k_m)
    put(ws, CONSTANTS, 17, lane, c.tau_v)
    put(ws, CONSTANTS, 18, lane, c.v_0)
    put(ws, CONSTANTS, 19, lane, c.C_cos)
    put(ws, CONSTANTS, 20, lane, c.C_sin)
    put(ws, CONSTANTS, 21, lane, c.d_N)
    put(ws, CONSTANTS, 22, lane, c.theta_corner)


@inlined
def load_switches(ws: np.ndarray, lane: int) -> Switches:
    """Factors of the right-hand side in a lane."""
    return Switches(
        field(ws, SWITCHES, 0, lane),
        field(ws, SWITCHES, 1, lane),
        field(ws, SWITCHES, 2, lane),
        field(ws, SWITCHES, 3, lane),
        field(ws, SWITCHES, 4, lane),
    )


@inlined
def store_switches(ws: np.ndarray, lane: int, s: Switches) -> None:
    """Put the factors of the right-hand side into a lane."""
    put(ws, SWITCHES, 0, lane, s.net)
    put(ws, SWITCHES, 1, lane, s.couple)
    put(ws, SWITCHES, 2, lane, s.couple_sin)
    put(ws, SWITCHES, 3, lane, s.k_contact)
    put(ws, SWITCHES, 4, lane, s.k_truck)


@inlined
def load_factors(ws: np.ndarray, lane: int) -> GapFactors:
    """Factors of the gaps in a lane."""
    return GapFactors(
        field(ws, FACTORS, 0, lane),
        field(ws, FACTORS, 1, lane),
        field(ws, FACTORS, 2, lane),
        field(ws, FACTORS, 3, lane),
        field(ws, FACTORS, 4, lane),
        field(ws, FACTORS, 5, lane),
        field(ws, FACTORS, 6, lane),
        field(ws, FACTORS, 7, lane),
        field(ws, FACTORS, 8, lane),
        field(ws, FACTORS, 9, lane),
        field(ws, FACTORS, 10, lane),
        field(ws, FACTORS, 11, lane),
        field(ws, FACTORS, 12, lane),
        field(ws, FACTORS, 13, lane),
        field(ws, FACTORS, 14, lane),
        field(ws, FACTORS, 15, lane),
        field(ws, FACTORS, 16, lane),
        field(ws, FACTORS, 17, lane),
        field(ws, FACTORS, 18, lane),
        field(ws, FACTORS, 19, lane),
        field(ws, FACTORS, 20, lane),
        field(ws, FACTORS, 21, lane),
    )


@inlined
def store_factors(ws: np.ndarray, lane: int, g: GapFactors) -> None:
    """Put the factors of the gaps into a lane."""
    put(ws, FACTORS, 0, lane, g.contact_0)
    put(ws, FACTORS, 1, lane, g.contact)
    put(ws, FACTORS, 2, lane, g.rotation_0)
    put(ws, FACTORS, 3, lane, g.rotation_M)
    put(ws, FACTORS, 4, lane, g.rotation_abs_M)
    put(ws, FACTORS, 5, lane, g.rotation_theta)
    put(ws, FACTORS, 6, lane, g.rotation_omega)
    put(ws, FACTORS, 7, lane, g.couple_0)
    put(ws, FACTORS, 8, lane, g.couple_M)
    put(ws, FACTORS, 9, lane, g.couple_abs_M)
    put(ws, FACTORS, 10, lane, g.couple_limit)
    put(ws, FACTORS, 11, lane, g.corner_0)
    put(ws, FACTORS, 12, lane, g.corner_theta)
    put(ws, FACTORS, 13, lane, g.arm_0)
    put(ws, FACTORS, 14, lane, g.arm)
    put(ws, FACTORS, 15, lane, g.top_0)
    put(ws, FACTORS, 16, lane, g.top_abs)
    put(ws, FACTORS, 17, lane, g.top)
    put(ws, FACTORS, 18, lane, g.base_0)
    put(ws, FACTORS, 19, lane, g.base_abs)
    put(ws, FACTORS, 20, lane, g.base)
    put(ws, FACTORS, 21, lane, g.limit)


@inlined
def load_state(ws: np.ndarray, lane: int) -> State:
    """State of a lane at the start of its step."""
    return State(
        field(ws, STATE, 0, lane),
        field(ws, STATE, 1, lane),
        field(ws, STATE, 2, lane),
        field(ws, STATE, 3, lane),
        field(ws, STATE, 4, lane),
        field(ws, STATE, 5, lane),
    )


@inlined
def store_state(ws: np.ndarray, lane: int, y: State) -> None:
    """Put the state at the start of a step into a lane."""
    put(ws, STATE, 0, lane, y.x_b)
    put(ws, STATE, 1, lane, y.v_b)
    put(ws, STATE, 2, lane, y.theta_b)
    put(ws, STATE, 3, lane, y.omega_b)
    put(ws, STATE, 4, lane, y.x_v)
    put(ws, STATE, 5, lane, y.v_v)


@inlined
def load_end_state(ws: np.ndarray, lane: int) -> State:
    """State of a lane at the end of its step."""
    return State(
        field(ws, END_STATE, 0, lane),
        field(ws, END_STATE, 1, lane),
        field(ws, END_STATE, 2, lane),
        field(ws, END_STATE, 3, lane),
        field(ws, END_STATE, 4, lane),
        field(ws, END_STATE, 5, lane),
    )


@inlined
def store_end_state(ws: np.ndarray, lane: int, y: State) -> None:
    """Put the state at the end of a step into a lane."""
    put(ws, END_STATE, 0, lane, y.x_b)
    put(ws, END_STATE, 1, lane, y.v_b)
    put(ws, END_STATE, 2, lane, y.theta_b)
    put(ws, END_STATE, 3, lane, y.omega_b)
    put(ws, END_STATE, 4, lane, y.x_v)
    put(ws, END_STATE, 5, lane, y.v_v)


@inlined
def load_start(ws: np.ndarray, lane: int) -> Acceleration:
    """Acceleration of a lane at the start of its step."""
    return Acceleration(
        field(ws, START, 0, lane),
        field(ws, START, 1, lane),
        field(ws, START, 2, lane),
        field(ws, START, 3, lane),
    )


@inlined
def store_start(ws: np.ndarray, lane: int, k: Acceleration) -> None:
    """Put the acceleration at the start of a step into a lane."""
    put(ws, START, 0, lane, k.a_b)
    put(ws, START, 1, lane, k.alpha_b)
    put(ws, START, 2, lane, k.a_v)
    put(ws, START, 3, lane, k.M)


@inlined
def load_end(ws: np.ndarray, lane: int) -> Acceleration:
    """Acceleration of a lane at the end of its step."""
    return Acceleration(
        field(ws, END, 0, lane),
        field(ws, END, 1, lane),
        field(ws, END, 2, lane),
        field(ws, END, 3, lane),
    )


@inlined
def store_end(ws: np.ndarray, lane: int, k: Acceleration) -> None:
    """Put the acceleration at the end of a step into a lane."""
    put(ws, END, 0, lane, k.a_b)
    put(ws, END, 1, lane, k.alpha_b)
    put(ws, END, 2, lane, k.a_v)
    put(ws, END, 3, lane, k.M)


@inlined
def load_modes(ws: np.ndarray, lane: int) -> Modes:
    """Modes of a lane."""
    return Modes(
        int(field(ws, MODES, 0, lane)),
        field(ws, MODES, 1, lane) != 0.0,
        field(ws, MODES, 2, lane),
        field(ws, MODES, 3, lane),
        int(field(ws, MODES, 4, lane)),
        int(field(ws, MODES, 5, lane)),
    )


@inlined
def store_modes(ws: np.ndarray, lane: int, m: Modes) -> None:
    """Put the modes into a lane."""
    put(ws, MODES, 0, lane, m.turning)
    put(ws, MODES, 1, lane, m.touching)
    put(ws, MODES, 2, lane, m.corner)
    put(ws, MODES, 3, lane, m.arm)
    put(ws, MODES, 4, lane, m.yielded_top)
    put(ws, MODES, 5, lane, m.yielded_base)


@inlined
def load_maxima(ws: np.ndarray, lane: int) -> Maxima:
    """Maxima of a lane so far; lanes do not keep the times."""
    return Maxima(
        field(ws, MAXIMA, 0, lane),
        0.0,
        field(ws, MAXIMA, 1, lane),
        0.0,
        field(ws, MAXIMA, 2, lane),
        0.0,
        field(ws, MAXIMA, 3, lane),
        0.0,
    )


@inlined
def store_maxima(ws: np.ndarray, lane: int, m: Maxima) -> None:
    """Put the maxima so far into a lane."""
    put(ws, MAXIMA, 0, lane, m.theta)
    put(ws, MAXIMA, 1, lane, m.x_b)
    put(ws, MAXIMA, 2, lane, m.x_v)
    put(ws, MAXIMA, 3, lane, m.F_v)
