from pathlib import Path

import pytest

GRID = """\
name: small grid
boulder: {length: 1.65 m, width: 1.68 m, height: [1.6, 2.6, 3.5] m, density: 2596 kg/m^3}
site: {embedment_depth: [0.9, 1.8, 2.6] m}
soil: {density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: [60, 95] MN/m^3}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
"""


@pytest.fixture
def grid(tmp_path, monkeypatch):
    """Work in an empty folder with a file of 18 designs: some pass, some fail, six are impossible."""
    monkeypatch.chdir(tmp_path)
    path = Path("grid.yaml")
    path.write_text(GRID)
    return path


@pytest.fixture
def possible_grid(grid):
    """Work with 18 designs that are all possible; over some of them the truck passes without a touch."""
    grid.write_text(GRID.replace("[0.9, 1.8, 2.6]", "[0.8, 1.2, 1.5]"))
    return grid
