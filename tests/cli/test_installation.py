"""``sweep examples`` and ``sweep doctor``: what comes with an installation."""

from __future__ import annotations

from pathlib import Path

import pytest

from boulder_sweep.cli import doctor

CONFIGS = Path(__file__).parents[2] / "configs"


def test_examples_are_the_files_that_the_documentation_names(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = sweep("examples")
    assert code == 0
    copied = {path.name: path.read_bytes() for path in Path("configs").iterdir()}
    assert copied == {path.name: path.read_bytes() for path in CONFIGS.iterdir()}
    listed = dict(line.split(": ", 1) for line in out.replace("\n  ", " ").splitlines())
    assert [*listed] == [f"configs/{path.name}" for path in sorted(CONFIGS.glob("*.yaml"))]
    assert listed["configs/wet_backfill.yaml"] == (
        "A car park at the waterfront: loose sand with water three feet down, US units throughout."
    )


def test_examples_replace_nothing(sweep, tmp_path):
    there = tmp_path / "there"
    there.mkdir()
    code, _, err = sweep("examples", str(there))
    assert code == 4
    assert err == f"error: {there} exists already; name another folder\n"
    assert list(there.iterdir()) == []


def test_doctor_names_versions_and_folders(sweep):
    code, out, _ = sweep("doctor")
    assert code == 0
    rows = dict(line.split(": ", 1) for line in out.replace("\n  ", " ").splitlines())
    assert [*rows][:3] == ["boulder-sweep", "Python", "packages"]
    assert {"plot", "report", "query", "scan", "dask", "s3", "PDF", "kernels"} <= {*rows}
    assert {"all", "site", "dev"}.isdisjoint(rows)
    assert "numba " in rows["packages"]
    assert "missing" not in out


@pytest.mark.parametrize(("package", "extra"), [("matplotlib", "plot"), ("s3fs", "s3")])
def test_doctor_says_how_to_install_what_is_missing(sweep, monkeypatch, package, extra):
    known = doctor.version

    def without(name):
        if name == package:
            raise doctor.PackageNotFoundError
        return known(name)

    monkeypatch.setattr(doctor, "version", without)
    code, out, _ = sweep("doctor")
    assert code == 0
    row = next(line for line in out.replace("\n  ", " ").splitlines() if line.startswith(extra))
    assert f"{package} missing" in row
    assert row.endswith(f"in a clone of boulder-sweep, pip install '.[{extra}]'")
