"""The numbers of many lanes: a record of each group of them, whose fields have one number for every lane.

``group.state.theta_b[lane]`` is one number of one lane. Neighbouring lanes are neighbours in memory, and a loop over
them is vectorised, since the compiler sees that no store touches a later load: all fields are parts of one record. The
soil of a design that is not uniform makes fields of its own.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np

from ._jit import IS_PLAIN, LINE, inlined, overload
from .design import Body, Constants, Design, Readings, constants_of
from .dynamics import Acceleration, Modes, State, Switches
from .following import Clock, Impact, Pace
from .layered import FewLayers, GivenLayer, Layer, SoilSums, constants_of_few, with_record
from .modes import GapFactors
from .outcomes import Compression, Maxima
from .outlined import (
    FewPieces,
    GivenPiece,
    Lean,
    Piece,
    TaperedPiece,
    TaperedSoil,
    constants_beside_pieces,
    constants_beside_taper,
)

LANES = 1 if IS_PLAIN else 8
"""Designs that are integrated side by side: one vector of eight doubles. More of them hide no more latency and take
more of the fastest memory (measured: 2 to 5 % slower with 16 or 32). Without the compiler there is nothing to gain."""


class Attempt(NamedTuple):
    """What is known of a lane's last step, beside where it ended."""

    error: float
    """Its error [m/s]."""
    plain: float
    """1.0 where it has been accepted as it is."""
    status: float
    """RUNNING, or why the design that has been started here needs no step."""


def numbers_of(record: Any) -> np.dtype:
    """Return the type of a record of the lanes' numbers for every field of a record."""
    numbers = np.dtype([(name, np.float64, (LANES,)) for name in record._fields], align=True)
    return np.dtype((np.record, numbers))


@functools.cache
def group_type(soil: type | None, parts: int) -> np.dtype:
    """Return the type of a group of lanes.

    Parameters
    ----------
    soil
        `FewLayers`, `FewPieces` or `TaperedSoil`; None for uniform soils.
    parts
        Number of layers or pieces of a design.
    """
    records: list[Any] = [
        ("constants", numbers_of(Constants)),
        ("pace", numbers_of(Pace)),
        ("state", numbers_of(State)),
        ("start", numbers_of(Acceleration)),
        ("front", numbers_of(Compression)),
        ("maxima", numbers_of(Maxima)),
        ("clock", numbers_of(Clock)),
        ("modes", numbers_of(Modes)),
        ("switches", numbers_of(Switches)),
        ("factors", numbers_of(GapFactors)),
        ("end_state", numbers_of(State)),
        ("end", numbers_of(Acceleration)),
        ("attempt", numbers_of(Attempt)),
        ("design", numbers_of(Design)),
    ]
    if soil is FewLayers:
        records += [("sums", numbers_of(SoilSums)), ("layers", numbers_of(Layer), (parts,))]
        records += [("given_layers", numbers_of(GivenLayer), (parts,))]
    elif soil is not None:
        records += [("lean", numbers_of(Lean)), ("body", numbers_of(Body))]
        records += (
            [("pieces", numbers_of(Piece), (parts,))] if soil is FewPieces else [("taper", numbers_of(TaperedPiece))]
        )
        records += [("given_pieces", numbers_of(GivenPiece), (parts,))]
    return np.dtype((np.record, np.dtype(records, align=True)))


def empty_groups(soil: type | None = None, parts: int = 0) -> np.ndarray:
    """Return two groups of lanes: where designs run, and where they are started. Arguments: see `group_type`.

    Their vectors lie on whole lines of the fast memory.
    """
    kind = group_type(soil, parts)
    room = np.zeros(2 * kind.itemsize + LINE, np.uint8)
    first = -room.ctypes.data % LINE
    return room[first : first + 2 * kind.itemsize].view(kind)


