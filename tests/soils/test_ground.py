"""Soils as they lie: pressures against the oracle, whole sweeps, what folds into one factor, and the energy ledger."""

from dataclasses import replace
from math import inf, radians
from pathlib import Path

import numpy as np
import pytest

import boulder_sweep
from boulder_kernels import DesignTable, simulate_table
from boulder_kernels.ground import put_soil, slope_factor
from boulder_kernels.pieces import PiecewiseTable, table_in_layers
from boulder_sweep.impact.history import soil_profile
from boulder_sweep.impact.recomputing import recompute
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import evaluation_of
from boulder_sweep.judge.inputs import sampled_designs
from boulder_sweep.settings.model import RESISTANCES, Ground, Layer
from boulder_sweep.soils import SLICES, ground_of, with_soil
from tests import oracle
from tests.oracle import ground as by_hand

LAYERS = (Layer(0.5, 2000.0, 36.0, 40.0, 2.0), Layer(1.2, 2100.0, 40.0, 80.0))
GROUND = Ground(LAYERS, cohesion_kPa=4.0, water_table_m=0.8, slope_deg=10.0)
IN_FILE = (
    "soil.layers=[{from: 0.5 m, density: 2000, friction_angle: 36 deg, subgrade_reaction: 40, cohesion: 2 kPa}, "
    "{from: 120 cm, density: 2.1 t/m^3, friction_angle: 40, subgrade_reaction: 80 MN/m^3}]",
    "soil.cohesion=4 kPa",
    "soil.water_table=0.8 m",
    "soil.slope=10 deg",
)
UNITS = (("m", 1.0), ("kPa", 1.0))


def table_of(phi_deg: float = 42.0) -> DesignTable:
    inputs = replace(oracle.RWG, phi=radians(phi_deg))
    values = {name: getattr(inputs, name, 0.5) for name in DesignTable._fields}
    return DesignTable(**{name: np.array([value]) for name, value in values.items()})


def layers_of(table: DesignTable, law: str, ground: Ground, count: int) -> np.ndarray:
    """Return the layers of one design, also where the pressure is proportional to depth."""
    layers = np.empty((1, count, 6))
    put_soil(table, ground_of(law, ground), True, SLICES, np.empty((0, 4)), layers, np.empty((1, 0, 4)))
    return layers


def oracle_ground(table: DesignTable, ground: Ground) -> oracle.inputs.Ground:
    top = oracle.inputs.Layer(0.0, table.rho_s[0], table.phi[0], table.beta[0], 1e3 * ground.cohesion_kPa)
    below = (
        oracle.inputs.Layer(
            layer.from_m,
            layer.density_kg_m3,
            radians(layer.friction_angle_deg),
            layer.subgrade_reaction_MN_m3,
            1e3 * layer.cohesion_kPa,
        )
        for layer in ground.layers
    )
    water = inf if ground.water_table_m is None else ground.water_table_m
    return oracle.inputs.Ground((top, *below), water, radians(ground.slope_deg))


@pytest.mark.parametrize("law", RESISTANCES)
@pytest.mark.parametrize("water_m", [None, 0.0, 0.5, 0.8, 5.0])
def test_pressures_are_those_of_the_oracle(law: str, water_m: float | None) -> None:
    """By every law, with the water in, at a boundary of, above and below the layers (Eqs 105 to 107)."""
    table, ground = table_of(), replace(GROUND, water_table_m=water_m)
    inputs = replace(oracle.RWG, phi=table.phi[0], resistance=law)
    layers = with_soil(table, law, ground).layers[0]
    known = oracle_ground(table, ground)
    for depth in (0.0, 0.1, 0.49, 0.51, 0.79, 0.81, 1.19, 1.21, 1.9):
        row = layers[np.searchsorted(layers[:, 0], depth, side="right")]
        found = row[4] + row[5] * depth
        assert found == pytest.approx(by_hand.ultimate_pressure(inputs, known, depth) / inputs.K_epsilon, rel=1e-9)
        layer = oracle.inputs.layer_at(known, depth)
        np.testing.assert_allclose(row[1:4], (layer.rho_s, layer.phi, layer.beta))


