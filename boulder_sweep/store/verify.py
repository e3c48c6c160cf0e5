"""Whether a part on the disk is what the manifest says it is."""

from __future__ import annotations

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from .lock import is_locked
from .manifest import Manifest, Part, Version, load

_ATTEMPTS = 3


def sha256_of_bytes(content: memoryview | bytes) -> str:
    """SHA-256 of some bytes, in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def load_checked(folder: Path, *, read_parts: bool) -> tuple[Manifest, dict[str, str]]:
    """Read the manifest of a folder, and compare the parts with it.

    Parameters
    ----------
    folder
        The output folder; a run may be writing into it.
    read_parts
        Whether to compare checksums (`verified_parts`), or only sizes (`sized_parts`).

    Returns
    -------
    manifest : Manifest
        With the undamaged parts only.
    damaged : dict
        What is wrong with the others, in words; by file name.
    """
    for _ in range(_ATTEMPTS):
        manifest = load(folder)
        whole, damaged = verified_parts(folder, manifest) if read_parts else sized_parts(folder, manifest)
        # A part may have been replaced by a longer one since the manifest was read: then look again.
        if not (damaged and is_locked(folder)):
            break
    manifest.parts = whole
    return manifest, damaged


def verified_parts(folder: Path, manifest: Manifest) -> tuple[dict[str, Part], dict[str, str]]:
    """Read every part that is recorded and compare its checksum.

    Parameters
    ----------
    folder
        The output folder.
    manifest
        Its manifest.

    Returns
    -------
    whole : dict
        The parts that are what they should be, as they are; by file name.
    damaged : dict
        What is wrong with the others, in words; by file name.
    """
    whole: dict[str, Part] = {}
    damaged: dict[str, str] = {}
    # Checksums are computed without the interpreter's lock, so threads read and compute at once.
    with ThreadPoolExecutor(max_workers=min(8, os.cpu_count() or 1)) as pool:
        found = pool.map(lambda name: _check(folder / name, manifest.parts[name]), manifest.parts)
        for name, result in zip(manifest.parts, found, strict=True):
            if isinstance(result, Part):
                whole[name] = result
            else:
                damaged[name] = result
    return whole, damaged


def sized_parts(folder: Path, manifest: Manifest) -> tuple[dict[str, Part], dict[str, str]]:
    """Compare the size of every part that is recorded, without reading it.

    Parameters and results are those of `verified_parts`.
    """
    whole: dict[str, Part] = {}
    damaged: dict[str, str] = {}
    for name, part in manifest.parts.items():
        try:
            size = (folder / name).stat().st_size
        except OSError:
            damaged[name] = "gone"
            continue
        if size == part.now.bytes:
            whole[name] = part
        elif part.before and size == part.before.bytes:
            whole[name] = _as_before(part, part.before)
        else:
            damaged[name] = _size_text(size, part.now)
    return whole, damaged


def _check(path: Path, part: Part) -> Part | str:
    """Return the part as it is on the disk, or what is wrong with it."""
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            size = file.tell()
    except FileNotFoundError:
        return "gone"
    except OSError as problem:
        return f"cannot be read: {problem.strerror}"
    if (size, digest) == (part.now.bytes, part.now.sha256):
        return replace(part, before=None, verdicts_before=None)
    # Killed between announcing a longer version of this part and putting it in place.
    if part.before and (size, digest) == (part.before.bytes, part.before.sha256):
        return _as_before(part, part.before)
    if size != part.now.bytes:
        return _size_text(size, part.now)
    return "changed: its checksum differs"


def _as_before(part: Part, before: Version) -> Part:
    """Return the record of a part whose longer version was announced but never came."""
    return replace(part, now=before, verdicts=part.verdicts_before or {}, before=None, verdicts_before=None)


def _size_text(size: int, expected: Version) -> str:
    """Say how a size differs."""
    kind = "truncated" if size < expected.bytes else "longer than written"
    return f"{kind}: {size:,} bytes instead of {expected.bytes:,}"