def count_of(group: Any, name: str) -> int:
    """Return how many records a field of a group, or of its Numba type, has; 0 if there is none of this name."""
    if isinstance(group, numba.types.Record):
        array: Any = group.fields[name].type if name in group.fields else None
        return array.shape[0] if array else 0
    return len(group[name]) if name in group.dtype.names else 0


def is_tapered(group: Any) -> bool:
    """Return whether the lanes of a group, or of its Numba type, have a `TaperedSoil`."""
    return "taper" in (group.fields if isinstance(group, numba.types.Record) else group.dtype.names)


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


@inlined
def load_layer(p: Any, lane: int) -> Layer:
    """Return one layer of a lane."""
    return Layer(p.low[lane], p.to[lane], p.K[lane], p.inverse_K[lane], p.P_0[lane], p.P_1[lane], p.R[lane])


@inlined
def load_given_layer(p: Any, lane: int) -> GivenLayer:
    """Return one layer as it is given."""
    return GivenLayer(p.to[lane], p.density[lane], p.friction[lane], p.subgrade[lane], p.p_0[lane], p.p_1[lane])


@inlined
def load_piece(p: Any, lane: int) -> Piece:
    """Return one piece of the soil of a lane."""
    return Piece(p.low[lane], p.to[lane], p.K[lane], p.P_0[lane], p.P_1[lane], p.R[lane], p.w_0[lane], p.w_1[lane])


@inlined
def load_given_piece(p: Any, lane: int) -> GivenPiece:
    """Return one piece as it is given."""
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


def by_count(load: Callable[[Any, int], Any]) -> Callable[[Any, int], tuple[Any, ...]]:
    """Return a function that loads as many records, one after another, as there are in an array, into a tuple."""

    def load_all(parts: Any, lane: int) -> tuple[Any, ...]:
        """Return all of them."""
        return tuple(load(parts[m], lane) for m in range(len(parts)))

    @inlined
    def one(p: Any, m: int, lane: int) -> Any:
        """Load one, as a tuple."""
        return (load(p[m], lane),)

    @inlined
    def two(p: Any, m: int, lane: int) -> Any:
        """Load two."""
        return one(p, m, lane) + one(p, m + 1, lane)

    @inlined
    def four(p: Any, m: int, lane: int) -> Any:
        """Load four."""
        return two(p, m, lane) + two(p, m + 2, lane)

    def choose(parts: Any, lane: Any) -> Callable[..., Any]:
        """Return the function for so many."""
        return {
            1: lambda parts, lane: one(parts, 0, lane),
            2: lambda parts, lane: two(parts, 0, lane),
            4: lambda parts, lane: four(parts, 0, lane),
            8: lambda parts, lane: four(parts, 0, lane) + four(parts, 4, lane),
        }[parts.shape[0]]

    overload(load_all)(choose)
    return load_all


load_layers, load_given_layers = by_count(load_layer), by_count(load_given_layer)
load_pieces, load_given_pieces = by_count(load_piece), by_count(load_given_piece)


@inlined
def with_layers(group: Any, lane: int) -> Any:
    """Return the constants of a lane in layers of soil."""
    s = group.sums
    sums = SoilSums(
        s.S_1[lane],
        s.S_2[lane],
        s.S_3[lane],
        s.L_1[lane],
        s.L_2[lane],
        s.L_3[lane],
        s.U_0[lane],
        s.U_1[lane],
        s.Z_0[lane],
        s.Z_1[lane],
        s.Z_2[lane],
        s.Z_3[lane],
    )
    return with_record(load_numbers(group, lane), FewLayers(sums, load_layers(group.layers, lane)))


@inlined
def with_pieces(group: Any, lane: int) -> Any:
    """Return the constants of a lane in pieces of soil."""
    soil = FewPieces(Lean(group.lean.moment[lane]), load_pieces(group.pieces, lane))
    return with_record(load_numbers(group, lane), soil)


@inlined
def with_taper(group: Any, lane: int) -> Any:
    """Return the constants of a lane beside a taper."""
    p = group.taper
    taper = TaperedPiece(p.K[lane], p.R[lane], p.x_yield[lane], p.w_0[lane], p.w_1[lane])
    return with_record(load_numbers(group, lane), TaperedSoil(Lean(group.lean.moment[lane]), (taper,)))


