"""A rock as a scan shows it, in place of a real one: noise on a superellipsoid, lying askew.

The surface is |x/p|^n + |y/q|^n + |z/r|^n = 1 with n = 5, each point moved along its ray by the sum of waves in random
directions, all from one seed.
"""

from __future__ import annotations

import numpy as np

SIDES_M = (3.4, 1.8, 1.7)
EXPONENT = 5.0
WAVES, ROUGHNESS = 40, 0.012
"""Number of waves, and the size of each as a share of the radius."""


def rock_surface(
    seed: int, sides_m: tuple[float, float, float] = SIDES_M, exponent: float = EXPONENT, finer: int = 4
) -> tuple[np.ndarray, np.ndarray]:
    """Return points [m], shape (n, 3), and faces, shape (m, 3), of a rock of 20 * 4^finer faces at the origin."""
    from trimesh.creation import icosphere

    sphere = icosphere(subdivisions=finer)
    rays = np.asarray(sphere.vertices)
    radius = (np.abs(rays) ** exponent).sum(axis=1) ** (-1.0 / exponent)
    random = np.random.default_rng(seed)
    for _ in range(WAVES):
        radius *= 1.0 + ROUGHNESS * np.sin(rays @ (4.0 * random.standard_normal(3)) + 2.0 * np.pi * random.random())
    return rays * radius[:, None] * (0.5 * np.array(sides_m)), np.asarray(sphere.faces)


def askew(points: np.ndarray, seed: int) -> np.ndarray:
    """Return points turned at random and moved away from the origin, as a scanner leaves them."""
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.standard_normal((3, 3)))
    return points @ (turn * np.sign(np.linalg.det(turn))).T + random.uniform(-5.0, 5.0, 3)


def example_rock() -> str:
    """Return the example scan as a PLY file, its points in whole millimetres."""
    points, faces = rock_surface(seed=2)
    points = askew(points, seed=2)
    header = [
        "ply",
        "format ascii 1.0",
        "comment no real stone: written by python -m docs.studies",
        f"element vertex {len(points)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    corners = (" ".join(f"{value:.3f}" for value in point) for point in points)
    return "\n".join([*header, *corners, *(f"3 {a} {b} {c}" for a, b, c in faces)]) + "\n"
