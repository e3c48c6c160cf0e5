"""From a surface to a solid: what is wrong with it is repaired, and what was done is said.

A surface encloses a volume if its oriented edges cancel, each run through as often in one direction as in the other.
Holes are closed by fans from the middle of their rims, which always reaches that. The fan of a plane rim is a flat lid:
so a stone is closed exactly that was scanned where it lies, without the side on the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boulder_sweep.errors import ScanError
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.stones.reading import ScannedSurface

MOST_CLOSED = 0.25
"""Largest part of the surface that may be added to close holes without a plane rim."""
MOST_ADDED = 0.45
"""Largest part of the surface that may be added, the base included; the base of a slab is a third of it and more."""
PLANE_WITHIN = 0.02
"""Distance of the rim from a plane up to which it counts as plane, as a share of its largest side."""
LEAST_BASE = 0.02
"""Part of the surface from which a plane hole is a base: one missing triangle is plane too."""
MOST_CRUMBS = 0.02
"""Largest part of its volume that bodies beside the stone may have, to be left out."""
LEAST_VOLUME = 1e-3
"""Least volume, as a share of a cube on the largest side."""
MOST_PATCHES = 1000
"""Patches that hang together by points only, of which the faces are turned to the same side, the largest first."""
SAME_POINT = 1e-7
"""Distance within which points are one, as a share of the largest side."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed stone, homogeneous."""

    vertices: np.ndarray
    """Points in the axes of the scan [m], shape (n, 3)."""
    faces: np.ndarray
    """Triangles with their outer side where their points run anticlockwise, int64, shape (m, 3)."""
    volume: float
    """Volume within the surface [m^3]."""
    centre: np.ndarray
    """Centre of mass [m], shape (3,)."""
    inertia: np.ndarray
    """Moments of inertia about the centre for a density of 1 kg/m^3 [m^5], shape (3, 3)."""
    repairs: tuple[str, ...] = ()
    """What was done to the surface, in words; nothing where it was closed."""
    closed: float = 0.0
    """Part of the surface that was added to close holes, without the base."""
    base: float = 0.0
    """Part of the surface that is a flat lid on a plane rim, the base on which the stone lay; 0 where it has none."""
    over: float = 0.0
    """Part of the volume between all that was added and the centre of mass."""

    def moment(self, axis: np.ndarray) -> float:
        """Return the moment of inertia about an axis (unit vector) through the centre, for 1 kg/m^3 [m^5]."""
        return float(axis @ self.inertia @ axis)


def solid_of(scan: ScannedSurface) -> Solid:
    """Return the stone that a scan is the surface of.

    Raise `ScanError` where it is flat, holds several bodies, or is too open to be closed.
    """
    repairs: list[str] = []
    vertices, faces = _merge_points(scan.vertices, scan.faces)
    if len(faces) < 4:
        raise ScanError(f"{scan.file}: has {counted(len(faces), 'face')} with an area; a boulder has at least 4")
    faces, crumbs = _largest_body(vertices, faces, scan.file)
    if crumbs:
        repairs.append(f"{_bodies(crumbs)} beside the boulder left out")
    faces, turned = _orient_faces(faces)
    if turned:
        repairs.append(f"{counted(turned, 'face')} turned to the side of the others")
    vertices, lids, hole = _lids(vertices, faces)
    added = _areas(vertices, lids)
    areas = np.bincount(hole, added) / (added.sum() + _areas(vertices, faces).sum())
    is_base = _is_base(vertices, faces, lids, hole, areas)
    closed, base = float(areas[~is_base].sum()), float(areas[is_base].sum())
    if closed > MOST_CLOSED or closed + base > MOST_ADDED:
        raise ScanError(
            f"{scan.file}: is open: {closed + base:.0%} of its surface would be added to close it; at most "
            f"{MOST_CLOSED:.0%} is, or {MOST_ADDED:.0%} with an underside inside a plane rim; scan the boulder from "
            "all sides, or trim the scan to a plane just above the ground"
        )
    faces = np.concatenate([faces, lids])
    volume = float(_cones(vertices, faces, vertices[np.unique(faces)].mean(axis=0)).sum())
    if volume < 0.0:
        faces, volume = faces[:, ::-1], -volume
        repairs.append("its inside was outside; turned")
    largest = float(np.ptp(vertices[faces].reshape(-1, 3), axis=0).max())
    if volume > np.prod(np.ptp(vertices[np.unique(faces)], axis=0)) * (1.0 + 1e-6):
        raise ScanError(f"{scan.file}: encloses more than the box around it: its surface crosses itself; repair it")
    if not volume > LEAST_VOLUME * largest**3:
        raise ScanError(
            f"{scan.file}: encloses no volume to speak of ({volume:.2g} m³); it is flat, or no closed surface"
        )
    moments = _moments(vertices, faces)
    cones = np.abs(np.bincount(hole, _cones(vertices, lids, moments[1]))) / volume
    for which, words in (
        (is_base, "underside closed by a flat lid"),
        (~is_base, f"{counted(int((~is_base).sum()), 'hole')} closed"),
    ):
        if which.any():
            surface, inside = 100 * areas[which].sum(), 100 * cones[which].sum()
            repairs.append(f"{words}, {surface:.2g} % of the surface, over {inside:.2g} % of the volume")
    used, inverse = np.unique(faces, return_inverse=True)
    vertices, faces = np.ascontiguousarray(vertices[used]), np.ascontiguousarray(inverse.reshape(-1, 3))
    return Solid(vertices, faces, *moments, tuple(repairs), closed, base, float(cones.sum()))


