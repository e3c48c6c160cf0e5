"""Small and read-only disks."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest


class SmallDisk:
    """A disk of a few MB in memory, where this machine lets us mount one.

    Elsewhere its place is taken by a folder of the same name, and the tests inject what the disk would do.
    """

    def __init__(self, path: Path, megabytes: int):
        self.path = path
        path.mkdir()
        mount = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "none", str(path)]
        self.real = _succeeds(mount)

    def remount(self, options: str) -> bool:
        """Change its size or its rights; False where it is no real disk."""
        return self.real and _succeeds(["mount", "-o", f"remount,{options}", str(self.path)])

    def unmount(self) -> None:
        """Take it away."""
        if self.real:
            subprocess.run(["umount", "-l", str(self.path)], check=True)


def _succeeds(command: list[str]) -> bool:
    """Whether a command is there and works."""
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Callable[[int], SmallDisk]]:
    """Make small disks."""
    made = []

    def make(megabytes: int) -> SmallDisk:
        made.append(SmallDisk(tmp_path / f"disk-{len(made)}", megabytes))
        return made[-1]

    yield make
    for disk in made:
        disk.unmount()
