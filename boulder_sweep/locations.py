"""Files and folders by path or by URL: ``out``, ``file:///data/out``, ``s3://bucket/out``; files that appear whole.

Everything with ``://`` but ``file://`` is a path of universal-pathlib. Credentials come from where the library of the
file system looks for them (environment variables, its own files, the role of a machine). A URL that contains any is
refused, so that none can get into a log or a message.
"""

from __future__ import annotations

import errno
import hashlib
import io
import os
import re
import secrets
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_IFDIR, S_IFREG, S_ISREG
from types import SimpleNamespace
from typing import IO, TYPE_CHECKING, Any, BinaryIO, TypeAlias
from urllib.parse import unquote

from boulder_sweep.errors import BoulderSweepError, LinkError
from boulder_sweep.signals import undone, until_end
from boulder_sweep.text import install, one_line

if TYPE_CHECKING:
    from upath import UPath

Location: TypeAlias = "Path | UPath"
"""Where a file or a folder is: on a disk, or by a URL."""
_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.\-]*)://([^/?#]*)([^?#]*)(.*)", re.DOTALL)
_SECRET_IN_URL = re.compile(r"""://([^/\s'"]*@)|(?<=[^\s'"])\?[^\s'"]+=[^\s'"]*""")
_SECRET_NAME = re.compile("KEY|SECRET|TOKEN|PASSW|CREDENTIAL|CONNECTION_STRING")
_SHORTEST_SECRET = 8
_S3 = ("s3", "s3a")
_WITHIN_S, _SILENT_S = 45, 30
"""Time for all tries of a call to a store, and for one of S3's without a byte [s]; that begins when the system has what
is sent, so two parts of 1.5 MB share a line of 1 Mbit/s."""
WRITING = ".writing"
"""Ending of what is not finished."""
_TEMPORARY = "sweep-"
_PASSING_NAME = re.compile(
    rf"(?:\..*\.|\.|{_TEMPORARY})?([0-9a-f]{{8}})-([0-9]{{1,10}})-[0-9a-f]{{16}}{re.escape(WRITING)}", re.DOTALL
)
_ABANDONED_S = 3600.0
"""Age of an unfinished file of another machine at which nobody writes it any more [s]."""
_TRIES = 10
_SHOWN = 40
"""Characters of a name that are repeated in a temporary one: four bytes each, and 255 bytes are a name's limit."""


class LocationError(BoulderSweepError):
    """A URL cannot be used; the text never repeats a user name, password or query from it."""


def is_url(text: str) -> bool:
    """Whether a text is meant as a URL."""
    return "://" in text


def location_of(text: str | Location) -> Location:
    """Return the file or folder that a path or URL names.

    Raise `LocationError` where the URL has a user name, password or query in it, or no package can open it.
    """
    if not isinstance(text, str):
        return text if hasattr(text, "fs") else Path(text)
    if not is_url(text):
        return Path(text)
    match = _URL.fullmatch(text.strip())
    if match is None:
        raise LocationError(f"{text.partition('://')[0]}:// is not the beginning of a URL")
    scheme, host, path, rest = match[1].lower(), match[2], match[3], match[4]
    shown = f"{scheme}://{host.rpartition('@')[2]}{path}"
    if "@" in host or rest:
        what = "a user name or password" if "@" in host else "a query or fragment"
        raise LocationError(
            f"{shown}: the URL was given with {what}, which would be written down in many places; leave credentials "
            f"where the library of the file system looks for them, such as AWS_ACCESS_KEY_ID or ~/.aws for s3"
        )
    if scheme == "file":
        if host not in ("", "localhost"):
            raise LocationError(f"{shown}: files of another machine; write file:///folder")
        return Path(unquote(path))
    return _opened(scheme, shown.rstrip("/"))


def _opened(scheme: str, shown: str) -> UPath:
    """Return the path of a file system that remembers no lists of folders: others write, too."""
    options: dict[str, Any] = {"use_listings_cache": False}
    try:
        from fsspec.config import conf  # an extra: most users keep their results on a disk
        from upath import UPath

        if scheme in _S3:
            options["config_kwargs"] = {"read_timeout": _SILENT_S, **conf.get(scheme, {}).get("config_kwargs", {})}
        path = UPath(shown, **options)
        _ = path.fs  # imports what the scheme needs
    except ImportError as missing:
        extra = install("s3") if scheme in _S3 or missing.name else one_line(missing)
        raise LocationError(f"{shown}: {scheme}:// needs another package: {extra}") from None
    except ValueError as unknown:
        raise LocationError(f"{shown} cannot be opened: {one_line(unknown)}") from None
    return path


def harmless(problem: BaseException) -> str:
    """Describe a failure in one line, without what a library may have quoted of credentials."""
    text = one_line(problem)
    for name, value in os.environ.items():
        if len(value) >= _SHORTEST_SECRET and _SECRET_NAME.search(name):
            text = text.replace(value, "***")
    return _SECRET_IN_URL.sub(lambda match: "://" if match[1] else "?***", text)


def _asked(location: UPath, what: str, *arguments: Any, **more: Any) -> Any:
    """Call a method of a file system; what its library raises becomes `OSError`, without what it quotes of secrets."""
    limits = {"timeout": _WITHIN_S} if location.fs.async_impl else {}
    try:
        return getattr(location.fs, what)(location.path, *arguments, **more, **limits)
    except (FileNotFoundError, NotADirectoryError):
        raise
    except Exception as problem:  # they raise whatever their libraries raise
        said = harmless(problem) if str(problem) else f"no answer, or failures only, for {_WITHIN_S} s"
        raise OSError(errno.EACCES if isinstance(problem, PermissionError) else errno.EIO, said) from None