def _merge_points(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a surface whose points are single and whose faces have an area, each once.

    Both are sorted, so that no sum depends on the order in which a file holds them.
    """
    import trimesh

    low = vertices[faces].reshape(-1, 3).min(axis=0)
    size = float(np.ptp(vertices[faces].reshape(-1, 3), axis=0).max())
    mesh = trimesh.Trimesh((vertices - low) / size, faces, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=round(-np.log10(SAME_POINT)))
    mesh.update_faces(mesh.unique_faces())
    corners = mesh.faces
    mesh.update_faces((corners != corners[:, [1, 2, 0]]).all(axis=1))
    points, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    order = np.lexsort(points.T)
    faces = np.argsort(order)[faces]
    first = faces.argmin(axis=1)[:, None]
    faces = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1)
    return points[order] * size + low, faces[np.lexsort(faces.T)]


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the three oriented edges of every face: both points, lower number first, and whether these run upwards."""
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    up = ends[:, 0] < ends[:, 1]
    return np.where(up, ends[:, 0], ends[:, 1]), np.where(up, ends[:, 1], ends[:, 0]), up


def _neighbours(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs of faces that share an edge with each other only, and whether they run through it the same way."""
    low, high, up = _edges(faces)
    key = low * (faces.max() + 1) + high
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
    twice = starts[np.diff(np.r_[starts, len(ordered)]) == 2]
    first, second = order[twice], order[twice + 1]
    return first // 3, second // 3, up[first] == up[second]


def _orient_faces(faces: np.ndarray) -> tuple[np.ndarray, int]:
    """Return faces that all have their outer side on the same side, and how many were turned for it."""
    first, second, same = _neighbours(faces)
    if not same.any():
        return faces, 0
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    count = len(faces)
    # An entry of 1 where the neighbours agree, 2 where one must be turned.
    graph = coo_array((np.where(same, 2, 1), (first, second)), shape=(count, count)).tocsr()
    graph = graph + graph.T
    body = connected_components(graph, directed=False)[1]
    starts, sizes = np.unique(body, return_index=True, return_counts=True)[1:]
    turn = np.zeros(count, dtype=bool)
    for start in starts[np.argsort(-sizes, kind="stable")][:MOST_PATCHES]:
        order, before = breadth_first_order(graph, start, directed=False)
        weights = np.asarray(graph[order[1:], before[order[1:]]]).reshape(-1) if len(order) > 1 else np.empty(0)
        for face, parent, weight in zip(order[1:], before[order[1:]], weights, strict=True):
            turn[face] = turn[parent] ^ (weight == 2)
        patch = body == body[start]
        if 2 * turn[patch].sum() > patch.sum():
            turn[patch] = ~turn[patch]
    faces = faces.copy()
    faces[turn] = faces[turn][:, ::-1]
    return faces, int(turn.sum())


def _largest_body(vertices: np.ndarray, faces: np.ndarray, file: str) -> tuple[np.ndarray, int]:
    """Return the faces of the largest body, and how many small ones are left out."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    shape = len(vertices), len(vertices)
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=shape)
    body = connected_components(graph, directed=False)[1][faces[:, 0]]
    names, counts = np.unique(body, return_counts=True)
    if len(names) == 1:
        return faces, 0
    # By the volume of the box around each: a body may be open, and its own volume then says nothing.
    starts, corners = np.cumsum(counts) - counts, vertices[faces[np.argsort(body, kind="stable")]]
    size = np.maximum.reduceat(corners.max(axis=1), starts) - np.minimum.reduceat(corners.min(axis=1), starts)
    bulk = size.prod(axis=1)
    largest = int(bulk.argmax())
    others = float(np.delete(bulk, largest).sum() / max(bulk[largest], 1e-300))
    if others > MOST_CRUMBS:
        raise ScanError(
            f"{file}: holds {_bodies(len(names))}, and the others are {others:.0%} as large as the largest; leave only "
            "the boulder in the scan, as one surface"
        )
    return faces[body == names[largest]], len(names) - 1


def _lids(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points with the middles of all holes, faces that close these, and which hole each closes."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    low, high, up = _edges(faces)
    key = low * len(vertices) + high
    edges, inverse = np.unique(key, return_inverse=True)
    balance = np.bincount(inverse, np.where(up, 1, -1)).astype(np.int64)
    rims = np.flatnonzero(balance)
    if not len(rims):
        return vertices, np.empty((0, 3), dtype=np.int64), np.empty(0, dtype=np.int64)
    # A face added along a rim runs through it the other way, as often as the edge lacks it.
    lacking = np.repeat(rims, np.abs(balance[rims]))
    start, end = edges[lacking] // len(vertices), edges[lacking] % len(vertices)
    start, end = np.where(balance[lacking] > 0, (end, start), (start, end))
    size = len(vertices)
    graph = coo_array((np.ones(len(start), dtype=np.int8), (start, end)), shape=(size, size))
    hole = np.unique(connected_components(graph, directed=False)[1][start], return_inverse=True)[1]
    length = np.linalg.norm(vertices[end] - vertices[start], axis=1)
    middles = np.stack(
        [
            np.bincount(hole, length * 0.5 * (vertices[start, k] + vertices[end, k])) / np.bincount(hole, length)
            for k in range(3)
        ],
        axis=1,
    )
    return np.concatenate([vertices, middles]), np.stack([start, end, size + hole], axis=1), hole


def _is_base(
    vertices: np.ndarray, faces: np.ndarray, lids: np.ndarray, hole: np.ndarray, areas: np.ndarray
) -> np.ndarray:
    """Return which hole is the base of the stone, bool, for each hole.

    It is the largest, if its rim is plane and all of the stone lies on one side.
    """
    is_base = np.zeros(len(areas), dtype=bool)
    if not len(areas) or areas.max() < LEAST_BASE:
        return is_base
    largest = areas.argmax()
    rim = vertices[lids[hole == largest, 0]]
    along = np.linalg.svd(rim - rim.mean(axis=0), full_matrices=False)[2]
    within = PLANE_WITHIN * np.ptp(rim @ along[0])
    height, above = ((points - rim.mean(axis=0)) @ along[2] for points in (rim, vertices[np.unique(faces)]))
    is_base[largest] = np.abs(height).max() <= within and (above.min() >= -within or above.max() <= within)
    return is_base


def _bodies(count: int) -> str:
    return "1 body" if count == 1 else f"{count:,} bodies"


def _areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the areas of faces."""
    corner = vertices[faces]
    return 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)


def _cones(vertices: np.ndarray, faces: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return the volumes between faces and a point, negative where it is before their outer side."""
    corner = vertices[faces] - middle
    return np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6.0


def _moments(vertices: np.ndarray, faces: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return volume, centre of mass, and moments of inertia about it for a density of 1 kg/m^3."""
    from trimesh.triangles import mass_properties

    # About a point of the stone: in map coordinates, third powers of the distance from the origin keep no digit.
    near = vertices[faces[0, 0]]
    properties = mass_properties((vertices - near)[faces], density=1.0)
    return float(properties.volume), near + np.asarray(properties.center_mass), np.asarray(properties.inertia)
