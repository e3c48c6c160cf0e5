"""Layers, water table, cohesion and slope in a settings file: what is read, and what is refused, and where."""

import pytest

from boulder_sweep.cli.console import grid_lines
from boulder_sweep.settings import SettingsError, load
from boulder_sweep.settings.model import Ground, Layer

FILE = """\
boulder: {length: 1.65 m, width: 1.98 m, height: 3.05 m, density: 2596}
site: {embedment_depth: 1.9 m}
soil:
  density: 1860
  friction_angle: [38 deg, 43 deg]
  subgrade_reaction: 60
WHAT
vehicle: {mass: 6800 kg, speed: 50 km/h, spring: 3103 kN/m, damper: 138.9 kN*s/m}
"""
DEEPER = "{from: 0.5 m, density: 2 t/m^3, friction_angle: 36 deg, subgrade_reaction: 40000 kN/m^3, cohesion: 2 kPa}"


def loaded(tmp_path, *lines: str):
    path = tmp_path / "ground.yaml"
    path.write_text(FILE.replace("WHAT", "\n".join(f"  {line}" for line in lines)))
    return load(path)


def test_what_is_read(tmp_path) -> None:
    sweep = loaded(tmp_path, f"layers: [{DEEPER}]", "cohesion: 4000 Pa", "water_table: 80 cm", "slope: 0.1 rad")
    ground = sweep.model.ground
    assert ground.layers == (Layer(0.5, 2000.0, 36.0, 40.0, 2.0),)
    assert (ground.cohesion_kPa, ground.water_table_m) == (4.0, 0.8)
    assert ground.slope_deg == pytest.approx(5.7296, abs=1e-4)
    assert sweep.n_designs == 2
    words = (
        "2 layers of soil, cohesion 4 / 2 kPa, water table 0.8 m down, ground falling by 5.72958° behind the boulder"
    )
    assert grid_lines(sweep)[-1] == f"  {words}"
    assert Ground.of_dict(sweep.resolved()["model"]["ground"]) == ground


@pytest.mark.parametrize(
    ("line", "where", "message"),
    [
        ("layers: []", "7:11", "must be a list of 1 to 100 layers"),
        ("layers: loose", "7:11", "must be a list of 1 to 100 layers"),
        ("layers: [5]", "7:12", "a layer must be a block of keys"),
        (f"layers: [{DEEPER}, {DEEPER}]", "7:119", "begins at 0.5 m, not below the layer before it (0.5 m)"),
        (f"layers: [{DEEPER.replace('density: 2 t/m^3, ', '')}]", "7:12", "the layer lacks density"),
        (f"layers: [{DEEPER.replace('cohesion', 'cohesoin')}]", "7:101", "is not a key of a layer"),
        (f"layers: [{DEEPER.replace('2 kPa', '2 kg')}]", "7:111", "'kg' is a mass; a pressure is needed"),
        (f"layers: [{DEEPER.replace('36 deg', '{mean: 36, cov: 0.1}')}]", "7:60", "takes one value here"),
        (f"layers: [{DEEPER.replace('0.5 m', '0 m')}]", "7:19", "outside the admitted range"),
        ("cohesion: [2, 4]", "7:13", "takes one value here, not a list or a range"),
        ("water_table: -1 m", "7:16", "outside the admitted range"),
        ("slope: 38 deg", "7:3", "must be less than every friction angle (the least is 38 deg)"),
    ],
)
def test_what_is_refused(tmp_path, line: str, where: str, message: str) -> None:
    with pytest.raises(SettingsError) as refused:
        loaded(tmp_path, line)
    (problem,) = refused.value.problems
    assert message in problem.message
    assert f"{problem.line}:{problem.column}" == where


def test_the_slope_is_held_against_design_values_and_layers(tmp_path) -> None:
    """36 deg in the layer; a factor of 1.25 leaves 30.2 deg."""
    path = tmp_path / "ground.yaml"
    path.write_text(FILE.replace("WHAT", f"  layers: [{DEEPER}]\n  slope: 33 deg"))
    assert load(path).model.slope_deg == 33.0
    with pytest.raises(SettingsError, match=r"the least is 30\.17 deg"):
        load(path, ("partial_factor.friction_angle=1.25",))


@pytest.mark.parametrize(("water", "floats"), [("0.2 m", True), ("0.6 m", False)])
def test_soil_that_floats(tmp_path, water: str, floats: bool) -> None:
    """Only soil below the water table must be heavier than water."""
    path = tmp_path / "ground.yaml"
    path.write_text(FILE.replace("1860", "960").replace("WHAT", f"  layers: [{DEEPER}]\n  water_table: {water}"))
    if floats:
        with pytest.raises(SettingsError, match=r"soil of 960 kg/m\^3 would float"):
            load(path)
    else:
        assert load(path).model.water_table_m == 0.6


def test_named_soils_have_none_of_their_own(tmp_path) -> None:
    path = tmp_path / "ground.yaml"
    soils = "soil: [{name: a, density: 1860, friction_angle: 38, subgrade_reaction: 60, slope: 5 deg}]"
    path.write_text(
        "\n".join(
            line if not line.startswith("soil") else soils for line in FILE.splitlines()[:3] + FILE.splitlines()[-1:]
        )
    )
    with pytest.raises(SettingsError, match="is not a key of soil in a named set: it is one for all designs of a file"):
        load(path)
