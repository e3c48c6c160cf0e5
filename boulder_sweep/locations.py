"""Files and folders by path or by URL: ``out``, ``file:///data/out``, ``s3://bucket/out``.

Everything with ``://`` but ``file://`` goes through fsspec. Credentials come from where the library of the file system
looks for them (environment variables, its own files, the role of a machine). A URL that contains any is refused, so
that none can get into a manifest, a log or a message.
"""

from __future__ import annotations

import errno
import io
import os
import queue
import re
import stat
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast
from urllib.parse import unquote

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.text import one_line

Returned = TypeVar("Returned")
_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.\-]*)://([^/?#]*)([^?#]*)(.*)", re.DOTALL)
_SECRET_IN_URL = re.compile(r"""://([^/\s'"]*@)|(?<=[^\s'"])\?[^\s'"]+=[^\s'"]*""")
_SECRET_NAME = re.compile("KEY|SECRET|TOKEN|PASSW|CREDENTIAL|CONNECTION_STRING")
_SHORTEST_SECRET = 8
_S3 = ("s3", "s3a")
_TRIES = 4
FIRST_WAIT_S = 0.2
"""Wait after the first failure of a request; three times longer after each one [s]."""
REQUEST_S = 12.0
"""How long to wait for the answer to a request, all tries together [s]; longer where much is sent or read."""
_LIST_TIMES = 5
"""How many times longer to wait for a list: it comes in pages of a thousand names, one after the other, and a sweep of
billions of rows has ten thousands of them."""
_SLOWEST_BYTES_PER_S = 2.5e5
_PART_BYTES = 1 << 24
"""What a file that is read may hold, when its size is not known; a part is smaller."""
_TRY_S = {"connect_timeout": 3, "read_timeout": 5, "retries": {"total_max_attempts": 1}}
"""Limits of one try, as botocore names them [s]. Without them it tries for minutes by itself."""
_FINAL = {
    FileNotFoundError: errno.ENOENT,
    FileExistsError: errno.EEXIST,
    IsADirectoryError: errno.EISDIR,
    NotADirectoryError: errno.ENOTDIR,
    PermissionError: errno.EACCES,
}
"""Answers of a store, not failures, with their numbers: trying again does not help."""


class LocationError(BoulderSweepError):
    """A URL cannot be used; the text never repeats a user name, password or query from it."""


class RemoteStat(NamedTuple):
    """What `RemotePath.stat` returns."""

    st_size: int
    st_mode: int


