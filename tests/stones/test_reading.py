"""Scans as files: the four formats, units, and files that cannot be used."""

import json
import struct
from contextlib import suppress

import numpy as np
import pytest

from boulder_sweep.errors import ScanError
from boulder_sweep.stones import reading
from boulder_sweep.stones.reading import read_scan
from boulder_sweep.stones.solid import solid_of
from tests.stones.shapes import rock, sphere, written

KINDS = ("ply", "stl", "obj", "glb")


@pytest.fixture
def file(tmp_path):
    """Return a function that writes bytes or text to a file of a name."""

    def write(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def glb(header, data=b""):
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\x00") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_holds_the_same_stone(kind, tmp_path):
    surface = rock(1)
    found = read_scan(written(surface, tmp_path / f"rock.{kind}"))
    assert found.file == f"rock.{kind}"
    assert len(found.sha256) == 64
    own = solid_of(found)
    assert len(own.faces) == len(surface[1])
    whole = solid_of(reading.ScannedSurface("", "", *surface))
    assert own.volume == pytest.approx(whole.volume, rel=1e-6)
    np.testing.assert_allclose(own.centre, whole.centre, atol=1e-5)


def test_units(tmp_path):
    points, faces = rock(1)
    path = written((points * 1000.0, faces), tmp_path / "rock.ply")
    assert solid_of(read_scan(path, 1e-3)).volume == pytest.approx(
        solid_of(reading.ScannedSurface("", "", points, faces)).volume
    )
    with pytest.raises(ScanError, match=r"its largest side is 3\d\d\d m; .*; if the scan is in mm, add its unit: mm"):
        read_scan(path)


def test_a_pebble(tmp_path):
    path = written(sphere(0.01), tmp_path / "pebble.ply")
    with pytest.raises(ScanError, match=r"its largest side is 0.02 m; stones of 0.1 to 20 m are taken$"):
        read_scan(path)


def test_parts_of_a_scene_are_placed(tmp_path):
    """A GLB file whose node scales and moves the mesh."""
    import trimesh

    points, faces = sphere(1.0, 3)
    scene = trimesh.Scene()
    placing = np.diag([2.0, 2.0, 2.0, 1.0])
    placing[:3, 3] = (5.0, 0.0, 0.0)
    scene.add_geometry(trimesh.Trimesh(points, faces, process=False), transform=placing)
    scene.export(tmp_path / "rock.glb")
    own = solid_of(read_scan(tmp_path / "rock.glb"))
    assert own.volume == pytest.approx(8.0 * solid_of(reading.ScannedSurface("", "", points, faces)).volume, rel=1e-5)
    np.testing.assert_allclose(own.centre, (5.0, 0.0, 0.0), atol=1e-5)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("rock.xyz", "0 0 0", r"is not a scan that can be read; use one of \.ply, \.stl, \.obj, \.glb"),
        ("rock.ply", b"", "is empty"),
        ("rock.ply", "a rock", "the header of a PLY file is missing"),
        ("rock.ply", "ply\nformat ascii 1.0\nelement face many\nend_header\n", "is damaged or of another format"),
        ("rock.stl", "a rock", "the file ends early, or is no STL file"),
        ("rock.stl", b"\x00" * 84, "holds no faces"),
        ("rock.stl", b"\x00" * 80 + struct.pack("<I", 7) + b"\x00" * 60, "the file ends early, or is no STL file"),
        ("rock.obj", "a rock", "no faces"),
        ("rock.obj", b"v 0 0 0\n\x00\x00", "the file is no text"),
        ("rock.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "rock.obj: "),
        ("rock.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "coordinates that are no finite numbers"),
        ("rock.obj", "v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", "coordinates that are no finite numbers"),
        ("rock.glb", "a rock", "is damaged or of another format"),
        ("rock.glb", b"glTF" + b"\x00" * 40, "the header of a GLB file is missing"),
        ("rock.glb", glb([]), "is damaged or of another format"),
        ("rock.glb", glb({"buffers": [{"uri": "../secret.bin"}]}), "keeps its points in other files"),
        ("rock.glb", glb({"extensionsUsed": ["KHR_draco_mesh_compression"]}), "export it without compression"),
        ("rock.glb", glb({"nodes": [{"children": [1, 1]}, {}]}), "a node has two parents"),
        ("rock.glb", glb({"accessors": [{"count": -1}]}), "a count is negative"),
        ("rock.glb", glb({"accessors": [{"count": float("inf")}]}), "is damaged or of another format"),
        ("rock.glb", glb({"nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}], "scene": 0}), "rock.glb: "),
        ("rock.glb", glb({"accessors": [{"count": 10**12}]}), r"1,000,000,000,000 faces or points; at most"),
        ("rock.glb", glb({}), "no faces"),
    ],
)
def test_files_that_cannot_be_used(name, content, words, file):
    with pytest.raises(ScanError, match=words) as refusal:
        read_scan(file(name, content))
    assert str(refusal.value).count("\n") == 0


def test_nodes_in_a_circle(tmp_path):
    """A mesh whose node is its own child, and two nodes that are each other's."""
    data = written(rock(1, finer=1), tmp_path / "rock.glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    header = json.loads(data[20 : 20 + length])
    binary = data[20 + length + 8 :]
    for nodes in ([{"mesh": 0, "children": [0]}], [{"mesh": 0, "children": [1]}, {"children": [0]}]):
        (tmp_path / "rock.glb").write_bytes(glb(header | {"nodes": nodes, "scenes": [{"nodes": [0]}]}, binary))
        with suppress(ScanError):
            assert solid_of(read_scan(tmp_path / "rock.glb")).volume > 0.0


def test_points_without_faces(file):
    text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    with pytest.raises(ScanError, match="holds no faces; export the scan as a mesh, not as points"):
        read_scan(file("rock.ply", text + "0 0 0\n1 1 1\n"))


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


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("huge.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 8\nelement face 10000000\nend_header\n"),
        ("huge.ply", "ply\nformat ascii 1.0\nelement vertex 10000000\nelement face 8\nend_header\n"),
        ("huge.obj", "\nf 1 2 3" * 30),
        ("huge.obj", "\nv 1 2 3" * 30),
        ("huge.stl", "solid x\n" + "facet\nendfacet\n" * 30),
        ("huge.stl", b"\x00" * 80 + struct.pack("<I", 30) + b"\x00" * 1500),
    ],
)
def test_more_faces_than_are_read(name, content, file, monkeypatch):
    """Told from the header, or by counting, before trimesh is asked."""
    monkeypatch.setattr(reading, "MAX_FACES", 20)
    monkeypatch.setattr(reading, "_loaded", None)
    with pytest.raises(ScanError, match=r"has (30|10,000,000) faces or points; at most 20 are read: reduce it first"):
        read_scan(file(name, content))


def test_meshes_placed_many_times(file, monkeypatch):
    monkeypatch.setattr(reading, "MAX_FACES", 20)
    header = {
        "accessors": [{"count": 60}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}, {"mesh": 0}],
    }
    with pytest.raises(ScanError, match="has 40 faces or points"):
        read_scan(file("huge.glb", glb(header)))


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
    monkeypatch.setattr("trimesh.resolvers.FilePathResolver.get", lambda self, name: opened.append(name))
    assert solid_of(read_scan(path)).volume == pytest.approx(1.0 / 6.0)
    assert opened == []


def test_without_trimesh(file, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(
        ScanError, match=r"scans need trimesh, which is not installed: pip install 'boulder-sweep\[scan\]'"
    ):
        read_scan(file("rock.ply", "ply"))
