"""Questions about a vehicle whose front stiffens: the second spring is an input as any other."""

import pytest

from boulder_sweep import load, need, uncertainty

pytestmark = pytest.mark.slow  # compiles kernels of its own
STAGES = "vehicle.spring=[{stiffness: 3103.3 kN/m}, {beyond: 0.5 m, stiffness: %s}]"


def test_the_least_depth_depends_on_it() -> None:
    alone = need(load("configs/rwg.yaml"))
    stiff = need(load("configs/rwg.yaml", [STAGES % "9 MN/m"]))
    assert stiff.frame.passes_at[0] < alone.frame.passes_at[0] - 0.02
    assert stiff.frame.vehicle_second_spring_N_m[0] == 9e6


def test_it_may_be_uncertain_and_what_decides() -> None:
    spread = ["vehicle.second_spring={distribution: uniform, low: 3.2 MN/m, high: 30 MN/m}", "vehicle.speed=14.9 m/s"]
    found = uncertainty(load("configs/rwg.yaml", [STAGES % "9 MN/m", "site.embedment_depth=1.75 m", *spread]))
    row = found.frame.iloc[0]
    assert row.p_pass_driver == "vehicle.second_spring"
    assert 0.0 <= row.p_pass_low <= row.p_pass <= row.p_pass_high <= 1.0
    fixed = load("configs/rwg.yaml", [STAGES % "9 MN/m", "vehicle.mass={mean: 6722 kg, cov: 5 %}"])
    assert uncertainty(fixed).frame.vehicle_second_spring_N_m[0] == 9e6
