"""Read a scan, an untrusted file: PLY, STL, OBJ or GLB; its surface, and whether a stone has its size.

trimesh reads; what is checked is here. It passes over what it does not understand, opens what a file names, and makes
what a header says without looking. So the bytes are counted first: more than is read is refused, and so is what trimesh
takes for something else. It gets only points and faces, without names of materials or pictures, and no way to other
files. What it returns must have the points and triangles that were counted.
"""

from __future__ import annotations

import hashlib
import importlib.util
import io
import json
import re
import stat
import struct
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from boulder_sweep.errors import ScanError
from boulder_sweep.text import install, why

MAX_FACES = 1_000_000
"""Most triangles, and most points where triangles share them. A phone makes 100,000, a profile needs a few thousand."""
MAX_LINES = 8 * MAX_FACES
"""Most lines of a text: points, their normals and colours, faces."""
MAX_TEXT_FACETS = 300_000
"""Most facets of an STL file as text, of which each takes 2.5 kB to read."""
MAX_LINE_BYTES = 1_000_000
MAX_JSON_BYTES = 1_000_000
"""Largest description in a GLB file. A scan needs a few kilobytes."""
MAX_NODES = 1_000
DECIMATE = "reduce it first, for example to 200,000 faces in MeshLab or CloudCompare"
AS_PLY = "export it as binary PLY, of triangles"

HARMLESS = re.compile(
    r"KHR_(materials_\w+|texture_\w+|lights_punctual|mesh_quantization|xmp\w*|node_visibility)"
    r"|EXT_(texture_\w+|lights_\w+|mesh_features|structural_metadata)|FB_ngon_encoding|MSFT_texture_dds"
)
"""Extensions of glTF that move no point of a mesh: looks, names, and coordinates as whole numbers."""
MOVING = re.compile(r"KHR_draco_mesh_compression|(KHR|EXT)_meshopt_compression|EXT_mesh_gpu_instancing")
"""Extensions without which a file that does not require them may still show another surface."""

_Counted = tuple[int, int, bytes]
"""How many points and triangles there are, and the bytes for trimesh."""


@dataclass(frozen=True, eq=False)
class Part:
    """A piece of a surface as it is stored."""

    points: np.ndarray
    """Points, shape (n, 3)."""
    faces: np.ndarray
    """Triangles, as numbers of points, int64, shape (m, 3)."""
    placing: np.ndarray
    """What moves the points to their places, shape (4, 4)."""
    step: float = 0.0
    """Least distance between neighbouring numbers: 1 where the file stores whole ones."""


def parts_of(kind: str, data: bytes) -> list[Part]:
    """Return the surface in the bytes of a file whose name ends in `kind`, one of `READERS`.

    Raise `ScanError` where it is damaged, of another format, too large, or holds what is not read; the words do not
    name the file.
    """
    try:
        points, faces, plain = READERS[kind](data)
        parts = _loaded(kind, plain) if faces else []
    except ScanError:
        raise
    except Exception:  # whatever trimesh raises
        raise ScanError(f"is damaged, or no {kind[1:].upper()} file that is read; {AS_PLY}") from None
    found = sum(len(part.points) for part in parts), sum(len(part.faces) for part in parts)
    if faces and (found[1] != faces or (found[0] != points and kind != ".obj")):  # of OBJ, points without faces may go
        raise ScanError(
            f"holds {points:,} points and {faces:,} triangles, and {found[0]:,} and {found[1]:,} were read; {AS_PLY}"
        )
    return parts


def _loaded(kind: str, data: bytes) -> list[Part]:
    """Return what trimesh reads. Without the name of a file, it opens no other."""
    import trimesh

    how: dict[str, Any] = {"process": False, "skip_materials": True, "maintain_order": True}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", "string or file could not be read to its end")
        scene: Any = trimesh.load(io.BytesIO(data), kind[1:], force="scene", **how)
    parts = []
    for node in scene.graph.nodes_geometry:
        placing, name = scene.graph[node]
        mesh = scene.geometry[name]
        step = 1.0 if mesh.metadata.get("whole_numbers") else 0.0
        parts.append(Part(np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int64), placing, step))
    return parts


def check_count(count: int, each: int = 1) -> None:
    """Raise `ScanError` for more faces than are read, or more of what each face may have several of."""
    if count > each * MAX_FACES:
        raise ScanError(f"has {count:,} faces or points; at most {MAX_FACES:,} are read: {DECIMATE}")


_TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
_TYPES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f"}
_TYPES |= {"float64": "d"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def _ply(data: bytes) -> _Counted:
    """Count what is in a PLY file: Turk, The PLY Polygon File Format, 1994."""
    head = re.match(rb"ply[ \t]*\r?\n.{1,100000}?\nend_header[ \t]*\r?\n", data, re.DOTALL)
    if not head:
        raise ScanError("is damaged, or the header of a PLY file is missing")
    form, elements, names = "", dict[str, tuple[int, list[list[str]]]](), set[tuple[str, str]]()
    for words in map(str.split, head[0].decode("latin-1").split("\n")[1:-2]):
        match words:
            case ["comment" | "obj_info", *_]:
                pass
            case ["format", form, "1.0"] if form in _ORDERS:
                pass
            case ["element", name, digits] if digits.isdecimal() and name not in elements:
                elements[name] = int(digits), []
                check_count(int(digits))
            case ["property", *kinds, own] if elements and (name, own) not in names:
                names.add((name, own))
                elements[name][1].append([_TYPES[one] for one in kinds if one != "list"])
            case _:
                raise ScanError(f"is damaged: its header holds {' '.join(words)[:60]!r}")
    start, (points, _), (faces, corners) = head.end(), elements["vertex"], elements.get("face", (0, []))
    if form == "ascii":
        counted, before = sum(count for count, _ in elements.values()), data.count(b"\n", 0, start)
        lines = data[start:].split(b"\n", counted)
        if len(lines) < counted or any(lines[counted:]) or len(max(lines, default=b"", key=len)) > MAX_LINE_BYTES:
            raise ScanError(f"is damaged: it has other lines than the {counted:,} that its header counts")
        if faces and ([*elements][:2] != ["vertex", "face"] or len(corners[0]) < 2):
            raise ScanError(f"holds points and faces in another order than is read; {AS_PLY}")
        for number, line in enumerate(lines[points : points + faces], before + points + 1):
            row = line.split()
            many = int(row[0]) if row else 0
            if not 3 <= many < len(row) or not all(map(bytes.isdigit, row[: many + 1])):
                raise ScanError(f"line {number}: is damaged: it is no face as the header describes it")
            faces += many - 3
        check_count(faces)
        return points, faces, data
    for name, (count, properties) in elements.items():
        size, lists = 0, list[tuple[np.dtype[Any], int, int]]()
        for kinds in properties if count else ():
            *counts, kind = (np.dtype(_ORDERS[form] + one) for one in kinds)
            many = 1
            for one in counts:
                many = int(np.ndarray((), one, data, start + size))
                lists.append((one, start + size, many))
                size += one.itemsize
            size += many * kind.itemsize
        if start + count * size > len(data):
            raise ScanError("is damaged: it ends before what its header counts")
        if any((np.ndarray(count, one, data, place, size) != many).any() for one, place, many in lists):
            raise ScanError(f"has lists of several lengths, such as triangles beside polygons; {AS_PLY}")
        if name == "face" and lists:
            faces = count * (lists[0][2] - 2)
            check_count(faces)
        start += count * size
    if start != len(data):
        raise ScanError(f"is damaged: it goes on for {len(data) - start:,} bytes after what its header counts")
    return points, faces, data


_FACET = re.compile(
    rb"\bfacet\b[^\n]*\n\s*outer\s+loop\s*\n(?:\s*vertex(?:[ \t]+[-+.\de]+){3}[ \t]*\r?\n){3}\s*endloop\s+endfacet\b"
)


def _stl(data: bytes) -> _Counted:
    """Count the facets of an STL file, binary where its length fits the count that it says."""
    count = int.from_bytes(data[80:84], "little")
    if len(data) < 84 or len(data) != 84 + 50 * count:
        data = data.lower()
        count = data.count(b"endfacet")
        check_count(count)
        if count > MAX_TEXT_FACETS:
            raise ScanError(f"has {count:,} facets as text; at most {MAX_TEXT_FACETS:,} are read; {AS_PLY}")
        if not re.match(rb"\s*solid\b", data) or not re.search(rb"\bendsolid\b[^\n]*\s*\Z", data[-10_000:]):
            raise ScanError("is damaged: it ends early, or is no STL file")
        found = sum(1 for _ in _FACET.finditer(data))
        if not found == count == data.count(b"facet") - count == data.count(b"vertex") / 3:
            raise ScanError(f"is damaged: {found:,} of its {count:,} facets have three corners")
    check_count(count)
    return 3 * count, count, data


_NUMBER = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_PASSED = frozenset(
    b"vt vn vp g o s mg l p usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj".split()
)
"""Words that begin lines of an OBJ file without points or faces of the surface."""


def _obj(data: bytes) -> _Counted:
    """Count what is in an OBJ file: Wavefront, Advanced Visualizer, appendix B1; polygons only."""
    points, faces, triangles = list[bytes](), list[bytes](), 0
    if (count := data.count(b"\n")) > MAX_LINES:
        raise ScanError(f"has {count:,} lines; at most {MAX_LINES:,} are read: {DECIMATE}")
    if data.count(b"\r") > data.count(b"\r\n"):
        raise ScanError(f"ends its lines in another way than is read; {AS_PLY}")
    file = io.BytesIO(data)
    for number, line in enumerate(iter(lambda: file.readline(MAX_LINE_BYTES + 1), b""), 1):
        if len(line) > MAX_LINE_BYTES:
            raise ScanError(f"line {number}: is longer than {MAX_LINE_BYTES:,} bytes; {AS_PLY}")
        word, *words = line.partition(b"#")[0].split() or [b"g"]
        if word == b"v" and 3 <= len(words) <= 7 and all(map(_NUMBER.fullmatch, words)):  # a colour may follow
            points.append(b"v " + b" ".join(words[:3]))
        elif word in (b"f", b"fo") and len(words) >= 3 and re.fullmatch(rb"[-\d/\s]+", b" ".join(words)):
            corners = [int(one.partition(b"/")[0]) for one in words]
            faces.append(b"f " + b" ".join([b"%d" % (one if one > 0 else len(points) + 1 + one) for one in corners]))
            if 0 in corners or min(corners) < -len(points):
                raise ScanError(f"line {number}: names a point that is not there")
            triangles += len(corners) - 2
        elif word not in _PASSED:
            raise ScanError(f"line {number}: is {line[:60].strip().decode('latin-1')!a}, which is not read; {AS_PLY}")
        check_count(max(len(points), triangles))
    return len(points), triangles, b"\n".join([*points, *faces])


def _glb(data: bytes) -> _Counted:
    """Count what the scene of a GLB file places: Khronos, glTF 2.0 specification."""
    magic, version, whole, length, chunk = struct.unpack_from("<4sIII4s", data, 0)
    if magic != b"glTF" or version != 2 or chunk != b"JSON":
        raise ScanError("is damaged, or the header of a GLB file (glTF 2.0) is missing")
    if whole != len(data):
        raise ScanError(f"is damaged: its header says {whole:,} bytes, and it has {len(data):,}")
    if length > MAX_JSON_BYTES:
        raise ScanError(f"describes its surface in {length:,} bytes; at most {MAX_JSON_BYTES:,} are read: {AS_PLY}")
    header, rest = json.loads(data[20 : 20 + length]), data[20 + length :]
    used, required = ({*header.get(f"extensions{which}", ())} for which in ("Used", "Required"))
    foreign = {name for name in required if not HARMLESS.fullmatch(name)} | {n for n in used if MOVING.fullmatch(n)}
    if foreign:
        raise ScanError(f"uses {', '.join(map(ascii, sorted(foreign)))}, which is not read; {AS_PLY}, or without it")
    if header.get("skins"):
        raise ScanError(f"has a skin, which bends the surface and is not read; apply the pose and {AS_PLY}")
    if any("uri" in one for one in header.get("buffers", ())):
        raise ScanError("keeps its points in other files; export it as one file")
    accessors, nodes = header.get("accessors", []), header.get("nodes", [])
    check_count(sum(one["count"] for one in accessors), 12)
    for one in accessors:
        view = {} if "bufferView" not in one else header["bufferViews"][one["bufferView"]]
        least = min(one["count"] - 1, one.get("byteOffset", 0), view.get("byteOffset", 0))
        if "sparse" in one or not view or least < 0:
            raise ScanError(f"holds points that are sparse, compressed or missing, which are not read; {AS_PLY}")
    sizes = [_glb_size(mesh, accessors) for mesh in header.get("meshes", ())]
    below = {child for node in nodes for child in node.get("children", ())}
    header.setdefault("scenes", [{"nodes": [number for number in range(len(nodes)) if number not in below]}])
    found, waiting, seen = np.zeros(2, np.int64), [*header["scenes"][header.get("scene", 0)].get("nodes", ())], set()
    while waiting:
        node = nodes[number := waiting.pop()]
        if number in seen:
            raise ScanError("is damaged: a node has two parents")
        seen.add(number)
        waiting += node.get("children", ())
        found += sizes[node["mesh"]] if "mesh" in node else 0
        check_count(int(found[1]))
        for name in ("camera", "name", "extras", "extensions"):  # trimesh leaves out a node with a camera
            node.pop(name, None)
    if len(seen) > MAX_NODES:
        raise ScanError(f"has {len(seen):,} nodes; at most {MAX_NODES:,} are read: {AS_PLY}")
    text, (points, faces) = json.dumps(header).encode(), found.tolist()
    return points, faces, struct.pack("<4sIII4s", magic, 2, 20 + len(text) + len(rest), len(text), chunk) + text + rest


def _glb_size(mesh: dict[str, Any], accessors: list[dict[str, Any]]) -> np.ndarray:
    """Return how many points and triangles a mesh has, and leave in it only what trimesh needs."""
    size = np.zeros(2, np.int64)
    kept, kinds = [], set[bool]()
    for piece in mesh["primitives"]:
        if piece.get("targets"):
            raise ScanError(f"has morph targets (shape keys), which are not read; apply them and {AS_PLY}")
        mode, place = piece.get("mode", 4), piece["attributes"]["POSITION"]
        if mode == 6:
            raise ScanError(f"holds fans of triangles, which are not read; {AS_PLY}")
        if mode not in (4, 5):
            continue  # points and lines
        points, numbers = accessors[place], accessors[piece.get("indices", place)]
        if points["type"] != "VEC3" or points.get("normalized"):
            raise ScanError(f"has normalized coordinates, which are not read; {AS_PLY}, or with coordinates as floats")
        is_whole = numbers["type"] == "SCALAR" and numbers["componentType"] in (5121, 5123, 5125)
        if not is_whole and numbers is not points:
            raise ScanError("is damaged: it numbers corners with something else than whole numbers")
        size += points["count"], numbers["count"] // 3 if mode == 4 else numbers["count"] - 2
        kinds.add(points["componentType"] == 5126)
        kept.append({"attributes": {"POSITION": place}} | {k: piece[k] for k in ("indices", "mode") if k in piece})
    mesh.clear()
    mesh |= {"primitives": kept, "extras": {"whole_numbers": False in kinds}}
    return size


READERS: dict[str, Callable[[bytes], _Counted]] = {".ply": _ply, ".stl": _stl, ".obj": _obj, ".glb": _glb}
"""What counts a file of each format, by the end of its name."""

MAX_BYTES = 400_000_000
"""Largest file that is read."""
LEAST_SIZE_M, LARGEST_SIZE_M = 0.1, 20.0
"""Largest side of a stone that is taken for one [m]."""
OTHER_UNITS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048}
"""Units in which scans are often written, in metres."""


@dataclass(frozen=True, eq=False)
class ScannedSurface:
    """The surface in a file, as it is."""

    file: str
    sha256: str
    vertices: np.ndarray
    """Points [m], shape (n, 3)."""
    faces: np.ndarray
    """Triangles, as numbers of points, int64, shape (m, 3)."""
    step_m: float = 0.0
    """Distance between neighbouring numbers at its largest coordinate, as the file stores them [m]."""


def read_scan(path: str | Path, metres: float = 1.0) -> ScannedSurface:
    """Return the surface of a stone in a PLY, STL, OBJ or GLB file, whose unit has a length [m].

    Raise `ScanError` where the file is missing, too large, of another kind, damaged, holds no surface, or no stone has
    its size.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in READERS:
        raise ScanError(f"{path}: is not a scan that can be read; use one of {', '.join(READERS)}")
    if importlib.util.find_spec("trimesh") is None:  # an extra: files with sizes or profiles do not need it
        raise ScanError(f"scans need trimesh, which is not installed: {install('scan')}")
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
