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
    assert sand.hatanaka_uchida(n1_60) == pytest.approx(math.sqrt(20.0 * n1) + 20.0, abs=0.02)
    assert pytest.approx(15.4, abs=0.02) == 20.0 * 0.6 / 0.78


def test_a_blow_count_of_ufc_by_hand():
    """UFC 3-220-10, Eq 8-6, at (N1)60 = 20: sqrt(308) + 20 = 37.55 deg."""
    assert sand.hatanaka_uchida(20.0) == pytest.approx(37.55, abs=0.005)


@pytest.mark.parametrize(("n1_60", "angle"), [(15.0, 31.48), (25.0, 34.3), (10.0, 30.046), (60.0, 43.156)])
def test_wolff_by_the_figures_of_others(n1_60, angle):
    """The tests of the libraries geolysis (15 blows) and groundhog (25), and two by hand."""
    assert sand.wolff(n1_60) == pytest.approx(angle, abs=0.05)


@pytest.mark.parametrize(("n", "angle"), [(10.0, 30.0), (30.0, 36.0), (50.0, 41.0)])
def test_wolff_by_the_table_that_he_fitted(n, angle):
    """Peck, Hanson and Thornburn (1974): medium sand 10 to 30 blows and 30 to 36 deg, dense 30 to 50 and 36 to 41."""
    assert sand.wolff(n) == pytest.approx(angle, abs=0.4)


def test_two_correlations_for_the_same_count():
    """N 22 at 60 % and 1.5 m, (N1)60 28.05: 40.8 deg and 35.1 deg; without the stress Wolff's fit would give 31.9."""
    count = sand.normalized_blow_count(22.0, 0.6, 1.5, sand.vertical_stress(1.5, None))
    angles = sand.angles_by_blow_count(count)
    assert list(angles) == ["Hatanaka and Uchida 1996", "Wolff 1989"]
    assert list(angles.values()) == pytest.approx([40.784, 35.090], abs=0.001)
    assert sand.wolff(count / 1.7) == pytest.approx(31.903, abs=0.001)


@pytest.mark.parametrize(("n1_60", "lowest"), [(4.55, "Hatanaka and Uchida 1996"), (39.0, "Wolff 1989")])
def test_neither_correlation_is_the_lower_one_everywhere(n1_60, lowest):
    angles = sand.angles_by_blow_count(n1_60)
    assert min(angles, key=angles.get) == lowest


def test_cones_by_the_line_of_the_source():
    """At one atmosphere of stress 100 atmospheres of resistance are two decades: 17.6 + 22 deg; a tenth is 11 less."""
    assert sand.kulhawy_mayne(10.1325, 101.325) == pytest.approx(39.6)
    assert sand.kulhawy_mayne(20.265, 101.325) == pytest.approx(39.6 + 11.0 * math.log10(2.0))
    assert sand.kulhawy_mayne(10.1325, 2.0 * 101.325) == pytest.approx(39.6 - 5.5 * math.log10(2.0))


@pytest.mark.parametrize("ratio", [20.0, 50.0, 100.0, 200.0])
def test_robertson_and_campanella_by_their_other_form(ratio):
    """The form before it was rounded otherwise, arctan(0.1 + 0.38 lg(q_c / sigma')), as quoted by others."""
    other = math.degrees(math.atan(0.1 + 0.38 * math.log10(ratio)))
    assert sand.robertson_campanella(0.1 * ratio, 100.0) == pytest.approx(other, abs=0.25)


def test_robertson_and_campanella_by_hand():
    """At 100 times the stress: arctan(2.29 / 2.68) = 40.51 deg."""
    assert sand.robertson_campanella(10.0, 100.0) == pytest.approx(40.513, abs=0.001)


def test_near_the_surface_both_correlations_for_cones_count_with_the_same_stress():
    limit = sand.ATMOSPHERE_KPA / 1.7**2
    for angle in sand.BY_CONE.values():
        assert angle(9.0, 5.0) == angle(9.0, 0.999 * limit) == pytest.approx(angle(9.0, limit))
        assert angle(9.0, 2.0 * limit) < angle(9.0, limit)


