"""Equations broken on purpose, one at a time: the place, what stands there, and what is put in its stead."""

from __future__ import annotations

from typing import NamedTuple


class Mutation(NamedTuple):
    """One broken equation."""

    equations: tuple[int, ...]
    """Whose tests in the register must notice."""
    file: str
    old: str
    new: str


_DESIGN, _SOIL = "kernels/boulder_kernels/design.py", "kernels/boulder_kernels/soil.py"
_DYNAMICS, _MODES = "kernels/boulder_kernels/dynamics.py", "kernels/boulder_kernels/modes.py"
_WALL, _TRAJECTORY = "boulder_sweep/crash_tests/rigid_wall.py", "boulder_sweep/impact/trajectory.py"
_DESIGNS, _SECOND = "boulder_sweep/designs.py", "kernels/boulder_kernels/second_spring.py"
_STAGES = "boulder_sweep/crash_tests/stiffening_wall.py"
_RESISTANCE, _LIFT, _UPLIFT = (f"boulder_sweep/{name}.py" for name in ("soils", "judge/uplift", "impact/uplift"))
_GROUND = "boulder_sweep/soils.py"
_LAYERED, _LAYERS = (f"kernels/boulder_kernels/{name}.py" for name in ("layered", "layered_soil"))

_PLASTIC, _UNLOADING = (f"kernels/boulder_kernels/{name}.py" for name in ("plastic", "unloading"))

