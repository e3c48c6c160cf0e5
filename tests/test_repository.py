"""What a repository carries beside its code: the version is stated once, and what repeats it agrees."""

from __future__ import annotations

import tomllib
from pathlib import Path

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_citation_has_the_version_and_licence_of_the_package() -> None:
    citation = YAML(typ="safe").load(ROOT / "CITATION.cff")
    assert (citation["version"], citation["license"]) == (PROJECT["version"], PROJECT["license"])


def test_pre_commit_runs_the_tools_of_the_lock() -> None:
    locked = dict(
        line.split(";")[0].strip().split("==") for line in (ROOT / "requirements-dev.lock").read_text().splitlines()
    )
    hooks = {
        repo["repo"].rsplit("/", 1)[1]: repo["rev"].lstrip("v")
        for repo in YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"]
    }
    assert hooks == {"ruff-pre-commit": locked["ruff"], "codespell": locked["codespell"]}
