"""Scans as files: the four formats, units, and files that cannot be used."""

import re
import struct
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from boulder_sweep.errors import ScanError
from boulder_sweep.stones import reading
from boulder_sweep.stones.reading import read_scan
from boulder_sweep.stones.solid import solid_of
from boulder_sweep.stones.weighing import scanned
from tests.stones.files import BOX, glb, gltf, obj, ply, prism, regular, stl
from tests.stones.shapes import rock, sphere, written

KINDS = ("ply", "stl", "obj", "glb")
SCANS = Path(__file__).parent / "scans"


@pytest.fixture
def file(tmp_path):
    """Return a function that writes bytes or text to a file of a name."""

    def write(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


ASCII = "format ascii 1.0\n"
FACET = "facet\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 3 0\nendloop\nendfacet\n"
ANGLE = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (0.5, 0.5), (0.5, 1.5), (0.0, 1.5)])
"""The rim of an angle, not convex, of 1.5 m^2."""
SOLIDS = {
    "box": (*BOX, 4.8),
    "hexagons": (*prism(regular(6, 0.8), 1.5), 1.5 * 1.5 * np.sqrt(3.0) * 0.64),
    "frustum": (*prism(regular(9, 1.0), 2.0, 0.5), 2.0 / 3.0 * 1.75 * 4.5 * np.sin(np.pi / 4.5)),
    "many corners": (*prism(regular(300, 1.0), 1.0), 150.0 * np.sin(np.pi / 150.0)),
    "angle": (*prism(ANGLE, 2.0), 3.0),
}
"""Points, polygons and volume."""


def placed_gltf(node, *, real="f4", index="u1", nodes=()):
    """Return a GLB of the box in a node that is placed."""
    header, data = gltf(*BOX, index=index, real=real)
    return glb(header | {"nodes": [{"mesh": 0} | node, *nodes], "scenes": [{"nodes": [len(nodes)]}]}, data)


def crumbs(count):
    """Return the box in many bodies: itself, and small boxes beside it."""
    points, faces = BOX
    bodies = [points, *(0.01 * points + (9.0, k, 0.0) for k in range(count))]
    return np.concatenate(bodies), [tuple(8 * k + j for j in one) for k in range(len(bodies)) for one in faces]


STYLES = ("plain", "tabs", "blanks", "comments", "colours", "windows", "negative", "objects", "textures")
STYLES += ("normals", "both", "no last line")
WAYS = [
    *(("ply", {"order": order}) for order in "<>"),
    ("ply", {"order": ""}),
    *(("ply", {"order": order, "more": True, "real": "f4", "number": "u4"}) for order in ("<", ">", "")),
    *(("ply", {"order": order, "count": "i4", "number": "u2"}) for order in "<>"),
    *(("ply", {"order": order, "line": "\r\n"}) for order in ("<", ">", "")),
    *(("obj", {"style": style}) for style in STYLES),
    *(("stl", {"style": style}) for style in ("binary", "text", "upper", "mixed", "windows")),
    *(("glb", {"index": index, "stride": stride}) for index, stride in (("u2", 12), ("u4", 12), ("u2", 32))),
]
"""Formats and the ways to write them."""


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize(
    ("kind", "way"), WAYS, ids=[f"{kind}-{'-'.join(map(repr, way.values()))}" for kind, way in WAYS]
)
def test_volumes_are_those_of_formulas(kind, way, name, file):
    points, polygons, volume = SOLIDS[name]
    if way.get("count", "u1") == "u1" and name == "many corners" and kind == "ply":
        way = way | {"count": "u2"}  # more corners than a byte counts
    write = {"ply": ply, "obj": obj, "stl": stl, "glb": lambda *surface, **more: glb(*gltf(*surface, **more))}[kind]
    scan = read_scan(file(f"rock.{kind}", write(points, polygons, **way)))
    triangles = sum(len(one) - 2 for one in polygons)
    assert len(scan.faces) == triangles
    if kind != "stl" and way.get("style") != "objects":
        assert len(scan.vertices) == len(points)
    own = solid_of(scan)
    assert own.repairs == ()
    assert own.volume == pytest.approx(volume, rel=1e-6)


TURN = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]


