"""An impact on a boulder that is no box, from the paper and from mechanics, with NumPy and SciPy: corrected readings.

Nothing here is shared with the kernels. The boulder is a body of slices whose integrals `quad` works out; the soil is N
elements, each with its own width; truck and boulder push on each other where they touch; the weight acts at the
boulder's own centre against the end of the foot that it turns about. Rates are integrated by DOP853, and a segment ends
where the boulder leaves its base or passes through the upright.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, tan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp

from tests.oracle.inputs import GRAVITY, Inputs

Array = NDArray[np.float64]
ELEMENTS = 1000


@dataclass(frozen=True)
class Stone:
    """Points of a profile from the foot to the top, arrays of shape (P,) [m]: width, reach to and from the truck."""

    height: Array
    width: Array
    near: Array
    far: Array

    def at(self, column: str, z: float | Array) -> Array:
        """Width or reach at heights over the foot."""
        return np.interp(z, self.height, getattr(self, column))

    def integral(self, moment) -> float:
        """Integral over the volume of the inner integral of something over the length, a function of z, near, far."""
        total = 0.0
        for low, high in zip(self.height[:-1], self.height[1:], strict=True):
            total += quad(
                lambda z: float(self.at("width", z)) * moment(z, float(self.at("near", z)), float(self.at("far", z))),
                low,
                high,
                epsabs=0.0,
                epsrel=1e-13,
            )[0]
        return total


class Body(NamedTuple):
    """What moves: boulder and wedge; lengths from the middle of the foot, heights from the foot."""

    m_b: float
    x: float
    z: float
    J: float
    far: float
    M_soil: float
    soil_z: float
    soil_zz: float


def body(stone: Stone, i: Inputs, elements: int = ELEMENTS) -> Body:
    """Weigh boulder and soil."""
    volume = stone.integral(lambda z, near, far: near + far)
    x = stone.integral(lambda z, near, far: (far**2 - near**2) / 2) / volume
    z_b = stone.integral(lambda z, near, far: z * (near + far)) / volume
    J = stone.integral(lambda z, near, far: (near + far) * (z - z_b) ** 2 + ((far - x) ** 3 + (near + x) ** 3) / 3)
    knots = [i.d - z for z in stone.height if 0.0 < z < i.d]
    far = quad(lambda a: a * float(stone.at("far", i.d - a)), 0.0, i.d, points=knots or None, epsrel=1e-12)[0]
    alpha = (np.arange(elements) + 0.5) * i.d / elements
    tan_w = tan(np.pi / 4 + i.phi / 2)
    m_n = i.rho_s * stone.at("width", i.d - alpha) * i.d / elements * tan_w * (i.d - alpha)  # Eqs 1, 2
    heights = i.d - alpha
    return Body(
        i.rho_b * volume, x, z_b, i.rho_b * J, far / (i.d**2 / 2),
        m_n.sum(), (m_n * heights).sum(), (m_n * heights**2).sum(),
    )  # fmt: skip


class ImpactResult(NamedTuple):
    """Largest values of an impact, and the energy that is not accounted for as a share of the truck's."""

    rotation: float
    displacement: float
    vehicle: float
    force: float
    imbalance: float


