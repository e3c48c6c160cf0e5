"""Memory of the lanes: one record for each group of lanes, in which every field has a number for each lane.

``group.state.theta_b[lane]`` is one number of one lane. A field keeps the numbers of neighbouring lanes next to each
other, and all fields are parts of one record. The compiler can then see that no store touches a later load, and
vectorises a loop over the lanes. A soil in pieces adds fields of its own.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from itertools import product
from typing import Any, NamedTuple

import numba
import numpy as np

from ._jit import IS_PLAIN, LINE, inlined, overload
from .design import Body, Constants, Design, Readings, constants_of
from .dynamics import Acceleration, Modes, State, Switches
from .following import Clock, Impact, Pace
from .modes import GapFactors
from .outcomes import Compression, Maxima
from .pieces import COUNTS, FewPieces, GivenPiece, Piece, SoilSums, constants_of_few, with_soil

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


def numbers_of(names: tuple[str, ...]) -> np.dtype:
    """Return the type of a record of the lanes' numbers under these names."""
    numbers = np.dtype([(name, np.float64, (LANES,)) for name in names], align=True)
    return np.dtype((np.record, numbers))


@functools.cache
def group_type(pieces: int, has_strength: bool, has_outline: bool) -> np.dtype:
    """Return the type of a group of lanes.

    Parameters
    ----------
    pieces
        Number of pieces of the soil of a design, in `boulder_kernels.pieces.COUNTS`; 0 for uniform soils beside boxes.
    has_strength
        Whether the ultimate resistance of a piece may be other than proportional to the depth.
    has_outline
        Whether boulders are no boxes.
    """
    records: list[Any] = [
        ("constants", numbers_of(Constants._fields)),
        ("pace", numbers_of(Pace._fields)),
        ("state", numbers_of(State._fields)),
        ("start", numbers_of(Acceleration._fields)),
        ("front", numbers_of(Compression._fields)),
        ("maxima", numbers_of(Maxima._fields)),
        ("clock", numbers_of(Clock._fields)),
        ("modes", numbers_of(Modes._fields)),
        ("switches", numbers_of(Switches._fields)),
        ("factors", numbers_of(GapFactors._fields)),
        ("end_state", numbers_of(State._fields)),
        ("end", numbers_of(Acceleration._fields)),
        ("attempt", numbers_of(Attempt._fields)),
        ("design", numbers_of(Design._fields)),
    ]
    if pieces:
        # A piece begins where the one above it ends.
        constant = ("low", *(() if has_strength else ("P_0",)), *(() if has_outline else ("w_0", "w_1")))
        piece = tuple(name for name in Piece._fields if name not in constant)
        records += [("lean", np.float64, (LANES,))] if has_outline else []
        records += [("sums", numbers_of(SoilSums._fields))]
        records += [("pieces", numbers_of(piece), (pieces,)), ("body", numbers_of(Body._fields))]
        records += [("given", numbers_of(GivenPiece._fields), (pieces,))]
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
    room = np.zeros(2 * kind.itemsize + LINE, np.uint8)
    first = -room.ctypes.data % LINE
    return room[first : first + 2 * kind.itemsize].view(kind)


def field_of(group: Any, name: str) -> Any:
    """Return a field of a record or of its type, Numba's or NumPy's; None if there is none of this name."""
    if isinstance(group, numba.types.Record):
        return group.fields[name].type if name in group.fields else None
    return group[name] if name in group.dtype.names else None


