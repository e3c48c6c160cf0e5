"""Commands that take a folder take a URL."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from boulder_sweep.locations import location_of


@pytest.fixture
def out(sweep, possible_grid):
    url = "memory://results/possible.sweep"
    code, *_ = sweep("run", possible_grid, "-q", "-o", url, "--overwrite")
    assert code == 0
    return url


def test_commands_take_the_url_of_a_result(sweep, possible_grid, out, tmp_path):
    code, told, _ = sweep("run", possible_grid, "-q", "-o", out, "--resume", "--dry-run", "--json")
    found = json.loads(told)
    assert (code, found["out"], found["estimate"]["rows_to_compute"], found["estimate"]["damaged"]) == (0, out, 0, {})
    assert sweep("plot", out)[0] == 0
    assert sweep("report", out)[0] == 0
    assert sweep("simulate", out, "--design", "3")[0] == 0
    assert sweep("export", out, "-o", "table.csv")[0] == 0
    assert {path.name for path in tmp_path.iterdir()} >= {"possible.png", "possible.html", "table.csv"}


def test_a_url_with_credentials_is_refused_before_anything_is_done(sweep, possible_grid):
    code, out, err = sweep("run", possible_grid, "-o", "s3://KEY:SECRET@bucket/out")
    assert (code, out) == (2, "")
    assert err.startswith("error: s3://bucket/out: the URL was given with a user name or password")
    assert "SECRET" not in err


def test_answers_are_written_to_a_url(sweep, possible_grid):
    need = ("need", possible_grid, "-q", "-o")
    assert sweep(*need, "memory://answers/least.parquet")[0] == 0
    assert sweep(*need, "least.parquet")[0] == 0
    assert location_of("memory://answers/least.parquet").read_bytes() == Path("least.parquet").read_bytes()
