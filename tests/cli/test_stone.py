"""``sweep stone``: what a scan says, as lines, as an object and as a picture; what is refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from boulder_sweep import load
from boulder_sweep.answers.placing import boulder_block, placed
from boulder_sweep.cli.stone import placing_lines
from boulder_sweep.stones.weighing import scanned
from tests.answers.designs import bare_need
from tests.stones.shapes import box, frustum, sphere, written

ROOT = Path(__file__).parents[2]
ROCK, SITE_FILE = ROOT / "docs" / "examples" / "rock.ply", ROOT / "configs" / "site.yaml"


@pytest.fixture
def block(tmp_path, monkeypatch):
    """Work in an empty folder with the scan of a block of 1.2 by 1.6 by 2.5 m."""
    monkeypatch.chdir(tmp_path)
    return written(box(1.2, 1.6, 2.5), Path("block.ply"))


def test_a_block(sweep, block):
    code, out, err = sweep("stone", block, "--mass", "12.48 t")
    assert (code, err) == (0, "")
    assert "block.ply: 12 faces, closed as it is" in out
    assert "volume      4.800 m³" in out
    assert "mass        12.48 t as given, 2,600 kg/m³" in out
    assert "sides       a 2.50, b 1.60, c 1.20 m" in out
    assert "solidity    1.00 of that box, 1.00 of the convex hull" in out
    assert "inertia     4.16, 8.00, 9.16 t·m² about a, b, c" in out
    assert re.search(r"^ a +±b +2\.50 +1\.60 +1\.20 +1\.60 × 1\.20 +0\.00 +0\.0% +100% +0\.000$", out, re.MULTILINE)
    assert len(re.findall(r"^ ?-?[abc] +±[abc] ", out, re.MULTILINE)) == 12
    assert "rounded" not in out
    assert max(map(len, out.splitlines())) <= 80


def test_a_slab_scanned_where_it_lies(sweep, block):
    """Its base is more than a quarter of the surface, and the flat foot on which it stands."""
    points, faces = box(3.0, 2.2, 1.1)
    points = points * np.where(points[:, 2:] > 0.0, (0.94, 0.95, 1.0), 1.0)
    below = (points[faces][:, :, 2] < 0.0).all(axis=1)
    whole, found = (
        sweep("stone", written((points, kept), Path(name)), "--mass", "18 t")
        for name, kept in (("whole.ply", faces), ("slab.ply", faces[~below]))
    )
    assert "  repaired    underside closed by a flat lid, 28 % of the surface, over 17 % of the volume\n" in found[1]
    assert found[1].split("\n", 2)[2] == whole[1].split("\n", 1)[1]
    assert re.search(r"^ c +±a +1\.10 +3\.00 +2\.20 +3\.00 × 2\.20 +0\.00 +0\.0% +100%", found[1], re.MULTILINE)
    assert (whole[0], whole[2], found[0]) == (0, "", 0)
    assert found[2].startswith("caution: 17% of its volume lies over what was added to close it: what the boulder has")
    assert found[2].count("caution") == 1
    assert json.loads(sweep("stone", "slab.ply", "--json")[1])["base_share"] == pytest.approx(0.28, abs=0.005)


def test_without_a_mass_its_density_is_assumed(sweep, block):
    _, out, err = sweep("stone", block)
    assert "mass        12.72 t, if its density is 2,650 kg/m³; weigh it and give --mass" in out
    assert err == ""


def test_a_mass_that_no_rock_has(sweep, block):
    code, _, err = sweep("stone", block, "--mass", "30 t")
    assert code == 0
    assert err.startswith("caution: its density is 6,250 kg/m³, and rock has 2,000 to 3,300: the mass, the scale of")


def test_a_block_of_settings(sweep, block):
    written(frustum(1.0, 0.5, 2.0, sides=400), Path("cone.stl"))
    _, out, _ = sweep("stone", "cone.stl", "--mass", "9.6 t", "--up", "z", "--facing", "x")
    _, head, text = out.partition("# cone.stl: z up, x to the vehicle")
    assert head
    found = YAML(typ="safe").load(text)
    side = np.sqrt(np.pi)
    assert found["boulder"]["mass"] == "9.600 t"
    assert found["boulder"]["profile"] == [
        {"height": "0.000 m", "width": f"{side:.3f} m", "near": f"{side / 2:.3f} m", "far": f"{side / 2:.3f} m"},
        {"height": "2.000 m", "width": f"{side / 2:.3f} m", "near": f"{side / 4:.3f} m", "far": f"{side / 4:.3f} m"},
    ]
    assert "foot" not in found["boulder"]


def test_a_block_of_settings_says_what_is_cut_off(sweep, block):
    written(sphere(1.0, 4), Path("ball.obj"))
    _, out, _ = sweep("stone", "ball.obj", "--mass", "11 t", "--up", "a", "--facing", "-b")
    cut = re.search(r"# ball.obj: a up, -b to the vehicle, (.*) m cut off for a foot\nboulder:\n  mass: (.*) t\n", out)
    assert float(cut[1]) == pytest.approx(1.0 - np.sqrt(0.75), abs=0.011)
    cap = 0.25 * float(cut[1]) ** 2 * (3.0 - float(cut[1]))
    assert float(cut[2]) == pytest.approx(11.0 * (1.0 - cap), abs=0.02)


def test_a_foot_that_is_rounded(sweep, block):
    written(frustum(0.02, 1.0, 3.0), Path("cone.stl"))
    _, out, _ = sweep("stone", "cone.stl", "--up", "z", "--facing", "x")
    assert out.rstrip().endswith("  foot: rounded")
    _, out, _ = sweep("stone", "cone.stl")
    assert "rounded: no cut of a quarter of the height makes a foot; bed it in concrete" in out


def test_as_one_object(sweep, block):
    code, out, _ = sweep("stone", ROCK, "--mass", "24 t", "--json")
    assert code == 0
    found = json.loads(out)
    assert found["mass_kg"] == pytest.approx(24000.0)
    assert found["sha256"] == scanned(ROCK).sha256
    assert len(found["standings"]) == 24
    one = json.loads(sweep("stone", ROCK, "--mass", "24 t", "--json", "--up", "-a", "--facing", "c")[1])
    assert one["standings"] == [own for own in found["standings"] if (own["up"], own["facing"]) == ("-a", "c")]
    assert one["standings"][0]["profile"][0]["height_m"] == 0.0


def test_a_picture(sweep, block):
    assert sweep("stone", ROCK, "--plot", "rock.png")[0] == 0
    assert Path("rock.png").read_bytes().startswith(b"\x89PNG")


@pytest.fixture(scope="module")
def placed_at_a_site():
    """Place the example at the site of the configs, in one soil, with three of its ends up."""
    found = scanned(ROCK, mass_kg=23_500.0)
    ways = tuple(found.stone.standing(*way) for way in (("a", "b"), ("-a", "-c"), ("c", "b")))
    return placed(found, lambda boulder: load(SITE_FILE, [boulder, "soil.friction_angle=40 deg"]), ways)


def test_a_stone_at_a_site_is_asked_for_its_least_depth(placed_at_a_site):
    """Every depth is that which `need` finds for the block of settings of that way."""
    found = placed_at_a_site
    assert len(found.ways) + found.rounded == 3
    assert len(found.passing) == 2
    depths = [way.depth_m for way in found.passing]
    assert depths == sorted(depths)
    for way in found.passing:
        sweep = load(SITE_FILE, [boulder_block(found.found, way.standing), "soil.friction_angle=40 deg"])
        assert bare_need(sweep).arrow["least_embedment_depth_m"].to_pylist() == [way.depth_m]


def test_the_block_of_the_best_way_is_taken(placed_at_a_site, sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "\n".join(placing_lines(placed_at_a_site, str(tmp_path / "rock.ply"), "m", str(tmp_path / "site.yaml")))
    assert "at " in text
    (tmp_path / "rock.ply").write_bytes(ROCK.read_bytes())
    site = SITE_FILE.read_text(encoding="utf-8").replace("[36, 40] deg", "40 deg")
    before, after = site.index("boulder:"), site.index("soil:")
    block = text[text.index("boulder:") :]
    (tmp_path / "site.yaml").write_text(site[:before] + block + "\n\n" + site[after:], encoding="utf-8")
    code, out, err = sweep("simulate", "site.yaml", "--json")
    assert code == 0, err
    assert json.loads(out)["verdict"] == "pass"


def placed_way(up, facing, *changes):
    """Place the example one way in one soil, with changes to the site of the configs; the placing and its lines."""
    found = scanned(ROCK, mass_kg=23_500.0)
    way = (found.stone.standing(up, facing),)
    placing = placed(found, lambda boulder: load(SITE_FILE, [boulder, "soil.friction_angle=40 deg", *changes]), way)
    return placing, "\n".join(placing_lines(placing, str(ROCK), "m", str(SITE_FILE)))


def test_a_depth_between_two_that_fail_is_never_recommended():
    """Lying on its broad side the stone passes 0.65 m deep by sliding, and overturns at 0.8 m."""
    placing, text = placed_way("c", "a")
    (way,) = placing.ways
    assert (way.depth_m, way.row["found"], way.row["verdict"]) == (None, "not_monotone", None)
    stretches = [tuple(map(float, one.split(" to "))) for one in way.row["passes_within"].split(", ")]
    assert any(low <= 0.65 <= high for low, high in stretches)
    assert not any(low <= 0.8 <= high for low, high in stretches)
    assert "there is no depth from which on it passes\n1 way to stand: it passes at some depths, and fails at" in text
    assert "boulder:" not in text


def test_the_end_of_the_search_is_not_called_the_least_depth():
    placing, text = placed_way("c", "a", "vehicle.speed=5 mph")
    (way,) = placing.ways
    assert way.row["found"] == "always"
    assert f" ≤{way.depth_m:.3f} " in text
    assert "\n≤: passes from the least depth tried on; a lesser one may do\n" in text
    assert "least depth" not in text.replace("least depth tried", "")


def test_a_stone_that_the_truck_goes_over_says_so():
    placing, text = placed_way("a", "b", "criterion.min_overlap=1.5 m")
    assert placing.passing == []
    assert "1 way to stand: it fails down to where the truck would pass or ride over it" in text


def test_what_is_recommended_in_uncertain_soil_passes_when_it_is_pasted(sweep, tmp_path):
    site = SITE_FILE.read_text(encoding="utf-8").replace("[36, 40] deg", "{mean: 38 deg, sd: 2 deg}")
    (tmp_path / "site.yaml").write_text(site, encoding="utf-8")
    (tmp_path / "rock.ply").write_bytes(ROCK.read_bytes())
    words = ("stone", tmp_path / "rock.ply", tmp_path / "site.yaml", "--mass", "23.5 t", "--up", "a", "--facing", "b")
    code, text, _ = sweep(*words, "-q")
    assert code == 0
    before, after = site.index("boulder:"), site.index("soil:")
    pasted = site[:before] + text[text.index("boulder:") :] + "\n" + site[after:]
    (tmp_path / "site.yaml").write_text(pasted, encoding="utf-8")
    code, out, err = sweep("simulate", tmp_path / "site.yaml", "--json")
    assert (code, json.loads(out)["verdict"]) == (0, "pass"), err