def by_soil(uniform: Callable[..., Any], in_pieces: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls one for groups of uniform soils, and another where the soil is in pieces."""

    def chosen(group: Any) -> Callable[..., Any]:
        """Return the one for a group or its type."""
        return uniform if field_of(group, "pieces") is None else in_pieces

    def call(group: Any, lane: int, *others: Any) -> Any:
        """Call the function that suits the soil of the group."""
        return chosen(group)(group, lane, *others)

    def choose(group: Any, lane: Any, *others: Any) -> Callable[..., Any]:
        """Return the call for these types."""
        of_soil = chosen(group)
        calls: list[Callable[..., Any]] = [
            lambda group, lane: of_soil(group, lane),
            lambda group, lane, c: of_soil(group, lane, c),
            lambda group, lane, one, other: of_soil(group, lane, one, other),
        ]
        return calls[len(others)]  # Numba inlines nothing whose number of arguments is open

    overload(call)(choose)
    return call


@inlined
def load_state(s: Any, lane: int) -> State:
    """Return a state of a lane."""
    return State(s.x_b[lane], s.v_b[lane], s.theta_b[lane], s.omega_b[lane], s.x_v[lane], s.v_v[lane])


@inlined
def load_acceleration(k: Any, lane: int) -> Acceleration:
    """Return an acceleration of a lane."""
    return Acceleration(k.a_b[lane], k.alpha_b[lane], k.a_v[lane], k.M[lane])


@inlined
def load_switches(group: Any, lane: int) -> Switches:
    """Return the factors of the modes of a lane."""
    s = group.switches
    return Switches(s.net[lane], s.couple[lane], s.couple_sin[lane], s.k_contact[lane], s.k_truck[lane])


@inlined
def load_impact(group: Any, lane: int) -> Impact:
    """Return the impact in a lane."""
    p, c, m, n, t, g = group.pace, group.front, group.maxima, group.modes, group.clock, group.factors
    return Impact(
        Pace(p.h_touching[lane], p.h_apart[lane], p.budget[lane]),
        load_state(group.state, lane),
        load_acceleration(group.start, lane),
        Compression(c.u[lane], c.rate[lane], c.crush[lane], c.crush_rate[lane]),
        Maxima(
            m.theta[lane],
            m.t_theta[lane],
            m.x_b[lane],
            m.t_x_b[lane],
            m.x_v[lane],
            m.t_x_v[lane],
            m.F_v[lane],
            m.t_F_v[lane],
            m.crush[lane],
            m.t_crush[lane],
        ),
        Clock(
            t.t[lane],
            t.h[lane],
            t.h_full[lane],
            t.attempts[lane],
            t.barrier[lane],
            t.horizon[lane],
            t.error[lane],
            t.rotation_changes[lane],
        ),
        Modes(
            int(n.turning[lane]),
            bool(n.touching[lane]),
            n.corner[lane],
            n.arm[lane],
            int(n.yielded_top[lane]),
            int(n.yielded_base[lane]),
        ),
        load_switches(group, lane),
        GapFactors(
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
            g["base"][lane],
            g.limit[lane],
            g.tolerance[lane],
        ),
    )


@inlined
def store_pace(group: Any, lane: int, p: Pace) -> None:
    """Write which steps an impact is given."""
    to = group.pace
    to.h_touching[lane], to.h_apart[lane], to.budget[lane] = p.h_touching, p.h_apart, p.budget


@inlined
def store_clock(group: Any, lane: int, t: Clock) -> None:
    """Write how far an impact has come."""
    to = group.clock
    to.t[lane], to.h[lane], to.h_full[lane], to.attempts[lane] = t.t, t.h, t.h_full, t.attempts
    to.barrier[lane], to.horizon[lane], to.error[lane], to.rotation_changes[lane] = (
        t.barrier,
        t.horizon,
        t.error,
        t.rotation_changes,
    )


@inlined
def store_state(to: Any, lane: int, y: State) -> None:
    """Write a state of a lane."""
    to.x_b[lane], to.v_b[lane], to.theta_b[lane], to.omega_b[lane] = y.x_b, y.v_b, y.theta_b, y.omega_b
    to.x_v[lane], to.v_v[lane] = y.x_v, y.v_v


@inlined
def store_acceleration(to: Any, lane: int, k: Acceleration) -> None:
    """Write an acceleration of a lane."""
    to.a_b[lane], to.alpha_b[lane], to.a_v[lane], to.M[lane] = k.a_b, k.alpha_b, k.a_v, k.M


@inlined
def store_motion(group: Any, lane: int, i: Impact) -> None:
    """Write what changes with every step of an impact into its lane."""
    store_state(group.state, lane, i.y)
    store_acceleration(group.start, lane, i.k)
    front, maxima, c, m = group.front, group.maxima, i.front, i.maxima
    front.u[lane], front.rate[lane], front.crush[lane], front.crush_rate[lane] = c.u, c.rate, c.crush, c.crush_rate
    maxima.theta[lane], maxima.t_theta[lane], maxima.x_b[lane], maxima.t_x_b[lane] = m.theta, m.t_theta, m.x_b, m.t_x_b
    maxima.x_v[lane], maxima.t_x_v[lane], maxima.F_v[lane], maxima.t_F_v[lane] = m.x_v, m.t_x_v, m.F_v, m.t_F_v
    maxima.crush[lane], maxima.t_crush[lane] = m.crush, m.t_crush
    store_clock(group, lane, i.clock)


@inlined
def store_modes(group: Any, lane: int, i: Impact) -> None:
    """Write what changes with the modes of an impact into its lane."""
    modes, switches, factors, n, s, g = group.modes, group.switches, group.factors, i.modes, i.switches, i.factors
    modes.turning[lane], modes.touching[lane], modes.corner[lane], modes.arm[lane] = (
        n.turning,
        n.touching,
        n.corner,
        n.arm,
    )
    modes.yielded_top[lane], modes.yielded_base[lane] = n.yielded_top, n.yielded_base
    switches.net[lane], switches.couple[lane], switches.couple_sin[lane], switches.k_contact[lane] = (
        s.net,
        s.couple,
        s.couple_sin,
        s.k_contact,
    )
    switches.k_truck[lane] = s.k_truck
    factors.contact[lane], factors.rotation_0[lane], factors.rotation_abs_M[lane], factors.rotation_theta[lane] = (
        g.contact,
        g.rotation_0,
        g.rotation_abs_M,
        g.rotation_theta,
    )
    factors.rotation_omega[lane], factors.couple_M[lane], factors.couple_abs_M[lane], factors.couple_limit[lane] = (
        g.rotation_omega,
        g.couple_M,
        g.couple_abs_M,
        g.couple_limit,
    )
    factors.corner_0[lane], factors.corner_theta[lane], factors.arm[lane], factors.top[lane] = (
        g.corner_0,
        g.corner_theta,
        g.arm,
        g.top,
    )
    factors["base"][lane], factors.limit[lane], factors.tolerance[lane] = g.base, g.limit, g.tolerance


@inlined
def store_attempt(group: Any, lane: int, error: float, plain: float, status: float) -> None:
    """Write the fields of `Attempt`."""
    to = group.attempt
    to.error[lane], to.plain[lane], to.status[lane] = error, plain, status


@inlined
def load_design(group: Any, lane: int) -> Design:
    """Return the design that is being started in a lane."""
    p = group.design
    return Design(
        p.L[lane],
        p.W[lane],
        p.H[lane],
        p.rho_b[lane],
        p.d[lane],
        p.e[lane],
        p.rho_s[lane],
        p.phi[lane],
        p.beta[lane],
        p.K_epsilon[lane],
        p.m_v[lane],
        p.v_0[lane],
        p.k_v[lane],
        p.c_v[lane],
        p.e_bumper[lane],
    )


@inlined
def store_design(group: Any, lane: int, p: Design) -> None:
    """Write a design that is to be started."""
    to = group.design
    to.L[lane], to.W[lane], to.H[lane], to.rho_b[lane] = p.L, p.W, p.H, p.rho_b
    to.d[lane], to.e[lane], to.rho_s[lane], to.phi[lane] = p.d, p.e, p.rho_s, p.phi
    to.beta[lane], to.K_epsilon[lane], to.m_v[lane], to.v_0[lane] = p.beta, p.K_epsilon, p.m_v, p.v_0
    to.k_v[lane], to.c_v[lane], to.e_bumper[lane] = p.k_v, p.c_v, p.e_bumper


@inlined
def load_numbers(group: Any, lane: int) -> Constants:
    """Return the constants of a lane but for its soil.

    What is not of use is not loaded: lanes know the closed form of the soil only; and no motion depends on three
    lengths from which other constants have been made.
    """
    c = group.constants
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
def store_numbers(group: Any, lane: int, c: Any) -> None:
    """Write the constants of a lane but for its soil."""
    to = group.constants
    to.m_eff[lane], to.J_eff[lane], to.inverse_m_eff[lane], to.inverse_J_eff[lane] = (
        c.m_eff,
        c.J_eff,
        c.inverse_m_eff,
        c.inverse_J_eff,
    )
    to.l_n[lane], to.z_0[lane], to.d[lane], to.K_soil[lane] = c.l_n, c.z_0, c.d, c.K_soil
    to.R_soil[lane], to.x_yield[lane], to.h[lane], to.g_x[lane] = c.R_soil, c.x_yield, c.h, c.g_x
    to.k_v[lane], to.k_m[lane], to.tau_v[lane], to.v_0[lane] = c.k_v, c.k_m, c.tau_v, c.v_0
    to.C_cos[lane], to.C_sin[lane], to.theta_corner[lane] = c.C_cos, c.C_sin, c.theta_corner


def optional(name: str, value: float) -> tuple[Callable[[Any, int], float], Callable[[Any, int, float], None]]:
    """Return functions that load a number of a lane from a record, and store it, if the record has a field for it.

    Where it has none, the number is a constant that the compiler knows, and what is multiplied by zero is left out.
    """

    def load(record: Any, lane: int) -> float:
        """Return the number of one lane."""
        numbers = field_of(record, name)
        return value if numbers is None else float(numbers[lane])

    def store(record: Any, lane: int, number: float) -> None:
        """Write the number of one lane."""
        if field_of(record, name) is not None:
            record[name][lane] = number

    def choose_load(record: Any, lane: Any) -> Callable[..., float]:
        """Return the loading for these types."""
        if field_of(record, name) is None:
            return lambda record, lane: value
        return lambda record, lane: record[name][lane]

    def choose_store(record: Any, lane: Any, number: Any) -> Callable[..., None]:
        """Return the storing for these types."""
        if field_of(record, name) is None:
            return lambda record, lane, number: None

        def store_number(record: Any, lane: int, number: float) -> None:
            """Write the number of one lane."""
            record[name][lane] = number

        return store_number

    overload(load)(choose_load)
    overload(store)(choose_store)
    return load, store


load_strength, store_strength = optional("P_0", 0.0)
load_w_0, store_w_0 = optional("w_0", 1.0)
load_w_1, store_w_1 = optional("w_1", 0.0)
load_lean, store_lean = optional("lean", 0.0)


@inlined
def load_piece(group: Any, m: int, lane: int) -> Piece:
    """Return one piece of the soil of a lane; the ends of the soil are numbers that the compiler knows."""
    pieces = group.pieces
    p = pieces[m]
    low = pieces[m - 1].to[lane] if m > 0 else 0.0
    to = p.to[lane] if m + 1 < len(pieces) else 1.0
    P_0, w_0, w_1 = load_strength(p, lane), load_w_0(p, lane), load_w_1(p, lane)
    return Piece(low, to, p.K[lane], p.inverse_K[lane], P_0, p.P_1[lane], p.R[lane], w_0, w_1)


@inlined
def load_given(group: Any, m: int, lane: int) -> GivenPiece:
    """Return one piece as it is given."""
    p = group.given[m]
    return GivenPiece(
        p.to[lane],
        p.density[lane],
        p.friction[lane],
        p.subgrade[lane],
        p.p_0[lane],
        p.p_1[lane],
        p.w_0[lane],
        p.w_1[lane],
    )


def by_count(load: Callable[[Any, int, int], Any]) -> Callable[[Any, int], tuple[Any, ...]]:
    """Return a function that loads a record of each piece, one after another, into a tuple."""

    def load_all(group: Any, lane: int) -> tuple[Any, ...]:
        """Return all of them."""
        return tuple(load(group, m, lane) for m in range(len(group.pieces)))

    @inlined
    def one(group: Any, m: int, lane: int) -> Any:
        """Load one, as a tuple."""
        return (load(group, m, lane),)

    @inlined
    def two(group: Any, m: int, lane: int) -> Any:
        """Load two from m on, as a tuple."""
        return one(group, m, lane) + one(group, m + 1, lane)

    @inlined
    def four(group: Any, m: int, lane: int) -> Any:
        """Load four from m on, as a tuple."""
        return two(group, m, lane) + two(group, m + 2, lane)

    def choose(group: Any, lane: Any) -> Callable[..., Any]:
        """Return the function for so many."""
        return {
            1: lambda group, lane: one(group, 0, lane),
            2: lambda group, lane: two(group, 0, lane),
            4: lambda group, lane: four(group, 0, lane),
            8: lambda group, lane: four(group, 0, lane) + four(group, 4, lane),
        }[field_of(group, "pieces").shape[0]]

    overload(load_all)(choose)
    return load_all


load_pieces, load_all_given = by_count(load_piece), by_count(load_given)


@inlined
def load_in_soil(group: Any, lane: int) -> Any:
    """Return the constants of a lane whose soil is in pieces."""
    s = group.sums
    sums = SoilSums(
        s.U_0[lane],
        s.U_1[lane],
        s.S_1[lane],
        s.S_2[lane],
        s.S_3[lane],
        s.Z_0[lane],
        s.Z_1[lane],
        s.Z_2[lane],
        s.Z_3[lane],
    )
    return with_soil(load_numbers(group, lane), load_lean(group, lane), FewPieces(sums, load_pieces(group, lane)))


load_constants = by_soil(load_numbers, load_in_soil)
"""Return the constants of a lane."""


@inlined
def store_in_soil(group: Any, lane: int, c: Any) -> None:
    """Write constants whose soil is in pieces."""
    store_numbers(group, lane, c)
    store_lean(group, lane, c.lean)
    to, s = group.sums, c.soil.sums
    to.U_0[lane], to.U_1[lane], to.S_1[lane], to.S_2[lane] = s.U_0, s.U_1, s.S_1, s.S_2
    to.S_3[lane], to.Z_0[lane], to.Z_1[lane], to.Z_2[lane] = s.S_3, s.Z_0, s.Z_1, s.Z_2
    to.Z_3[lane] = s.Z_3
    for m in range(len(c.soil.pieces)):
        one, p = group.pieces[m], c.soil.pieces[m]
        one.to[lane], one.K[lane], one.inverse_K[lane], one.P_1[lane] = p.to, p.K, p.inverse_K, p.P_1
        one.R[lane] = p.R
        store_strength(one, lane, p.P_0)
        store_w_0(one, lane, p.w_0)
        store_w_1(one, lane, p.w_1)


store_constants = by_soil(store_numbers, store_in_soil)
"""Write the constants of a lane."""

BELOW, BODY_SIZE, PIECE_SIZE = len(Design._fields), len(Body._fields), len(GivenPiece._fields)
"""Rows of a table of designs: above the soil, of the body, and of each piece."""


@inlined
def store_nothing_given(group: Any, lane: int, a: np.ndarray, row: int) -> None:
    """Write nothing of uniform soil."""


@inlined
def store_pieces_given(group: Any, lane: int, a: np.ndarray, row: int) -> None:
    """Write body and pieces of a design that is to be started, rows of a table."""
    b = group.body
    b.m_b[lane] = a[BELOW + 0, row]
    b.J[lane] = a[BELOW + 1, row]
    b.x[lane] = a[BELOW + 2, row]
    b.y[lane] = a[BELOW + 3, row]
    b.line[lane] = a[BELOW + 4, row]
    b.foot[lane] = a[BELOW + 5, row]
    b.lean[lane] = a[BELOW + 6, row]
    for m in range(len(group.given)):
        to, n = group.given[m], BELOW + BODY_SIZE + PIECE_SIZE * m
        to.to[lane] = a[n + 0, row]
        to.density[lane] = a[n + 1, row]
        to.friction[lane] = a[n + 2, row]
        to.subgrade[lane] = a[n + 3, row]
        to.p_0[lane] = a[n + 4, row]
        to.p_1[lane] = a[n + 5, row]
        to.w_0[lane] = a[n + 6, row]
        to.w_1[lane] = a[n + 7, row]


store_given = by_soil(store_nothing_given, store_pieces_given)
"""Write what is given of the soil of a design that is to be started, the rows of a table below its `Design`."""


@inlined
def uniform_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Constants:
    """Return the constants of a design in uniform soil."""
    return constants_of(design, readings, 0)


@inlined
def pieces_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Any:
    """Return the constants of a design whose soil is in pieces."""
    b = group.body
    body = Body(b.m_b[lane], b.J[lane], b.x[lane], b.y[lane], b.line[lane], b.foot[lane], b.lean[lane])
    return constants_of_few(design, readings, body, load_all_given(group, lane))


constants_in_lane = by_soil(uniform_in_lane, pieces_in_lane)
"""Return the constants of a design that is being started."""


@inlined
def copy_start(group: Any, lane: int, start: Any, other: int) -> None:
    """Copy constants and impact from a lane of one group to a lane of another, or of the same."""
    i = load_impact(start, other)
    store_constants(group, lane, load_constants(start, other))
    store_pace(group, lane, i.pace)
    store_motion(group, lane, i)
    store_modes(group, lane, i)


@inlined
def copy_step(group: Any, lane: int, start: Any, other: int) -> None:
    """Copy the end of a step, too."""
    copy_start(group, lane, start, other)
    a = start.attempt
    store_state(group.end_state, lane, load_state(start.end_state, other))
    store_acceleration(group.end, lane, load_acceleration(start.end, other))
    store_attempt(group, lane, a.error[other], a.plain[other], a.status[other])
