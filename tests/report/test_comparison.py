"""Two results laid side by side: designs matched by inputs, verdicts that changed, what differs."""

import pytest

import boulder_sweep
from boulder_sweep.report.comparison import compare
from tests.report.conftest import GRID


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