def load_constants(group: Any, lane: int) -> Any:
    """Return the constants of a lane."""
    return _constants_loader(group)(group, lane)


def _constants_loader(group: Any) -> Callable[..., Any]:
    if count_of(group, "layers"):
        return with_layers
    if count_of(group, "pieces"):
        return with_pieces
    return with_taper if is_tapered(group) else load_numbers


@overload(load_constants)
def _load_constants(group: Any, lane: Any) -> Callable[..., Any]:
    loader = _constants_loader(group)
    return lambda group, lane: loader(group, lane)


@inlined
def store_layers(group: Any, lane: int, c: Any) -> None:
    """Write constants in layers of soil."""
    store_numbers(group, lane, c)
    to, s = group.sums, c.soil.sums
    to.S_1[lane], to.S_2[lane], to.S_3[lane], to.L_1[lane] = s.S_1, s.S_2, s.S_3, s.L_1
    to.L_2[lane], to.L_3[lane], to.U_0[lane], to.U_1[lane] = s.L_2, s.L_3, s.U_0, s.U_1
    to.Z_0[lane], to.Z_1[lane], to.Z_2[lane], to.Z_3[lane] = s.Z_0, s.Z_1, s.Z_2, s.Z_3
    for m in range(len(c.soil.layers)):
        one, p = group.layers[m], c.soil.layers[m]
        one.low[lane], one.to[lane], one.K[lane], one.inverse_K[lane] = p.low, p.to, p.K, p.inverse_K
        one.P_0[lane], one.P_1[lane], one.R[lane] = p.P_0, p.P_1, p.R


@inlined
def store_pieces(group: Any, lane: int, c: Any) -> None:
    """Write constants in pieces of soil."""
    store_numbers(group, lane, c)
    group.lean.moment[lane] = c.soil.lean.moment
    for m in range(len(c.soil.pieces)):
        one, p = group.pieces[m], c.soil.pieces[m]
        one.low[lane], one.to[lane], one.K[lane], one.P_0[lane] = p.low, p.to, p.K, p.P_0
        one.P_1[lane], one.R[lane], one.w_0[lane], one.w_1[lane] = p.P_1, p.R, p.w_0, p.w_1


@inlined
def store_taper(group: Any, lane: int, c: Any) -> None:
    """Write constants beside a taper."""
    store_numbers(group, lane, c)
    group.lean.moment[lane] = c.soil.lean.moment
    to, p = group.taper, c.soil.pieces[0]
    to.K[lane], to.R[lane], to.x_yield[lane], to.w_0[lane] = p.K, p.R, p.x_yield, p.w_0
    to.w_1[lane] = p.w_1


def store_constants(group: Any, lane: int, c: Any) -> None:
    """Write the constants of a lane."""
    _constants_storer(group)(group, lane, c)


def _constants_storer(group: Any) -> Callable[..., None]:
    if count_of(group, "layers"):
        return store_layers
    if count_of(group, "pieces"):
        return store_pieces
    return store_taper if is_tapered(group) else store_numbers


@overload(store_constants)
def _store_constants(group: Any, lane: Any, c: Any) -> Callable[..., None]:
    storer = _constants_storer(group)
    return lambda group, lane, c: storer(group, lane, c)


BELOW = len(Design._fields)
"""Row of a table of designs at which what is given of their soil begins."""
BODY_SIZE, LAYER_SIZE, PIECE_SIZE = len(Body._fields), len(GivenLayer._fields), len(GivenPiece._fields)


