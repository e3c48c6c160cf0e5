"""Questions asked in Python: of a file, of a mapping, and what a notebook shows of the answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import boulder_sweep
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings import SettingsError, load

CONFIGS = Path(__file__).parents[2] / "configs"
DEEP = ["site.embedment_depth=2.4 m"]


@pytest.fixture
def site():
    """The settings of a site as a mapping."""
    text = (CONFIGS / "site.yaml").read_text(encoding="utf-8").replace("[36, 40] deg", "'[36, 40] deg'")
    return YAML(typ="safe", pure=True).load(text)


def test_a_mapping_is_what_its_file_is(site):
    of_file, of_mapping = load(CONFIGS / "site.yaml"), boulder_sweep.load(site)
    assert of_mapping.resolved() == of_file.resolved()
    assert of_mapping.path is None
    assert boulder_sweep.load(site, DEEP).resolved() == load(CONFIGS / "site.yaml", DEEP).resolved()


def test_numbers_of_numpy_and_bare_ones_are_values(site):
    site["boulder"]["height"] = np.array([2.6, 3.4])
    site["boulder"]["length"] = np.float64(1.65)
    site["name"] = "Straße"
    sweep = boulder_sweep.load(site)
    assert sweep.axes[0].values.tolist() == [2.6, 3.4]
    assert (sweep.constants["boulder_length_m"], sweep.name) == (1.65, "Straße")


def test_notes_are_warnings_in_python_and_notes_at_the_terminal(site, sweep, tmp_path):
    site["vehicle"]["speed"] = 30
    note = "30 m/s is outside the usual range"
    with pytest.warns(UserWarning, match=f"settings: vehicle.speed: {note}"):
        boulder_sweep.load(site)
    path = tmp_path / "fast.yaml"
    path.write_text((CONFIGS / "site.yaml").read_text(encoding="utf-8").replace("30 mph", "30 m/s"), encoding="utf-8")
    with pytest.warns(UserWarning, match=note), pytest.raises(QuestionError, match="to be found"):
        boulder_sweep.capacity(path)
    assert " ".join(sweep("check", path)[2].split()).count(note) == 1


def test_overrides_are_a_list(site):
    with pytest.raises(TypeError, match=r"overrides must be a list of strings, such as \['vehicle.speed=40 mph'\]"):
        boulder_sweep.load(site, "vehicle.speed=40 mph")


def test_jobs_are_checked_before_anything_is_simulated(site):
    with pytest.raises(TypeError, match="jobs must be a whole number, not str"):
        boulder_sweep.need(site, jobs="2")


def test_mistakes_of_a_mapping_are_named_by_their_entries(site):
    site["soil"]["friction_angle"] = 432
    site["boulder"]["heights"] = "3 m"
    site["vehicle"]["speed"] = float("nan")
    with pytest.raises(SettingsError) as refused:
        boulder_sweep.load(site)
    assert sorted(str(problem).partition(" ")[0] for problem in refused.value.problems) == [
        "settings:",
        "settings:",
        "settings:",
    ]
    assert sorted(problem.key for problem in refused.value.problems) == [
        "boulder.heights",
        "soil.friction_angle",
        "vehicle.speed",
    ]


def test_files_that_a_mapping_names_lie_in_the_current_directory(site, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("yard.csv").write_text("boulder_height_m\n3.4\n3.6\n")
    del site["boulder"]["height"]
    site["soil"]["friction_angle"] = "40 deg"
    assert boulder_sweep.load({"table": "yard.csv", **site}).n_designs == 2


def test_every_question_takes_a_file_a_mapping_or_a_sweep(site):
    given = {**site, "site": {"embedment_depth": 2.4}}
    one = {**given, "boulder": {**site["boulder"], "height": 3.4}, "soil": {**site["soil"], "friction_angle": 40}}
    uncertain = {**one, "soil": {**one["soil"], "friction_angle": {"mean": "40 deg", "sd": "2 deg"}}}
    for asked, settings, options in (
        (boulder_sweep.need, site, {}),
        (boulder_sweep.capacity, given, {}),
        (boulder_sweep.uncertainty, uncertain, {"half_width": 0.2}),
    ):
        by_mapping, by_sweep = (asked(own, **options).arrow for own in (settings, boulder_sweep.load(settings)))
        assert by_mapping.equals(by_sweep)
    assert boulder_sweep.capacity(CONFIGS / "clayey_terrace.yaml").arrow.num_rows == 1


def test_what_needs_a_depth_names_the_function_that_finds_it(site):
    with pytest.raises(QuestionError, match=r"boulder_sweep\.need\(sweep\)"):
        boulder_sweep.capacity(site)


def test_a_notebook_shows_what_the_commands_print(site, sweep):
    withstood = boulder_sweep.capacity(load(CONFIGS / "site.yaml", DEEP))
    html = withstood._repr_html_()
    printed = sweep("capacity", CONFIGS / "site.yaml", "--set", DEEP[0], "-q")[1]
    assert html == f"<div><pre>{printed.rstrip()}</pre></div>"
    assert repr(withstood) == printed.rstrip()
    chances = boulder_sweep.uncertainty(CONFIGS / "uncertain_site.yaml", half_width=0.2)
    assert "<pre>" in chances._repr_html_()
    assert "P(pass)" in chances._repr_html_()


def test_the_notes_are_there_where_nothing_is_wrong(sweep):
    for command in ("need", "capacity", "simulate"):
        err = sweep(command, CONFIGS / "uncertain_site.yaml", "--set", "boulder.width=2.6 m", "--at", "mean")[2]
        assert "note: uncertain inputs taken at" in err
        assert "boulder.width" in err
        assert err.count("taken at") == 1