@pytest.mark.parametrize(
    ("content", "volume"),
    [
        (placed_gltf({"scale": [1.0, 2.0, 0.5], "rotation": TURN, "translation": [9.0, 9.0, 9.0]}), 4.8),
        (placed_gltf({"scale": [-1.0, 1.0, 1.5]}), 7.2),
        (placed_gltf({"matrix": [0, 1, 0, 0, -2, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]}), 9.6),
        (placed_gltf({}, nodes=[{"camera": 0, "children": [0], "scale": [2, 2, 2]}]), 8.0 * 4.8),
        (placed_gltf({}, nodes=[{"scale": [1, 1, 3], "children": [0]}, {"children": [1]}]), 14.4),
        (placed_gltf({}, nodes=[{}]), 0.0),
        (glb(*gltf(*BOX, mode=5)), 4.8),
        (glb(*gltf(1e3 * BOX[0], BOX[1], real="i2")), 4.8e9),
    ],
    ids=[
        *("scaled and turned", "mirrored", "matrix", "under a camera", "a chain", "not in the scene", "strips"),
        "whole numbers",
    ],
)
def test_nodes_place_their_meshes(content, volume, file):
    path = file("rock.glb", content)
    if not volume:
        with pytest.raises(ScanError, match="holds no faces"):
            read_scan(path)
        return
    metres = 1e-3 if volume > 1e9 else 1.0
    own = solid_of(read_scan(path, metres))
    assert own.repairs == ()
    assert own.volume == pytest.approx(volume * metres**3, rel=1e-6)


def test_a_stone_of_two_meshes(file):
    """The six sides of a box, three each in two meshes, one of which is moved by its node."""
    points, polygons = BOX
    header, data = gltf(points, polygons, mode=5)
    pieces = header["meshes"][0]["primitives"]
    header |= {
        "meshes": [{"primitives": pieces[:3]}, {"primitives": pieces[3:]}],
        "nodes": [
            {"mesh": 0, "translation": [1, 0, 0]},
            {"children": [2], "translation": [2, 0, 0]},
            {"mesh": 1, "translation": [-1, 0, 0]},
        ],
        "scenes": [{"nodes": [0, 1]}],
    }
    own = solid_of(read_scan(file("rock.glb", glb(header, data))))
    assert (own.volume, own.repairs) == (pytest.approx(4.8, rel=1e-6), ())


@pytest.mark.parametrize("write", [ply, stl, obj, lambda *surface: glb(*gltf(*surface))], ids=KINDS)
def test_bodies_beside_the_stone(write, file, request):
    kind = request.node.callspec.id
    own = solid_of(read_scan(file(f"rock.{kind}", write(*crumbs(5)))))
    assert own.repairs == ("5 bodies beside the boulder left out",)
    assert own.volume == pytest.approx(4.8, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "volume"), [("polygons.ply", None), ("triangles_and_quads.ply", None), ("tab.obj", 1 / 6)]
)
def test_scans_as_other_programs_write_them(name, volume):
    if volume is None:
        with pytest.raises(
            ScanError, match=r"lists of several lengths, such as triangles beside polygons; export it as"
        ):
            read_scan(SCANS / name)
        return
    own = solid_of(read_scan(SCANS / name))
    assert (own.volume, own.repairs) == (pytest.approx(volume, rel=1e-6), ())


MAP = np.array([88860.0, 667130.0, 30.0])


@pytest.mark.parametrize(
    ("name", "write", "coarse"),
    [
        ("rock.ply", lambda points, faces: ply(points + MAP, faces), False),
        ("rock.ply", lambda points, faces: ply(points, faces, real="f4"), False),
        ("rock.ply", lambda points, faces: ply(points + MAP, faces, real="f4"), True),
        ("rock.ply", lambda points, faces: ply((points + MAP).astype("f4"), faces), True),
        ("rock.ply", lambda points, faces: ply((points + MAP).astype("f4"), faces, order=""), True),
        ("rock.obj", lambda points, faces: obj(points + MAP, faces), False),
        ("rock.obj", lambda points, faces: obj((points + MAP).astype("f4"), faces), True),
        ("rock.stl", lambda points, faces: stl(points + MAP, faces), True),
        ("rock.stl", lambda points, faces: stl(points + MAP, faces, "text"), False),
        ("rock.glb", lambda points, faces: glb(*gltf(points + MAP, faces)), True),
        ("rock.glb", lambda points, faces: glb(*gltf(points, faces)), False),
    ],
)
def test_coordinates_that_are_coarse(name, write, coarse, file):
    cautions = scanned(file(name, write(*sphere(1.0, 3)))).cautions
    assert len(cautions) == coarse
    if coarse:
        assert cautions[0].startswith("the numbers in which it keeps its coordinates lie 62.5 mm apart, so far from")
        assert cautions[0].endswith("subtract a point near the boulder from all coordinates before you export them")