@inlined
def store_given_layers(group: Any, lane: int, a: np.ndarray, row: int) -> None:
    """Write the layers of a design that is to be started, rows of a table."""
    for m in range(len(group.given_layers)):
        to, n = group.given_layers[m], BELOW + LAYER_SIZE * m
        to.to[lane] = a[n + 0, row]
        to.density[lane] = a[n + 1, row]
        to.friction[lane] = a[n + 2, row]
        to.subgrade[lane] = a[n + 3, row]
        to.p_0[lane] = a[n + 4, row]
        to.p_1[lane] = a[n + 5, row]


@inlined
def store_given_pieces(group: Any, lane: int, a: np.ndarray, row: int) -> None:
    """Write body and pieces of a design that is to be started, rows of a table."""
    b = group.body
    b.m_b[lane] = a[BELOW + 0, row]
    b.J[lane] = a[BELOW + 1, row]
    b.x[lane] = a[BELOW + 2, row]
    b.y[lane] = a[BELOW + 3, row]
    b.line[lane] = a[BELOW + 4, row]
    b.foot[lane] = a[BELOW + 5, row]
    b.lean[lane] = a[BELOW + 6, row]
    for m in range(len(group.given_pieces)):
        to, n = group.given_pieces[m], BELOW + BODY_SIZE + PIECE_SIZE * m
        to.to[lane] = a[n + 0, row]
        to.density[lane] = a[n + 1, row]
        to.friction[lane] = a[n + 2, row]
        to.subgrade[lane] = a[n + 3, row]
        to.p_0[lane] = a[n + 4, row]
        to.p_1[lane] = a[n + 5, row]
        to.w_0[lane] = a[n + 6, row]
        to.w_1[lane] = a[n + 7, row]


@inlined
def store_nothing_given(group: Any, lane: int, a: np.ndarray, row: int) -> None:
    """Write nothing of uniform soil."""


def store_given(group: Any, lane: int, a: np.ndarray, row: int) -> None:
    """Write what is given of the soil of a design that is to be started, the rows of a table below its `Design`."""
    _given_storer(group)(group, lane, a, row)


def _given_storer(group: Any) -> Callable[..., None]:
    if count_of(group, "given_layers"):
        return store_given_layers
    return store_given_pieces if count_of(group, "given_pieces") else store_nothing_given


@overload(store_given)
def _store_given(group: Any, lane: Any, a: Any, row: Any) -> Callable[..., None]:
    storer = _given_storer(group)
    return lambda group, lane, a, row: storer(group, lane, a, row)


@inlined
def load_body(group: Any, lane: int) -> Body:
    """Return the boulder that is being started in a lane."""
    b = group.body
    return Body(b.m_b[lane], b.J[lane], b.x[lane], b.y[lane], b.line[lane], b.foot[lane], b.lean[lane])


@inlined
def uniform_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Constants:
    """Return the constants of a design in uniform soil."""
    return constants_of(design, readings, 0)


@inlined
def layers_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Any:
    """Return the constants of a design in layers of soil."""
    return constants_of_few(design, readings, load_given_layers(group.given_layers, lane))


@inlined
def pieces_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Any:
    """Return the constants of a design in pieces of soil."""
    given = load_given_pieces(group.given_pieces, lane)
    return constants_beside_pieces(design, readings, load_body(group, lane), given)


@inlined
def taper_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Any:
    """Return the constants of a design beside a taper."""
    given = load_given_pieces(group.given_pieces, lane)
    return constants_beside_taper(design, readings, load_body(group, lane), given)


def constants_in_lane(group: Any, lane: int, design: Design, readings: Readings) -> Any:
    """Return the constants of a design that is being started."""
    return _constants_maker(group)(group, lane, design, readings)


def _constants_maker(group: Any) -> Callable[..., Any]:
    if count_of(group, "layers"):
        return layers_in_lane
    if count_of(group, "pieces"):
        return pieces_in_lane
    return taper_in_lane if is_tapered(group) else uniform_in_lane


@overload(constants_in_lane)
def _constants_in_lane(group: Any, lane: Any, design: Any, readings: Any) -> Callable[..., Any]:
    maker = _constants_maker(group)
    return lambda group, lane, design, readings: maker(group, lane, design, readings)


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
