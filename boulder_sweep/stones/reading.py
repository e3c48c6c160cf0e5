"""Read a scan, an untrusted file: its bytes, its surface, and whether a stone has its size.

Nothing but the file itself is opened, whatever materials or pictures it names.
"""

from __future__ import annotations

import hashlib
import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boulder_sweep.errors import ScanError
from boulder_sweep.stones.formats import DECIMATE, READERS, Part, check_count, parts_of
from boulder_sweep.text import install, why

MAX_BYTES = 400_000_000
"""Largest file that is read."""
LEAST_SIZE_M, LARGEST_SIZE_M = 0.1, 20.0
"""Largest side of a stone that is taken for one [m]."""
OTHER_UNITS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048}
"""Units in which scans are often written, in metres."""


@dataclass(frozen=True, eq=False)
class ScannedSurface:
    """The surface in a file, as it is.

    Attributes
    ----------
    file : str
        The file.
    sha256 : str
        Hash of its content.
    vertices : ndarray of float64, shape (n, 3)
        Points [m].
    faces : ndarray of int64, shape (m, 3)
        Triangles, as numbers of points.
    step_m : float
        Distance between neighbouring numbers at its largest coordinate, as the file stores them [m].
    """

    file: str
    sha256: str
    vertices: np.ndarray
    faces: np.ndarray
    step_m: float = 0.0


def require_trimesh() -> None:
    """Check that trimesh is installed.

    Raises
    ------
    ScanError
        trimesh is not installed.
    """
    from importlib.util import find_spec  # an extra: files with sizes or profiles do not need it

    if find_spec("trimesh") is None:
        raise ScanError(f"scans need trimesh, which is not installed: {install('scan')}")


def read_scan(path: str | Path, metres: float = 1.0) -> ScannedSurface:
    """Read the surface of a stone.

    Parameters
    ----------
    path
        PLY, STL, OBJ or GLB file.
    metres
        Length of its unit [m].

    Raises
    ------
    ScanError
        The file is missing, too large, of another kind, damaged, holds no surface, or no stone has its size.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in READERS:
        raise ScanError(f"{path}: is not a scan that can be read; use one of {', '.join(READERS)}")
    require_trimesh()
    data = _content(path)
    try:
        vertices, faces, step = _placed(parts_of(kind, data))
    except ScanError as problem:
        raise ScanError(f"{path}: {problem}") from None
    _check_size(path, vertices, metres)
    return ScannedSurface(path.name, hashlib.sha256(data).hexdigest(), vertices * metres, faces, step * metres)


def _content(path: Path) -> bytes:
    """Return the bytes of a regular file of a bounded size."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise ScanError(f"{path}: is not a regular file")
        if status.st_size > MAX_BYTES:
            size, most = status.st_size / 1e6, MAX_BYTES / 1e6
            raise ScanError(f"{path}: has {size:,.0f} MB; at most {most:g} MB are read: {DECIMATE}")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)  # it may grow after the check
    except FileNotFoundError:
        raise ScanError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as problem:
        words = why(problem) if isinstance(problem, OSError) else str(problem)
        raise ScanError(f"{path}: cannot be read: {words}") from None
    if len(data) > MAX_BYTES:
        raise ScanError(f"{path}: is larger than {MAX_BYTES / 1e6:g} MB: {DECIMATE}")
    if not data:
        raise ScanError(f"{path}: is empty")
    return data


def _placed(parts: list[Part]) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the points that faces use and the faces of all parts in their places, and the spacing of coordinates."""
    vertices, faces, step, before = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0.0, 0
    for part in parts:
        if not len(part.faces):
            continue
        if part.faces.min() < 0 or part.faces.max() >= len(part.points):
            raise ScanError("is damaged: a face names a point that is not there")
        used, numbers = np.unique(part.faces, return_inverse=True)
        points, turn = part.points[used], part.placing[:3, :3]
        with np.errstate(all="ignore"):  # what is no finite number is refused below
            placed = points.astype(np.float64) @ turn.T + part.placing[:3, 3]
            mirrored = np.linalg.det(turn) < 0.0
        if not np.isfinite(placed).all():
            raise ScanError("is damaged: it has coordinates that are no finite numbers")
        vertices.append(placed)
        faces.append(before + numbers.reshape(-1, 3)[:, :: -1 if mirrored else 1])
        step = max(step, max(part.step, _spacing(points)) * float(np.linalg.norm(turn, axis=0).max()))
        before += len(used)
        check_count(before, 3)
    if not before:
        raise ScanError("holds no faces; export the scan as a mesh, not as points")
    return np.concatenate(vertices), np.concatenate(faces), step


def _spacing(points: np.ndarray) -> float:
    """Return the distance between neighbouring numbers at the largest coordinate, in the least type that holds all."""
    largest = np.abs(points).max()
    with np.errstate(over="ignore"):
        single = points.astype(np.float32)
    return float(np.spacing(np.float32(largest) if (single == points).all() else largest))


def _check_size(path: Path, used: np.ndarray, metres: float) -> None:
    """Refuse what is too small or too large for a stone, and say which unit it may be in."""
    side = float(np.ptp(used, axis=0).max())
    if LEAST_SIZE_M <= side * metres <= LARGEST_SIZE_M:
        return
    fitting = [name for name, unit in OTHER_UNITS.items() if 0.5 <= side * unit <= 6.0 and unit != metres]
    advice = f"; if the scan is in {fitting[0]}, add its unit: {fitting[0]}" if fitting else ""
    raise ScanError(
        f"{path}: its largest side is {side * metres:.4g} m; boulders of {LEAST_SIZE_M:g} to {LARGEST_SIZE_M:g} m are "
        f"taken{advice}"
    )