@pytest.mark.parametrize("slope_deg", [0.0, 5.0, 20.0, 29.0])
def test_slope_is_coulombs_weakest_wedge(slope_deg: float) -> None:
    """The closed form against the weakest of all plane wedges (Eq 107)."""
    for phi_deg in (30.0, 40.0, 47.0):
        found = slope_factor(radians(phi_deg), radians(slope_deg))
        assert found == pytest.approx(by_hand.slope_factor(radians(phi_deg), radians(slope_deg)), rel=1e-9)
    assert slope_factor(radians(40.0), radians(20.0)) == pytest.approx(0.4787, abs=1e-4)


@pytest.mark.parametrize("law", RESISTANCES)
@pytest.mark.parametrize("ground", [Ground(slope_deg=15.0), Ground(water_table_m=0.0), Ground((), 0.0, 0.0, 8.0)])
def test_what_is_proportional_to_depth_is_a_factor(law: str, ground: Ground) -> None:
    """The lanes with a factor on the strength, and the layers with the pressures themselves: one result."""
    table = table_of()
    folded = with_soil(table, law, ground)
    assert isinstance(folded, DesignTable)
    evaluation = evaluation_of(
        boulder_sweep.load("configs/rwg.yaml"), accuracy_of(boulder_sweep.load("configs/rwg.yaml"))
    )
    layered = table_in_layers(table, layers_of(table, law, ground, 1))
    one, other = (simulate_table(some, evaluation.readings, evaluation.control) for some in (folded, layered))
    assert one.status == other.status
    np.testing.assert_allclose(one[1:6], other[1:6], rtol=1e-8)


def test_usual_ground_changes_nothing() -> None:
    """The very same table, for which the lanes are compiled."""
    table = table_of()
    assert with_soil(table, "kp_squared", Ground()) is table
    assert boulder_sweep.load("configs/rwg.yaml").model.ground.is_usual
    assert "ground" not in boulder_sweep.load("configs/rwg.yaml").resolved()["model"]


def test_settings_become_layers() -> None:
    """Units, and the uppermost layer from the entries that every soil has."""
    sweep = boulder_sweep.load("configs/rwg.yaml", IN_FILE)
    assert sweep.model.ground == GROUND
    assert Ground.of_dict(sweep.resolved()["model"]["ground"]) == GROUND
    table = sampled_designs(sweep, 1).table
    assert isinstance(table, PiecewiseTable)
    assert table.layers.shape == (1, 4, 6)
    np.testing.assert_allclose(table.layers[0, :, 0], (0.5, 0.8, 1.2, inf))
    factored = boulder_sweep.load("configs/rwg.yaml", (*IN_FILE, "partial_factor.friction_angle=1.25"))
    assert np.tan(np.radians(36.0)) / 1.25 == pytest.approx(
        np.tan(np.radians(factored.model.layers[0].friction_angle_deg))
    )


def check_layers(folder: Path, name: str, *more: str) -> None:
    """Run and simulate a layered soil, and compute the row again."""
    sweep = boulder_sweep.load("configs/rwg.yaml", (*IN_FILE, *more))
    boulder_sweep.run(sweep, folder / name)
    found = recompute(folder / name, 0)
    assert found.unequal == ()
    assert "3 layers of soil, cohesion 4 / 2 / 0 kPa" in found.sweep.model.ground.words_in(*UNITS)
    history = boulder_sweep.simulate(sweep)
    assert history.summary()["max_rotation_deg"] >= found.stored["max_rotation_deg"]
    assert history.energy().largest_residual < 1e-6
    _, forces = soil_profile(history.motion, 100, 4000)
    assert forces.sum() == pytest.approx(history.soil_force_N[100], rel=2e-2)


def test_a_run_and_its_row_computed_again_agree(tmp_path: Path) -> None:
    """To the last bit; and the energy of the truck is all accounted for."""
    check_layers(tmp_path, "layers")


@pytest.mark.nightly  # compiles kernels of its own
def test_a_run_and_its_row_computed_again_agree_by_elements(tmp_path: Path) -> None:
    check_layers(tmp_path, "elements", "model.soil={elements: 60}")
    weaker = boulder_sweep.simulate(boulder_sweep.load("configs/rwg.yaml", IN_FILE)).summary()["max_rotation_deg"]
    assert weaker > boulder_sweep.simulate("configs/rwg.yaml").summary()["max_rotation_deg"]
