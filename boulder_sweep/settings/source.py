"""Read a small text file from an untrusted source: regular file, bounded size, UTF-8."""

from __future__ import annotations

import stat
from pathlib import Path

from boulder_sweep.locations import RemotePath
from boulder_sweep.settings.problems import Problem, SettingsError

MAX_BYTES = 500_000
"""Largest settings file; real ones have a few kilobytes. Long lists of designs belong in a table."""

_BYTE_ORDER_MARKS = (
    (b"\xff\xfe\x00\x00", "UTF-32"),
    (b"\x00\x00\xfe\xff", "UTF-32"),
    (b"\xff\xfe", "UTF-16"),
    (b"\xfe\xff", "UTF-16"),
)


def refuse(file: str, message: str, line: int | None = None, column: int | None = None) -> SettingsError:
    """Return the error for a file that cannot be used at all."""
    return SettingsError([Problem(file, line, column, "", message)])


def check_regular_file(path: Path | RemotePath, max_bytes: int, what: str) -> None:
    """Refuse anything but a regular file of at most `max_bytes`, before a byte is read.

    Parameters
    ----------
    path : Path or RemotePath
        The file.
    max_bytes : int
        Largest size admitted.
    what : str
        Advice for a file that is too large.

    Raises
    ------
    SettingsError
        Missing, a directory, a device or pipe, not readable, or too large.
    """
    label = str(path)
    try:
        status = path.stat()
    except FileNotFoundError:
        raise refuse(label, "there is no such file") from None
    except (OSError, ValueError) as error:
        raise refuse(label, f"cannot be opened ({_reason(error)})") from None
    if stat.S_ISDIR(status.st_mode):
        raise refuse(label, "is a directory; a file is needed")
    if not stat.S_ISREG(status.st_mode):
        raise refuse(label, "is not a regular file (pipes and devices are not read)")
    if status.st_size > max_bytes:
        raise refuse(label, f"has {status.st_size / 1e6:.1f} MB; at most {max_bytes / 1e6:g} MB is read. {what}")


def read_settings_text(path: Path) -> str:
    """Return the text of a settings file.

    Raises
    ------
    SettingsError
        The file cannot be read, is too large, or is not UTF-8 text.
    """
    check_regular_file(path, MAX_BYTES, "Put a long list of designs into a separate file: table: designs.csv")
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)  # a file may grow between the check and the reading
    except OSError as error:
        raise refuse(str(path), f"cannot be read ({_reason(error)})") from None
    if len(data) > MAX_BYTES:
        raise refuse(str(path), f"is larger than {MAX_BYTES / 1e6:g} MB")
    return decode(data, str(path))


def decode(data: bytes, label: str) -> str:
    """Return `data` as text, or say why it cannot be.

    Raises
    ------
    SettingsError
        UTF-16 or UTF-32, zero bytes, or bytes that are not UTF-8.
    """
    for mark, encoding in _BYTE_ORDER_MARKS:
        if data.startswith(mark):
            raise refuse(label, f"is {encoding} text; save it as UTF-8")
    if b"\x00" in data:
        raise refuse(label, "is not a text file (it contains zero bytes); a YAML file in UTF-8 is needed")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = error.start - (before.rfind(b"\n") + 1) + 1
        raise refuse(label, "is not UTF-8 text; save it as UTF-8", line, column) from None


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
