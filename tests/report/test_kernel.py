"""The kernel that is shipped: from these sources, and nothing but arithmetic; no page is made with another."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import boulder_kernels
import boulder_sweep
from boulder_sweep.report.build import KERNEL, SOURCES, sources_hash, stamp_of
from tests.test_rooms import GRAPH, PACKAGES

RWG = Path(__file__).parents[2] / "configs" / "rwg.yaml"


def test_the_kernel_is_that_of_these_sources():
    assert stamp_of(KERNEL.read_bytes()) == sources_hash(), "python -m boulder_sweep.report.build builds it anew"


def test_a_kernel_without_a_stamp_is_of_no_sources():
    assert stamp_of(b"\0asm\1\0\0\0") == ""


def test_the_hash_covers_all_that_is_compiled():
    """`source_hash` takes one folder; what the page compiles imports from there and from SOURCES alone."""
    folder = PACKAGES["boulder_kernels"]
    assert {file.parent for file in folder.rglob("*.py")} == {folder}
    compiled = {f"boulder_sweep.report.{Path(name).stem}" for name in SOURCES} - {"boulder_sweep.report.build"}
    assert compiled
    beyond = {name for module in compiled for name in GRAPH[module] if not name.startswith("boulder_kernels")}
    assert beyond <= compiled


@pytest.fixture(scope="module")
def altered(tmp_path_factory):
    """Environment with a copy of the packages, as an installation holds them, in which one kernel was changed."""
    folder = tmp_path_factory.mktemp("altered")
    for package in (boulder_sweep, boulder_kernels):
        source = Path(package.__file__).parent
        shutil.copytree(source, folder / source.name, ignore=shutil.ignore_patterns("__pycache__"))
    changed = folder / "boulder_kernels" / "soil.py"
    changed.write_text(changed.read_text() + "\nCHANGED = 1\n")
    return os.environ | {"PYTHONPATH": str(folder), "BOULDER_SWEEP_CACHE_DIR": str(folder / "cache")}


@pytest.mark.parametrize("command", ["report", "explore"])
def test_no_page_is_made_with_a_kernel_of_other_sources(command, altered, result, tmp_path):
    asked = result if command == "report" else RWG
    page = tmp_path / "page.html"
    words = [sys.executable, "-m", "boulder_sweep", command, str(asked), "-o", str(page)]
    ended = subprocess.run(words, env=altered, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 2, ended.stderr
    said = " ".join(ended.stderr.split())
    assert "kernel.wasm was not built from the kernels of this installation" in said
    assert "`python -m boulder_sweep.report.build`" in said
    assert not page.exists()


@pytest.mark.nightly
def test_built_anew_it_is_the_same_to_the_byte(tmp_path):
    again = tmp_path / "kernel.wasm"
    subprocess.run([sys.executable, "-m", "boulder_sweep.report.build", str(again)], check=True)
    assert again.read_bytes() == KERNEL.read_bytes()
