"""Whole impacts against figures obtained beforehand by another program.

Those come from sums over N = 20 000 elements and 0.5 s, without a stop at a rotation limit. The peak forces
and the times of maxima were read off at instants, so they may lie a little beside the true peak. Only the
printed impact arm depends noticeably on N: it contains half an element, 0.0006 deg on RWG at N = 20 000.
"""

from dataclasses import replace
from math import nan

import numpy as np
import pytest

from tests.oracle import ABG, AS_PRINTED, CORRECTED, RWG, Inputs, Readings, simulate
from tests.oracle.inputs import CORRECTED_NAMES
from tests.oracle.records import recorded_impact

# case, readings, max |theta| [deg], its time [s], max x_b [m], max x_v [m], peak F_v [kN], time of 20 deg [s]
ROWS = [
    pytest.param(ABG, AS_PRINTED, 114.258, 0.389, 1.6555, 2.0859, 776.55, 0.0795, id="ABG printed"),
    pytest.param(ABG, CORRECTED, 157.742, 0.407, 1.4096, 3.5016, 855.44, 0.0769, id="ABG corrected"),
    pytest.param(RWG, AS_PRINTED, 7.6946, 0.2369, 0.1505, 0.9209, 1079.79, nan, id="RWG printed"),
    pytest.param(RWG, CORRECTED, 13.7612, 0.3039, 0.2820, 1.3243, 1027.73, nan, id="RWG corrected"),
]

# one reading changed, max |theta| of RWG [deg]
FROM_PRINTED = {
    "inertia": 7.698,
    "impact_arm": 18.274,
    "contact": 8.156,
    "restoring": 7.395,
    "separation": 7.695,
}
FROM_CORRECTED = {
    "inertia": 16.160,
    "impact_arm": 6.772,
    "contact": 13.329,
    "restoring": 18.199,
    "separation": 14.235,
}


@pytest.mark.parametrize(("inputs", "readings", "theta", "t", "x_b", "x_v", "F_v", "t_20"), ROWS)
def test_crash_tests(
    inputs: Inputs,
    readings: Readings,
    theta: float,
    t: float,
    x_b: float,
    x_v: float,
    F_v: float,
    t_20: float,
) -> None:
    found = simulate(inputs, readings)
    of_elements = 6e-4 if readings == AS_PRINTED else 0.0
    assert np.degrees(found.max_rotation.value) == pytest.approx(theta, abs=6e-4 + of_elements)
    assert found.max_rotation.time == pytest.approx(t, abs=6e-4)
    assert found.max_displacement.value == pytest.approx(x_b, abs=6e-5)
    assert found.max_vehicle_displacement.value == pytest.approx(x_v, abs=6e-5)
    assert found.peak_force.value / 1e3 == pytest.approx(F_v, abs=0.03)
    assert found.time_of_rotation(np.radians(20.0)) == pytest.approx(t_20, abs=6e-5, nan_ok=True)


@pytest.mark.parametrize("switch", FROM_PRINTED)
def test_one_reading_from_printed(switch: str) -> None:
    found = recorded_impact(RWG, replace(AS_PRINTED, **{switch: CORRECTED_NAMES[switch]}))
    degrees = np.degrees(found.max_rotation.value)
    of_elements = 0.0 if switch == "impact_arm" else 6e-4
    assert degrees == pytest.approx(FROM_PRINTED[switch], abs=6e-4 + of_elements)


@pytest.mark.parametrize("switch", FROM_CORRECTED)
def test_one_reading_from_corrected(switch: str) -> None:
    found = recorded_impact(RWG, replace(CORRECTED, **{switch: "printed"}))
    assert np.degrees(found.max_rotation.value) == pytest.approx(FROM_CORRECTED[switch], abs=6e-4)


@pytest.mark.parametrize(
    ("elements", "theta"),
    [(None, 7.6940), (2000, 7.6997), (5000, 7.6963), (20000, 7.6946)],
)
def test_element_sums_of_the_printed_readings(elements: int | None, theta: float) -> None:
    found = recorded_impact(RWG, AS_PRINTED, elements=elements, rtol=1e-7, land_on_kinks=False)
    assert np.degrees(found.max_rotation.value) == pytest.approx(theta, abs=6e-5)


@pytest.mark.parametrize("switch", ["inertia", "contact", "separation"])
def test_one_reading_from_printed_by_element_sums(switch: str) -> None:
    """Those where the half element shows in the figures."""
    readings = replace(AS_PRINTED, **{switch: CORRECTED_NAMES[switch]})
    found = recorded_impact(RWG, readings, elements=20000, rtol=1e-6, land_on_kinks=False)
    assert np.degrees(found.max_rotation.value) == pytest.approx(FROM_PRINTED[switch], abs=6e-4)


def test_soil_density_of_the_text() -> None:
    """The tables have 1859.9 kg/m^3, the text 2010 kg/m^3: on RWG that is a degree."""
    found = recorded_impact(replace(RWG, rho_s=2010.0), CORRECTED)
    assert np.degrees(found.max_rotation.value) == pytest.approx(12.75, abs=6e-3)
