"""Groups of lanes: designs side by side, one in each lane of the vector registers, and how their numbers are kept.

A group of lanes is one record, in which every field has a number for each lane: ``group.y.theta_b[lane]``. A field
keeps the numbers of neighbouring lanes next to each other, and all fields are parts of one record. The compiler can
then see that no store touches a later load, and vectorises a loop over the lanes. A soil in pieces adds fields of its
own. For each named tuple one function loads a lane's numbers from its record, and one stores them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from itertools import product
from typing import Any, NamedTuple

import numba
import numpy as np

from ._jit import IS_PLAIN, by_types, inlined, kernel, on_lines, through
from .design import Constants, Design, Readings, body_in, constants_of
from .dynamics import Acceleration, Modes, State, Switches
from .events import GapFactors
from .impact import Clock, Impact, Pace
from .numerics import put
from .outcomes import Compression, Maxima
from .pieces import (
    BELOW,
    BODY_SIZE,
    COUNTS,
    PIECE_SIZE,
    FewPieces,
    Piece,
    SoilSums,
    constants_of_few,
    given_piece_in,
    with_soil,
)

LANES = 1 if IS_PLAIN else 8
"""Designs that are integrated side by side: one vector of eight doubles. More of them hide no more latency and take
more of the fastest memory (measured: 2 to 5 % slower with 16 or 32). Without the compiler there is nothing to gain."""


class Attempt(NamedTuple):
    """What is known of a lane's last step, beside where it ended."""

    error: float
    """Estimated error of the step [m/s]."""
    plain: float
    """1.0 where it has been accepted as it is."""
    status: float
    """RUNNING, or why the design that has been started here needs no step."""


UNUSED = ("c_x", "c_y", "elements", "d_N")
"""Constants that no motion in lanes depends on."""


def numbers_of(names: tuple[str, ...]) -> np.dtype:
    """Return the type of a record of the lanes' numbers under these names."""
    numbers = np.dtype([(name, np.float64, (LANES,)) for name in names], align=True)
    return np.dtype((np.record, numbers))


@functools.cache
def group_type(pieces: int, has_strength: bool, has_outline: bool) -> np.dtype:
    """Return the type of a group of lanes.

    ``pieces``: number of pieces of the soil of a design, in `boulder_kernels.pieces.COUNTS`; 0 for uniform soils beside
    boxes; ``has_strength``: whether the ultimate resistance of a piece may be other than proportional to the depth;
    ``has_outline``: whether boulders are no boxes.
    """
    records: list[Any] = []
    given = BELOW
    if pieces:  # first, since Numba takes a record that begins like another for a kind of it
        # A piece begins where the one above it ends.
        some = *(("w_0", "w_1") if has_outline else ()), *(("P_0",) if has_strength else ())
        piece = *some, "to", "K", "inverse_K", "P_1", "R"
        records += [("lean", np.float64, (LANES,))] if has_outline else []
        records += [("sums", numbers_of(SoilSums._fields)), ("pieces", numbers_of(piece), (pieces,))]
        given += BODY_SIZE + PIECE_SIZE * pieces
    tuples: list[Any] = [("pace", Pace), ("y", State), ("k", Acceleration), ("front", Compression), ("maxima", Maxima)]
    tuples += [("clock", Clock), ("modes", Modes), ("switches", Switches), ("factors", GapFactors)]
    tuples += [("y_end", State), ("k_end", Acceleration), ("attempt", Attempt)]
    records += [(name, numbers_of(each._fields)) for name, each in tuples]
    records += [("constants", numbers_of(tuple(name for name in Constants._fields if name not in UNUSED)))]
    records += [("given", np.float64, (given, LANES))]
    return np.dtype((np.record, np.dtype(records, align=True)))


_SOILS = (0, True, True), *product(COUNTS, (False, True), (False, True))
GROUP_TYPES = tuple(numba.from_dtype(group_type(*soil)) for soil in _SOILS)
"""Numba's types of all groups, made in the same order in every process and kept. Numba numbers record types as they are
made, and names compiled code by these numbers. Code that two processes have compiled for two kinds of groups could have
one name, and a process that loads both would run one in place of the other."""


