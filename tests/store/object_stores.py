"""An object store in memory that fails, is slow, or shows lists of yesterday, as a file system of fsspec."""

from __future__ import annotations

import random
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import fsspec
from fsspec.spec import AbstractFileSystem

NAME = "faulty"


class Trouble:
    """What goes wrong, how often, and how often it has.

    Parameters
    ----------
    seed
        Of the random numbers.
    share
        Of the requests that something happens to.
    only_new
        Whether the store refuses to write an object that exists when asked to; otherwise it overwrites.
    """

    def __init__(self, seed: int, share: float, only_new: bool):
        self.chance = random.Random(seed)
        self.share, self.only_new = share, only_new
        self.counts = {"not read": 0, "refused": 0, "answer lost": 0, "late": 0, "stale list": 0}

    def of(self, *kinds: str) -> str:
        """Choose what happens to a request; empty for nothing."""
        often = {("stale list",): 2.0, ("not read",): 0.1}.get(kinds, 1.0)  # there are few lists and many readings
        if self.chance.random() > self.share * often:
            return ""
        kind = self.chance.choice(kinds)
        self.counts[kind] += 1
        return kind


class FaultyFileSystem(AbstractFileSystem):
    """Objects by name; there are no folders."""

    protocol = NAME
    cachable = False
    objects: ClassVar[dict[str, bytes]] = {}
    before: ClassVar[list[str]] = []
    late: ClassVar[list[tuple[int, Callable[[], None]]]] = []
    trouble: ClassVar[Trouble | None] = None
    lock: ClassVar[threading.RLock] = threading.RLock()

    def info(self, path: str, **_: Any) -> dict[str, Any]:
        """Describe an object or what looks like a folder."""
        path = self._strip_protocol(path)
        with self.lock:
            self._may_fail()
            if path in self.objects:
                return {"name": path, "size": len(self.objects[path]), "type": "file"}
            if any(name.startswith(f"{path}/") for name in self.objects):
                return {"name": path, "size": 0, "type": "directory"}
        raise FileNotFoundError(path)

    def ls(self, path: str, detail: bool = True, **_: Any) -> list[Any]:
        """List what is below a name, or what was some time ago."""
        path = self._strip_protocol(path)
        with self.lock:
            stale = self.trouble is not None and self.trouble.of("stale list")
            names = [name for name in (self.before if stale else self.objects) if name.startswith(f"{path}/")]
            if not stale and self.trouble is not None and self.trouble.chance.random() < 0.5:
                type(self).before = list(self.objects)
        if not names:
            raise FileNotFoundError(path)
        entries = [{"name": name, "size": len(self.objects.get(name, b"")), "type": "file"} for name in names]
        return entries if detail else names

    def cat_file(self, path: str, *_: Any, **__: Any) -> bytes:
        """Return an object."""
        with self.lock:
            self.arrive()
            self._may_fail()
            try:
                return self.objects[self._strip_protocol(path)]
            except KeyError:
                raise FileNotFoundError(path) from None

    def pipe_file(self, path: str, value: bytes, mode: str = "overwrite", **_: Any) -> None:
        """Write an object."""
        path = self._strip_protocol(path)

        def write() -> None:
            if mode == "create" and path in self.objects and (self.trouble is None or self.trouble.only_new):
                raise FileExistsError(path)
            self.objects[path] = value

        self._change(write)

    def cp_file(self, path1: str, path2: str, **_: Any) -> None:
        """Copy an object."""
        source, target = self._strip_protocol(path1), self._strip_protocol(path2)

        def copy() -> None:
            if source not in self.objects:
                raise FileNotFoundError(source)
            self.objects[target] = self.objects[source]

        self._change(copy, "refused", "answer lost")

    def rm_file(self, path: str) -> None:
        """Remove an object, if there is one."""
        self._change(lambda: self.objects.pop(self._strip_protocol(path), None), "refused", "answer lost")

    def _may_fail(self) -> None:
        """Fail to answer a question."""
        if self.trouble is not None and self.trouble.of("not read"):
            raise ConnectionError("no answer")

    def _change(self, change: Callable[[], Any], *kinds: str) -> None:
        """Make a change, or fail to, or make it and fail to say so, or make it later."""
        with self.lock:
            self.arrive()
            what = "" if self.trouble is None else self.trouble.of(*(kinds or ("refused", "answer lost", "late")))
            if what == "late":
                assert self.trouble is not None
                self.late.append((self.trouble.chance.randrange(1, 12), change))
            elif what != "refused":
                change()
            if what:
                raise TimeoutError(
                    f"no answer: {what}; sent to https://AKIA:SECRET@host/x?Signature=SECRET with SECRET-KEY"
                )

    def arrive(self) -> None:
        """Let late requests arrive when it is time."""
        waiting = [(left - 1, change) for left, change in self.late]
        self.late[:] = [(left, change) for left, change in waiting if left > 0]
        for left, change in waiting:
            if left <= 0:
                try:
                    change()
                except (FileExistsError, FileNotFoundError):
                    continue


@contextmanager
def store(trouble: Trouble | None = None) -> Iterator[FaultyFileSystem]:
    """Give an empty store that answers to ``faulty://``."""
    fsspec.register_implementation(NAME, FaultyFileSystem, clobber=True)
    for kept in (FaultyFileSystem.objects, FaultyFileSystem.before, FaultyFileSystem.late):
        kept.clear()
    FaultyFileSystem.trouble = trouble
    try:
        yield FaultyFileSystem()
    finally:
        FaultyFileSystem.trouble = None
