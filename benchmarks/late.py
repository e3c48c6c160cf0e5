"""Shallow boulders, which rock for seconds, against an independent integration: ``python -m benchmarks.late``.

Random designs with d/H from 0.02 to 0.35 are run as a user would run them, and integrated for 30 s by the classical
Runge-Kutta method with a fixed step of 0.2 ms and of 0.1 ms. These equations are those of the tests' oracle, compiled:
they share no code with the kernels, estimate no error and end on no proof. Where the two steps do not agree on the
verdict the truth is not known, and the design is set aside. Exit code 1 if a pass overturns or a fail stands.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections import namedtuple
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
import pandas as pd

import boulder_sweep

from .report import Table, write_between_markers

DESIGNS = 30_000
SEED = 22
STEPS_S = (2e-4, 1e-4)
UNTIL_S = 30.0
LIMIT_DEG = 20.0
PIECE = 250
"""Designs integrated at a time, between two looks at the progress."""
GRAVITY = 9.80665
NODES = (-math.sqrt(0.6), 0.0, math.sqrt(0.6))
WEIGHTS = (5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0)
"""Gauss's rule on (-1, 1): exact for spring, drag and their moments between two kinks."""
HELD, CLOCKWISE, ANTICLOCKWISE = 0, 1, -1
_compiled = numba.njit(nogil=True, error_model="numpy", cache=True)


Inputs = namedtuple("Inputs", "L W H rho_b d e rho_s phi beta K_epsilon m_v v_0 k_v c_v")
"""One impact: symbols of the paper, SI, beta in N/m^3."""


class Body(NamedTuple):
    """What follows from the inputs: Eqs 1 to 16 with the corrected readings, and the soil per depth."""

    m_b: float
    m_eff: float
    J_eff: float
    l_n: float
    """Distance from the centre of mass to the right face [m]."""
    below: float
    """Depth of the centre of mass below the soil line [m]; negative above it."""
    R_v: float
    gamma_v: float
    stiffness: float
    """Spring per depth and depth: k_n over height and alpha [N/m^3]."""
    strength: float
    """Ultimate force per depth and depth [N/m^2]."""
    drag: float
    """Drag per depth and velocity squared [kg/m^2]."""


class State(NamedTuple):
    """The seven states of Eq 52."""

    x_b: float
    v_b: float
    theta: float
    omega: float
    x_v: float
    v_v: float
    a_v: float


@_compiled
def body_of(i: Inputs) -> Body:
    """Masses, centre and inertia of boulder and soil wedge, N -> infinity."""
    wedge = i.rho_s * i.W * math.tan(math.pi / 4 + i.phi / 2)
    m_b = i.rho_b * i.L * i.W * i.H
    M_soil = wedge * i.d**2 / 2
    m_eff = m_b + M_soil
    c_x = (M_soil * i.L + m_b * i.L / 2) / m_eff
    c_y = (wedge * i.d**3 / 3 + m_b * i.H / 2) / m_eff
    l_n = i.L - c_x
    J_b = m_b / 12 * (i.H**2 + i.L**2) + m_b * ((c_y - i.H / 2) ** 2 + (c_x - i.L / 2) ** 2)
    a = c_y / i.d
    J_soil = wedge * i.d**4 * (1 / 4 - 2 * a / 3 + a * a / 2) + M_soil * l_n**2
    h = i.e + i.d - c_y
    K_p = (1 + math.sin(i.phi)) / (1 - math.sin(i.phi))
    return Body(
        m_b,
        m_eff,
        J_b + J_soil,
        l_n,
        i.d - c_y,
        math.hypot(h, c_x),
        -math.atan2(c_x, h),
        i.beta * i.W * math.tan(i.phi) / i.d,
        K_p * K_p * i.rho_s * GRAVITY * i.K_epsilon * i.W,
        i.rho_s * i.W,
    )


@_compiled
def crossing(top: float, bottom: float) -> float:
    """Where a line from `top` to `bottom` crosses zero, as a fraction of the depth limited to 0 ... 1."""
    slope = bottom - top
    return min(max(-top / slope, 0.0), 1.0) if slope != 0.0 else 1.0


