"""Read the bytes of a scan, which nobody vouches for: PLY, STL, OBJ and GLB, as parts of a surface.

A reader takes in everything that the file says it holds, or refuses the file: a line or a byte that is left over is a
mistake, and what cannot be read is named. Nothing large is made before its size is known. Materials, pictures and
normals are passed over.
"""

from __future__ import annotations

import io
import json
import re
import struct
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from operator import index
from typing import Any

import numpy as np

from boulder_sweep.errors import ScanError
from boulder_sweep.text import printable

MAX_FACES = 1_000_000
"""Most triangles, and most points where triangles share them. A phone makes 100,000, a profile needs a few thousand."""
MAX_LINES = 8 * MAX_FACES
"""Most lines of a text: points, their normals and colours, faces."""
MAX_LINE_BYTES = 1_000_000
MAX_JSON_BYTES = 1_000_000
"""Largest description in a GLB file. A scan needs a few kilobytes."""
DECIMATE = "reduce it first, for example to 200,000 faces in MeshLab or CloudCompare"
AS_PLY = "export it as binary PLY"

HARMLESS = re.compile(
    r"KHR_(materials_\w+|texture_\w+|lights_punctual|mesh_quantization|xmp\w*|node_visibility)"
    r"|EXT_(texture_\w+|lights_\w+|mesh_features|structural_metadata)|FB_ngon_encoding|MSFT_texture_dds"
)
"""Extensions of glTF that move no point of a mesh: looks, names, and coordinates as whole numbers."""
MOVING = {
    "KHR_draco_mesh_compression",
    "KHR_meshopt_compression",
    "EXT_meshopt_compression",
    "EXT_mesh_gpu_instancing",
}
"""Extensions without which a file that does not require them may still show another surface."""


@dataclass(frozen=True, eq=False)
class Part:
    """A piece of a surface as it is stored.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Points in the type in which the file stores them; float64 from a text.
    faces : ndarray of int64, shape (m, 3)
        Triangles, as numbers of points.
    placing : ndarray of float64, shape (4, 4)
        What moves the points to their places.
    """

    points: np.ndarray
    faces: np.ndarray
    placing: np.ndarray


def parts_of(kind: str, data: bytes) -> list[Part]:
    """Read a file.

    Parameters
    ----------
    kind
        The end of its name, one of `READERS`.
    data
        Its bytes.

    Raises
    ------
    ScanError
        It is damaged, of another format, too large, or holds what is not read. The words do not name the file.
    """
    try:
        return READERS[kind](data)
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, struct.error, RecursionError):
        raise ScanError(f"is damaged, or no {kind[1:].upper()} file") from None


def check_count(count: int, each: int = 1) -> None:
    """Refuse more faces than are read, or more of what each face may have several of.

    Raises
    ------
    ScanError
        There are more.
    """
    if count > each * MAX_FACES:
        raise ScanError(f"has {count:,} faces or points; at most {MAX_FACES:,} are read: {DECIMATE}")


def _one(points: np.ndarray, faces: np.ndarray) -> list[Part]:
    return [Part(points, faces, np.eye(4))]


