"""Two results laid side by side: designs matched by inputs, verdicts that changed, what differs."""

import numpy as np
import pytest

import boulder_sweep
from boulder_sweep.errors import ReportError
from boulder_sweep.report.comparison import compare
from tests.report.conftest import GRID, SETS


@pytest.fixture(scope="module")
def slower(tmp_path_factory):
    """Result of the same grid in another order of axes, with one height less, one more, and a printed arm."""
    folder = tmp_path_factory.mktemp("slower")
    other = GRID.replace("width: [1.5, 1.9] m", "width: [1.9, 1.5] m").replace("2.0 m, to: 3.6 m", "2.2 m, to: 3.8 m")
    (folder / "grid.yaml").write_text(other)
    sweep = boulder_sweep.load(folder / "grid.yaml", ["model.readings={preset: corrected, impact_arm: printed}"])
    boulder_sweep.run(sweep, folder / "out")
    return folder / "out"


def test_a_result_does_not_differ_from_itself(result):
    found = compare(result, result)
    assert (len(found.matched), found.only_before, found.only_after, len(found.flipped)) == (252, 0, 0, 0)
    assert found.changed == ()
    assert found.least["mass_kg"][0] == found.least["mass_kg"][1]


def test_designs_are_matched_wherever_they_stand(result, slower):
    found = compare(result, slower)
    assert (len(found.matched), found.only_before, found.only_after) == (224, 28, 28)
    before, after = boulder_sweep.read(result), boulder_sweep.read(slower)
    for row in found.matched.itertuples():
        one, other = before.loc[row.design_id_before], after.loc[row.design_id_after]
        assert (one.verdict, other.verdict) == (row.verdict_before, row.verdict_after)
        assert one.boulder_width_m == other.boulder_width_m
        assert one.embedment_depth_m == pytest.approx(other.embedment_depth_m, rel=1e-11)


def test_every_change_is_counted_with_its_reason(result, slower):
    found = compare(result, slower)
    differ = found.matched[found.matched.verdict_before != found.matched.verdict_after]
    assert len(differ) > 10
    assert sum(found.flips().values()) == len(differ) == len(found.flipped)
    saved = (differ.verdict_before == "fail") & (differ.verdict_after == "pass")
    assert found.flips()["fail (overturns) -> pass"] == saved.sum()
    changes = (found.flipped.max_rotation_deg_after - found.flipped.max_rotation_deg_before).abs().tolist()
    assert changes == sorted(changes, reverse=True)


def test_what_differs_is_said(result, slower):
    changed = compare(result, slower).changed
    assert any(line.startswith("settings.model.preset: ") for line in changed)
    assert any("boulder_height_m" in line for line in changed)


def test_least_mass_and_depth_before_and_after(result, slower):
    found = compare(result, slower)
    for place, folder in enumerate((result, slower)):
        table = boulder_sweep.read(folder)
        table = table[table.verdict == "pass"]
        mass = table.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3")
        assert found.least["mass_kg"][place] == mass.min()
        assert found.least["depth_m"][place] == table.embedment_depth_m.min()


@pytest.fixture
def made(tmp_path):
    """Return a function that runs a file with changes and returns the folder."""

    def made(text, *overrides):
        out = tmp_path / f"out-{len(list(tmp_path.iterdir()))}"
        file = tmp_path / f"{out.name}.yaml"
        file.write_text(text)
        boulder_sweep.run(boulder_sweep.load(file, overrides), out)
        return out

    return made


def test_designs_of_two_soils_are_paired_by_what_they_share(result, made):
    weaker = made(GRID, "soil.friction_angle=[34, 38] deg")
    found = compare(result, weaker)
    assert (len(found.matched), found.only_before, found.only_after) == (252, 0, 0)
    assert found.differ == ("friction_angle_deg",)
    assert found.values("friction_angle_deg") == [(36.0, 34.0), (40.0, 38.0)]
    assert set(found.varying) == {"boulder_width_m", "boulder_height_m", "embedment_ratio", "friction_angle_deg"}
    before, after = boulder_sweep.read(result), boulder_sweep.read(weaker)
    assert found.turned()["passes"] == (before.verdict == "pass").sum()
    lost = (before.verdict == "pass") & (after.verdict != "pass")  # both grids have one order
    assert found.turned()["passes_lost"] == lost.sum() > 5
    assert found.turned()["passes_gained"] == 0
    assert found.to_dict()["differ"] == ["friction_angle_deg"]
    for row in found.matched.itertuples():
        assert row.friction_angle_deg_before == row.friction_angle_deg_after + 2.0
        assert after.boulder_height_m[row.design_id_after] == row.boulder_height_m


def test_depths_given_as_ratios_are_paired_by_their_ratio(result, made):
    higher = made(GRID, "boulder.height={from: 2.05 m, to: 3.65 m, count: 9}")
    found = compare(result, higher)
    assert found.differ == ("boulder_height_m",)
    assert len(found.matched) == 252
    m = found.matched
    for when in ("before", "after"):
        assert np.allclose(
            m[f"embedment_depth_m_{when}"] / m[f"boulder_height_m_{when}"], m.embedment_ratio, rtol=1e-11
        )


def test_named_soils_are_paired_as_wholes(made):
    one, other = made(SETS), made(SETS.replace("32 deg", "31 deg").replace("42 deg", "41 deg"))
    found = compare(one, other)
    assert (len(found.matched), found.differ) == (12, ("friction_angle_deg",))
    assert found.values("friction_angle_deg") == [(32.0, 31.0), (42.0, 41.0)]
    assert set(found.matched.soil_density_kg_m3) == {1700.0, 1900.0}


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (
            "soil.friction_angle=[30, 34, 38] deg",
            "friction angle φ′ has 2 values (36 to 40 deg) in one and 3 values (30 to 38 deg) in the other. Values "
            "that differ are paired in order, so give both as many of them, or one value in common",
        ),
        ("boulder.width=1.2 m", "boulder width has 2 values (1.5 to 1.9 m) in one and 1 value (1.2 to 1.2 m) in the"),
    ],
)
def test_nothing_in_common_is_refused_with_a_way_out(result, made, change, why):
    with pytest.raises(ReportError, match="have no design in common: ") as refused:
        compare(result, made(GRID, change))
    assert why in str(refused.value)


def test_values_in_common_and_no_combination(made):
    one, other = (
        made(SETS),
        made(SETS.replace("32 deg", "0 deg").replace("42 deg", "32 deg").replace("0 deg", "42 deg")),
    )
    with pytest.raises(ReportError, match="every single value occurs in both, but no design does"):
        compare(one, other)