def empty_groups(pieces: int = 0, *, has_strength: bool = True, has_outline: bool = True) -> np.ndarray:
    """Return two groups of lanes: where designs run, and where they are started. Arguments: see `group_type`.

    Their vectors lie on whole lines of the fast memory.
    """
    kind = group_type(pieces, has_strength, has_outline)
    return on_lines(2 * kind.itemsize).view(kind)


def field_of(record: Any, name: str) -> Any:
    """Return a field of a record or of its type, Numba's or NumPy's; None if there is none of this name."""
    if isinstance(record, numba.types.Record):
        return record.fields[name].type if name in record.fields else None
    return record[name] if name in record.dtype.names else None


def is_uniform(group: Any) -> bool:
    """Return whether a group of lanes, or its type, is of uniform soils."""
    return field_of(group, "pieces") is None


@inlined
def load_state(y: Any, lane: int) -> State:
    """Load the state of the motion."""
    return State(y.x_b[lane], y.v_b[lane], y.theta_b[lane], y.omega_b[lane], y.x_v[lane], y.v_v[lane])


@inlined
def store_state(to: Any, lane: int, y: State) -> None:
    """Store the state of the motion."""
    to.x_b[lane], to.v_b[lane], to.theta_b[lane], to.omega_b[lane], to.x_v[lane], to.v_v[lane] = y


@inlined
def load_acceleration(k: Any, lane: int) -> Acceleration:
    """Load the acceleration at a state."""
    return Acceleration(k.a_b[lane], k.alpha_b[lane], k.a_v[lane], k.M[lane])


@inlined
def store_acceleration(to: Any, lane: int, k: Acceleration) -> None:
    """Store the acceleration at a state."""
    to.a_b[lane], to.alpha_b[lane], to.a_v[lane], to.M[lane] = k


@inlined
def load_switches(s: Any, lane: int) -> Switches:
    """Load the factors of the modes."""
    return Switches(s.net[lane], s.couple[lane], s.couple_sin[lane], s.k_contact[lane], s.k_truck[lane])


@inlined
def store_attempt(to: Any, lane: int, attempt: Attempt) -> None:
    """Store what is known of a step."""
    to.error[lane], to.plain[lane], to.status[lane] = attempt


@inlined
def store_pace(to: Any, lane: int, pace: Pace) -> None:
    """Store which steps an impact is given."""
    to.h_touching[lane], to.h_apart[lane], to.budget[lane] = pace


@inlined
def load_front(u: Any, lane: int) -> Compression:
    """Load the compression of the vehicle."""
    return Compression(u.u[lane], u.rate[lane], u.crush[lane], u.crush_rate[lane])


@inlined
def load_maxima(m: Any, lane: int) -> Maxima:
    """Load the largest values so far."""
    theta, t_theta, x_b, t_x_b = m.theta[lane], m.t_theta[lane], m.x_b[lane], m.t_x_b[lane]
    x_v, t_x_v, F_v, t_F_v = m.x_v[lane], m.t_x_v[lane], m.F_v[lane], m.t_F_v[lane]
    return Maxima(theta, t_theta, x_b, t_x_b, x_v, t_x_v, F_v, t_F_v, m.crush[lane], m.t_crush[lane])


@inlined
def load_clock(c: Any, lane: int) -> Clock:
    """Load how far the simulation has come."""
    t, h, h_full, attempts, barrier = c.t[lane], c.h[lane], c.h_full[lane], c.attempts[lane], c.barrier[lane]
    return Clock(t, h, h_full, attempts, barrier, c.horizon[lane], c.error[lane], c.rotation_changes[lane])


@inlined
def store_clock(to: Any, lane: int, c: Clock) -> None:
    """Store how far the simulation has come."""
    to.t[lane], to.h[lane], to.h_full[lane], to.attempts[lane] = c.t, c.h, c.h_full, c.attempts
    to.barrier[lane], to.horizon[lane] = c.barrier, c.horizon
    to.error[lane], to.rotation_changes[lane] = c.error, c.rotation_changes


@inlined
def load_modes(m: Any, lane: int) -> Modes:
    """Load the modes of the motion."""
    turning, touching, corner, arm = int(m.turning[lane]), m.touching[lane] != 0.0, m.corner[lane], m.arm[lane]
    return Modes(turning, touching, corner, arm, int(m.yielded_top[lane]), int(m.yielded_base[lane]))