def _fans(corners: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the triangles of polygons, each a fan from its first corner.

    Their volume is the volume of the polygons for every flat polygon, convex or not.
    """
    first = np.cumsum(counts) - counts
    fans = counts - 2
    start = np.repeat(first, fans)
    step = np.arange(len(start)) - np.repeat(np.cumsum(fans) - fans, fans)
    return np.stack([corners[start], corners[start + step + 1], corners[start + step + 2]], axis=1)


def _polygons(corners: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the triangles of polygons after checking how many these are."""
    if len(counts) and counts.min() < 3:
        raise ScanError("is damaged: a face has fewer than 3 corners")
    check_count(int(counts.sum()) - 2 * len(counts))
    return _fans(corners.astype(np.int64), counts)


def _rows(text: bytes, start: int = 0, first: int = 1) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the number and the words of every line that has words, without comments, from a byte on.

    Raises
    ------
    ScanError
        It is no text, or has too many or too long lines.
    """
    if text.find(b"\x00", start) >= 0:
        raise ScanError("is damaged, or the file is no text")
    if text.find(b"\n", start) < 0:
        text = text.replace(b"\r", b"\n")
    if (count := text.count(b"\n", start)) > MAX_LINES:
        raise ScanError(f"has {count:,} lines; at most {MAX_LINES:,} are read: {DECIMATE}")
    file = io.BytesIO(text)
    file.seek(start or 3 * text.startswith(b"\xef\xbb\xbf"))
    lines = enumerate(iter(partial(file.readline, MAX_LINE_BYTES + 1), b""), first)
    for number, line in lines:
        words, size = line.partition(b"#")[0].split(), len(line)
        while words and words[-1][-1:] == b"\\" and words[0][:1] in (b"v", b"f") and size <= MAX_LINE_BYTES:
            more = next(lines, (0, b""))[1]  # goes on with this one
            words[-1:] = words[-1][:-1].split() + more.partition(b"#")[0].split()
            size += len(more)
        if size > MAX_LINE_BYTES:
            raise ScanError(f"line {number}: is longer than {MAX_LINE_BYTES:,} bytes; {AS_PLY}")
        if words:
            yield number, words


# --- PLY ---

_TYPES = {
    name: code
    for names, code in (
        ("char int8", "i1"),
        ("uchar uint8", "u1"),
        ("short int16", "i2"),
        ("ushort uint16", "u2"),
        ("int int32", "i4"),
        ("uint uint32", "u4"),
        ("float float32", "f4"),
        ("double float64", "f8"),
    )
    for name in names.split()
}
_STRUCT = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class _Element:
    """An element of a PLY file: its name, how many there are, and the types of count and value of each property."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]]

    @property
    def wanted(self) -> list[str]:
        """The properties that say what the surface is."""
        names = {"vertex": ("x", "y", "z"), "face": ("vertex_indices", "vertex_index")}.get(self.name, ())
        return [name for name in names if name in self.properties]


def _ply(data: bytes) -> list[Part]:
    """Read a PLY file: Turk, The PLY Polygon File Format, 1994."""
    order, elements, start, line = _ply_header(data)
    rows = _rows(data, start, line) if not order else iter(())
    points, faces = np.empty((0, 3)), np.empty((0, 3), np.int64)
    for element in elements:
        if order:
            columns, counts, start = _binary_columns(element, order, data, start)
        else:
            columns, counts = _text_columns(element, rows)
        if element.name == "vertex":
            points = np.stack(columns, axis=1)
        elif element.name == "face":
            faces = _polygons(columns[0], counts)
    if order and start != len(data):
        raise ScanError(f"is damaged: it goes on for {len(data) - start:,} bytes after what its header counts")
    for number, _ in rows:
        raise ScanError(f"line {number}: is one more than its header counts")
    return _one(points, faces)


def _ply_header(data: bytes) -> tuple[str, list[_Element], int, int]:
    """Return the order of bytes (none for a text), the elements, and the byte and line at which these start."""
    head = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    end = head and re.compile(rb"(?:^|[\r\n])[ \t]*end_header[ \t]*" + head[1]).search(data, 0, 100_000)
    if not head or not end:
        raise ScanError("is damaged, or the header of a PLY file is missing")
    lines = data[: end.end()].decode("latin-1").split(head[1].decode())[:-1]
    order, elements = None, list[_Element]()
    for words in map(str.split, lines[1:-1]):
        match words:
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, "1.0"]:
                order = _ORDERS[name]
            case ["element", name, count] if name not in [element.name for element in elements]:
                elements.append(_Element(name, int(count), {}))
            case ["property", "list", count, value, name] if name not in elements[-1].properties:
                elements[-1].properties[name] = _TYPES[count], _TYPES[value]
            case ["property", value, name] if name not in elements[-1].properties:
                elements[-1].properties[name] = "", _TYPES[value]
            case _:
                raise ScanError(f"is damaged: its header holds {' '.join(words)[:60]!r}")
    if order is None:
        raise ScanError("is damaged: its header does not say its format")
    for element in elements:
        check_count(abs(element.count))
        _check_element(element)
    check_count(sum(element.count * len(element.properties) for element in elements), 20)
    return order, elements, end.end(), len(lines) + 1


def _check_element(element: _Element) -> None:
    """Refuse counts that are none, and points and faces of another kind."""
    kinds = element.properties
    if element.count < 0 or any(count and count not in _STRUCT for count, _ in kinds.values()):
        raise ScanError("is damaged: its header counts with something else than whole numbers")
    if element.name == "tristrips":
        raise ScanError("holds strips of triangles, which are not read; export it with faces")
    wanted = [kinds[name] for name in element.wanted]
    if element.name == "vertex" and (len(wanted) != 3 or any(count for count, _ in wanted)):
        raise ScanError("is damaged: its points have no x, y and z")
    if element.name == "face" and not (len(wanted) == 1 and all(kind in _STRUCT for kind in wanted[0])):
        raise ScanError("is damaged: its faces have no list of corners, vertex_indices")


