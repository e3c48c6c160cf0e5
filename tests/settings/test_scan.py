"""A boulder by its scan: as the block of settings that `sweep stone` prints, and mistakes with their places."""

import hashlib
import re
import shutil
from pathlib import Path

import pytest

from boulder_sweep.settings import SettingsError, load
from boulder_sweep.settings.loader import load_text
from boulder_sweep.stones.weighing import scanned
from tests.stones.files import ply, prism, regular

ROCK = Path(__file__).parents[2] / "docs" / "examples" / "rock.ply"
SCAN = "{file: rock.ply, up: a, facing: b}"
BOULDER = f"  scan: {SCAN}\n  mass: 23.5 t\n"


@pytest.fixture
def site(tmp_path, minimal):
    """Write a file whose boulder is a scan beside it, with some words replaced; return its path."""
    shutil.copy(ROCK, tmp_path / "rock.ply")
    sides = minimal[minimal.index("boulder:\n") : minimal.index("site:")]

    def write(*replaced: tuple[str, str]) -> Path:
        boulder = BOULDER
        for old, new in replaced:
            assert old in boulder
            boulder = boulder.replace(old, new)
        path = tmp_path / "grid.yaml"
        path.write_text(minimal.replace(sides, f"boulder:\n{boulder}\n"), encoding="utf-8")
        return path

    return write


def test_a_scan_is_its_profile_and_density(site):
    sweep = load(site())
    found = scanned(ROCK, mass_kg=23_500.0)
    own = found.stone.standing("a", "b")
    inputs = sweep.resolved()["inputs"]
    assert inputs["boulder_density_kg_m3"] == pytest.approx(found.density_kg_m3, rel=1e-15)
    assert inputs["boulder_height_m"] == pytest.approx(own.profile.height[-1], rel=1e-15)
    assert inputs["boulder_width_m"] == pytest.approx(own.profile.width.max(), rel=1e-15)
    volume = sweep.model.shape.filled
    for side in ("length", "width", "height"):
        volume *= inputs[f"boulder_{side}_m"]
    assert volume * inputs["boulder_density_kg_m3"] == pytest.approx(found.density_kg_m3 * own.volume, rel=1e-12)


def test_the_metadata_hold_the_scan(site):
    given = load(site()).resolved()["model"]["scan"]
    assert given["file"] == "rock.ply"
    assert given["sha256"] == hashlib.sha256(ROCK.read_bytes()).hexdigest()
    assert (given["up"], given["facing"]) == ("a", "b")
    assert given["cut_m"] == pytest.approx(0.25)


def test_a_density_in_place_of_the_mass_may_be_an_axis(site):
    assert load(site(("mass: 23.5 t", "density: [2500, 2600] kg/m^3"))).n_designs == 2


def test_what_makes_one_doubt_a_scan_is_a_note(site, tmp_path):
    """Coordinates that count from far away, in single precision: steps of 2 mm."""
    path = site()
    points, polygons = prism(regular(8, 0.8), 2.0)
    (tmp_path / "rock.ply").write_bytes(ply(points + 20_000.0, polygons, real="f4"))
    (note,) = [note for note in load(path).notes if note.key == "boulder.scan"]
    assert (note.line, "subtract a point near the stone" in note.message) == (2, True), note
    (tmp_path / "rock.ply").write_bytes(ply(points, polygons, real="f4"))
    assert not [note for note in load(path).notes if note.key == "boulder.scan"]


def test_a_unit(site, tmp_path):
    in_feet = load(site(("facing: b", "facing: b, unit: ft"), ("23.5 t", "0.66 t")))
    assert in_feet.resolved()["inputs"]["boulder_height_m"] < 1.2


@pytest.mark.parametrize(
    ("old", "new", "column", "words"),
    [
        (SCAN, "rock.ply", 9, r"must be a block, as in \{file: rock.ply, up: a, facing: b\}"),
        ("up: a, ", "", 9, "the scan lacks up"),
        ("up: a", "upp: a", 26, "'upp' is not a key of a scan .*; did you mean up"),
        ("facing: b", "facing: a", 9, "do not go together"),
        ("facing: b", "facing: q", 9, "'q' is no end of a stone"),
        ("rock.ply", "none.ply", 9, "none.ply: there is no such file"),
        ("facing: b", "facing: b, unit: kg", 9, "kg"),
        ("  mass: 23.5 t\n", "", 3, "give the mass of the whole stone, or its density: one of them"),
        ("mass: 23.5 t", "mass: 23.5 t\n  density: 2600 kg/m^3", 3, "one of them"),
        ("mass: 23.5 t", "mass: 23.5 t\n  height: 3 m", 3, "height follows from the scan; remove one of them"),
        ("mass: 23.5 t", "mass: [20 t, 23 t]", 9, "takes one value"),
    ],
)
def test_mistakes(site, old, new, column, words):
    path = site((old, new))
    with pytest.raises(SettingsError, match=words) as refused:
        load_text(path.read_text(encoding="utf-8"), path)
    assert all(problem.key == "boulder.scan" for problem in refused.value.problems)
    assert [p.column for p in refused.value.problems if re.search(words, str(p))] == [column]