@_compiled
def soil_loads(y: State, i: Inputs, b: Body) -> tuple[float, float]:
    """Force [N] and moment [N m] of the soil, Eqs 19 to 36, panel by panel between the kinks."""
    sin, cos = math.sin(y.theta), math.cos(y.theta)
    at_top, slope = y.x_b + b.l_n * (cos - 1.0) + b.below * sin, -sin
    v_top, v_slope = y.v_b + y.omega * (b.below * cos - b.l_n * sin), -y.omega * cos
    reach = b.strength / b.stiffness
    p = crossing(at_top - reach, at_top + slope * i.d - reach)
    q = crossing(at_top + reach, at_top + slope * i.d + reach)
    r = crossing(v_top, v_top + v_slope * i.d)
    low, high = min(p, q, r), max(p, q, r)
    middle = p + q + r - low - high
    edges = (0.0, low * i.d, middle * i.d, high * i.d, i.d)
    F = M = 0.0
    for panel in range(4):
        half = 0.5 * (edges[panel + 1] - edges[panel])
        if half <= 0.0:
            continue
        for node in range(3):
            alpha = edges[panel] + half * (1.0 + NODES[node])
            spring = b.stiffness * alpha * (at_top + slope * alpha)
            most = b.strength * alpha
            v = v_top + v_slope * alpha
            f = -WEIGHTS[node] * half * (min(max(spring, -most), most) + b.drag * v * abs(v))
            F += f
            M += f * (-(alpha - b.below) * cos - b.l_n * sin)
    return F, M


@_compiled
def rate(y: State, turning: int, touching: bool, i: Inputs, b: Body) -> tuple[State, float]:
    """Rates of the states, Eq 52, and the moment of soil and vehicle [N m]."""
    F, M = soil_loads(y, i, b)
    lever = b.R_v * math.cos(b.gamma_v + y.theta)
    a_v = jerk = 0.0
    if touching:
        a_v = y.a_v
        F_v = -i.m_v * a_v
        F += F_v
        M += F_v * lever
        jerk = -i.k_v / i.c_v * a_v + i.k_v / i.m_v * (y.v_b + y.omega * lever - y.v_v)
    turn = 0.0
    if turning != HELD:
        tilt = turning * y.theta
        couple = -turning * b.m_b * GRAVITY * (i.L / 2 * math.cos(tilt) - i.H / 2 * math.sin(tilt))
        turn = (M + couple) / b.J_eff
    return State(y.v_b, F / b.m_eff, y.omega, turn, y.v_v, a_v, jerk), M


@_compiled
def moved(y: State, k: State, h: float) -> State:
    """State a time h further on with constant rates."""
    return State(
        y.x_b + h * k.x_b,
        y.v_b + h * k.v_b,
        y.theta + h * k.theta,
        y.omega + h * k.omega,
        y.x_v + h * k.x_v,
        y.v_v + h * k.v_v,
        y.a_v + h * k.a_v,
    )


@_compiled
def step(y: State, h: float, turning: int, touching: bool, i: Inputs, b: Body) -> State:
    """Return the state one step of the classical Runge-Kutta method later, in fixed modes."""
    k1, _ = rate(y, turning, touching, i, b)
    k2, _ = rate(moved(y, k1, 0.5 * h), turning, touching, i, b)
    k3, _ = rate(moved(y, k2, 0.5 * h), turning, touching, i, b)
    k4, _ = rate(moved(y, k3, h), turning, touching, i, b)
    y = moved(moved(y, k1, h / 6.0), k2, h / 3.0)
    return moved(moved(y, k3, h / 3.0), k4, h / 6.0)


@_compiled
def left(y: State, turning: int, touching: bool, at_release: float, i: Inputs, b: Body) -> float:
    """Least of the quantities that stay positive while the modes last, each scaled to about one."""
    if touching:
        room = -y.a_v
    else:
        room = at_release - (y.x_v - y.x_b - b.R_v * (math.sin(b.gamma_v + y.theta) - math.sin(b.gamma_v)))
    if turning == HELD:
        _, M = rate(y, turning, touching, i, b)
        return min(room, b.m_b * GRAVITY * i.L / 2 - abs(M))
    return min(room, turning * y.theta)