def _binary_columns(element: _Element, order: str, data: bytes, start: int) -> tuple[list[np.ndarray], np.ndarray, int]:
    """Return the values of the properties that are wanted, how many the last has each time, and where these end."""
    sizes = {name: np.dtype(kind).itemsize for name, (_, kind) in element.properties.items()}
    if any(count for count, _ in element.properties.values()):
        walk = [
            (struct.Struct(order + _STRUCT[count]) if count else None, sizes[name], name in element.wanted)
            for name, (count, _) in element.properties.items()
        ]
        starts, counts = array("q"), array("q")
        for _ in range(element.count):
            for count, size, wanted in walk:
                many = 1
                if count:
                    (many,) = count.unpack_from(data, start)
                    start += count.size
                if many < 0:
                    raise ScanError("is damaged: a list has fewer than no entries")
                if wanted:
                    starts.append(start)
                    counts.append(many)
                start += many * size
        shape = element.count, len(element.wanted)
        places, many_each = (np.frombuffer(column, np.int64).reshape(shape).T for column in (starts, counts))
    else:
        before = dict(zip(sizes, np.cumsum([0, *sizes.values()]), strict=False))
        row = sum(sizes.values()) * np.arange(element.count)
        places = np.array([start + before[name] + row for name in element.wanted])
        many_each = np.ones_like(places)
        start += sum(sizes.values()) * element.count
    if start > len(data):
        raise ScanError("is damaged: it ends before what its header counts")
    check_count(int(many_each.sum()), 3)
    octets, columns = np.frombuffer(data, np.uint8), []
    for name, starts_at, each in zip(element.wanted, places, many_each, strict=True):
        within = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
        at = np.repeat(starts_at, each) + sizes[name] * within
        values = octets[at[:, None] + np.arange(sizes[name])].view(order + element.properties[name][1])
        columns.append(values.reshape(-1))
    return columns, many_each[-1] if len(many_each) else np.empty(0, np.int64), start


def _text_columns(element: _Element, rows: Iterator[tuple[int, list[bytes]]]) -> tuple[list[np.ndarray], np.ndarray]:
    """Return the values of the properties that are wanted, and how many the last has each time, from lines."""
    columns: dict[str, Any] = {name: array("q" if element.properties[name][0] else "d") for name in element.wanted}
    counts = array("q")
    for _ in range(element.count):
        number, words = next(rows, (0, []))
        if not number:
            raise ScanError("is damaged: it ends before what its header counts")
        at = 0
        try:
            for name, (count, _) in element.properties.items():
                many = 1
                if count:
                    many = int(words[at])
                    at += 1
                if name in columns:
                    columns[name].extend([(int if count else float)(word) for word in words[at : at + many]])
                    counts.append(many)
                at += many
        except (ValueError, LookupError, OverflowError):
            at = -1
        if at != len(words):
            raise ScanError(
                f"line {number}: is damaged: it is no {printable(element.name[:60])} as the header describes it"
            )
        check_count(len(counts), 3)
    many_each = np.frombuffer(counts, np.int64).reshape(element.count, -1) if columns else np.empty((0, 1), np.int64)
    return [np.frombuffer(column, column.typecode) for column in columns.values()], many_each[:, -1]


# --- STL ---

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])


def _stl(data: bytes) -> list[Part]:
    """Read an STL file, binary where its length fits the count that it says."""
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else -1
    if len(data) == 84 + _FACET.itemsize * count:
        check_count(count)
        points = np.frombuffer(data, _FACET, offset=84)["corners"].reshape(-1, 3)
    else:
        points = _stl_text(data)
    return _one(points, np.arange(len(points)).reshape(-1, 3))


_STL_WORDS = {b"solid", b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"endsolid"}