def test_coordinates_too_coarse_for_a_stone(file):
    points, faces = sphere(1.0, 3)
    path = file("rock.ply", ply(points + 10.0 * MAP, faces, real="f4"))
    with pytest.raises(ScanError, match=r"coordinates lie 500 mm apart, .*, too far for a boulder; subtract a point"):
        scanned(path)


def test_a_node_far_from_the_origin_does_not_make_coordinates_coarse(file):
    assert not scanned(file("rock.glb", placed_gltf({"translation": MAP.tolist()}))).cautions
    step = read_scan(file("rock.glb", placed_gltf({"scale": [0.1, 0.1, 0.2]}, real="i2"))).step_m
    assert step == pytest.approx(0.2)  # of whole numbers, one, in the direction in which the node stretches it most


MISREAD = r"\d+% of its surface was added to close holes: if the scan has no such"
INTO_GROUND = r"\d+% of its volume lies over what was added to close it: what the boulder has beyond, in the ground"


@pytest.mark.parametrize(
    ("polygons", "said"),
    [
        (BOX[1], []),
        (BOX[1][:5], [INTO_GROUND]),
        (BOX[1][:4], [MISREAD, INTO_GROUND]),
        (prism(regular(48, 0.5), 2.0, top=2.0)[1][1:], []),
    ],
    ids=["closed", "base", "base and a hole", "narrow base"],
)
def test_a_wide_hole_may_be_a_misread_file(polygons, said, file):
    points = BOX[0] if len(polygons) < 7 else prism(regular(48, 0.5), 2.0, top=2.0)[0]
    cautions = scanned(file("rock.ply", ply(points, polygons))).cautions
    assert len(cautions) == len(said)
    assert all(map(re.match, said, cautions))