@_compiled
def integrated(i: Inputs, h_full: float, until: float, limit: float) -> tuple[float, float]:
    """Integrate an impact up to a time [s] or to the limit of rotation [rad], whichever comes first.

    Returns
    -------
    theta, t
        Largest rotation [rad], and the time at the end [s].
    """
    b = body_of(i)
    y = State(0.0, 0.0, 0.0, 0.0, 0.0, i.v_0, 0.0)
    turning, touching, at_release = HELD, True, 0.0
    t = largest = 0.0
    while t < until and largest < limit:
        h = h_full
        after = step(y, h, turning, touching, i, b)
        if left(after, turning, touching, at_release, i, b) < 0.0:
            # Something changes within the step: the last moment before it, to the last bit, by bisection.
            low, high = 0.0, h
            for _ in range(60):
                middle = 0.5 * (low + high)
                inside = left(step(y, middle, turning, touching, i, b), turning, touching, at_release, i, b) >= 0.0
                low, high = (middle, high) if inside else (low, middle)
            h = high
            after = step(y, h, turning, touching, i, b)
            contact = after.x_v - after.x_b - b.R_v * (math.sin(b.gamma_v + after.theta) - math.sin(b.gamma_v))
            if touching and after.a_v > 0.0:
                touching, at_release = False, contact
                after = State(*after[:6], 0.0)
            elif not touching and contact > at_release:
                touching = True
                after = State(*after[:6], 0.0)
            if turning == HELD:
                _, M = rate(after, turning, touching, i, b)
                if abs(M) > b.m_b * GRAVITY * i.L / 2:
                    turning = CLOCKWISE if M > 0.0 else ANTICLOCKWISE
            elif turning * after.theta < 0.0:
                turning = -turning
        y = after
        t += h
        largest = max(largest, abs(y.theta))
    return largest, t


@_compiled
def integrate_rows(rows: np.ndarray, h: float, until: float, limit: float) -> np.ndarray:
    """Integrate designs one by one: inputs of shape (n, 14); largest rotation [rad] and end [s], shape (n, 2)."""
    found = np.empty((len(rows), 2))
    for n in range(len(rows)):
        r = rows[n]
        i = Inputs(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9], r[10], r[11], r[12], r[13])
        found[n] = integrated(i, h, until, limit)
    return found


def shallow(count: int, seed: int) -> pd.DataFrame:
    """Draw shallow designs that the truck hits, with the columns of a table of designs."""
    rng = np.random.default_rng(seed)
    n = 4 * count
    H = rng.uniform(1.2, 4.0, n)
    drawn = pd.DataFrame(
        {
            "boulder_length_m": rng.uniform(1.0, 3.0, n),
            "boulder_width_m": rng.uniform(0.8, 2.5, n),
            "boulder_height_m": H,
            "boulder_density_kg_m3": rng.uniform(2400.0, 3074.0, n),
            "embedment_depth_m": rng.uniform(0.02, 0.35, n) * H,
            "soil_density_kg_m3": rng.uniform(1520.0, 2240.0, n),
            "friction_angle_deg": rng.uniform(27.0, 49.0, n),
            "subgrade_reaction_MN_m3": rng.uniform(10.0, 110.0, n),
            "strain_rate_factor": rng.uniform(1.0, 1.2, n),
            "vehicle_mass_kg": rng.uniform(1500.0, 7500.0, n),
            "impact_speed_m_s": rng.uniform(4.0, 14.0, n),
            "vehicle_spring_N_m": rng.uniform(1.5e6, 4.0e6, n),
            "vehicle_damper_N_s_m": rng.uniform(0.9e5, 2.4e5, n),
            "bumper_height_m": rng.uniform(0.3, 0.55, n),
            "hood_height_m": rng.uniform(0.8, 1.6, n),
        }
    )
    reached = drawn.boulder_height_m - drawn.embedment_depth_m > drawn.bumper_height_m + 0.3
    return drawn[reached].head(count).reset_index(drop=True)


def judged(designs: pd.DataFrame, accuracy: str) -> pd.DataFrame:
    """Run designs as a user would, and return the table."""
    with tempfile.TemporaryDirectory() as folder:
        designs.to_csv(Path(folder) / "designs.csv", index=False)
        grid = Path(folder) / "grid.yaml"
        grid.write_text(f"name: shallow\ntable: designs.csv\nsolver: {{accuracy: {accuracy}}}\n")
        boulder_sweep.run(boulder_sweep.load(grid), Path(folder) / "shallow.sweep")
        return boulder_sweep.read(Path(folder) / "shallow.sweep")