def _stl_text(data: bytes) -> np.ndarray:
    """Return the corners of the facets of a text, each of three."""
    if not re.match(rb"\s*solid\b", data, re.IGNORECASE):
        raise ScanError("is damaged: it ends early, or is no STL file")
    points, facets, word = array("d"), 0, b""
    for number, words in _rows(data):
        word = words[0].lower()
        if word == b"vertex":
            points.extend(_point(words, number))
        elif word == b"endfacet":
            facets += 1
            check_count(facets)
            if len(points) != 9 * facets:
                raise ScanError(f"line {number}: is damaged: a facet has three corners")
        elif word not in _STL_WORDS:
            raise ScanError(f"line {number}: is damaged: {_shown(words)} is no line of an STL file")
    if word != b"endsolid" or len(points) != 9 * facets:
        raise ScanError("is damaged: it ends early, without endsolid")
    return np.frombuffer(points, np.float64).reshape(-1, 3)


# --- OBJ ---

_PASSED = frozenset(
    b"vt vn vp g o s mg l p usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj".split()
)
"""Words that begin lines of an OBJ file without points or faces of the surface."""


def _obj(data: bytes) -> list[Part]:
    """Read an OBJ file: Wavefront, Advanced Visualizer, appendix B1; polygons only."""
    points, corners, counts = array("d"), array("q"), array("q")
    for number, words in _rows(data):
        word = words[0]
        if word == b"v":
            points.extend(_point(words, number))
            check_count(len(points) // 3)
        elif word in (b"f", b"fo"):
            here = len(points) // 3
            try:
                named = [int(corner.partition(b"/")[0]) for corner in words[1:]]
            except ValueError:
                named = [0]
            if 0 in named or min(named, default=0) < -here:
                raise ScanError(f"line {number}: is damaged: {_shown(words)} is no face of points that are there")
            corners.extend(name - 1 if name > 0 else here + name for name in named)
            counts.append(len(named))
            check_count(len(corners) - 2 * len(counts))
        elif word not in _PASSED:
            raise ScanError(f"line {number}: holds {_shown(words)}, which is not read; {AS_PLY}")
    return _one(
        np.frombuffer(points, np.float64).reshape(-1, 3),
        _polygons(np.frombuffer(corners, np.int64), np.frombuffer(counts, np.int64)),
    )


def _point(words: list[bytes], line: int) -> tuple[float, float, float]:
    """Return the coordinates in a line; a weight or a colour may follow."""
    try:
        x, y, z = map(float, words[1:4])
    except ValueError:
        raise ScanError(f"line {line}: is damaged: {_shown(words)} is no point") from None
    return x, y, z


def _shown(words: list[bytes]) -> str:
    return ascii(b" ".join(words[:9])[:60].decode("latin-1"))


# --- GLB ---

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def _glb(data: bytes) -> list[Part]:
    """Read a GLB file: Khronos, glTF 2.0 specification; the meshes that its scene places."""
    header, buffer = _glb_chunks(data)
    extensions = {*header.get("extensionsRequired", ())}
    foreign = {name for name in extensions if not HARMLESS.fullmatch(name)} | MOVING & {
        *header.get("extensionsUsed", ())
    }
    if foreign:
        raise ScanError(f"uses {', '.join(map(ascii, sorted(foreign)))}, which is not read; {AS_PLY}, or without it")
    if header.get("skins"):
        raise ScanError(f"has a skin, which bends the surface and is not read; apply the pose and {AS_PLY}")
    if any("uri" in one for one in header.get("buffers", ())):
        raise ScanError("keeps its points in other files; export it as one file")
    nodes = header.get("nodes", [])
    below = {child for node in nodes for child in node.get("children", ())}
    roots = [number for number in range(len(nodes)) if number not in below]
    if "scenes" in header:
        roots = header["scenes"][header.get("scene", 0)].get("nodes", [])
    meshes: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    parts, faces, seen = list[Part](), 0, set[int]()
    waiting = [(root, np.eye(4)) for root in reversed(roots)]
    while waiting:
        number, placing = waiting.pop()
        if number in seen:
            raise ScanError("is damaged: a node has two parents")
        seen.add(number)
        node = nodes[number]
        with np.errstate(all="ignore"):  # points in places that are no finite numbers are refused
            placing = placing @ _placing(node)
        waiting += [(child, placing) for child in reversed(node.get("children", []))]
        if "mesh" in node:
            if node["mesh"] not in meshes:
                meshes[node["mesh"]] = list(_glb_mesh(header, buffer, header["meshes"][node["mesh"]]))
            parts += [Part(points, corners, placing) for points, corners in meshes[node["mesh"]]]
            faces += sum(len(corners) for _, corners in meshes[node["mesh"]])
            check_count(faces)
    return parts


def _glb_chunks(data: bytes) -> tuple[dict[str, Any], memoryview]:
    """Return the description and the buffer."""
    magic, version, whole, length, chunk = struct.unpack_from("<4sIII4s", data, 0)
    if magic != b"glTF" or version != 2 or chunk != b"JSON":
        raise ScanError("is damaged, or the header of a GLB file (glTF 2.0) is missing")
    if whole != len(data):
        raise ScanError(f"is damaged: its header says {whole:,} bytes, and it has {len(data):,}")
    if length > MAX_JSON_BYTES:
        raise ScanError(f"describes its surface in {length:,} bytes; at most {MAX_JSON_BYTES:,} are read: {AS_PLY}")
    header, start, buffer = json.loads(data[20 : 20 + length]), 20 + length, memoryview(b"")
    if start < len(data):
        length, chunk = struct.unpack_from("<I4s", data, start)
        if chunk == b"BIN\x00":
            buffer = memoryview(data)[start + 8 : start + 8 + length]
            if len(buffer) != length:
                raise ScanError("is damaged: it ends early")
    return header, buffer


def _placing(node: dict[str, Any]) -> np.ndarray:
    """Return what moves the points of a node to the points of the node above."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    placing = np.eye(4)
    if "rotation" in node:
        from scipy.spatial.transform import Rotation

        placing[:3, :3] = Rotation.from_quat(node["rotation"]).as_matrix()
    placing[:3, :3] *= np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64).reshape(3)
    placing[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return placing


def _glb_mesh(
    header: dict[str, Any], buffer: memoryview, mesh: dict[str, Any]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield points and triangles of each piece of a mesh."""
    faces = 0
    for piece in mesh["primitives"]:
        mode = piece.get("mode", _TRIANGLES)
        if piece.get("targets"):
            raise ScanError(f"has morph targets (shape keys), which are not read; apply them and {AS_PLY}")
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            continue  # points and lines
        points = _accessor(header, buffer, piece["attributes"]["POSITION"], "VEC3")
        if "indices" in piece:
            numbers = _accessor(header, buffer, piece["indices"], "SCALAR").reshape(-1).astype(np.int64)
        else:
            numbers = np.arange(len(points))
        if mode == _TRIANGLES:
            corners = numbers.reshape(-1, 3)
        elif mode == _FAN:
            corners = _fans(numbers, np.array([max(len(numbers), 2)]))
        else:
            corners = np.stack([numbers[:-2], numbers[1:-1], numbers[2:]], axis=1)
            corners[1::2] = corners[1::2, ::-1]
        faces += len(corners)
        check_count(faces)
        yield points, corners


def _accessor(header: dict[str, Any], buffer: memoryview, number: int, shape: str) -> np.ndarray:
    """Return what an accessor shows of the buffer."""
    accessor = header["accessors"][number]
    if "sparse" in accessor:
        raise ScanError(f"holds a sparse accessor, which is not read; {AS_PLY}, or without sparse accessors")
    if accessor.get("normalized"):
        raise ScanError(f"holds normalized coordinates, which are not read; {AS_PLY}, or with coordinates as floats")
    if "bufferView" not in accessor:
        raise ScanError(f"holds no points, or compressed ones; {AS_PLY}, or without compression")
    view = header["bufferViews"][accessor["bufferView"]]
    if view["buffer"] != 0:
        raise ScanError("keeps its points in other files; export it as one file")
    start, length, count = view.get("byteOffset", 0), view["byteLength"], index(accessor["count"])
    kind, width = np.dtype(_COMPONENTS[accessor["componentType"]]), _WIDTHS[shape]
    stride = view.get("byteStride", width * kind.itemsize)
    if shape == "SCALAR" and kind.kind != "u":
        raise ScanError("is damaged: it numbers corners with something else than whole numbers")
    if accessor["type"] != shape or min(start, count, stride) < 0 or start + length > len(buffer):
        raise ScanError("is damaged: it describes what is not there")
    check_count(count, 3)
    shown, offset = buffer[start : start + length], accessor.get("byteOffset", 0)
    return np.ndarray((count, width), kind, shown, offset, (stride, kind.itemsize))


READERS: dict[str, Callable[[bytes], list[Part]]] = {".ply": _ply, ".stl": _stl, ".obj": _obj, ".glb": _glb}
"""The reader of each format, by the end of a file's name."""