def test_units(tmp_path):
    points, faces = rock(1)
    path = written((points * 1000.0, faces), tmp_path / "rock.ply")
    assert solid_of(read_scan(path, 1e-3)).volume == pytest.approx(
        solid_of(reading.ScannedSurface("", "", points, faces)).volume
    )
    with pytest.raises(ScanError, match=r"its largest side is 3\d\d\d m; .*; if the scan is in mm, add its unit: mm"):
        read_scan(path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("rock.xyz", "0 0 0", r"is not a scan that can be read; use one of \.ply, \.stl, \.obj, \.glb"),
        ("rock.ply", b"", "is empty"),
        ("rock.ply", "a rock", "the header of a PLY file is missing"),
        ("rock.ply", "ply\nformat ascii 1.0\ncomment end_header\n", "the header of a PLY file is missing"),
        *(
            ("rock.ply", f"ply\n{form}{line}\nend_header\n", words)
            for form, line, words in (
                *(
                    (ASCII, line, "is damaged: its header holds 'e")
                    for line in ("element face many", "element face -1")
                ),
                (ASCII, "surface", "its header holds 'surface'"),
                *((ASCII, f"element {name} 1", "is damaged, or no PLY file") for name in ("face", "tristrips")),
                (ASCII, "element vertex 2", "is damaged: it has other lines than the 2 that its header counts"),
                (ASCII, "element vertex 1\nproperty float x\nproperty float x", "header holds 'property float x'"),
                ("", "element vertex 1\nproperty float x", "is damaged, or no PLY file that is read"),
            )
        ),
        ("rock.ply", ply(*BOX) + b"\x00", "it goes on for 1 bytes after what its header counts"),
        ("rock.ply", ply(*BOX)[:-1], "it ends before what its header counts"),
        ("rock.ply", ply(*BOX, line="\r"), "the header of a PLY file is missing"),
        ("rock.ply", ply(*BOX, order="") + b"4 0 1 2 3\n", "it has other lines than the 14 that its header counts"),
        ("rock.ply", ply(*BOX, order="")[:-10], "line 24: is damaged: it is no face as the header describes it"),
        ("rock.ply", ply(*BOX, order="")[:-20], "is damaged"),
        ("rock.ply", ply(*BOX, order="")[:-4] + b"\n", "line 24: is damaged: it is no face as the header describes it"),
        ("rock.ply", ply(*BOX, order="")[:-4] + b" 3 9\n", "a face names a point that is not there"),
        ("rock.ply", ply(*BOX, order="").replace(b"0 0 2.5", b"0 0 2,5"), "is damaged, or no PLY file"),
        (
            "rock.ply",
            ply(*BOX).replace(struct.pack("<Biiii", 4, 2, 3, 7, 6), struct.pack("<Biiii", 5, 2, 3, 7, 6)),
            "several",
        ),
        # Four, three and five corners take as many bytes as three times four.
        (
            "rock.ply",
            ply(*BOX, count="i4")[:-60] + np.array([4, 0, 1, 3, 2, 3, 4, 6, 7, 5, *range(5)], "<i4").tobytes(),
            "several",
        ),
        ("rock.ply", ply(BOX[0], [(0, 1)]), "holds no faces; export the scan as a mesh, not as points"),
        *(("rock.ply", ply(BOX[0], [(0, 1, k)]), "a face names a point that is not there") for k in (8, -1)),
        ("rock.stl", b"\x00" * 84, "holds no faces"),
        *(
            ("rock.stl", content, "it ends early, or is no STL file")
            for content in ("a rock", b"\x00" * 80 + struct.pack("<I", 7) + b"\x00" * 60, stl(*BOX, style="text")[:-14])
        ),
        *(
            ("rock.stl", f"solid\n{FACET.replace(old, new)}{FACET}endsolid", "1 of its [123] facets have three corners")
            for old, new in (
                *(("2 0 0", word) for word in ("2 0", "2 0 0 0", "2 0 zero", "2,0 0 0", "2 0 0\nvertex 1 1 1")),
                *(("vertex 2 0 0\n", ""), ("endloop", ""), ("vertex 2", "rock 2")),
            )
        ),
        ("rock.stl", f"solid\n{FACET.replace('endfacet', 'endfacer')}{FACET}endsolid", "1 of its 1 facets have three"),
        ("rock.stl", "solid\nrock\nendsolid", "holds no faces"),
        ("rock.obj", "# a rock", "holds no faces"),
        *(
            ("rock.obj", f"v 0 0 0\nv 1 0 0\n{line}\nf 1 2 3\n", f"line 3: {words}")
            for line, words in (
                ("a rock", r"is 'a rock', which is not read; export it as binary PLY"),
                *(
                    (line, "is '.*', which is not read")
                    for line in ("\x00\x00", "v 0 1", "f 1 2", "f 1 1.5 2", "f 1 \\\n1 2")
                ),
                *((f"f 1 2 {k}", "names a point that is not there") for k in (-3, 0)),
            )
        ),
        *(
            ("rock.obj", f"v 0 0 0\nv 1 0 0\nv 0 {y} 0\nf 1 2 {k}\n", words)
            for y, k, words in (
                *(("1", k, "is damaged, or no OBJ file that is read") for k in ("9", "3" * 30)),
                *((y, "3", f"line 3: is 'v 0 {y} 0', which") for y in ("1,5", "one", "0x1", "nan", "inf", "1-e5")),
                ("1e999", "3", "coordinates that are no finite numbers"),
            )
        ),
        ("rock.obj", obj(*BOX, style="continued"), "which is not read"),
        *(
            ("rock.obj", one, "ends its lines in another way")
            for one in (obj(*BOX, style="old mac"), "v 0 1 0\rf 1 2 3")
        ),
        ("rock.glb", "a rock", "is damaged, or no GLB file"),
        ("rock.glb", b"glTF" + b"\x00" * 40, "the header of a GLB file .* is missing"),
        ("rock.glb", glb({}) + b"\x00", "its header says 32 bytes, and it has 33"),
        ("rock.glb", glb([]), "is damaged, or no GLB file"),
        ("rock.glb", glb(*gltf(*BOX, mode=6)), "holds fans of triangles, which are not read; export it as binary PLY"),
        (
            "rock.glb",
            glb({"nodes": [{}] * 1001, "scenes": [{"nodes": [*range(1001)]}]}),
            "has 1,001 nodes; at most 1,000",
        ),
        ("rock.glb", glb({"buffers": [{"uri": "../secret.bin"}]}), "keeps its points in other files"),
        ("rock.glb", glb({"nodes": [{"children": [1, 1]}, {}]}), "a node has two parents"),
        ("rock.glb", glb({"nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}], "scene": 0}), "two parents"),
        ("rock.glb", glb({}), "holds no faces"),
    ],
)
def test_files_that_cannot_be_used(name, content, words, file):
    with pytest.raises(ScanError, match=words) as refusal:
        read_scan(file(name, content))
    assert str(refusal.value).count("\n") == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        *(
            (change, "holds points that are sparse, compressed or missing, .*; export it as binary PLY")
            for change in ({"sparse": {"count": 1}}, {"bufferView": None}, {"count": -1}, {"byteOffset": -4})
        ),
        *((change, "has normalized coordinates, .*, or with") for change in ({"normalized": True}, {"type": "VEC2"})),
        ({"count": 10**12}, r"1,000,000,000,036 faces or points; at most"),
        ({"count": float("inf")}, "inf faces or points; at most"),
        ({"count": 5}, "a face names a point that is not there"),
        *(
            (change, "is damaged, or no GLB file")
            for change in ({"count": 9}, {"componentType": 5130}, {"count": "8"}, {"bufferView": 9})
        ),
    ],
)
def test_points_of_a_glb_that_are_not_read(change, words, file):
    header, data = gltf(*BOX)
    first = {key: value for key, value in (header["accessors"][0] | change).items() if value is not None}
    with pytest.raises(ScanError, match=words):
        read_scan(file("rock.glb", glb(header | {"accessors": [first, *header["accessors"][1:]]}, data)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"extensionsRequired": ["EXT_meshopt_compression"]},
            r"uses 'EXT_meshopt_compression', which is not read; expo",
        ),
        ({"extensionsRequired": ["X_unheard\n"]}, r"uses 'X_unheard\\n', which is not read; export it as binary PLY"),
        ({"extensionsUsed": ["KHR_draco_mesh_compression"]}, "uses 'KHR_draco_mesh_compression', which is not read"),
        ({"extensionsUsed": ["EXT_mesh_gpu_instancing"]}, "uses 'EXT_mesh_gpu_instancing', which is not read"),
        (
            {"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}]}]},
            r"has morph targets \(shape keys\), .*; apply them and export it as binary PLY",
        ),
        ({"skins": [{"joints": [0]}]}, "has a skin, .*; apply the pose and export it as binary PLY"),
        ({"extensionsRequired": ["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"]}, None),
        ({"extensionsUsed": ["X_unheard"], "skins": []}, None),
    ],
)
def test_what_a_glb_may_use(change, words, file):
    header, data = gltf(*BOX)
    path = file("rock.glb", glb(header | change, data))
    if words is None:
        assert solid_of(read_scan(path)).volume == pytest.approx(4.8, rel=1e-6)
        return
    with pytest.raises(ScanError, match=words):
        read_scan(path)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("share", [0.02, 0.5, 0.99])
