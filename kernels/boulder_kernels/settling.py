"""Proofs that a simulation may end: that nothing it reports can still grow, or that no limit can be reached any more.

Under the gravity couple and released contact every force is either conservative or dissipative, and once the truck no
longer moves forward it can only be pushed back: the force of contact takes energy from the boulder and gives it to
the truck. So from then on

    E = kinetic energy of the boulder + elastic energy of the soil + lift of the weight + compression of the truck

never grows. To turn further than it has, the boulder would have to pass theta = +-theta_max, and to move further
x_b = x_max. If E is below the least potential energy on these lines, it cannot: the motion has *settled*. The elastic
energy of the soil is convex, so a tangent plane bounds it from below wherever it is taken, and a few steps of a root
finder place the tangent well; the bound is a proof wherever they end.

Where soil rings long after the impact, that proof can wait for seconds. The verdict needs less, and at the horizon less
is asked: that E is below the least potential energy, wherever x_b, on theta = +-theta_limit or at a smaller angle that
the boulder has to pass first, as that at which it would tip over. Then it never reaches the limit. The truck, which
does not move forward any more, never will again, since contact only pushes it back: its displacement is final, and with
it the penetration and the crush. Rotation and displacement of the boulder may still grow, the rotation never to its
limit.

As printed neither holds, and no other proof can: a restoring moment that brakes a boulder turning forward and lets it
turn back freely, and a truck that the air pulls on, feed energy. It does happen: of the random designs of
`tests/rk4` that stand for a second as printed, some overturn within ten.
"""

from __future__ import annotations

import math

from ._jit import inlined, kernel
from .design import Constants, Readings
from .dynamics import State, contact_displacement, least_couple, lift_of, soil_potential, spring_compression
from .numerics import Bracket, narrowed, next_guess, sine_versine
from .outcomes import Maxima
from .soil import Potential, soil_kinematics

NO_PROOF = -1e300
"""Barrier of a motion that nothing has been proved of: no energy is below it."""
PLACING_STEPS = 6
"""Most steps of the root finder that places a tangent."""
PLACED = 1e-6
"""Precision with which a tangent is placed, as a fraction of the energy, or of the lift of the weight."""
BALANCED_FROM, BALANCED_TO = 0.66, 0.71
"""Where a uniform soil turned about a point pushes no way, as a ratio of the depth: at 2/3 while it is elastic, at
1/sqrt(2) where all of it yields."""
MOVED_FROM = 0.75
"""Fraction of the largest rotation from which on a boulder mostly is where moving takes the least energy."""
CAUTION = 1.0 - 1e-6
"""The energy must be below the barrier by the integrator's own error, and more."""
LEAST_ANGLE = 1e-9
"""No smaller angle is looked at [rad]."""
CAUTION_AT_LIMIT = 0.99
"""Share of the barrier that counts at the limit: no later step looks again, and steps may be long."""


@kernel
def proof_is_possible(readings: Readings) -> bool:
    """Whether the energy argument holds: no force that is read as printed drives the motion."""
    return readings.restoring_gravity and readings.separation_released


@inlined
def least_elastic_energy(slope_x: float, c: Constants) -> float:
    """Lower bound of the elastic energy at a rotation, wherever the boulder stands [J].

    ``slope_x``: decrease of displacement over the depth, sin|theta| d [m]; not negative.

    The least energy has its displacement between none at the soil line and none at the base, A = 0 ... slope_x.
    """
    if slope_x == 0.0:
        return 0.0
    low, high = BALANCED_FROM * slope_x, BALANCED_TO * slope_x
    f_low, f_high = soil_potential(low, slope_x, c).V_A, soil_potential(high, slope_x, c).V_A
    if not f_low < 0.0 < f_high:
        low, high = 0.0, slope_x
        f_low, f_high = soil_potential(low, slope_x, c).V_A, soil_potential(high, slope_x, c).V_A
    bracket = Bracket(low, f_low, high, f_high, 0.0)
    least = 0.0
    for _ in range(PLACING_STEPS):
        A = next_guess(bracket)
        p = soil_potential(A, slope_x, c)
        below = abs(p.V_A) * slope_x
        least = max(least, p.V - below)
        if below <= PLACED * p.V:
            break
        bracket = narrowed(bracket, A, p.V_A)
    return least


@inlined
def energy_to_turn(theta_max: float, c: Constants) -> float:
    """Lower bound of the potential energy at theta = +-theta_max [J].

    ``theta_max``: rotation [rad]; ``c``: constants of a design whose restoring moment is the couple of the weight.
    """
    sin, versin = sine_versine(theta_max)
    return least_couple(c) * sin + c.C_sin * versin + least_elastic_energy(c.d * sin, c)