@inlined
def load_factors(g: Any, lane: int) -> GapFactors:
    """Load what the events follow from."""
    return GapFactors(
        g.contact[lane],
        g.rotation_0[lane],
        g.rotation_abs_M[lane],
        g.rotation_theta[lane],
        g.rotation_omega[lane],
        g.couple_M[lane],
        g.couple_abs_M[lane],
        g.couple_limit[lane],
        g.corner_0[lane],
        g.corner_theta[lane],
        g.arm[lane],
        g.top[lane],
        g["base"][lane],  # without the compiler, ``g.base`` is an attribute that every record of NumPy has
        g.limit[lane],
        g.tolerance[lane],
    )


@inlined
def load_impact(group: Any, lane: int) -> Impact:
    """Load what a simulation carries from step to step."""
    pace = group.pace
    return Impact(
        Pace(pace.h_touching[lane], pace.h_apart[lane], pace.budget[lane]),
        load_state(group.y, lane),
        load_acceleration(group.k, lane),
        load_front(group.front, lane),
        load_maxima(group.maxima, lane),
        load_clock(group.clock, lane),
        load_modes(group.modes, lane),
        load_switches(group.switches, lane),
        load_factors(group.factors, lane),
    )


@inlined
def store_motion(group: Any, lane: int, i: Impact) -> None:
    """Store what changes with every step of an impact."""
    front, maxima, m = group.front, group.maxima, i.maxima
    store_state(group.y, lane, i.y)
    store_acceleration(group.k, lane, i.k)
    front.u[lane], front.rate[lane], front.crush[lane], front.crush_rate[lane] = i.front
    maxima.theta[lane], maxima.t_theta[lane], maxima.x_b[lane], maxima.t_x_b[lane] = m.theta, m.t_theta, m.x_b, m.t_x_b
    maxima.x_v[lane], maxima.t_x_v[lane], maxima.F_v[lane], maxima.t_F_v[lane] = m.x_v, m.t_x_v, m.F_v, m.t_F_v
    maxima.crush[lane], maxima.t_crush[lane] = m.crush, m.t_crush
    store_clock(group.clock, lane, i.clock)


@inlined
def store_modes(group: Any, lane: int, i: Impact) -> None:
    """Store what changes with the modes of an impact."""
    modes, s, to, g = group.modes, group.switches, group.factors, i.factors
    modes.turning[lane], modes.touching[lane], modes.corner[lane] = i.modes.turning, i.modes.touching, i.modes.corner
    modes.arm[lane], modes.yielded_top[lane] = i.modes.arm, i.modes.yielded_top
    modes.yielded_base[lane] = i.modes.yielded_base
    s.net[lane], s.couple[lane], s.couple_sin[lane], s.k_contact[lane], s.k_truck[lane] = i.switches
    to.contact[lane], to.rotation_0[lane], to.rotation_abs_M[lane] = g.contact, g.rotation_0, g.rotation_abs_M
    to.rotation_theta[lane], to.rotation_omega[lane] = g.rotation_theta, g.rotation_omega
    to.couple_M[lane], to.couple_abs_M[lane], to.couple_limit[lane] = g.couple_M, g.couple_abs_M, g.couple_limit
    to.corner_0[lane], to.corner_theta[lane], to.arm[lane] = g.corner_0, g.corner_theta, g.arm
    to.top[lane], to["base"][lane], to.limit[lane], to.tolerance[lane] = g.top, g.base, g.limit, g.tolerance


@inlined
def load_numbers(c: Any, lane: int) -> Constants:
    """Load constants but for their soil; those that are `UNUSED` are zero."""
    return Constants(
        c.m_eff[lane],
        c.J_eff[lane],
        c.inverse_m_eff[lane],
        c.inverse_J_eff[lane],
        0.0,
        0.0,
        c.l_n[lane],
        c.z_0[lane],
        c.d[lane],
        0,
        c.K_soil[lane],
        c.R_soil[lane],
        c.x_yield[lane],
        c.h[lane],
        c.g_x[lane],
        c.k_v[lane],
        c.k_m[lane],
        c.tau_v[lane],
        c.v_0[lane],
        c.C_cos[lane],
        c.C_sin[lane],
        0.0,
        c.theta_corner[lane],
    )