def test_truncated_files(kind, share, tmp_path):
    """Refused, or, where a text ends with its last faces, an open surface that is closed again."""
    path = written(rock(1), tmp_path / f"rock.{kind}")
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    if (kind, share) == ("obj", 0.99):
        assert "hole" in solid_of(read_scan(path)).repairs[0]
        return
    with pytest.raises(ScanError, match=rf"rock\.{kind}: "):
        solid_of(read_scan(path))


@pytest.mark.parametrize("kind", KINDS)
def test_flipped_bytes_give_an_answer_or_a_refusal(kind, tmp_path):
    path = written(rock(1, finer=2), tmp_path / f"rock.{kind}")
    data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    random = np.random.default_rng(7)
    answers = 0
    for _ in range(40):
        wrong = data.copy()
        wrong[random.integers(len(wrong), size=random.integers(1, 9))] = random.integers(256)
        path.write_bytes(wrong.tobytes())
        with suppress(ScanError):
            answers += solid_of(read_scan(path)).volume > 0.0
    assert answers > 0


HEAD = "ply\nformat {}\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n"
HEAD += "property list int int vertex_indices\nend_header\n"
HUGE_MESH = {
    "accessors": [{"bufferView": 0, "count": 60, "type": "VEC3", "componentType": 5126}],
    "bufferViews": [{"buffer": 0, "byteLength": 720}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
}


@pytest.mark.parametrize(
    ("name", "content", "found"),
    [
        ("huge.ply", HEAD.format("binary_little_endian 1.0", 8, 10**7), "10,000,000"),
        ("huge.ply", HEAD.format("ascii 1.0", 10**7, 8), "10,000,000"),
        ("huge.ply", HEAD.format("ascii 1.0", 10**7, 8).replace("format", "comment xend_header\nformat"), "10,000,000"),
        ("huge.ply", HEAD.format("ascii 1.0", 1, 1) + "0 0 0\n32" + " 0" * 32, "30"),
        ("huge.ply", ply(BOX[0], [[0] * 32]), "30"),
        ("huge.ply", ply(BOX[0], [[0] * 80]), "78"),
        ("huge.obj", "\nv 1 2 3\nf" + " 1" * 32, "30"),
        ("huge.obj", "v 1 2 3" + "\nf 1 1 1" * 30, "21"),
        ("huge.obj", "\nv 1 2 3" * 30, "21"),
        ("huge.stl", "solid x\n" + ("facet\n" + "vertex 0 0 0\n" * 3 + "EndFacet\n") * 30, "30"),
        ("huge.stl", b"\x00" * 80 + struct.pack("<I", 30) + b"\x00" * 1500, "30"),
        ("huge.glb", glb(HUGE_MESH | {"nodes": [{"mesh": 0}] * 2}, b"\x00" * 720), "40"),
        ("huge.glb", glb(*gltf(*crumbs(1))), "24"),
    ],
)
def test_more_faces_than_are_read(name, content, found, file, monkeypatch):
    monkeypatch.setattr(reading, "MAX_FACES", 20)
    with pytest.raises(ScanError, match=rf"has {found} faces or points; at most 20 are read: reduce it first"):
        read_scan(file(name, content))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("huge.stl", stl(*BOX, style="text"), "has 12 facets as text; at most 11 are read; export it as binary PLY"),
        ("huge.obj", "\n" * 40, r"has 40 lines; at most 30 are read: reduce it first"),
        ("huge.obj", "v 1 2 3\nf" + " 1" * 60, r"line 2: is longer than 100 bytes; export it as binary PLY"),
        (
            "huge.glb",
            glb({"asset": "a" * 100}),
            r"describes its surface in 116 bytes; at most 100 are read: export it as",
        ),
    ],
)
def test_texts_larger_than_are_read(name, content, words, file, monkeypatch):
    monkeypatch.setattr(reading, "MAX_LINES", 30)
    monkeypatch.setattr(reading, "MAX_LINE_BYTES", 100)
    monkeypatch.setattr(reading, "MAX_JSON_BYTES", 100)
    monkeypatch.setattr(reading, "MAX_TEXT_FACETS", 11)
    with pytest.raises(ScanError, match=words):
        read_scan(file(name, content))


