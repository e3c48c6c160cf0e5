"""How a simulation is run: what is asked for, the longest step that is stable, and the first step.

**Stability.** Within a step the motion is smooth, and an explicit method is stable where its step times every rate of
the linearised motion lies in the stability region of the method. The rates are bounded from above, once per design, for
the states that the motion can reach: by the energy of the truck, and up to the rotation at which the simulation ends. A
design that would need too many steps is refused before it starts, and the status names the rate that asks for them.
Rates of an impossible design are not numbers, which `np.sqrt` also gives without the compiler.

**The first step** ends where the boulder begins to turn. A boulder stands on its base until the blow overcomes the
couple of its weight, a few milliseconds after the first touch, so the first step of nearly every simulation would be
cut there. Up to then boulder and truck only move along the direction of travel, on soil that is far from its ultimate
resistance: a linear motion but for the drag, which a power series of the time describes. So the instant is known
beforehand, well enough for a step that ends just behind it. Where it does not, the event is found within that step or a
later one, as any other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import exact_inlined, inlined, kernel
from .design import Constants
from .dynamics import soil_reaction
from .events import AT_END, TOLERANCE, GapFactors, needs_moment
from .numerics import sine_versine
from .outcomes import FINER, NONE_NEEDED, Status
from .soil import Kinematics

VALID_ROTATION = math.radians(20.0)
"""Rotation up to which the model is valid [rad]: beyond, the boulder climbs out of its bed, as the paper says. What
turns further is never a pass, whatever the limit of its criterion."""
STEP_RATIO = 3.0
"""Ratio of the steps of the two solutions that an error is estimated from, coarser over finer."""


class Control(NamedTuple):
    """How a simulation is run."""

    h: float
    """Step [s]; shortened where a design needs it, see `stable_step`."""
    horizon: float
    """Simulated time [s], unless a design ends before or has reason to go on."""
    theta_limit: float
    """Limit of rotation [rad]."""
    elements: int
    """Number N of soil elements; 0 for the closed form."""
    error_estimate: bool
    """Whether the estimated error of a design is confirmed by a second solution where one could be wrong, see
    `boulder_kernels.table.simulate_table`. Without, the steps of one solution give it."""
    stop_at_limit: bool = True
    """Whether the simulation ends where the rotation reaches its limit."""
    locate_yield: bool = False
    """Whether steps also end where the soil reaches its ultimate resistance. The force has a kink there: a step that
    runs across it is of third order only. Locating it restores the fifth, and pays for errors below about 1e-4 deg."""
    refined: bool = False
    """Whether the step of every design is divided by `STEP_RATIO`, after any shortening: the finer of the two
    solutions that the error is estimated from."""
    longest_horizon: float = 0.0
    """Simulated time [s] up to which a design goes on that reaches the horizon without proof that it stays below its
    limits; not beyond the horizon where it is shorter, or where nothing stops at the limit."""
    last_resort: bool = False
    """Whether a design that needs more steps than are allowed is simulated all the same, see
    `boulder_kernels.impact.simulate_last_resort`."""
    paired: bool = False
    """Where errors are estimated: whether every design is solved twice for it, and not only doubtful ones."""
    event_tolerance: float = TOLERANCE
    """Precision with which events are located, as a fraction of the step; `boulder_kernels.events.TOLERANCE` as
    printed."""
    side_by_side: bool = True
    """Whether designs that may go through lanes side by side do, or one after another. The two round differently."""


EVENT_TOLERANCE = 1e-5
"""Second and finer solutions locate events to this fraction of a step. Boulders that rock, or are barely lifted,
amplify what the time of the first kink was off by, whatever the step: located as in first solutions, late ones need
steps 10 times as short to agree."""
STABLE_OSCILLATION = 1.5
"""Largest step times angular frequency. On the imaginary axis the method amplifies by 0.3 % a step there (its limit
for none is 1.0), which the damping of the soil and the length of an impact more than cover."""
STABLE_DECAY = 3.0
"""Largest step times rate of decay (the method's limit on the negative real axis is 3.3)."""
MOST_SHORTENING = 25.0
"""A design may take this many times the steps asked for, or `STEPS_ALWAYS` if that is more."""
STEPS_ALWAYS = 2_500
"""Steps to the horizon that every design may take."""
MOST_STEPS = 500_000
"""Most steps that any design takes."""
RETRY = 0.25
"""Factor on the step of a design whose motion became non-finite all the same, for its retry."""
ACCEPTED = -1
"""Refusal of a design that is not refused."""
QUARTER_TURN = 0.5 * math.pi
ATTEMPTS_PER_STEP = 4
ATTEMPTS_SPARE = 10_000
"""A simulation gives up after ATTEMPTS_PER_STEP attempts per nominal step, plus this many for events."""
SMALL = 1e-5
"""Share of the displacement at which the soil yields, or of the depth where that is less, by which it is moved to find
its stiffness: soil with cohesion may be said to yield nowhere, or far away."""
BEHIND = 1.0 + 0.3 * AT_END * TOLERANCE
"""The step is to end where the net moment is over the couple by this factor."""


@inlined
def control_in(c: np.ndarray) -> Control:
    """Return the control that an array holds, in the order of its fields; booleans are 0 or 1."""
    h, horizon, theta_limit, longest_horizon, event_tolerance = c[0], c[1], c[2], c[8], c[11]
    error_estimate, stop_at_limit, locate_yield, refined = c[4] != 0.0, c[5] != 0.0, c[6] != 0.0, c[7] != 0.0
    last_resort, paired, side_by_side = c[9] != 0.0, c[10] != 0.0, c[12] != 0.0
    return Control(
        h, horizon, theta_limit, int(c[3]), error_estimate, stop_at_limit, locate_yield, refined,
        longest_horizon, last_resort, paired, event_tolerance, side_by_side,
    )  # fmt: skip


@inlined
def control_for(solution: int, c: Control) -> Control:
    """Return how a design is solved, first (`NONE_NEEDED`) or for a second solution (`FINER` to `PAIR`).

    Where errors are estimated, first by a third of the step; a doubtful design again by half of that, and by steps that
    end close to events; any other that has a second solution by the step itself.
    """
    finer = solution == FINER
    h = 0.5 * c.h if finer else c.h
    refined = finer or solution == NONE_NEEDED if c.error_estimate else c.refined
    located, tolerance = c.locate_yield or finer, EVENT_TOLERANCE if finer else c.event_tolerance
    return Control(
        h, c.horizon, c.theta_limit, c.elements, c.error_estimate, c.stop_at_limit, located, refined,
        c.longest_horizon, c.last_resort, c.paired, tolerance, c.side_by_side,
    )  # fmt: skip


class Rates(NamedTuple):
    """Upper bounds of what drives the motion to and fro, and of what slows it down."""

    soil: float
    """Squared angular frequency [1/s^2] by the springs of the soil."""
    truck: float
    """Squared angular frequency [1/s^2] by the spring of the truck."""
    turning: float
    """Squared angular frequency [1/s^2] by weight, contact and soil, whose arms grow with the rotation."""
    relaxation: float
    """Rate [1/s] of the truck's spring against its damper, k_v/c_v."""
    drag: float
    """Rate [1/s] of the drag of the soil at its fastest."""


@exact_inlined
def largest_force(c: Constants) -> float:
    """Upper bound of the contact force [N]: the damper passes on no more, nor does the spring stop it by more."""
    stored = c.v_0 * c.k_v / np.sqrt(c.k_m)
    return min(stored, c.v_0 * c.k_v / (c.k_m * c.tau_v)) if c.tau_v > 0.0 else stored


@exact_inlined
def largest_speed(reach: float, inverse_J: float, c: Constants) -> float:
    """Upper bound of the speed of the boulder anywhere in the soil [m/s].

    ``reach``: bound of the lever of the soil [m]; ``inverse_J``: reciprocal of the moment of inertia that turns [1/(kg
    m^2)].

    The energy of the truck bounds it, were it all in the boulder. So does a blow, whose point of contact moves off at
    no more than twice the speed of the truck: an end of the boulder then moves at most 1 + sqrt(1 + (reach/gyration)^2)
    times as fast as the truck, whatever the lever of the blow.
    """
    mobility = c.inverse_m_eff + reach * reach * inverse_J
    by_energy = np.sqrt(c.k_v / c.k_m * mobility)
    by_blow = 1.0 + np.sqrt(mobility / c.inverse_m_eff)
    return c.v_0 * min(by_energy, by_blow)


@exact_inlined
def rates_of(theta_stop: float, c: Constants) -> Rates:
    """Upper bounds of the rates of a design.

    ``theta_stop``: rotation at which the simulation ends [rad].

    The stiffness matrix of boulder and truck is a sum, and its largest eigenvalue at most the sum of the largest
    eigenvalues of its terms. The soil's follows from the integrals of r, r lever and r lever^2 over the depth, r = 0
    ... 1, with the lever (r d - z_0) cos(theta) + l_n sin(theta). Where the printed restoring moment doubles the net
    moment, the boulder turns as if half as heavy.
    """
    sin = sine_versine(theta_stop).sin if theta_stop < QUARTER_TURN else 1.0
    inverse_J = 2.0 * c.inverse_J_eff if c.theta_corner < theta_stop else c.inverse_J_eff
    d, z_0, l_n = c.d, c.z_0, abs(c.l_n)

    first = abs(d / 3.0 - 0.5 * z_0)
    second = 0.25 * d * d - (2.0 / 3.0) * z_0 * d + 0.5 * z_0 * z_0 + 2.0 * sin * l_n * first + 0.5 * (l_n * sin) ** 2
    first += 0.5 * l_n * sin
    across, around = 0.5 * c.inverse_m_eff, second * inverse_J
    coupled = first * first * c.inverse_m_eff * inverse_J
    soil = c.K_soil * (0.5 * (across + around) + np.sqrt(0.25 * (across - around) ** 2 + coupled))

    lever = min(abs(c.h) + abs(c.g_x) * sin, np.sqrt(c.h * c.h + c.g_x * c.g_x))
    truck = c.k_v * (c.inverse_m_eff + lever * lever * inverse_J) + c.k_m

    # The energy of the truck presses the soil no further than it takes to store it.
    pressed = 0.5 * c.K_soil * min(c.x_yield, 2.0 * c.v_0 * np.sqrt(c.k_v / (c.k_m * c.K_soil)))
    upright = max(abs(z_0), abs(d - z_0))
    turning = abs(c.C_cos) * sin + abs(c.C_sin)
    turning += largest_force(c) * (abs(c.g_x) + abs(c.h) * sin) + pressed * (l_n + upright * sin)

    mean_square = d * d / 3.0 - z_0 * d + z_0 * z_0 + sin * l_n * abs(d - 2.0 * z_0) + (l_n * sin) ** 2
    speed = largest_speed(upright + l_n * sin, inverse_J, c)
    drag = 2.0 * c.R_soil * speed * (c.inverse_m_eff + mean_square * inverse_J)
    return Rates(soil, truck, turning * inverse_J, c.k_m * c.tau_v, drag)


@exact_inlined
def stable_step(r: Rates) -> float:
    """Longest step that is stable for a design [s]."""
    oscillation = np.sqrt(r.soil + r.truck + r.turning)
    return min(STABLE_OSCILLATION / oscillation, STABLE_DECAY / (r.relaxation + r.drag))


@exact_inlined
def refusal(h: float, h_asked: float, horizon: float, r: Rates) -> int:
    """Status with which a design is refused because of its steps, or ACCEPTED.

    ``h, h_asked``: step of the design, and step asked for [s]; ``horizon``: longest simulated time [s]; ``r``: rates of
    the design.
    """
    asked = horizon / h_asked
    most = min(max(MOST_SHORTENING * asked, STEPS_ALWAYS), MOST_STEPS)
    if horizon / h <= most:
        return ACCEPTED
    if h >= h_asked:
        return Status.STEP_BUDGET.value
    oscillation = np.sqrt(r.soil + r.truck + r.turning)
    if STABLE_DECAY * oscillation < STABLE_OSCILLATION * (r.relaxation + r.drag):
        return Status.WEAK_DAMPER.value if r.relaxation >= r.drag else Status.THICK_SOIL.value
    if r.soil >= max(r.truck, r.turning):
        return Status.STIFF_SOIL.value
    return Status.STIFF_VEHICLE.value if r.truck >= r.turning else Status.LITTLE_INERTIA.value


@exact_inlined
def corrected(t: float, m_1: float, m_2: float, m_3: float, m_4: float, m_5: float, m_6: float, aim: float) -> float:
    """One step of Newton's method to the time [s] at which a series without constant term reaches an aim."""
    value = t * (m_1 + t * (m_2 + t * (m_3 + t * (m_4 + t * (m_5 + t * m_6)))))
    slope = m_1 + t * (2.0 * m_2 + t * (3.0 * m_3 + t * (4.0 * m_4 + t * (5.0 * m_5 + t * (6.0 * m_6)))))
    return t + (aim - value) / slope


@exact_inlined
def onset_of(c: Constants) -> float:
    """Time after the first touch at which the net moment exceeds the couple of the weight [s].

    ``c``: constants of a design, in any soil that has not been moved yet.

    It is no positive number where the blow does not turn the boulder away from the truck.

    With the compression of the spring u, its rate without the damper w = v_v - v_b, and x = x_b, v = v_b the motion is

        u' = w - r u, w' = -(k_m + p) u + q x, x' = v, v' = p u - q x

    (Eqs 10, 17, 45), where r = k_v/c_v, p = k_v/m_eff and q is the stiffness of the soil over m_eff, if all of it moves
    alike; the net moment is h k_v u plus what such a displacement of the soil turns. The series are cut behind t^6.
    """
    moved = SMALL * min(c.x_yield, c.d)
    soil = soil_reaction(Kinematics(moved, 0.0, 0.0, 0.0, -c.z_0, c.d), c)
    r, p = c.tau_v * c.k_m, c.k_v * c.inverse_m_eff
    q, both = -soil.F / moved * c.inverse_m_eff, c.k_m + p
    u_1 = c.v_0
    u_2 = -0.5 * r * u_1
    w_2, v_2 = -0.5 * both * u_1, 0.5 * p * u_1
    u_3, w_3, v_3 = (w_2 - r * u_2) / 3.0, -both * u_2 / 3.0, p * u_2 / 3.0
    x_3 = v_2 / 3.0
    u_4, w_4, v_4 = 0.25 * (w_3 - r * u_3), 0.25 * (q * x_3 - both * u_3), 0.25 * (p * u_3 - q * x_3)
    x_4 = 0.25 * v_3
    u_5, w_5, v_5 = 0.2 * (w_4 - r * u_4), 0.2 * (q * x_4 - both * u_4), 0.2 * (p * u_4 - q * x_4)
    x_5 = 0.2 * v_4
    u_6, x_6 = (w_5 - r * u_5) / 6.0, v_5 / 6.0
    of_u, of_x = c.k_v * c.h, soil.M / moved
    m_1, m_2, m_3 = of_u * u_1, of_u * u_2, of_u * u_3 + of_x * x_3
    m_4, m_5, m_6 = of_u * u_4 + of_x * x_4, of_u * u_5 + of_x * x_5, of_u * u_6 + of_x * x_6
    aim = BEHIND * c.C_cos
    t = aim / m_1
    t = corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)
    t = corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)
    t = corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)
    return corrected(t, m_1, m_2, m_3, m_4, m_5, m_6, aim)


@exact_inlined
def first_length(h: float, g: GapFactors, c: Constants) -> float:
    """Length of the first step of a simulation by steps of length h [s].

    ``h``: length of the steps; ``g, c``: factors of the gaps at the first touch, and constants of the design. As
    printed a boulder is not seated, and the first step is like any.
    """
    onset = onset_of(c)
    return onset if needs_moment(g) & (onset > 0.0) & (onset < h) else h


@kernel
def attempt_budget(h: float, horizon: float) -> float:
    """Attempts after which a simulation with time step h [s] gives up before its horizon [s]."""
    return ATTEMPTS_PER_STEP * horizon / h + ATTEMPTS_SPARE


@inlined
def first_step(control: Control, theta_stop: float, c: Constants) -> tuple[float, int]:
    """Step of a design [s], and the status it is refused with or ACCEPTED."""
    rates = rates_of(theta_stop, c)
    h = min(control.h, stable_step(rates))
    status = refusal(h, control.h, control.horizon, rates)
    return h / STEP_RATIO if control.refined else h, status
