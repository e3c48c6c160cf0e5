"""A wheel with compiled kernels: built, installed, and without Numba from its first start."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from boulder_kernels import _ahead, _cache, source_hash
from boulder_kernels.numerics import sine_versine
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


@pytest.mark.compiled
def test_kernels_are_compiled_for_processors_other_than_this_one(tmp_path: Path) -> None:
    """For every target of this architecture, of the recorded types, without a call."""
    recorded = tmp_path / "recorded"
    recorded.mkdir()
    name = _ahead.file_name(sine_versine, "f")
    (recorded / f"{name}{_ahead.RETURNS}").write_text('{"types": "f"}')
    for level in [level for level, needed in _cache.LEVELS.items() if platform.machine() in needed]:
        release.compile_for(level, recorded, tmp_path / level)
        assert sorted(file.name for file in (tmp_path / level).iterdir()) == sorted(
            [f"{name}{_ahead.LIBRARY}", f"{name}{_ahead.RETURNS}", _cache.SOURCES]
        )
        assert (tmp_path / level / f"{name}{_ahead.LIBRARY}").read_bytes().startswith(b"\x7fELF")
        assert (tmp_path / level / _cache.SOURCES).read_text() == source_hash()
    if level in _cache.levels():
        assert _ahead.loaded(tmp_path / level / name).call is not None


@pytest.mark.nightly
@pytest.mark.compiled
@pytest.mark.skipif(not _cache.levels(), reason="no target for this processor")
def test_a_wheel_carries_its_kernels(tmp_path: Path) -> None:
    """Of this processor's fastest target: found by a process that has compiled nothing, which stays without Numba."""
    source, level = tmp_path / "source", _cache.levels()[0]
    subprocess.run(["git", "clone", "-q", str(ROOT), str(source)], check=True)
    recorded = release.record(tmp_path)
    release.compile_for(level, recorded, source / "kernels" / "boulder_kernels" / "compiled" / level)
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=source, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert "manylinux_2_17" in wheel.name
    with zipfile.ZipFile(wheel) as content:
        content.extractall(tmp_path / "installed")
    environment = os.environ | {
        "PYTHONPATH": str(tmp_path / "installed"),
        _cache.CACHE_VARIABLE: str(tmp_path / "empty"),
    }
    for words in (
        ["need", "configs/site.yaml", "--margin", "25%"],
        ["run", "configs/rwg.yaml", "-o", str(tmp_path / "table")],
        ["simulate", "configs/abg.yaml"],
    ):
        command = [sys.executable, "-P", "-c", LIGHT, *words]
        done = subprocess.run(command, cwd=source, env=environment, capture_output=True, text=True, check=False)
        assert done.stderr.splitlines()[-1] == "False", done.stderr
        assert "compiling" not in done.stderr