def test_files_that_are_too_large_are_not_read(tmp_path):
    path = tmp_path / "huge.ply"
    with path.open("wb") as sparse:
        sparse.truncate(reading.MAX_BYTES + 1)
    with pytest.raises(ScanError, match=r"has 400 MB; at most 400 MB are read: reduce it first"):
        read_scan(path)


def test_places_that_are_no_files(tmp_path):
    with pytest.raises(ScanError, match="there is no such file"):
        read_scan(tmp_path / "none.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(ScanError, match="is not a regular file"):
        read_scan(tmp_path / "folder.ply")


def test_nothing_that_a_scan_names_is_opened(file, monkeypatch):
    file("stone.mtl", "newmtl a\nmap_Kd picture.png\n")
    text = "mtllib stone.mtl\nusemtl a\n" + "".join(
        f"v {x} {y} {z}\n" for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    )
    path = file("rock.obj", text + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    opened = []
    sys.addaudithook(lambda event, entries: opened.append(str(entries[0])) if event == "open" else None)
    assert read_scan(path).faces.shape == (4, 3)
    assert [Path(name).name for name in opened if str(path.parent) in name] == ["rock.obj"]


def test_without_trimesh(file, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(
        ScanError,
        match=r"scans need trimesh, which is not installed: in a clone .* pip install '.\[scan\]'",
    ):
        read_scan(file("rock.ply", "ply"))