MUTATIONS = (
    Mutation((1,), _DESIGN, "return (1.0 + half) / (1.0 - half)", "return (1.0 - half) / (1.0 + half)"),
    Mutation((2,), _DESIGN, "* (design.d - element_depth(", "* (design.d + element_depth("),
    Mutation((3,), _DESIGN, "(soil.mass * design.L + m_b * 0.5 * design.L)", "(soil.mass * design.L + m_b * design.L)"),
    Mutation((4,), _DESIGN, "(soil.first + m_b * 0.5 * design.H)", "(soil.first - m_b * 0.5 * design.H)"),
    Mutation((5, 6), _DESIGN, "else design.e + half_element - z_0", "else design.e - z_0"),
    Mutation((5, 6), _DESIGN, "h = design.e + z_0 if", "h = design.e - z_0 if"),
    Mutation((7, 8), _SOIL, "q = c.l_n * sin - c.z_0 * cos", "q = c.l_n * sin + c.z_0 * cos"),
    Mutation((9,), _DESIGNS, "embedment, hood) + bumper", "embedment, hood) - bumper"),
    Mutation((10,), _DYNAMICS, "(soil.F + F_v) * c.inverse_m_eff", "(soil.F - F_v) * c.inverse_m_eff"),
    Mutation((11,), _DYNAMICS, "M = soil.M + F_v * contact_lever", "M = -soil.M + F_v * contact_lever"),
    Mutation((12,), _DESIGN, "m_eff = m_b + soil.mass", "m_eff = m_b"),
    Mutation((13,), _DESIGN, "(c_y * c_y + l_n * l_n) * soil.mass", "(c_y * c_y - l_n * l_n) * soil.mass"),
    Mutation((14,), _DESIGN, "l_n = design.L - c_x", "l_n = c_x"),
    Mutation((15,), _DESIGN, "return design.rho_b * design.L", "return 1.01 * design.rho_b * design.L"),
    Mutation((16,), _DESIGN, "own *= 0.25", "own *= 0.5"),
    Mutation((17,), _DYNAMICS, "-s.k_truck * u,", "s.k_truck * u,"),
    Mutation((19, 20), _SOIL, "F_n = -(", "F_n = +("),
    Mutation((20,), _SOIL, "-F_n * (k.lever_d * ratio + k.q)", "-F_n * (k.lever_d * ratio - k.q)"),
    Mutation((19, 20), _SOIL, "pressed_r = c.K_soil * spring_r + R", "pressed_r = c.K_soil * spring_r - R"),
    Mutation((19,), _SOIL, "drag = BB * (2.0 * r_0 - 1.0)", "drag = BB * (2.0 * r_0 + 1.0)"),
    Mutation(
        (21, 26, 28),
        _SOIL,
        "limited = min(max(displacement, -c.x_yield), c.x_yield)",
        "limited = min(displacement, c.x_yield)",
    ),
    Mutation((22,), _SOIL, "x_b - c.l_n * versin + c.z_0 * sin", "x_b + c.l_n * versin + c.z_0 * sin"),
    Mutation((24,), _DESIGN, "return 1e6 * design.beta * design.W", "return 1e6 * design.beta"),
    Mutation((24,), _DESIGN, "return (n - 0.5) * d / elements", "return n * d / elements"),
    Mutation((25,), _DESIGN, "return d * (1.0 - half * half)", "return d * (1.0 + half * half)"),
    Mutation((27,), _DESIGN, "passive_pressure_coefficient(phi) ** 2", "passive_pressure_coefficient(phi)"),
    Mutation((28,), _DESIGN, "design.rho_s, design.K_epsilon) * design.W", "design.rho_s, 1.0) * design.W"),
    Mutation((34, 36), _SOIL, "velocity * abs(velocity)", "velocity * velocity"),
    Mutation((35,), _SOIL, "v_b - omega_b * q", "v_b + omega_b * q"),
    Mutation(
        (37,), _DYNAMICS, "c.C_cos - c.C_cos * versin + c.C_sin * sin", "c.C_cos - c.C_cos * versin - c.C_sin * sin"
    ),
    Mutation((38,), _MODES, "net, couple, couple_sin = 1.0, 0.0, 0.0", "net, couple, couple_sin = 0.0, 0.0, 0.0"),
    Mutation((39,), _MODES, "couple, couple_sin = -modes.corner", "couple, couple_sin = modes.corner"),
    Mutation((39,), _MODES, "net = 1.0 - modes.corner", "net = 1.0 + modes.corner"),
    Mutation((37, 39), _DYNAMICS, "switches.couple_sin * sin", "switches.couple_sin * sin * sin"),
    Mutation((40, 45), _DYNAMICS, "c.tau_v * (c.v_0 - v_v)", "c.tau_v * c.v_0"),
    Mutation((41, 46, 47), _DYNAMICS, "F_v = s.k_contact * u", "F_v = s.k_truck * u"),
    Mutation((45, 48), _DYNAMICS, "return c.h - c.h * versin + c.g_x * sin", "return c.h - c.h * versin - c.g_x * sin"),
    Mutation(
        (47,), _MODES, "if modes.touching or not readings.separation_released else 0.0", "if modes.touching else 0.0"
    ),
    Mutation((49,), _WALL, "x = m / c * (v_0 - v) + v_0 * odd", "x = m / c * (v_0 - v)"),
    Mutation((50, 51), _WALL, "/ (2.0 * self.damper_N_s_m)", "/ self.damper_N_s_m"),
    Mutation((52,), _DYNAMICS, "s.net * M + couple_moment", "M + couple_moment"),
    Mutation((53, 54, 55), _TRAJECTORY, "+ up * np.sin(theta)", "- up * np.sin(theta)"),
    Mutation((53, 54, 55), _TRAJECTORY, "x_b - along *", "x_b + along *"),
    Mutation((101,), _RESISTANCE, "return 3.0 * passive_coefficient", "return 2.0 * passive_coefficient"),
    Mutation((102,), _RESISTANCE, "5.0 * table.W / table.d", "5.0 * table.d / table.W"),
    Mutation((102,), _RESISTANCE, "np.minimum(K_p**2, K_p * R)", "K_p * R"),
    Mutation((103,), _LIFT, "(table.L**2 + table.H**2)", "(table.L**2 - table.H**2)"),
    Mutation((103,), _LIFT, "table.d**2 * table.L", "table.d**2 * table.W"),
    Mutation((104,), _UPLIFT, "- (across + over) * omega**2", "+ (across + over) * omega**2"),
    Mutation((105,), _GROUND, "2e3 * cohesion * np.sqrt(K_p)", "1e3 * cohesion * np.sqrt(K_p)"),
    Mutation((105,), _GROUND, "K_p * (stress - weight * top)", "K_p * stress"),
    Mutation((105,), _LAYERED, "p_0 * ultimate, p_1 * design.d * ultimate", "p_0 * ultimate, p_1 * ultimate"),
    Mutation((105,), _LAYERED, "pressure * design.W * h_e", "pressure * h_e"),
    Mutation((106,), _GROUND, "if top >= water else", "if top > water else"),
    Mutation(
        (106,), _GROUND, "stress = stress + weight * (bottom - top)", "stress = stress + G * rho_s * (bottom - top)"
    ),
    Mutation((107,), _GROUND, "/ elementary.cos(slope))", ")"),
    Mutation((108,), _LAYERS, "length = a - b if above else b - a", "length = b - a"),
    Mutation((108,), _LAYERS, "(layer.P_1 if above else -layer.P_1)", "layer.P_1"),
    Mutation((108,), _LAYERS, "length * powers + P_2 * logarithm", "length * powers - P_2 * logarithm"),
    Mutation((108,), _LAYERS, "0.5 * w.F_2 + (1.0 / 3.0) * w.G_3", "0.5 * w.F_2 + 0.5 * w.G_3"),
    Mutation((108,), _LAYERS, "0.5 * (2.0 * w.D_1 - sums.Z_1)", "0.5 * (w.D_1 - sums.Z_1)"),
    Mutation((111,), _SECOND, "return u * (1.0 - k_v / k_2)", "return u * (1.0 + k_v / k_2)"),
    Mutation((111,), _SECOND, "k_m=c.k_m * (k_2 / c.k_v)", "k_m=c.k_m"),
    Mutation((111,), _DYNAMICS, "(c.v_0 - v_v) - c.u_0", "(c.v_0 - v_v) + c.u_0"),
    Mutation((111,), _STAGES, "(a_2 - w.a * v_2) * odd", "(a_2 + w.a * v_2) * odd"),
    Mutation((112,), _SECOND, "/ (1.0 - k_v / k_2) if k_2 > k_v", "* (1.0 - k_v / k_2) if k_2 > k_v"),
    Mutation((121,), _PLASTIC, "F_n = behind - ahead", "F_n = -behind - ahead"),
    Mutation((122,), _PLASTIC, "= max(front, u - y)", "= max(front, u)"),
    Mutation((122,), _PLASTIC, "min(max(front, u - y), u + y)", "min(max(front, u), u + y)"),
    Mutation((123,), _PLASTIC, "work += soil.ultimate[n] * max(", "work += 0.5 * soil.ultimate[n] * max("),
    Mutation((124,), _PLASTIC, "(pressed * pressed - over * over)", "(pressed * pressed)"),
    Mutation((124,), _UNLOADING, "c.C_cos * abs(sin) + c.C_sin", "c.C_cos * abs(sin) - c.C_sin"),
)