@pytest.mark.parametrize(
    ("depth", "lowest"), [(1.5, "Kulhawy and Mayne 1990"), (10.0, "Robertson and Campanella 1983")]
)
def test_the_lower_correlation_for_cones_depends_on_the_depth(depth, lowest):
    angles = sand.angles_by_cone(9.0, sand.vertical_stress(depth, None))
    assert min(angles, key=angles.get) == lowest


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
    """Moist unit weights of loose, medium and dense sand are the table's; very dense sand takes those for dense."""
    assert [density / 16.018463 for density in sand.densities(angle)] == pytest.approx(pcf, rel=1e-6)


def test_the_table_is_below_the_rule_of_bowles():
    """Bowles (1996), Table 3-4, has about 28 + 15 D_r +- 2 deg; the table taken is nowhere more than 0.25 deg above."""
    for percent in range(15, 86):
        ratio = percent / 100.0
        assert sand.angle_by_relative_density(ratio) <= 28.0 + 15.0 * ratio + 0.25


def test_stress_normalization():
    assert sand.stress_factor(101.325) == 1.0
    assert sand.stress_factor(4.0 * 101.325) == 0.5
    assert sand.stress_factor(25.0) == sand.stress_factor(0.0) == 1.7  # 2.01 and infinite without the limit
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
        (sand.angles_by_blow_count, (4.5,), r"\(N1\)60 is 4\.5; the correlation holds from 4\.55 to 39"),
        (sand.angles_by_blow_count, (39.1,), "holds from"),
        (sand.angles_by_blow_count, (math.nan,), "holds from"),
        (sand.angles_by_cone, (0.0, 20.0), "needs more than 0"),
        (sand.angles_by_cone, (0.7, 20.0), "is 29.* deg; the correlation holds from 30 to 46 deg"),
        (sand.angles_by_cone, (60.0, 20.0), "holds from 30 to 46"),
        (sand.angles_by_cone, (3.0, 230.0), "is 27.* deg; the correlation holds from 30 to 46 deg"),
        (sand.angle_by_relative_density, (0.14,), "relative density is 0.14; the correlation holds from 0.15 to 0.85"),
        (sand.angle_by_relative_density, (0.9,), "holds from"),
    ],
)
def test_outside_the_range_is_refused(correlation, values, words):
    with pytest.raises(OutsideError, match=words):
        correlation(*values)


@pytest.mark.parametrize(
    ("correlation", "above", "below"),
    [
        (sand.angles_by_blow_count, (39.1,), (4.5,)),
        (sand.angles_by_cone, (60.0, 20.0), (0.7, 20.0)),
        (sand.angle_by_relative_density, (0.9,), (0.1,)),
    ],
)
def test_too_strong_is_told_from_too_weak(correlation, above, below):
    with pytest.raises(sand.AboveError):
        correlation(*above)
    with pytest.raises(OutsideError) as caught:
        correlation(*below)
    assert not isinstance(caught.value, sand.AboveError)


def test_the_ends_of_the_ranges_are_the_strongest_angles():
    assert sand.STRONGEST["spt"] == pytest.approx(sand.angles_by_blow_count(39.0))
    assert set(sand.STRONGEST["cpt"].values()) == {46.0}
    assert sand.STRONGEST["cpt"].keys() == sand.BY_CONE.keys()


def test_more_stress_and_shorter_rods_never_make_stronger_sand():
    for stress in (10.0, 30.0, 60.0, 120.0):
        for angle in sand.BY_CONE.values():
            assert angle(9.0, 1.1 * stress) <= angle(9.0, stress)
        assert sand.normalized_blow_count(20, 0.6, 3.0, 1.1 * stress) <= sand.normalized_blow_count(
            20, 0.6, 3.0, stress
        )
    assert sand.normalized_blow_count(20, 0.6, 3.0, 50.0) <= sand.normalized_blow_count(20, 0.6, 5.0, 50.0)
