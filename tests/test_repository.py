"""What a repository carries beside its code: version and URLs are stated once, and what repeats them agrees."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from tests.conftest import NOT_QUICK, QUICK

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
SOURCE = PROJECT["urls"]["Source"]


def test_the_citation_has_the_version_and_licence_of_the_package() -> None:
    citation = YAML(typ="safe").load(ROOT / "CITATION.cff")
    assert (citation["version"], citation["license"]) == (PROJECT["version"], PROJECT["license"])
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"version = {{{PROJECT['version']}}}" in readme, "the BibTeX entry"


def test_the_changelog_begins_with_the_version_of_the_package() -> None:
    """Behind what is not released yet, if there is any."""
    versions = re.findall(r"^## \[(.*?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert next(version for version in versions if version != "Unreleased") == PROJECT["version"]


def test_urls_of_the_project_stand_in_one_file() -> None:
    """A new home of the project is one edit."""
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found = [name for name in files.split("\0")[:-1] if SOURCE.encode() in (ROOT / name).read_bytes()]
    assert found == ["pyproject.toml"]


@pytest.fixture(scope="module")
def built() -> dict[str, Any]:
    """Metadata of the package as a build writes them."""
    command = [sys.executable, "-m", "hatchling", "metadata"]
    metadata: dict[str, Any] = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout)
    return metadata


def test_classifiers_name_the_versions_of_python(built: dict[str, Any]) -> None:
    """From the oldest one that is admitted, without a gap."""
    named = re.findall(r"Python :: 3\.(\d+)", "\n".join(PROJECT["classifiers"]))
    oldest = int(built["requires-python"].removeprefix(">=3."))
    assert [int(minor) for minor in named] == list(range(oldest, oldest + len(named)))
    assert len(named) > 1


def pins(file: str) -> dict[str, str]:
    """Versions that a file of requirements pins, by the name of the package."""
    lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
    return dict(line.split(";")[0].strip().split("==") for line in lines)


def bounds() -> dict[str, str]:
    """What `pyproject.toml` asks of the packages that users install, by their name."""
    extras = [one for extra, wanted in PROJECT["optional-dependencies"].items() for one in wanted if extra in USED]
    wanted = [re.split(r"(?=[<>=])", one, maxsplit=1) for one in [*PROJECT["dependencies"], *extras]]
    return {name.replace(".", "-"): bound for name, bound in wanted}


USED = re.findall(r"\w+", PROJECT["optional-dependencies"]["all"][0].partition("[")[2])
"""The extras of users; the others are for developers."""


def test_the_lowest_versions_are_those_that_are_tested() -> None:
    """By `.ci/bounds lowest`, every night: each bound is the version in the file, or what that version begins with."""
    pinned = pins("requirements-lowest.txt")
    for name, bound in bounds().items():
        lowest = bound.removeprefix(">=").partition(",")[0]
        assert f"{pinned[name]}.0.".startswith(f"{lowest}."), name
    assert "'.[all]'" in (ROOT / ".ci" / "bounds").read_text(encoding="utf-8")


def test_numba_is_admitted_up_to_the_version_that_is_tested() -> None:
    """Not the next one: another compiler may round otherwise.

    To admit it, put it into the lock, and make `tests/kernels` pass.
    """
    major, minor, _ = pins("requirements-dev.lock")["numba"].split(".")
    assert bounds()["numba"].partition(",")[2] == f"<{major}.{int(minor) + 1}"


@pytest.mark.parametrize("name", sorted({*QUICK, *NOT_QUICK}))
def test_what_the_quick_layer_names_is_there(name: str) -> None:
    assert (ROOT / "tests" / name).exists()


@pytest.mark.parametrize("script", sorted(path.name for path in (ROOT / ".ci").iterdir()))
def test_the_tests_that_a_script_names_are_there(script: str) -> None:
    """What a script lists in braces is written out as the shell does."""
    text = (ROOT / ".ci" / script).read_text(encoding="utf-8")
    for first, listed, last in re.findall(r"(tests/[\w/]*)(?:\{([\w,]+)\})?([\w/]*\.\w+)", text):
        for name in listed.split(","):
            assert (ROOT / f"{first}{name}{last}").is_file(), name


def test_pre_commit_runs_the_tools_of_the_lock() -> None:
    locked = pins("requirements-dev.lock")
    hooks = {
        repo["repo"].rsplit("/", 1)[1]: repo["rev"].lstrip("v")
        for repo in YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"]
    }
    assert hooks == {"ruff-pre-commit": locked["ruff"], "codespell": locked["codespell"]}
