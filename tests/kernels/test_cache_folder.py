"""Compiled kernels run as the user who loads them: only a folder that nobody else can write is used for them."""

from __future__ import annotations

import os
import pickle
import shutil
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from boulder_kernels import _jit

ROOT = Path(__file__).parents[2]
OTHER_USER = 65534


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder of this user in the shared temporary folder; pytest's is not open to other users."""
    folder = Path(tempfile.mkdtemp(prefix="test-cache-"))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


def named_only(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Leave one candidate for the folder: the named one."""
    monkeypatch.setenv(_jit.CACHE_VARIABLE, str(folder))
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    monkeypatch.setattr(_jit.tempfile, "gettempdir", lambda: "/dev/null")


def test_new_folders_are_closed_to_others(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named_only(monkeypatch, place / "a" / "b")
    before = os.umask(0)
    try:
        folder = _jit._cache_folder()
    finally:
        os.umask(before)
    assert folder is not None
    for made in (Path(folder), place / "a" / "b", place / "a"):
        assert stat.S_IMODE(made.stat().st_mode) == 0o700


@pytest.mark.parametrize("mode", [0o777, 0o775, 0o757, 0o1777])
@pytest.mark.parametrize("where", ["itself", "above"])
def test_a_folder_that_others_can_write_is_refused(
    place: Path, monkeypatch: pytest.MonkeyPatch, mode: int, where: str
) -> None:
    """A sticky folder above is safe, as the shared temporary folder: nobody else can replace what lies in it."""
    named_only(monkeypatch, place / "cache")
    folder = _jit._cache_folder()
    assert folder is not None
    (Path(folder) if where == "itself" else place).chmod(mode)
    if where == "above" and mode & stat.S_ISVTX:
        assert _jit._cache_folder() == folder
    else:
        with pytest.warns(UserWarning, match="other users can write into"):
            assert _jit._cache_folder() is None


def test_a_folder_of_another_user_is_refused(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Made by a second user where this one may do that, else seen as one."""
    folder = place / "cache"
    folder.mkdir(mode=0o755)
    if os.getuid() == 0:
        os.chown(folder, OTHER_USER, OTHER_USER)
    else:
        user = os.getuid() + 1
        monkeypatch.setattr(_jit.os, "getuid", lambda: user)
    named_only(monkeypatch, folder)
    with pytest.warns(UserWarning, match="belongs to another user"):
        assert _jit._cache_folder() is None


@pytest.mark.parametrize("mode", [0o666, 0o777])
def test_a_file_that_others_can_write_is_refused(place: Path, monkeypatch: pytest.MonkeyPatch, mode: int) -> None:
    named_only(monkeypatch, place)
    folder = _jit._cache_folder()
    assert folder is not None
    (Path(folder) / "kernel.so").touch()
    (Path(folder) / "kernel.so").chmod(mode)
    with pytest.warns(UserWarning, match="is another user's, or open to others"):
        assert _jit._cache_folder() is None


def test_a_file_of_another_user_is_refused(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named_only(monkeypatch, place)
    folder = _jit._cache_folder()
    assert folder is not None
    (Path(folder) / "kernel.so").touch()
    if os.getuid() == 0:
        os.chown(Path(folder) / "kernel.so", OTHER_USER, OTHER_USER)
        with pytest.warns(UserWarning, match="is another user's"):
            assert _jit._cache_folder() is None


def test_a_link_is_followed_once(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is checked is what is used, though the link may be changed afterwards."""
    (place / "real").mkdir()
    (place / "link").symlink_to(place / "real")
    named_only(monkeypatch, place / "link")
    folder = _jit._cache_folder()
    assert folder is not None
    assert Path(folder).parents[1] == place / "real"


TINY = """
from boulder_kernels import _jit
from boulder_kernels.numerics import sine_versine

print(sine_versine(0.0)[0], _jit.CACHE_FOLDER)
"""


class FileMaker:
    """Makes a file when it is unpickled."""

    def __init__(self, file: Path):
        self.file = file

    def __reduce__(self) -> tuple[object, ...]:
        return (Path.touch, (self.file,))


def run_tiny(place: Path) -> subprocess.CompletedProcess[str]:
    """Call a small kernel with a cache at a place, in another process."""
    environment = {
        "PATH": os.environ["PATH"],
        "PYTHONPATH": f"{ROOT / 'kernels'}",
        "PYTHONDONTWRITEBYTECODE": "1",
        _jit.CACHE_VARIABLE: str(place / "cache"),
        "XDG_CACHE_HOME": "/dev/null",
    }
    command = [sys.executable, "-W", "always", str(place / "tiny.py")]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, cwd="/")


@pytest.mark.compiled
def test_what_others_have_planted_does_not_run(place: Path) -> None:
    """It would, from a folder that is trusted: else this test would show nothing."""
    (place / "tiny.py").write_text(TINY)
    assert run_tiny(place).stdout.startswith("0.0 ")
    (index,) = (place / "cache").rglob("*.nbi")
    content = pickle.dumps(FileMaker(place / "has-run"))

    def has_run() -> bool:
        """Whether what is planted runs; the kernel must give the right number in any case."""
        index.parent.mkdir(mode=0o700, exist_ok=True)
        index.write_bytes(content)
        done = run_tiny(place)
        assert done.stdout.startswith("0.0 ")
        if (place / "has-run").exists():
            (place / "has-run").unlink()
            return True
        assert str(place) not in done.stdout
        assert words in done.stderr
        return False

    words = ""
    for mark in [path for path in index.parents[1].iterdir() if path.is_file()]:
        mark.touch()
    assert has_run()
    (place / "cache").chmod(0o777)
    words = "other users can write into"
    assert not has_run()
    (place / "cache").chmod(0o755)
    if os.getuid() == 0:
        shutil.chown(place / "cache", OTHER_USER)
        words = "belongs to another user"
        assert not has_run()