@inlined
def store_numbers(to: Any, lane: int, c: Any) -> None:
    """Store constants but for their soil and those that are `UNUSED`."""
    to.m_eff[lane], to.J_eff[lane] = c.m_eff, c.J_eff
    to.inverse_m_eff[lane], to.inverse_J_eff[lane] = c.inverse_m_eff, c.inverse_J_eff
    to.l_n[lane], to.z_0[lane], to.d[lane] = c.l_n, c.z_0, c.d
    to.K_soil[lane], to.R_soil[lane], to.x_yield[lane] = c.K_soil, c.R_soil, c.x_yield
    to.h[lane], to.g_x[lane], to.k_v[lane], to.k_m[lane] = c.h, c.g_x, c.k_v, c.k_m
    to.tau_v[lane], to.v_0[lane] = c.tau_v, c.v_0
    to.C_cos[lane], to.C_sin[lane], to.theta_corner[lane] = c.C_cos, c.C_sin, c.theta_corner


@inlined
def load_sums(s: Any, lane: int) -> SoilSums:
    """Load the sums over all pieces of the soil."""
    Z = s.Z_0[lane], s.Z_1[lane], s.Z_2[lane], s.Z_3[lane]
    return SoilSums(s.U_0[lane], s.U_1[lane], s.S_1[lane], s.S_2[lane], s.S_3[lane], *Z)


@inlined
def store_sums(to: Any, lane: int, s: SoilSums) -> None:
    """Store the sums over all pieces of the soil."""
    to.U_0[lane], to.U_1[lane], to.S_1[lane], to.S_2[lane], to.S_3[lane] = s.U_0, s.U_1, s.S_1, s.S_2, s.S_3
    to.Z_0[lane], to.Z_1[lane], to.Z_2[lane], to.Z_3[lane] = s.Z_0, s.Z_1, s.Z_2, s.Z_3


@by_types
def load_strength(piece: Any, lane: int) -> Callable[..., float]:
    """Return P_0 of a piece; where it has no field for it the compiler knows that it is zero."""
    if field_of(piece, "P_0") is None:
        return lambda piece, lane: 0.0
    return lambda piece, lane: piece.P_0[lane]


@by_types
def load_widths(piece: Any, lane: int) -> Callable[..., tuple[float, float]]:
    """Return w_0 and w_1 of a piece; where it has no fields for them the compiler knows that they are 1 and 0."""
    if field_of(piece, "w_0") is None:
        return lambda piece, lane: (1.0, 0.0)
    return lambda piece, lane: (piece.w_0[lane], piece.w_1[lane])


@by_types
def load_lean(group: Any, lane: int) -> Callable[..., float]:
    """Return ``lean`` of `boulder_kernels.pieces.SoilConstants`, zero of boxes."""
    if field_of(group, "lean") is None:
        return lambda group, lane: 0.0
    return lambda group, lane: group.lean[lane]


@by_types
def store_strength(to: Any, lane: int, P_0: float) -> Callable[..., None]:
    """Store P_0 of a piece that has a field for it."""
    if field_of(to, "P_0") is None:
        return lambda to, lane, P_0: None
    return lambda to, lane, P_0: put(to.P_0, 0, lane, P_0)


@by_types
def store_widths(to: Any, lane: int, w_0: float, w_1: float) -> Callable[..., None]:
    """Store w_0 and w_1 of a piece that has fields for them."""
    return (lambda to, lane, w_0, w_1: None) if field_of(to, "w_0") is None else _store_widths


def _store_widths(to: Any, lane: int, w_0: float, w_1: float) -> None:
    to.w_0[lane], to.w_1[lane] = w_0, w_1


@by_types
def store_lean(to: Any, lane: int, lean: float) -> Callable[..., None]:
    """Store ``lean`` in a group that has a field for it."""
    if field_of(to, "lean") is None:
        return lambda to, lane, lean: None
    return lambda to, lane, lean: put(to.lean, 0, lane, lean)


