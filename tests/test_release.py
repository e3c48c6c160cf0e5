"""A wheel with compiled kernels: built, installed, and without Numba from its first start."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from boulder_kernels import _cache
from boulder_sweep import release

ROOT = Path(__file__).parents[1]
LIGHT = """
import sys
from boulder_sweep.cli.main import main
try:
    main(sys.argv[1:])
finally:
    print("numba" in sys.modules, file=sys.stderr)
"""


@pytest.mark.nightly
@pytest.mark.compiled
@pytest.mark.skipif(not _cache.levels(), reason="no target for this processor")
def test_a_wheel_carries_its_kernels(tmp_path: Path) -> None:
    """Of this processor's fastest target: found by a process that has compiled nothing, which stays without Numba."""
    source, level = tmp_path / "source", _cache.levels()[0]
    subprocess.run(["git", "clone", "-q", str(ROOT), str(source)], check=True)
    release.compile_for(level, source / "kernels" / "boulder_kernels" / "compiled" / level)
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=source, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert "manylinux_2_17" in wheel.name
    with zipfile.ZipFile(wheel) as content:
        content.extractall(tmp_path / "installed")
    environment = os.environ | {
        "PYTHONPATH": str(tmp_path / "installed"),
        _cache.CACHE_VARIABLE: str(tmp_path / "cache"),
    }
    for words in (["run", "configs/rwg.yaml", "-o", str(tmp_path / "table")], ["simulate", "configs/abg.yaml"]):
        command = [sys.executable, "-P", "-c", LIGHT, *words]
        done = subprocess.run(command, cwd=source, env=environment, capture_output=True, text=True, check=False)
        assert done.stderr.splitlines()[-1] == "False", done.stderr
        assert "compiling" not in done.stderr
