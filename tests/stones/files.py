"""Write polygons as scans are written: four formats in the many ways that each allows."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

Polygons = Sequence[Sequence[int]]

BOX = (
    np.array([(x, y, z) for x in (0.0, 1.2) for y in (0.0, 1.6) for z in (0.0, 2.5)]),
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)


def prism(rim: np.ndarray, height: float, top: float = 1.0) -> tuple[np.ndarray, Polygons]:
    """A prism or frustum over any flat polygon, anticlockwise, with its two ends as one polygon each."""
    many = len(rim)
    points = np.concatenate(
        [np.column_stack([rim * scale, np.full(many, z)]) for scale, z in ((1.0, 0.0), (top, height))]
    )
    sides = [(k, (k + 1) % many, many + (k + 1) % many, many + k) for k in range(many)]
    return points, [tuple(range(many))[::-1], tuple(range(many, 2 * many)), *sides]


def regular(many: int, radius: float) -> np.ndarray:
    turn = 2.0 * np.pi * np.arange(many) / many
    return radius * np.column_stack([np.cos(turn), np.sin(turn)])


def triangles(polygons: Polygons) -> np.ndarray:
    return np.array([(one[0], *pair) for one in polygons for pair in pairwise(one[1:])])


TYPES = {"u1": "uchar", "i1": "int8", "u2": "ushort", "i4": "int", "u4": "uint32", "f4": "float", "f8": "float64"}


def ply(
    points: np.ndarray,
    polygons: Polygons,
    order: str = "<",
    count: str = "u1",
    number: str = "i4",
    real: str = "f8",
    *,
    more: bool = False,
    line: str = "\n",
) -> bytes:
    """A PLY file, binary in an order of bytes or a text for none; with `more`, with properties that are passed over.

    Polygons of several sizes are cut into triangles, but in a plain text.
    """
    if (order or more) and len({len(one) for one in polygons}) > 1:
        polygons = triangles(polygons).tolist()
    name = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}[order]
    extra = {"property uchar red": ("u1", 7)} if more else {}
    after = [f"property list uchar {TYPES[real]} texcoord"] if more else []
    head = ["ply", f"format {name} 1.0", "comment xend_header element face 99", f"element vertex {len(points)}"]
    head += [*extra, *(f"property {TYPES[real]} {axis}" for axis in "xyz")]
    head += [f"element face {len(polygons)}"]
    head += [f"property list {TYPES[count]} {TYPES[number]} {'vertex_index' if more else 'vertex_indices'}"]
    head += [*extra, *after]
    head += (
        ["element camera 1", "property int vertex1", "property int vertex2", "end_header"] if more else ["end_header"]
    )
    rows: list[list[tuple[str, Sequence[float]]]] = []
    first: list[tuple[str, Sequence[float]]] = [(kind, [value]) for kind, value in extra.values()]
    rows += [[*first, (real, list(point))] for point in points]
    rows += [
        [
            (count, [len(one)]),
            (number, list(one)),
            *first,
            *([("u1", [2 * len(one)]), (real, [0.5] * 2 * len(one))] if more else []),
        ]
        for one in polygons
    ]
    rows += [[("i4", [3, 4])]] if more else []
    if order:
        body = b"".join(np.array(values, order + kind).tobytes() for row in rows for kind, values in row)
    else:
        body = "".join(
            " ".join(f"{value:.17g}" for _, values in row for value in values) + line for row in rows
        ).encode()
    return "".join(text + line for text in head).encode() + body


def obj(points: np.ndarray, polygons: Polygons, style: str = "plain") -> bytes:
    """An OBJ file in one of several styles."""
    many = len(points)
    corner = {"textures": "{0}/1", "normals": "{0}//1", "both": "{0}/1/1"}.get(style, "{0}")
    shift = -many if style == "negative" else 1
    lines = [b"# a rock \\", b"mtllib C:\\rocks\\"] if style == "continued" else [b"# a rock", b"o rock"]
    lines += [("v " + " ".join(f"{x:.17g}" for x in point)).encode() for point in points]
    lines += [b"vt 0 0", b"vn 0 0 1", b"usemtl grey", b"s off"]
    faces = [("f " + " ".join(corner.format(k + shift) for k in one)).encode() for one in polygons]
    if style == "objects":  # each face with points of its own, counted backwards from where it stands
        lines = []
        for one in polygons:
            lines += [b"o piece", *("v {:.17g} {:.17g} {:.17g}".format(*points[k]).encode() for k in one)]
            lines += [("f " + " ".join(str(k - len(one)) for k in range(len(one)))).encode()]
        faces = []
    lines += faces
    edits = {
        "tabs": lambda line: line.replace(b" ", b"\t"),
        "blanks": lambda line: b"  \t" + line.replace(b" ", b"   ") + b" ",
        "continued": lambda line: line.replace(b" ", b" \\\n", 2) if line[:2] in (b"v ", b"f ") else line,
        "comments": lambda line: line + b" # f 1 2 3",
        "colours": lambda line: line + b" 0.5 0.5 0.5" if line[:2] == b"v " else line,
    }
    end = {"windows": b"\r\n", "old mac": b"\r"}.get(style, b"\n")
    return end.join(map(edits.get(style, bytes), lines)) + (b"" if style == "no last line" else end)


def stl(points: np.ndarray, polygons: Polygons, style: str = "binary") -> bytes:
    corners = points[triangles(polygons)]
    if style == "binary":
        body = b"".join(struct.pack("<12fH", 0, 0, 0, *three.reshape(-1), 0) for three in corners)
        return b"solid but binary".ljust(80) + struct.pack("<I", len(corners)) + body
    facets = "".join(
        "  facet normal 0 0 0\n    outer loop\n"
        + "".join("      vertex {:.17g} {:.17g} {:.17g}\n".format(*point) for point in three)
        + "    endloop\n  endfacet\n"
        for three in corners
    )
    text = f"solid rock\n{facets}endsolid rock\n"
    edits = {"upper": text.upper(), "mixed": text.replace("endf", "EndF").replace("vertex", "Vertex")}
    return edits.get(style, text.replace("\n", "\r\n") if style == "windows" else text).encode()


def glb(header: object, data: bytes = b"") -> bytes:
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\x00") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf(
    points: np.ndarray, polygons: Polygons, *, index: str = "u2", mode: int = 4, stride: int = 12, real: str = "f4"
) -> tuple[dict[str, object], bytes]:
    """Header and buffer of a mesh in one node: triangles (4), or each polygon as a strip (5) or a fan (6)."""
    kinds = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126, "i2": 5122}
    table = np.zeros((len(points), stride), np.uint8)
    width = 3 * np.dtype(real).itemsize
    table[:, :width] = np.ascontiguousarray(points, dtype="<" + real).view(np.uint8).reshape(len(points), width)
    turn = {5: lambda one: (one[0], one[1], one[3], one[2])}.get(mode, tuple)
    runs = [triangles(polygons).reshape(-1)] if mode == 4 else [turn(one) for one in polygons]
    numbers = [np.array(run, "<" + index) for run in runs]
    starts = np.cumsum([table.size, *(run.nbytes for run in numbers)])
    data = table.tobytes() + b"".join(run.tobytes() for run in numbers)
    position = {"bufferView": 0, "componentType": kinds[real], "type": "VEC3", "count": len(points)}
    shown = [
        {"bufferView": 1, "byteOffset": int(at - table.size), "componentType": kinds[index], "type": "SCALAR"}
        | {"count": len(run)}
        for at, run in zip(starts, numbers, strict=False)
    ]
    header = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": table.size, "byteStride": stride},
            {"buffer": 0, "byteOffset": table.size, "byteLength": len(data) - table.size},
        ],
        "accessors": [position, *shown],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1 + k, "mode": mode} for k in range(len(runs))]}
        ],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    return header, data
