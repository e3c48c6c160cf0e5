"""The block ``report`` of a file: project, client, author, date."""

import pytest

import boulder_sweep
from boulder_sweep.settings import load_text
from boulder_sweep.settings.problems import SettingsError
from boulder_sweep.store.provenance import settings_sha256
from tests.report.conftest import SITE


def loaded(block, tmp_path):
    return load_text(f"{SITE}{block}\n", tmp_path / "site.yaml")


def test_it_is_in_the_resolved_settings_and_in_no_hash(tmp_path):
    plain, headed = loaded("", tmp_path), loaded("report: {client: City, date: 2026-11-25}", tmp_path)
    assert "report" not in plain.resolved()
    assert headed.resolved()["report"] == {"client": "City", "date": "2026-11-25"}
    assert settings_sha256(plain.resolved()) == settings_sha256(headed.resolved())
    assert [axis.name for axis in headed.axes] == [axis.name for axis in plain.axes]
    assert loaded("report:", tmp_path).resolved() == plain.resolved()


def test_an_override_replaces_an_entry(tmp_path):
    (tmp_path / "site.yaml").write_text(f"{SITE}report: {{client: City}}\n")
    sweep = boulder_sweep.load(tmp_path / "site.yaml", ["report.client=County", "report.author=C. Day"])
    assert sweep.heading.given() == {"client": "County", "author": "C. Day"}


@pytest.mark.parametrize(
    ("block", "column", "words"),
    [
        (
            "report: City",
            9,
            "report: must be a block of keys: project, client, site, date, revision, author, checked_by",
        ),
        ("report: {cleint: City}", 10, "report.cleint: is not a key of report"),
        ("report: {client: [a, b]}", 18, "report.client: must be one line of text, not a list or a block"),
        ("report: {client: ''}", 18, "report.client: is empty; write one line of text, or leave it out"),
        (f"report: {{client: {'x' * 201}}}", 18, "report.client: has 201 characters; at most 200 fit into a heading"),
    ],
)
def test_a_wrong_entry_is_refused_where_it_stands(block, column, words, tmp_path):
    with pytest.raises(SettingsError) as refused:
        loaded(block, tmp_path)
    place = f"{tmp_path / 'site.yaml'}:{len(SITE.splitlines()) + 1}:{column}"
    assert str(refused.value.problems[0]).startswith(f"{place}: {words}")