@inlined
def load_next(above: Any, at: Any, m: int) -> Any:
    """Return the pieces above, and one more; the ends of the soil are numbers that the compiler knows."""
    group, lane = at
    pieces = group.pieces
    p = pieces[m]
    low = pieces[m - 1].to[lane] if m > 0 else 0.0
    to = p.to[lane] if m + 1 < len(pieces) else 1.0
    w_0, w_1 = load_widths(p, lane)
    piece = Piece(low, to, p.K[lane], p.inverse_K[lane], load_strength(p, lane), p.P_1[lane], p.R[lane], w_0, w_1)
    return (*above, piece)


@inlined
def store_piece(to: Any, lane: int, p: Piece) -> None:
    """Store a piece of the soil."""
    to.to[lane], to.K[lane], to.inverse_K[lane], to.P_1[lane], to.R[lane] = p.to, p.K, p.inverse_K, p.P_1, p.R
    store_strength(to, lane, p.P_0)
    store_widths(to, lane, p.w_0, p.w_1)


@inlined
def load_next_given(above: Any, at: Any, m: int) -> Any:
    """Return the pieces above as they are given, and one more."""
    group, lane = at
    return (*above, given_piece_in(group.given, BELOW + BODY_SIZE + PIECE_SIZE * m, lane))


load_all, load_all_given = through(load_next), through(load_next_given)


@by_types
def numbers_of_pieces(group: Any) -> Callable[..., tuple[int, ...]]:
    """Return the numbers of the pieces of a soil, which the compiler knows."""
    pieces = field_of(group, "pieces")
    numbers = tuple(range(pieces.shape[0]))
    return lambda group: numbers


@inlined
def load_in_soil(group: Any, lane: int) -> Any:
    """Load constants whose soil is in pieces."""
    soil = FewPieces(load_sums(group.sums, lane), load_all((), (group, lane), numbers_of_pieces(group)))
    return with_soil(load_numbers(group.constants, lane), load_lean(group, lane), soil)


@by_types
def load_constants(group: Any, lane: int) -> Callable[..., Any]:
    """Load the constants of a lane."""
    if is_uniform(group):
        return lambda group, lane: load_numbers(group.constants, lane)
    return lambda group, lane: load_in_soil(group, lane)


@inlined
def store_in_soil(group: Any, lane: int, c: Any) -> None:
    """Store constants whose soil is in pieces."""
    store_numbers(group.constants, lane, c)
    store_lean(group, lane, c.lean)
    store_sums(group.sums, lane, c.soil.sums)
    for m in range(len(c.soil.pieces)):
        store_piece(group.pieces[m], lane, c.soil.pieces[m])


@by_types
def store_constants(group: Any, lane: int, c: Any) -> Callable[..., None]:
    """Store the constants of a lane."""
    if is_uniform(group):
        return lambda group, lane, c: store_numbers(group.constants, lane, c)
    return lambda group, lane, c: store_in_soil(group, lane, c)


@by_types
def constants_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Callable[..., Any]:
    """Return the constants of a design that is being started."""
    if is_uniform(group):
        return lambda group, lane, design, readings: constants_of(design, readings, 0)
    return lambda group, lane, design, readings: constants_of_few(
        design,
        readings,
        body_in(group.given, BELOW, lane),
        load_all_given((), (group, lane), numbers_of_pieces(group)),
    )


@kernel
def copy_start(group: Any, lane: int, start: Any, other: int) -> None:
    """Copy constants and impact from a lane of one group to a lane of another, or of the same."""
    i = load_impact(start, other)
    store_constants(group, lane, load_constants(start, other))
    store_pace(group.pace, lane, i.pace)
    store_motion(group, lane, i)
    store_modes(group, lane, i)


@kernel
def copy_step(group: Any, lane: int, start: Any, other: int) -> None:
    """Copy the end of a step, too."""
    copy_start(group, lane, start, other)
    attempt = start.attempt
    store_state(group.y_end, lane, load_state(start.y_end, other))
    store_acceleration(group.k_end, lane, load_acceleration(start.k_end, other))
    store_attempt(group.attempt, lane, Attempt(attempt.error[other], attempt.plain[other], attempt.status[other]))