class RemotePath:
    """A file or folder of an fsspec file system, with the methods of `pathlib.Path` that readers use.

    Made by `location_of`. Every request is tried again a few times. Failures are raised as `OSError`, without the chain
    of causes, which may quote what was sent.
    """

    def __init__(self, filesystem: Any, path: str, url: str):
        self._filesystem, self._path, self._url = filesystem, path.rstrip("/"), url.rstrip("/")

    def __str__(self) -> str:
        return self._url

    def __repr__(self) -> str:
        return f"location_of({self._url!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RemotePath) and other._url == self._url

    def __hash__(self) -> int:
        return hash(self._url)

    def __reduce__(self) -> tuple[Any, ...]:
        return location_of, (self._url,)

    def __truediv__(self, name: str) -> RemotePath:
        return RemotePath(self._filesystem, f"{self._path}/{name}", f"{self._url}/{name}")

    @property
    def name(self) -> str:
        """The last part of the URL."""
        return self._path.rpartition("/")[2]

    @property
    def suffix(self) -> str:
        """The ending of the name, with its dot."""
        return Path(self.name).suffix

    def with_suffix(self, suffix: str) -> RemotePath:
        """Return the location whose name has another ending."""
        return self.parent / Path(self.name).with_suffix(suffix).name

    @property
    def parent(self) -> RemotePath:
        """The folder."""
        return RemotePath(self._filesystem, self._path.rpartition("/")[0], self._url.rpartition("/")[0])

    def resolve(self) -> RemotePath:
        """Return the same location: URLs are absolute."""
        return self

    def exists(self) -> bool:
        """Whether there is a file of this name, or a folder with a file in it."""
        return self._mode() != 0

    def is_dir(self) -> bool:
        """Whether there is a file below this name."""
        return stat.S_ISDIR(self._mode())

    def _mode(self) -> int:
        """Return the kind; 0 where there is nothing. Unlike fsspec's own questions it fails where the store does."""
        try:
            return self.stat().st_mode
        except FileNotFoundError:
            return 0

    def stat(self) -> RemoteStat:
        """Return size and kind.

        Raises
        ------
        OSError
            There is no such file, or the store does not answer.
        """
        info = self._request(self._filesystem.info, self._path)
        kind = stat.S_IFDIR if info.get("type") == "directory" else stat.S_IFREG
        return RemoteStat(int(info.get("size") or 0), kind)

    def read_bytes(self, most: int = _PART_BYTES) -> bytes:
        """Return the content of a file, of about as many bytes at most."""
        return bytes(self._request(self._filesystem.cat_file, self._path, size=most))

    def open(self, mode: str = "r", encoding: str | None = None, newline: str | None = None) -> Any:
        """Open a file for reading; its content is fetched at once."""
        content = io.BytesIO(self.read_bytes(max(self.stat().st_size, _PART_BYTES)))
        return content if "b" in mode else io.TextIOWrapper(content, encoding=encoding, newline=newline)

    def names(self) -> list[str]:
        """Return the names in a folder, those of folders with a slash at the end; none if there is no folder."""
        try:
            entries = self._request(self._filesystem.ls, self._path, times=_LIST_TIMES, detail=True)
        except FileNotFoundError:
            return []
        here = ((entry["name"].rstrip("/").rpartition("/")[2], entry["type"]) for entry in entries)
        return sorted(f"{name}/" if kind == "directory" else name for name, kind in here if name)

    def put(self, content: memoryview | bytes, *, only_new: bool = False) -> None:
        """Write a file in one step.

        Parameters
        ----------
        content
            All of it.
        only_new
            Leave it to the store to refuse a name that is taken; not every store can.

        Raises
        ------
        FileExistsError
            The name is taken; also after a first try whose answer was lost.
        """
        how: dict[str, Any] = {"mode": "create"} if only_new else {}
        self._request(self._filesystem.pipe_file, self._path, bytes(content), size=len(content), **how)

    def copy_to(self, target: RemotePath) -> None:
        """Copy a file within the store."""
        self._request(self._filesystem.cp_file, self._path, target._path)

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove a file."""
        try:
            self._request(self._filesystem.rm_file, self._path)
        except FileNotFoundError:
            if not missing_ok:
                raise

    def _request(
        self, request: Callable[..., Returned], *arguments: Any, size: int = 0, times: int = 1, **options: Any
    ) -> Returned:
        """Send a request in a thread of its own, and wait for the answer; not for ever, for a store may be silent.

        A request that is given up may still arrive.

        Raises
        ------
        OSError
            What the store answered, or the last failure.
        """
        limit_s = times * REQUEST_S + size / _SLOWEST_BYTES_PER_S
        answers: queue.SimpleQueue[tuple[Returned | None, OSError | None]] = queue.SimpleQueue()
        given_up = threading.Event()

        def send() -> None:
            try:
                answers.put((_tried(lambda: request(*arguments, **options), given_up), None))
            except OSError as failure:
                answers.put((None, failure))

        threading.Thread(target=send, name="request", daemon=True).start()
        try:
            answer, failure = answers.get(timeout=limit_s)
        except queue.Empty:
            given_up.set()
            failure = OSError(errno.ETIMEDOUT, f"the store has not answered for {limit_s:.0f} s")
        if failure is not None:
            raise failure from None
        return cast(Returned, answer)


def _tried(request: Callable[[], Returned], given_up: threading.Event) -> Returned:
    """Send a request, again if it fails; raises as `RemotePath._request`."""
    wait = FIRST_WAIT_S
    for left in range(_TRIES - 1, -1, -1):
        try:
            return request()
        except tuple(_FINAL) as answer:
            number = next(number for kind, number in _FINAL.items() if isinstance(answer, kind))
            failure = OSError(answer.errno or number, harmless(answer))
            break
        except Exception as problem:  # file systems raise whatever their libraries raise
            failure = OSError(getattr(problem, "errno", None) or errno.EIO, harmless(problem))
        if left and given_up.wait(wait):
            break
        wait *= 3
    raise failure from None


Location = Path | RemotePath
"""Where a file or a folder is."""


def harmless(problem: BaseException) -> str:
    """Describe a failure in one line, without what a library may have quoted of credentials."""
    text = one_line(problem)
    for name, value in os.environ.items():
        if len(value) >= _SHORTEST_SECRET and _SECRET_NAME.search(name):
            text = text.replace(value, "***")
    return _SECRET_IN_URL.sub(lambda match: "://" if match[1] else "?***", text)


def is_url(text: str) -> bool:
    """Whether a text is meant as a URL."""
    return "://" in text


def location_of(text: str | Path | RemotePath) -> Location:
    """Return the file or folder that a path or URL names.

    Raises
    ------
    LocationError
        The URL has a user name, password or query in it, or no package can open it.
    """
    if isinstance(text, RemotePath):
        return text
    if not isinstance(text, str) or not is_url(text):
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
    filesystem = _filesystem(scheme, shown)
    return RemotePath(filesystem, filesystem._strip_protocol(shown), shown)


def source_of(location: Location) -> Any:
    """Return what libraries can read a file from: its path, or its content opened."""
    return location if isinstance(location, Path) else location.open("rb")


def beside(location: Location, suffix: str) -> Path:
    """Return the path of a file made from a result: beside it, or in the current directory for a URL."""
    if isinstance(location, RemotePath):
        return Path(f"{location.name.removesuffix('.sweep')}{suffix}")
    return Path(f"{str(location if location.name else location.resolve()).removesuffix('.sweep')}{suffix}")


def _filesystem(scheme: str, shown: str) -> Any:
    """Return the file system of a URL, which remembers no lists of folders: others write, too."""
    try:
        import fsspec  # an extra: most users keep their results on a disk
        from fsspec.asyn import AsyncFileSystem

        kind = fsspec.get_filesystem_class(scheme)
        options: dict[str, Any] = {"use_listings_cache": False} if issubclass(kind, AsyncFileSystem) else {}
        if scheme in _S3:
            options["config_kwargs"] = {**_TRY_S, **fsspec.config.conf.get(scheme, {}).get("config_kwargs", {})}
        return fsspec.url_to_fs(shown, **options)[0]
    except ImportError as missing:
        extra = "pip install 'boulder-sweep[s3]'" if scheme in (*_S3, "memory") else one_line(missing)
        raise LocationError(f"{shown}: {scheme}:// needs another package: {extra}") from None
    except ValueError as unknown:
        raise LocationError(f"{shown} cannot be opened: {one_line(unknown)}") from None
