"""What a table was computed from."""

from __future__ import annotations

import ast
import json
import re
import shutil
from importlib.metadata import version
from pathlib import Path
from typing import get_type_hints

import pyarrow.parquet as pq
import pytest

import boulder_kernels
from boulder_sweep.answers.outputs import AnswerFile
from boulder_sweep.errors import ReportError
from boulder_sweep.settings import stored
from boulder_sweep.store import provenance
from boulder_sweep.store.provenance import canonical, differences, file_metadata, identity, identity_in, sha256_of
from tests.answers.designs import bare_need, site
from tests.store.folders import OTHER_VERSIONS


def test_the_same_content_has_the_same_hash_whatever_its_order():
    assert sha256_of({"a": 1, "b": [1.5, "é"]}) == sha256_of({"b": [1.5, "é"], "a": 1})
    assert sha256_of({"a": 1}) != sha256_of({"a": 2})
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical({"a": float("nan")})


def test_an_identity_is_plain_data_and_equal_after_json():
    found = identity({"x": (1, 2.5)}, {"inertia_box": True}, {"h": 0.004})
    assert json.loads(json.dumps(found)) == found
    assert found["settings_sha256"] == sha256_of({"x": [1, 2.5]})
    assert re.fullmatch("[0-9a-f]{64}", found["kernels_sha256"])
    assert set(found["versions"]) >= {"python", "target", "numpy", "numba", "llvmlite", "pyarrow", "boulder-sweep"}
    assert differences(found, json.loads(json.dumps(found))) == []


def test_versions_are_those_of_the_installed_packages():
    packages = ("numpy", "numba", "llvmlite", "pyarrow")
    assert {name: provenance.versions()[name] for name in packages} == {name: version(name) for name in packages}
    assert provenance._version("of-clay") == "unknown"


def test_every_entry_of_the_control_is_checked():
    kinds = get_type_hints(boulder_kernels.Control)
    assert {name: kind for name, (kind, _, _) in stored._CONTROL.items()} == kinds
    assert {*boulder_kernels.Readings._fields} == stored._READINGS


def test_kernels_are_hashed_by_content(tmp_path, monkeypatch):
    (tmp_path / "__init__.py").write_text("a = 1")
    assert provenance.kernels_sha256.__wrapped__() == boulder_kernels.source_hash()
    monkeypatch.setattr(boulder_kernels.__spec__, "origin", str(tmp_path / "__init__.py"))
    one = provenance.kernels_sha256.__wrapped__()
    (tmp_path / "__init__.py").write_text("a = 2")
    two = provenance.kernels_sha256.__wrapped__()
    (tmp_path / "more.py").write_text("")
    assert len({one, two, provenance.kernels_sha256.__wrapped__()}) == 3


def test_every_module_that_decides_a_row_is_hashed(tmp_path, monkeypatch):
    package = tmp_path / "boulder_sweep"
    shutil.copytree(provenance._PACKAGE_FOLDER, package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(provenance, "_PACKAGE_FOLDER", package)
    hash_now = provenance.rules_sha256.__wrapped__
    before = hash_now()
    deciding = [
        "designs.py",
        "soils.py",
        "investigation.py",
        *(f"judge/{name}.py" for name in ("accuracy", "evaluation", "inputs", "judged", "verdict")),
        "settings/fields.py",
    ]
    for name in deciding:
        source = package / name
        text = source.read_text()
        source.write_text(text + "# changed\n")
        assert hash_now() != before, name
        source.write_text(text)
    assert hash_now() == before


def imported(source: Path) -> set[str]:
    """Modules of this package that a module imports when it runs, as paths within the package."""
    tree = ast.parse(source.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    froms = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    found = [node.module for node in froms] + [f"{node.module}.{name.name}" for node in froms for name in node.names]
    own = (f"{name.removeprefix('boulder_sweep.').replace('.', '/')}.py" for name in found if name)
    return {name for name in own if (provenance._PACKAGE_FOLDER / name).is_file()}


def test_what_deciding_modules_import_is_hashed():
    """But for what only words an error or a line of text."""
    package = provenance._PACKAGE_FOLDER
    hashed = {path for pattern in provenance._DECIDING_SOURCES for path in package.glob(pattern)}
    deciding = [path for path in hashed if path.parent.name != "settings"]
    reached = set.union(*(imported(path) for path in deciding))
    assert "settings/model.py" in reached
    assert reached - {path.relative_to(package).as_posix() for path in hashed} <= {
        "text.py",
        "errors.py",
        "settings/units.py",
    }


def test_sources_that_are_missing_are_an_error_and_not_an_empty_hash(tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "_PACKAGE_FOLDER", tmp_path)
    with pytest.raises(FileNotFoundError, match=r"designs\.py"):
        provenance.rules_sha256.__wrapped__()


def test_differences_are_told_once_and_shortly():
    there = {"settings": {"a": {"b": 1}, "long": list(range(100))}, "settings_sha256": "1" * 64}
    here = {"settings": {"a": {"b": 2}, "long": list(range(99)), "new": None}, "settings_sha256": "2" * 64}
    told = differences(there, here)
    assert told[0] == "settings.a.b: 1 -> 2"
    assert all(len(line) < 160 for line in told)
    assert "settings.new: (none) -> null" in told
    assert not any("sha256" in line for line in told)
    assert differences({"kernels_sha256": "1" * 64}, {"kernels_sha256": "2" * 64}) == [
        "kernels_sha256: 111111111111 -> 222222222222"
    ]


def test_file_metadata_has_no_time_and_no_process():
    one = file_metadata(identity({}, {}, {}), repeat="sweep run x.yaml")
    assert one == file_metadata(identity({}, {}, {}), repeat="sweep run x.yaml")
    assert one[b"boulder_sweep.repeat"] == b"sweep run x.yaml"
    assert not any(re.search(rb"\d\d:\d\d:\d\d", value) for value in one.values())


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a file of answers."""
    path = tmp_path_factory.mktemp("answers") / "need.parquet"
    bare_need(site(), margin=0.1).write(path)
    return path


@pytest.mark.parametrize("version", OTHER_VERSIONS)
def test_a_file_of_answers_of_another_version_is_refused(answers, tmp_path, version):
    change, words = OTHER_VERSIONS[version]
    table = pq.read_table(answers)
    there = identity_in(table.schema.metadata)
    change(there)
    kept = {key: value for key, value in table.schema.metadata.items() if key != b"boulder_sweep.format"}
    other = tmp_path / "other.parquet"
    pq.write_table(table.replace_schema_metadata(kept | file_metadata(there)), other)
    with pytest.raises(ReportError) as refused:
        AnswerFile(other, ReportError)
    assert str(refused.value).startswith(f"{other} {words.format(provenance.versions()['boulder-sweep'])}")