def inputs_of(table: pd.DataFrame) -> np.ndarray:
    """Inputs of a table as of `integrate_rows`, shape (n, 14)."""
    columns: list[Any] = [
        *(table[f"boulder_{name}"] for name in ("length_m", "width_m", "height_m", "density_kg_m3")),
        *(table["embedment_depth_m"], table["impact_height_m"], table["soil_density_kg_m3"]),
        *(np.radians(table["friction_angle_deg"]), 1e6 * table["subgrade_reaction_MN_m3"]),
        *(table["strain_rate_factor"], table["vehicle_mass_kg"], table["impact_speed_m_s"]),
        *(table["vehicle_spring_N_m"], table["vehicle_damper_N_s_m"]),
    ]
    return np.ascontiguousarray(np.column_stack(columns).astype(float))


def truth(rows: np.ndarray, jobs: int) -> np.ndarray:
    """Largest rotations [rad] by each of `STEPS_S`, shape (n, 2)."""
    pieces = [rows[at : at + PIECE] for at in range(0, len(rows), PIECE)]
    found = []

    def by_both(piece: np.ndarray) -> np.ndarray:
        return np.column_stack([integrate_rows(piece, h, UNTIL_S, math.radians(LIMIT_DEG))[:, 0] for h in STEPS_S])

    with ThreadPoolExecutor(jobs) as pool:
        for done, piece in enumerate(pool.map(by_both, pieces), start=1):
            found.append(piece)
            print(f"\r{done} of {len(pieces)} pieces integrated", end="", file=sys.stderr)
    print(file=sys.stderr)
    return np.concatenate(found)


def compared(table: pd.DataFrame, rotations: np.ndarray) -> dict[str, int]:
    """Count what a table says against what is true.

    Parameters
    ----------
    table
        Result of a run.
    rotations
        As of `truth`.
    """
    overturns = rotations >= math.radians(LIMIT_DEG)
    known = overturns[:, 0] == overturns[:, 1]
    falls, stands = known & overturns[:, 1], known & ~overturns[:, 1]
    verdict, reason = table["verdict"].astype(str).to_numpy(), table["reason"].astype(str).to_numpy()
    return {
        "designs": len(table),
        "late": int((table["end_time_s"] > 1.0).sum()),
        "set aside": int((~known).sum()),
        "passes": int((verdict == "pass").sum()),
        "passes that overturn": int(((verdict == "pass") & falls).sum()),
        "fails": int((reason == "overturns").sum()),
        "fails that stand": int(((reason == "overturns") & stands).sum()),
        "undecided": int((verdict == "undecided").sum()),
        "undecided for their error": int(((verdict == "undecided") & (reason == "error")).sum()),
    }


def measure(count: int, seed: int, jobs: int, accuracies: list[str]) -> tuple[Table, bool]:
    """Measure; also return whether no verdict is wrong."""
    designs = shallow(count, seed)
    tables = {accuracy: judged(designs, accuracy) for accuracy in accuracies}
    rotations = truth(inputs_of(next(iter(tables.values()))), jobs)
    results = {accuracy: compared(table, rotations) for accuracy, table in tables.items()}
    names = list(next(iter(results.values())))
    found = Table(
        "late",
        "Shallow boulders against an independent integration",
        f"{count:,} random designs, d/H 0.02 to 0.35, seed {seed}; truth to {UNTIL_S:g} s by steps of 0.2 and 0.1 ms",
        ["accuracy", *names],
    )
    for accuracy, counts in results.items():
        found.rows.append([f"`{accuracy}`", *(f"{counts[name]:,}" for name in names)])
    wrong = sum(counts["passes that overturn"] + counts["fails that stand"] for counts in results.values())
    return found, wrong == 0


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.late", description=__doc__)
    parser.add_argument("--designs", type=int, default=DESIGNS)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--accuracy", nargs="+", default=["balanced", "fine"])
    parser.add_argument("--write", action="store_true", help="write the table into benchmarks/README.md")
    arguments = parser.parse_args()
    table, right = measure(arguments.designs, arguments.seed, arguments.jobs, arguments.accuracy)
    print(table.markdown())
    if arguments.write:
        write_between_markers([table])
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