@inlined
def bound_at(
    p: Potential, A: float, X: float, sin: float, versin: float, x_max: float, lift: float, c: Constants
) -> float:
    """Tangent plane p of the elastic energy at (A, X), plus lift |sin|, on x_b = x_max at a sine and a versine."""
    return p.V + p.V_A * (x_max - c.l_n * versin + c.z_0 * sin - A) + p.V_X * (c.d * sin - X) + lift * abs(sin)


@inlined
def slope_along(x_max: float, s: float, along: float, c: Constants) -> float:
    """Derivative of the elastic energy by the sine s on x_b = x_max, where the displacement grows by along times it."""
    p = soil_potential(x_max + along * s, c.d * s, c)
    return p.V_A * along + p.V_X * c.d


@inlined
def energy_to_move(x_max: float, theta_max: float, c: Constants) -> float:
    """Lower bound of the potential energy on x_b = x_max for |theta| <= theta_max [J].

    With t = tan(theta_max/2), 1 - cos(theta) lies between 0 and t sin|theta|, so the lift of the weight is at least
    sin|theta| (C_cos + C_sin t). What bounds the energy is then linear on either side of theta = 0, and least at one of
    the corners.
    """
    sin_max, versin_max = sine_versine(theta_max)
    t = versin_max / sin_max if sin_max > 0.0 else 0.0
    lift = least_couple(c) + c.C_sin * t
    # The tangent is placed where, along the line of the largest versine, the energy is least.
    along = c.z_0 - c.l_n * t
    low, high = MOVED_FROM * sin_max, sin_max
    f_low, f_high = lift + slope_along(x_max, low, along, c), lift + slope_along(x_max, high, along, c)
    if f_low >= 0.0:
        low, f_low = 0.0, lift + slope_along(x_max, 0.0, along, c)
    s = low if f_low >= 0.0 else high
    if f_low < 0.0 < f_high:
        bracket = Bracket(low, f_low, high, f_high, 0.0)
        for _ in range(PLACING_STEPS):
            s = next_guess(bracket)
            slope = lift + slope_along(x_max, s, along, c)
            if abs(slope) <= PLACED * lift:
                break
            bracket = narrowed(bracket, s, slope)
    A, X = x_max + along * s, c.d * s
    p = soil_potential(A, X, c)
    least = bound_at(p, A, X, 0.0, 0.0, x_max, lift, c)
    for side in (-1.0, 1.0):
        for versin in (0.0, t * sin_max):
            least = min(least, bound_at(p, A, X, side * sin_max, versin, x_max, lift, c))
    return least


@inlined
def barrier_energy(m: Maxima, c: Constants) -> float:
    """Energy below which a motion can exceed none of its maxima so far [J].

    ``m``: maxima so far; ``c``: constants of a design whose restoring moment is the couple of the weight.

    A force of contact F takes the energy F^2/(2 k_v) in the truck's spring.
    """
    to_press = 0.5 * m.F_v * m.F_v / c.k_v
    to_turn = energy_to_turn(m.theta, c)
    if to_turn <= 0.0:
        return NO_PROOF
    return CAUTION * min(to_turn, energy_to_move(m.x_b, m.theta, c), to_press)


@kernel
def stays_below(theta_limit: float, y: State, c: Constants) -> bool:
    """Whether a rotation below its limit provably stays there, and the truck provably where it is or behind.

    ``theta_limit``: limit of rotation [rad]; ``y``: the state, within the limit; ``c``: constants of a design whose
    readings allow a proof, see `proof_is_possible`.

    Of the angles to be passed some are tried, each half of the one before.
    """
    if y.v_v > 0.0:
        return False
    E = boulder_energy(y, c)
    angle = min(theta_limit, 0.5 * math.pi)
    while angle > max(abs(y.theta_b), LEAST_ANGLE):
        if CAUTION_AT_LIMIT * energy_to_turn(angle, c) > E:
            return True
        angle *= 0.5
    return False


@inlined
def inside_maxima(y: State, m: Maxima) -> bool:
    """Whether a state lies within the maxima so far; at one of them, a barrier taken earlier may lie behind it."""
    return abs(y.theta_b) < m.theta and y.x_b < m.x_b


@inlined
def boulder_energy(y: State, c: Constants) -> float:
    """Energy E that can only fall once the truck has stopped moving forward [J].

    ``c``: constants of a design whose restoring moment is the couple of the weight.
    """
    sin, versin = sine_versine(y.theta_b)
    k = soil_kinematics(y.x_b, y.v_b, y.omega_b, sin, versin, c)
    u = max(spring_compression(y.x_v, y.v_v, contact_displacement(y.x_b, sin, versin, c), c), 0.0)
    kinetic = 0.5 * (c.m_eff * y.v_b * y.v_b + c.J_eff * y.omega_b * y.omega_b)
    return kinetic + lift_of(sin, versin, c) + soil_potential(k.A, k.slope_x, c).highest + 0.5 * c.k_v * u * u
