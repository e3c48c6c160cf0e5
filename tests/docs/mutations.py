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
_DYNAMICS = "kernels/boulder_kernels/dynamics.py"
_WALL, _HISTORY = "boulder_sweep/crash_tests/rigid_wall.py", "boulder_sweep/impact/simulation.py"
_DESIGNS = "boulder_sweep/designs.py"
_GROUND = "kernels/boulder_kernels/ground.py"
_PIECES = "kernels/boulder_kernels/pieces.py"
_HEAVE, _STEPS, _OPINION = (f"kernels/boulder_kernels/{name}.py" for name in ("heave", "runge_kutta", "second_opinion"))

MUTATIONS = (
    Mutation((1,), _DESIGN, "return (1.0 + half) / (1.0 - half)", "return (1.0 - half) / (1.0 + half)"),
    Mutation((2,), _DESIGN, "* (design.d - element_depth(", "* (design.d + element_depth("),
    Mutation((3,), _DESIGN, "(soil.mass * body.line + m_b * body.x)", "(soil.mass * body.line + m_b * body.line)"),
    Mutation((4,), _DESIGN, "(soil.first + m_b * body.y)", "(soil.first - m_b * body.y)"),
    Mutation((5, 6), _DESIGN, "else design.e + half_element - z_0", "else design.e - z_0"),
    Mutation((5, 6), _DESIGN, "h = design.e + z_0 if", "h = design.e - z_0 if"),
    Mutation((7, 8), _SOIL, "q = c.l_n * sin - c.z_0 * cos", "q = c.l_n * sin + c.z_0 * cos"),
    Mutation((9,), _DESIGNS, "embedment, hood) + bumper", "embedment, hood) - bumper"),
    Mutation((10,), _DYNAMICS, "(soil.F + F_v) * c.inverse_m_eff", "(soil.F - F_v) * c.inverse_m_eff"),
    Mutation((11,), _DYNAMICS, "M = soil.M + F_v * contact_lever", "M = -soil.M + F_v * contact_lever"),
    Mutation((12,), _DESIGN, "m_eff = m_b + soil.mass", "m_eff = m_b"),
    Mutation((13,), _DESIGN, "(c_y * c_y + l_n * l_n) * soil.mass", "(c_y * c_y - l_n * l_n) * soil.mass"),
    Mutation((14,), _DESIGN, "l_n = body.line - c_x", "l_n = c_x"),
    Mutation((15,), _DESIGN, "return design.rho_b * design.L", "return 1.01 * design.rho_b * design.L"),
    Mutation((16,), _DESIGN, "J *= 0.25", "J *= 0.5"),
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
    Mutation((24,), _DESIGN, "return 1e6 * beta * design.W", "return 1e6 * beta"),
    Mutation((24,), _DESIGN, "return (n - 0.5) * d / elements", "return n * d / elements"),
    Mutation((25,), _DESIGN, "return d * (1.0 - half * half)", "return d * (1.0 + half * half)"),
    Mutation((27,), _DESIGN, "passive_pressure_coefficient(phi) ** 2", "passive_pressure_coefficient(phi)"),
    Mutation((28,), _DESIGN, "design.rho_s, design.K_epsilon) * design.W", "design.rho_s, 1.0) * design.W"),
    Mutation((34, 36), _SOIL, "velocity * abs(velocity)", "velocity * velocity"),
    Mutation((35,), _SOIL, "v_b - omega_b * q", "v_b + omega_b * q"),
    Mutation(
        (37,), _DYNAMICS, "c.C_cos - c.C_cos * versin + c.C_sin * sin", "c.C_cos - c.C_cos * versin - c.C_sin * sin"
    ),
    Mutation((38,), _DYNAMICS, "net, couple, couple_sin = 1.0, 0.0, 0.0", "net, couple, couple_sin = 0.0, 0.0, 0.0"),
    Mutation((39,), _DYNAMICS, "couple, couple_sin = -modes.corner", "couple, couple_sin = modes.corner"),
    Mutation((39,), _DYNAMICS, "net = 1.0 - modes.corner", "net = 1.0 + modes.corner"),
    Mutation((37, 39), _DYNAMICS, "switches.couple_sin * sin", "switches.couple_sin * sin * sin"),
    Mutation((40, 45), _DYNAMICS, "c.tau_v * (c.v_0 - v_v)", "c.tau_v * c.v_0"),
    Mutation((41, 46, 47), _DYNAMICS, "F_v = s.k_contact * u", "F_v = s.k_truck * u"),
    Mutation((45, 48), _DYNAMICS, "return c.h - c.h * versin + c.g_x * sin", "return c.h - c.h * versin - c.g_x * sin"),
    Mutation(
        (47,), _DYNAMICS, "if modes.touching or not readings.separation_released else 0.0", "if modes.touching else 0.0"
    ),
    Mutation((49,), _WALL, "x = m / c * (v_0 - v) + v_0 * odd", "x = m / c * (v_0 - v)"),
    Mutation((50, 51), _WALL, "/ (2.0 * self.damper_N_s_m)", "/ self.damper_N_s_m"),
    Mutation((52,), _DYNAMICS, "s.net * M + couple_moment", "M + couple_moment"),
    Mutation((53, 54, 55), _HISTORY, "+ up * np.sin(theta)", "- up * np.sin(theta)"),
    Mutation((53, 54, 55), _HISTORY, "x_b - along *", "x_b + along *"),
    Mutation((101,), _GROUND, "return 3.0 * K_p", "return 2.0 * K_p"),
    Mutation((102,), _GROUND, "5.0 * W / d", "5.0 * d / W"),
    Mutation((102,), _GROUND, "min(K_p * K_p, K_p * R)", "K_p * R"),
    Mutation((105,), _GROUND, "2e3 * cohesion * np.sqrt(K_p)", "1e3 * cohesion * np.sqrt(K_p)"),
    Mutation((105,), _GROUND, "K_p * (stress - weight * top)", "K_p * stress"),
    Mutation((105,), _PIECES, "p.p_0 * ultimate, p.p_1 * design.d * ultimate", "p.p_0 * ultimate, p.p_1 * ultimate"),
    Mutation((105,), _PIECES, "pressure * design.W * share", "pressure * share"),
    Mutation((106,), _GROUND, "if top >= ground.water else", "if top > ground.water else"),
    Mutation((106,), _GROUND, "stress += weight * (bottom - top)", "stress += G * rho_s * (bottom - top)"),
    Mutation((107,), _GROUND, "/ math.cos(slope))", ")"),
    Mutation((108,), _PIECES, "n, m, p = Ka - piece.P_1, Ka + piece.P_1", "n, m, p = Ka + piece.P_1, Ka + piece.P_1"),
    Mutation((108,), _PIECES, "n * r.three - KS * r.four + times(p, r.two)", "n * r.three - KS * r.four"),
    Mutation((108,), _PIECES, "ReleasedEnergy(times(share, logarithm)", "ReleasedEnergy(-times(share, logarithm)"),
    Mutation(
        (108,), _PIECES, "s.U_0 + (w_0 * (P_0 * i.one + P_1 * i.two)", "s.U_0 + (w_0 * (P_0 * i.one + P_1 * i.one)"
    ),
    Mutation((108,), _PIECES, "BB * N_1 - Bp * N_2 + pp * N_3", "BB * N_1 - Bp * N_1 + pp * N_3"),
    Mutation((131,), _HEAVE, "f.b_b * cos - f.a_b * sin", "f.b_b * cos + f.a_b * sin"),
    Mutation(
        (131,), _HEAVE, "turning = Q.Q_theta - i.S * omega_b * omega_b", "turning = Q.Q_theta + i.S * omega_b * omega_b"
    ),
    Mutation((131,), _HEAVE, "Q.Q_y / f.m_b + i.Y * omega_b * omega_b", "Q.Q_y / f.m_b - i.Y * omega_b * omega_b"),
    Mutation((131,), _HEAVE, "2.0 * l_n * sin * cos * f.M_first", "l_n * sin * cos * f.M_first"),
    Mutation((131,), _HEAVE, "A = f.J_b + turned if f.heave", "A = f.c.J_eff if f.heave"),
    Mutation(
        (132,),
        _HEAVE,
        "return Faces(f.c.l_n, f.c.l_n - f.L",
        "return Faces(f.c.l_n, f.c.l_n",
    ),
    Mutation((132,), _HEAVE, "f.heave * (y_b + d_n * versin)", "f.heave * (y_b - d_n * versin)"),
    Mutation((132,), _HEAVE, "f.heave * energy if z > 0.0 else 0.0", "0.0"),
    Mutation((132,), _HEAVE, "lift_near * a.near) * cos", "lift_near * a.far) * cos"),
    Mutation((132,), _HEAVE, "all_of_it.share * covered * drag", "all_of_it.share * drag"),
    Mutation((132,), _HEAVE, "share * length * (0.25 - (1.0 / 6.0) * share)", "share * length * 0.25"),
    Mutation((132,), _HEAVE, "0.5 * mean * mean + (1.0 / 24.0) * length * length", "0.5 * mean * mean"),
    Mutation((132,), _HEAVE, "(far.widening + near.widening) * p", "(far.widening - near.widening) * p"),
    Mutation(
        (133,),
        _HEAVE,
        "+ field(work, FOOT, j) * sin - f.c.c_y * versin",
        "- field(work, FOOT, j) * sin - f.c.c_y * versin",
    ),
    Mutation(
        (133,),
        _HEAVE,
        "elastic = min(max(f.k_foot * strip_depth(work, j, y_b, sin, versin, f), 0.0), f.q_foot)",
        "elastic = min(f.k_foot * strip_depth(work, j, y_b, sin, versin, f), f.q_foot)",
    ),
    Mutation(
        (133,),
        _HEAVE,
        "max(elastic - on * f.c_foot * (w_b - omega_b * X), 0.0)",
        "max(elastic - f.c_foot * (w_b - omega_b * X), 0.0)",
    ),
    Mutation((133,), _HEAVE, "math.exp(math.pi * math.tan(phi))", "math.exp(math.tan(phi))"),
    Mutation((133,), _STEPS, "field(work, SETS, j) + over", "over"),
    Mutation((148,), _HEAVE, "max(1.0 - math.tan(slope), 0.0) ** 2", "max(1.0 - math.tan(slope), 0.0)"),
    Mutation((148,), _HEAVE, "(low - top) - WATER * max(", "(low - top) + WATER * max("),
    Mutation((149,), _HEAVE, "reach * (RISE * f.L / d + half)", "0.0"),
    Mutation((149,), _HEAVE, "reach * (FALL * f.L / d + half)", "0.0"),
    Mutation((150,), _HEAVE, "middle - 0.5 * (near + near_to)", "middle - near"),
    Mutation((150,), _HEAVE, "(far_to - far) * inverse", "max(far_to - far, 0.0) * inverse"),
    Mutation((150,), _HEAVE, "min(near - near_to, 0.0) * inverse", "0.0"),
    Mutation((150,), _HEAVE, "u - times(a.far_slope, far_rise)", "u"),
    Mutation((150,), _HEAVE, "near.lift - times(f.heave * a.near_slope, F_near)", "near.lift"),
    Mutation((150,), _HEAVE, "if rubs else 0.0", "if not rubs else 0.0"),
    Mutation((150,), _HEAVE, "tilt * (middle - 0.5)", "0.0"),
    Mutation((149,), _HEAVE, "start if P_0 < 0.0 else end", "end"),
    Mutation((133,), _STEPS, "and at_end < 0.0 and reach > capacity", "and at_end > 0.0 and reach > capacity"),
    Mutation((134,), _HEAVE, "return v / math.sqrt(v * v + f.v_s * f.v_s)", "return v / (abs(v) + f.v_s)"),
    Mutation((134,), _HEAVE, "along - omega_b * at.far", "along + omega_b * at.far"),
    Mutation((134,), _HEAVE, "max(e.far, 0.0) + max(e.near, 0.0)", "max(e.far + e.near, 0.0)"),
    Mutation((134,), _HEAVE, "rub = -f.friction * push * slip", "rub = f.friction * push * slip"),
    Mutation((134,), _HEAVE, "-held * foot_slip * inverse", "-held * side_slip * inverse"),
    Mutation((134,), _HEAVE, "friction * (1.0 - math.sin(design.phi)) * density", "friction * density"),
    Mutation((134,), _HEAVE, "math.tan(2.0 / 3.0 * phi) if form", "math.tan(phi) if form"),
    Mutation((135,), _HEAVE, "a = f.a_b + 0.5 * f.foot * on_end", "a = f.a_b - 0.5 * f.foot * on_end"),
    Mutation((135,), _HEAVE, "return 6.0 * f.s_0 / f.foot", "return 2.0 * f.s_0 / f.foot"),
    Mutation(
        (136,), _OPINION, "elastic * (depth - elastic * (0.5 / f.k_foot))", "elastic * (depth - elastic / f.k_foot)"
    ),
    Mutation(
        (136,),
        _OPINION,
        "weight * (y_b - f.a_b * sin - f.b_b * versin)",
        "weight * (y_b - f.a_b * sin + f.b_b * versin)",
    ),
    Mutation((136,), _OPINION, "- (f.b_b + f.c.c_y) * versin)", "- f.b_b * versin)"),
    Mutation((137,), _OPINION, "least -= CAUTION * abs(least)", "least += 2.0 * abs(least)"),
    Mutation((137,), _OPINION, "min(bottom, depth - most)", "max(-0.5 * f.c.d, depth - most)"),
    Mutation(
        (137,),
        _OPINION,
        "control.stop and field(work, START, 7) <= 0.0",
        "control.stop and field(work, START, 7) <= 9.0",
    ),
    Mutation((137,), _OPINION, "f) + (crush_energy(u, c) if touching else 0.0)", "f)"),
    Mutation((141,), _DESIGN, "m_b = design.rho_b * volume", "m_b = 1.01 * design.rho_b * volume"),
    Mutation((141,), _DESIGN, "area = slice_ * (near + far)", "area = slice_ * 2.0 * near"),
    Mutation((142,), _DESIGN, "0.5 * (far * far - near * near)", "0.5 * (far * far + near * near)"),
    Mutation((142,), _DESIGN, "z_c += area * z\n", "z_c += slice_ * z\n"),
    Mutation((143,), _DESIGN, "- m_b * (x * x + z_c * z_c)", "- m_b * z_c * z_c"),
    Mutation(
        (143,), _DESIGN, "(far * far * far + near * near * near) / 3.0", "(far * far * far - near * near * near) / 3.0"
    ),
    Mutation((144,), _DYNAMICS, "+ c.lean * c.d * sin", "- c.lean * c.d * sin"),
    Mutation((144,), _DYNAMICS, "c.C_cos - abs(c.lean) * c.d", "c.C_cos"),
    Mutation((144,), _DYNAMICS, "reaction.M - times(lean, k.lever_d)", "reaction.M + times(lean, k.lever_d)"),
    Mutation(
        (145,), _PIECES, "-slope_of(outline, i, WIDTH) * d / design.W", "slope_of(outline, i, WIDTH) * d / design.W"
    ),
    Mutation((145,), _PIECES, "share = (given.w_0 + given.w_1 * ratio) * h_e", "share = given.w_0 * h_e"),
    Mutation((146,), _PIECES, "squared = half * half + KS * p", "squared = half * half - KS * p"),
    Mutation((147,), _PIECES, "n * r.four - KS * r.five", "n * r.four - KS * r.four"),
    Mutation((147,), _PIECES, "times((1.0 / 3.0) * R_1, turn_3)", "times(0.5 * R_1, turn_3)"),
    Mutation((147,), _PIECES, "piece.w_0 * zeroth + times(piece.w_1, first)", "piece.w_0 * zeroth"),
    Mutation((147,), _PIECES, "piece.w_0 * first + times(piece.w_1, under.second - over.second)", "piece.w_0 * first"),
)