def opened(location: Location) -> IO[bytes]:
    """Open a file for reading; raises OSError."""
    if isinstance(location, Path):
        # A pipe of this name must not be waited for.
        return open(location, "rb", opener=lambda path, flags: os.open(path, flags | os.O_NONBLOCK))
    return io.BytesIO(read_bytes(location))


def read_bytes(location: Location) -> bytes:
    """Return the content of a file; raises OSError."""
    if isinstance(location, Path):
        with opened(location) as file:
            return file.read()
    return bytes(_asked(location, "cat_file"))


def stat_of(location: Location) -> os.stat_result | SimpleNamespace:
    """Return ``st_size`` and ``st_mode`` of a file; raises OSError."""
    if isinstance(location, Path):
        return location.stat()
    said = _asked(location, "info")
    return SimpleNamespace(st_size=said["size"], st_mode=S_IFDIR if said["type"] == "directory" else S_IFREG)


def is_folder(location: Location) -> bool:
    """Whether there is a folder; on an object store, whether there is a file below this name. Raises OSError."""
    return location.is_dir() if isinstance(location, Path) else bool(_asked(location, "isdir"))


def names_in(folder: Location) -> list[str]:
    """Return the names in a folder, none if there is no folder; raises OSError."""
    try:
        if isinstance(folder, Path):
            return sorted(path.name for path in folder.iterdir())
        found = _asked(folder, "ls", detail=False)
        return sorted(name for one in found if (name := one.rstrip("/").rpartition("/")[2]))
    except FileNotFoundError:
        return []


def put(location: UPath, content: bytes | memoryview) -> None:
    """Write a file of a file system by URL in one request; raises OSError."""
    _asked(location, "pipe_file", bytes(content))


def remove(location: Location) -> None:
    """Remove a file that may exist; raises OSError."""
    with suppress(FileNotFoundError):
        location.unlink() if isinstance(location, Path) else _asked(location, "rm_file")


def source_of(location: Location) -> Any:
    """Return what libraries can read a file from: its path, or its content opened."""
    return location if isinstance(location, Path) else opened(location)


def beside(location: Location, suffix: str) -> Path:
    """Return the path of a file made from a result: beside it, or in the current directory for a URL."""
    if not isinstance(location, Path):
        return Path(f"{location.name.removesuffix('.sweep')}{suffix}")
    return Path(f"{str(location if location.name else location.resolve()).removesuffix('.sweep')}{suffix}")


def is_file(path: Path) -> bool:
    """Whether there is a file of a name that is about to be written; raises `LinkError` for a link or anything else."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return False
    if not S_ISREG(mode):
        raise LinkError(f"{path} is a link or not a plain file, and would not be what is written: remove it first")
    return True


def _machine() -> str:
    """Return a short name of this machine, fit for the name of a file."""
    return hashlib.sha256(socket.gethostname().encode()).hexdigest()[:8]


def _passing_name(before: str) -> str:
    """Return a name that nothing else has, and that says which process gave it."""
    return f"{before}{_machine()}-{os.getpid()}-{secrets.token_hex(8)}{WRITING}"


def remove_abandoned(folder: Path) -> None:
    """Remove what processes that were killed had in a folder; never fails."""
    with suppress(OSError):
        for path in folder.iterdir():
            match = _PASSING_NAME.fullmatch(path.name)
            with suppress(OSError):
                if match and _is_abandoned(path, match[1], int(match[2])):
                    _remove(path)


def _is_abandoned(path: Path, machine: str, pid: int) -> bool:
    """Whether the process that made a file has ended."""
    if machine != _machine():
        return time.time() - path.lstat().st_mtime > _ABANDONED_S
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        pass  # another user's
    return False


def _remove(path: Path) -> None:
    with suppress(OSError):
        if not path.is_dir():
            path.unlink(missing_ok=True)
    for _ in range(_TRIES):  # another thread may be removing the same
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)


@contextmanager
def created(folder: Path, before: str = "", at: int | None = None) -> Iterator[tuple[Path, BinaryIO]]:
    """Create a file that is gone at the end of the block or of the process, unless it was renamed.

    Its name begins with `before`; `at` is the descriptor of the folder. Raise OSError where it cannot be created.
    """
    path = folder / _passing_name(before)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    name = path if at is None else path.name
    with undone(lambda: os.fdopen(os.open(name, flags, 0o666, dir_fd=at), "wb"), lambda _: _remove(path)) as file, file:
        yield path, file


def gather_temporary_files() -> None:
    """Have all temporary files of this process in one folder, which is removed when it ends.

    Libraries keep a user's data in such files. Where there is no place for them, nothing changes.
    """
    with suppress(OSError):
        place = Path(tempfile.gettempdir())
        remove_abandoned(place)
        folder = place / _passing_name(_TEMPORARY)
        until_end(lambda: folder.mkdir(mode=0o700), lambda _: _remove(folder))
        tempfile.tempdir = str(folder)


@contextmanager
def replacing(target: Path) -> Iterator[BinaryIO]:
    """Give a file to write that takes the place of another when it is complete, or is removed.

    Raise `LinkError` where a link has the name, and OSError where it cannot be written; an old file is untouched.
    """
    is_file(target)
    remove_abandoned(target.parent)
    with created(target.parent, f".{target.name[:_SHOWN]}.") as (passing, file):
        yield file
        file.flush()
        os.fsync(file.fileno())
        passing.replace(target)
