"""An object store in memory that stops answering, or refuses, as a file system of fsspec."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import fsspec
from fsspec.implementations.memory import MemoryFileSystem

from tests.waiting import HANG_GUARD_S

NAME = "silent"


class SilentFileSystem(MemoryFileSystem):
    """Objects by name; `quiet` says which requests are not answered."""

    protocol = NAME
    cachable = False
    store: ClassVar[dict[str, Any]] = {}
    pseudo_dirs: ClassVar[list[str]] = [""]
    asked: ClassVar[list[str]] = []
    quiet: ClassVar[threading.Event] = threading.Event()
    speaks: ClassVar[threading.Event] = threading.Event()
    refuses: ClassVar[threading.Event] = threading.Event()

    @classmethod
    def _strip_protocol(cls, path: str) -> str:
        return super()._strip_protocol(path.replace(f"{NAME}://", "memory://"))

    def _answer(self, request: str) -> None:
        """Wait where the store is silent; fail where it refuses."""
        self.asked.append(request)
        if self.quiet.is_set():
            self.speaks.wait(HANG_GUARD_S)  # hang guard
        if self.refuses.is_set():
            raise ConnectionRefusedError("connection refused")

    def info(self, path: str, **options: Any) -> dict[str, Any]:
        self._answer("info")
        return super().info(path, **options)

    def ls(self, path: str, detail: bool = True, **options: Any) -> list[Any]:
        self._answer("ls")
        return super().ls(path, detail, **options)

    def cat_file(self, path: str, *limits: Any, **options: Any) -> bytes:
        self._answer("cat_file")
        path = self._strip_protocol(path)
        if path not in self.store:
            raise FileNotFoundError(path)
        return self.store[path].getvalue()

    def pipe_file(self, path: str, value: bytes, mode: str = "overwrite", **options: Any) -> None:
        self._answer("pipe_file")
        super().pipe_file(path, value, mode)

    def cp_file(self, path1: str, path2: str, **options: Any) -> None:
        self._answer("cp_file")
        super().cp_file(path1, path2)

    def rm_file(self, path: str) -> None:
        self._answer("rm_file")
        self.store.pop(self._strip_protocol(path), None)


@contextmanager
def store() -> Iterator[type[SilentFileSystem]]:
    """Give an empty store that answers to ``silent://``; at the end it speaks again."""
    fsspec.register_implementation(NAME, SilentFileSystem, clobber=True)
    SilentFileSystem.store.clear()
    SilentFileSystem.asked.clear()
    SilentFileSystem.pseudo_dirs[:] = [""]
    for event in (SilentFileSystem.quiet, SilentFileSystem.speaks, SilentFileSystem.refuses):
        event.clear()
    try:
        yield SilentFileSystem
    finally:
        SilentFileSystem.speaks.set()
        SilentFileSystem.quiet.clear()
