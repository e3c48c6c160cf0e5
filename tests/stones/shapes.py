"""Surfaces of exact solids as scans hold them: points and triangles, and how to write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from boulder_sweep.stones.reading import ScannedSurface
from boulder_sweep.stones.solid import Solid, solid_of
from boulder_sweep.stones.standing import Stone
from docs.studies.example_rock import askew, rock_surface

Surface = tuple[np.ndarray, np.ndarray]


def box(length: float, width: float, height: float) -> Surface:
    return _of(trimesh.creation.box((length, width, height)))


def cylinder(radius: float, height: float, sides: int = 96) -> Surface:
    return frustum(radius, radius, height, sides)


def frustum(foot: float, top: float, height: float, sides: int = 96) -> Surface:
    """A pyramid's frustum over a regular polygon, which a cone's is in the limit."""
    turn = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    low = np.column_stack([foot * ring, np.zeros(sides)])
    high = np.column_stack([top * ring, np.full(sides, height)])
    points = np.concatenate([low, high, [[0.0, 0.0, 0.0], [0.0, 0.0, height]]])
    k, next_ = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = [
        np.stack([k, next_, sides + next_], axis=1),
        np.stack([k, sides + next_, sides + k], axis=1),
        np.stack([next_, k, np.full(sides, 2 * sides)], axis=1),
        np.stack([sides + k, sides + next_, np.full(sides, 2 * sides + 1)], axis=1),
    ]
    return points, np.concatenate(faces)


def sphere(radius: float, finer: int = 4) -> Surface:
    return _of(trimesh.creation.icosphere(finer, radius))


def rock(seed: int, finer: int = 3) -> Surface:
    points, faces = rock_surface(seed, finer=finer)
    return askew(points, seed), faces


def _of(mesh: trimesh.Trimesh) -> Surface:
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def scan(surface: Surface) -> ScannedSurface:
    return ScannedSurface("rock.ply", "", *surface)


def solid(surface: Surface) -> Solid:
    return solid_of(scan(surface))


def stone(surface: Surface) -> Stone:
    return Stone(solid(surface), "rock.ply")


def written(surface: Surface, path: Path) -> Path:
    trimesh.Trimesh(*surface, process=False).export(path)
    return path
