"""Read a scan, an untrusted file: its sizes are checked before anything is loaded.

The formats are read by trimesh, without the materials and pictures that a scan names. Nothing that it names is opened.
"""

from __future__ import annotations

import hashlib
import io
import json
import stat
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boulder_sweep.errors import ScanError
from boulder_sweep.text import one_line, why

MAX_BYTES = 400_000_000
"""Largest file that is read."""
MAX_FACES = 1_000_000
"""Most faces, and most vertices, of a scan. A phone makes some 100,000, and a profile needs a few thousand."""
DECIMATE = "reduce it first, for example to 200,000 faces in MeshLab or CloudCompare"
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
    """

    file: str
    sha256: str
    vertices: np.ndarray
    faces: np.ndarray


def require_trimesh() -> None:
    """Check that trimesh is installed.

    Raises
    ------
    ScanError
        trimesh is not installed.
    """
    from importlib.util import find_spec  # an extra: files with sizes or profiles do not need it

    if find_spec("trimesh") is None:
        raise ScanError("scans need trimesh, which is not installed: pip install 'boulder-sweep[scan]'")


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
    if kind not in _FACES:
        raise ScanError(f"{path}: is not a scan that can be read; use one of {', '.join(_FACES)}")
    require_trimesh()
    data = _content(path)
    _check_counts(path, _FACES[kind], data)
    vertices, faces = _loaded(path, kind, data)
    if not len(faces):
        raise ScanError(f"{path}: holds no faces; export the scan as a mesh, not as points")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ScanError(f"{path}: is damaged: a face names a point that is not there")
    used = vertices[np.unique(faces)]
    if not np.isfinite(used).all():
        raise ScanError(f"{path}: is damaged: it has coordinates that are no finite numbers")
    _check_size(path, used, metres)
    return ScannedSurface(path.name, hashlib.sha256(data).hexdigest(), vertices * metres, faces)


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


def _check_counts(path: Path, count: Callable[[bytes], int], data: bytes) -> None:
    """Refuse a file that says that it holds too much, or does not say how much."""
    try:
        most = count(data)
    except (
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        ArithmeticError,
        struct.error,
        RecursionError,
    ) as problem:
        words = str(problem) if isinstance(problem, ValueError) else one_line(problem)
        raise ScanError(f"{path}: is damaged or of another format ({words})") from None
    if most > MAX_FACES:
        raise ScanError(f"{path}: has {most:,} faces or points; at most {MAX_FACES:,} are read: {DECIMATE}")


def _loaded(path: Path, kind: str, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Return points and faces as trimesh reads them."""
    import logging

    import trimesh

    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    try:
        # An open file without a name: trimesh then has no folder in which to look for what the scan names.
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind[1:], process=False, skip_materials=True)
        parts = [part for part in scene.dump() if isinstance(part, trimesh.Trimesh)]
        placed = np.cumsum([0, *(len(part.vertices) for part in parts)])
        vertices = np.concatenate([np.empty((0, 3)), *(part.vertices for part in parts)])
        numbers = (part.faces + before for part, before in zip(parts, placed[:-1], strict=True))
        faces = np.concatenate([np.empty((0, 3), dtype=np.int64), *numbers])
    except (KeyboardInterrupt, MemoryError):
        raise
    except Exception as problem:  # of a damaged file, the readers raise almost anything
        raise ScanError(f"{path}: cannot be read as {kind[1:].upper()} ({one_line(problem)})") from None
    return np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int64)


def _check_size(path: Path, used: np.ndarray, metres: float) -> None:
    """Refuse what is too small or too large for a stone, and say which unit it may be in."""
    side = float(np.ptp(used, axis=0).max())
    if LEAST_SIZE_M <= side * metres <= LARGEST_SIZE_M:
        return
    fitting = [name for name, unit in OTHER_UNITS.items() if 0.5 <= side * unit <= 6.0 and unit != metres]
    advice = f"; if the scan is in {fitting[0]}, add its unit: {fitting[0]}" if fitting else ""
    raise ScanError(
        f"{path}: its largest side is {side * metres:.4g} m; stones of {LEAST_SIZE_M:g} to {LARGEST_SIZE_M:g} m are "
        f"taken{advice}"
    )


def _faces_of_ply(data: bytes) -> int:
    """Return the largest count in the header."""
    end = data.find(b"end_header", 0, 100_000)
    if not data[:3].lower() == b"ply" or end < 0:
        raise ValueError("the header of a PLY file is missing")
    lines = (line.split() for line in data[:end].splitlines())
    return max((abs(int(words[2])) for words in lines if len(words) > 2 and words[0] == b"element"), default=0)


def _faces_of_stl(data: bytes) -> int:
    """Return the count that a binary file says and holds, or how many facets a text has."""
    if len(data) >= 84:
        count = struct.unpack_from("<I", data, 80)[0]
        if len(data) == 84 + 50 * count:
            return int(count)
    if b"facet" not in data[:10_000].lower():
        raise ValueError("the file ends early, or is no STL file")
    return data.count(b"endfacet") + data.count(b"ENDFACET")


def _faces_of_obj(data: bytes) -> int:
    """Return how many faces or points a text has."""
    if b"\x00" in data[:10_000]:
        raise ValueError("the file is no text")
    return max(data.count(b"\nf "), data.count(b"\nv "))


def _faces_of_glb(data: bytes) -> int:
    """Return how many faces or points all meshes have, each as often as it is placed."""
    magic, _, _, length, chunk = struct.unpack_from("<4sIII4s", data, 0)
    if magic != b"glTF" or chunk != b"JSON":
        raise ValueError("the header of a GLB file is missing")
    header = json.loads(data[20 : 20 + length])
    if any("uri" in buffer for buffer in header.get("buffers", ())):
        raise ValueError("it keeps its points in other files; export it as one file")
    if "KHR_draco_mesh_compression" in header.get("extensionsUsed", ()):
        raise ValueError("it is compressed; export it without compression")
    nodes = header.get("nodes", [])
    children = [child for node in nodes for child in node.get("children", ())]
    if len(children) != len(set(children)):
        raise ValueError("a node has two parents")
    counts = [int(accessor["count"]) for accessor in header.get("accessors", ())]
    if min(counts, default=0) < 0:
        raise ValueError("a count is negative")
    if sum(counts) > 20 * MAX_FACES:
        return sum(counts)
    faces = [
        sum(counts[part.get("indices", part["attributes"]["POSITION"])] // 3 for part in mesh.get("primitives", ()))
        for mesh in header.get("meshes", ())
    ]
    return max(sum(faces[node["mesh"]] for node in nodes if "mesh" in node), max(counts, default=0) // 3)


_FACES: dict[str, Callable[[bytes], int]] = {
    ".ply": _faces_of_ply,
    ".stl": _faces_of_stl,
    ".obj": _faces_of_obj,
    ".glb": _faces_of_glb,
}
"""How much a file holds, by the end of its name, read from its bytes without loading it."""