def simulate(stone: Stone, i: Inputs, horizon: float, elements: int = ELEMENTS, rtol: float = 1e-9) -> ImpactResult:
    """Integrate an impact up to the horizon [s]."""
    b = body(stone, i, elements)
    m = b.m_b + b.M_soil
    c_x, c_z = (b.m_b * b.x + b.M_soil * b.far) / m, (b.m_b * b.z + b.soil_z) / m  # Eqs 3, 4
    l_n = b.far - c_x
    J = b.J + b.m_b * ((b.x - c_x) ** 2 + (b.z - c_z) ** 2)  # Eq 16
    J += b.soil_zz - 2 * c_z * b.soil_z + c_z**2 * b.M_soil + b.M_soil * l_n**2  # Eq 13
    struck = float(stone.at("near", i.d + i.e)) + c_x, i.d + i.e - c_z  # from the centre: behind, above
    K_p = tan(np.pi / 4 + i.phi / 2) ** 2
    alpha = (np.arange(elements) + 0.5) * i.d / elements
    width, h_e = stone.at("width", i.d - alpha), i.d / elements
    k_n = 1e6 * i.beta * width * alpha * h_e / (i.d / tan(i.phi))  # Eqs 24, 25
    F_u = K_p**2 * i.rho_s * GRAVITY * alpha * i.K_epsilon * width * h_e  # Eqs 27, 28
    c_n = i.rho_s * width * h_e  # Eqs 33, 36
    d_n = alpha - (i.d - c_z)
    weight = b.m_b * GRAVITY
    ahead, behind = float(stone.far[0]) - b.x, float(stone.near[0]) + b.x  # ends of the foot from the own centre

    def couple(theta: float, side: int) -> float:
        """The weight at the centre, the base at the end of the foot on the side to which the boulder has turned."""
        if side > 0:
            return -weight * (ahead * cos(theta) - b.z * sin(theta))
        return weight * (behind * cos(theta) + b.z * sin(theta))

    def loads(y: Array) -> tuple[float, float, float, float]:
        """Force and moment without the couple, force of the truck, and power of the drag."""
        x, v, theta, omega, x_v, v_v = y[:6]
        dx = x + l_n * (cos(theta) - 1) - d_n * sin(theta)  # Eq 22
        v_n = v - omega * (l_n * sin(theta) + d_n * cos(theta))  # Eq 35
        spring, drag = np.clip(k_n * dx, -F_u, F_u), c_n * v_n * np.abs(v_n)
        up = -(d_n * cos(theta) + l_n * sin(theta))  # height of an element over the centre
        back, above = struck
        x_c = x + back - back * cos(theta) + above * sin(theta)
        u = x_v - x_c - i.m_v / i.c_v * (i.v_0 - v_v)  # Eq 45, integrated
        F_v = max(i.k_v * u, 0.0)
        F_n = -(spring + drag)
        return (
            F_v + F_n.sum(),
            F_v * (above * cos(theta) + back * sin(theta)) + (F_n * up).sum(),
            F_v,
            (drag * v_n).sum(),
        )

    def rates(y: Array, side: int) -> Array:
        F, M, F_v, power = loads(y)
        alpha_b = (M + couple(y[2], side)) / J if side else 0.0
        return np.array([y[1], F / m, y[3], alpha_b, y[5], -F_v / i.m_v, power, F_v**2 / i.c_v])

    def energy(y: Array) -> float:
        x, v, theta, omega, _, v_v = y[:6]
        dx = x + l_n * (cos(theta) - 1) - d_n * sin(theta)
        within = np.abs(k_n * dx) <= F_u
        springs = np.where(within, k_n * dx**2 / 2, F_u * np.abs(dx) - F_u**2 / (2 * k_n)).sum()
        corner = ahead * sin(theta) if theta > 0 else -behind * sin(theta)
        lift = weight * (corner + b.z * (cos(theta) - 1))
        return m * v**2 / 2 + J * omega**2 / 2 + i.m_v * v_v**2 / 2 + springs + lift + loads(y)[2] ** 2 / (2 * i.k_v)

    y, t, side = np.array([0.0, 0.0, 0.0, 0.0, 0.0, i.v_0, 0.0, 0.0]), 0.0, 0
    peaks, segments = np.zeros(4), 0
    while t < horizon and segments < 50:
        segments += 1

        def leaves(_t: float, y: Array, side: int = side) -> float:
            M = loads(y)[1]
            return min(weight * ahead - M, M + weight * behind) if side == 0 else side * y[2]

        event: Any = leaves
        event.terminal, event.direction = True, -1.0
        found = solve_ivp(
            lambda _t, y, side=side: rates(y, side), (t, horizon), y,
            method="DOP853", rtol=rtol, atol=rtol * 1e-2, max_step=1e-3, events=[leaves], dense_output=True,
        )  # fmt: skip
        assert found.status >= 0, found.message
        times = np.linspace(t, found.t[-1], 20 * len(found.t))
        states = found.sol(times)
        forces = [loads(state)[2] for state in states.T]
        peaks = np.maximum(peaks, [np.abs(states[2]).max(), states[0].max(), states[4].max(), max(forces)])
        t, y = found.t[-1], found.y[:, -1].copy()
        if t < horizon:
            side = (1 if loads(y)[1] > 0 else -1) if side == 0 else -side
            y[2] = 0.0
    before = i.m_v * i.v_0**2 / 2
    return ImpactResult(*peaks, imbalance=abs(energy(y) + y[6] + y[7] - before) / before)
