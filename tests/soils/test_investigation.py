"""Sand by what an investigation measures: against figures of the sources, and outside of what they hold for."""

from __future__ import annotations

import math

import pytest

from boulder_sweep import investigation as sand
from boulder_sweep.investigation import OutsideError


@pytest.mark.parametrize("n1", [3.5, 10.0, 20.0, 30.0])
def test_blow_counts_by_the_line_of_the_source(n1):
    """Hatanaka and Uchida have sqrt(20 N1) + 20 with their own hammers, of 78 %; UFC 3-220-10 has 15.4 = 20 x 60/78."""
    n1_60 = n1 * 0.78 / 0.6
    assert sand.angle_by_blow_count(n1_60) == pytest.approx(math.sqrt(20.0 * n1) + 20.0, abs=0.02)
    assert pytest.approx(15.4, abs=0.02) == 20.0 * 0.6 / 0.78


def test_a_blow_count_of_ufc_by_hand():
    """UFC 3-220-10, Eq 8-6, at (N1)60 = 20: sqrt(308) + 20 = 37.55 deg."""
    assert sand.angle_by_blow_count(20.0) == pytest.approx(37.55, abs=0.005)


def test_cones_by_the_line_of_the_source():
    """At one atmosphere of stress 100 atmospheres of resistance are two decades: 17.6 + 22 deg; a tenth is 11 less."""
    assert sand.angle_by_cone(10.1325, 101.325) == pytest.approx(39.6)
    assert sand.angle_by_cone(20.265, 101.325) - sand.angle_by_cone(10.1325, 101.325) == pytest.approx(
        11.0 * math.log10(2.0)
    )
    assert sand.angle_by_cone(10.1325, 2.0 * 101.325) == pytest.approx(39.6 - 5.5 * math.log10(2.0))


@pytest.mark.parametrize(
    ("ratio", "angle"), [(0.15, 28.0), (0.35, 30.0), (0.65, 36.0), (0.85, 41.0), (0.5, 33.0), (0.75, 38.5)]
)
def test_relative_density_by_the_table_of_the_source(ratio, angle):
    """EM 1110-2-2504, Table 3-1: loose 16 to 35 % and 28 to 30 deg, medium to 65 % and 36 deg, dense to 85 % and 41."""
    assert sand.angle_by_relative_density(ratio) == pytest.approx(angle)


@pytest.mark.parametrize(
    ("angle", "pcf"), [(29.0, (95, 125)), (30.0, (95, 125)), (33.0, (110, 130)), (38.0, (110, 140)), (44.0, (110, 140))]
)
def test_densities_by_the_table_of_the_source(angle, pcf):
    """The same table: moist unit weights of loose, medium and dense sand; of very dense sand those of dense one."""
    assert [density / 16.018463 for density in sand.densities(angle)] == pytest.approx(pcf, rel=1e-6)


def test_the_table_is_below_the_rule_of_bowles():
    """Bowles (1996), Table 3-4, has about 28 + 15 D_r +- 2 deg; the table taken is nowhere more than 0.25 deg above."""
    for percent in range(15, 86):
        ratio = percent / 100.0
        assert sand.angle_by_relative_density(ratio) <= 28.0 + 15.0 * ratio + 0.25


def test_stress_normalization():
    assert sand.stress_factor(101.325) == 1.0
    assert sand.stress_factor(4.0 * 101.325) == 0.5
    assert sand.stress_factor(25.0) == 1.7  # 2.01 without the limit
    assert sand.vertical_stress(2.0, 2000.0) == pytest.approx(39.2266)
    assert sand.vertical_stress(2.0, None) > sand.vertical_stress(2.0, 2240.0)


def test_a_raw_blow_count_by_hand():
    """N 28 at 60 % and 1.5 m, 33 kPa: 28 x 1 x 0.75 x 1.7 = 35.7."""
    stress = sand.vertical_stress(1.5, None)
    assert stress == pytest.approx(140.0 * 16.018463 * 9.80665 * 1.5 / 1000.0, rel=1e-6)
    assert sand.normalized_blow_count(28.0, 0.6, 1.5, stress) == pytest.approx(35.7)
    assert sand.normalized_blow_count(20.0, 0.78, 12.0, 101.325) == pytest.approx(26.0)
    assert [sand.rod_factor(length) for length in (1.5, 4.0, 5.0, 8.0, 15.0)] == [0.75, 0.75, 0.85, 0.95, 1.0]


@pytest.mark.parametrize(
    ("correlation", "values", "words"),
    [
        (sand.angle_by_blow_count, (4.5,), r"\(N1\)60 is 4\.5; the correlation holds from 4\.55 to 39"),
        (sand.angle_by_blow_count, (39.1,), "holds from"),
        (sand.angle_by_blow_count, (math.nan,), "holds from"),
        (sand.angle_by_cone, (0.7, 20.0), "is 29.* deg; the correlation holds from 30 to 46 deg"),
        (sand.angle_by_cone, (60.0, 20.0), "holds from 30 to 46"),
        (sand.angle_by_relative_density, (0.14,), "relative density is 0.14; the correlation holds from 0.15 to 0.85"),
        (sand.angle_by_relative_density, (0.9,), "holds from"),
    ],
)
def test_outside_the_range_is_refused(correlation, values, words):
    with pytest.raises(OutsideError, match=words):
        correlation(*values)


def test_more_stress_and_shorter_rods_never_make_stronger_sand():
    for stress in (10.0, 30.0, 60.0, 120.0):
        assert sand.angle_by_cone(9.0, 1.1 * stress) <= sand.angle_by_cone(9.0, stress)
        assert sand.normalized_blow_count(20, 0.6, 3.0, 1.1 * stress) <= sand.normalized_blow_count(
            20, 0.6, 3.0, stress
        )
    assert sand.normalized_blow_count(20, 0.6, 3.0, 50.0) <= sand.normalized_blow_count(20, 0.6, 5.0, 50.0)
