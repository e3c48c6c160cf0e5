"""Whether a part on the disk is what the manifest says it is."""

from __future__ import annotations

import hashlib
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .lock import is_locked
from .manifest import Manifest, Merge, Part, hidden_name, load

_ATTEMPTS = 3


def load_checked(folder: Path, *, read_parts: bool) -> tuple[Manifest, dict[str, str]]:
    """Read the manifest of a folder, and compare the parts with it.

    Parameters
    ----------
    folder
        The output folder; a run may be writing into it.
    read_parts
        Whether to compare checksums, or only sizes.

    Returns
    -------
    manifest : Manifest
        With the undamaged parts only, by the names their files have now.
    damaged : dict
        What is wrong with the others, in words; by file name.
    """
    for _ in range(_ATTEMPTS):
        manifest = load(folder)
        damaged = damaged_parts(folder, manifest, read_parts=read_parts)
        # Parts may have been merged since the manifest was read: then look again.
        if not (damaged and is_locked(folder)):
            break
    if manifest.merge is not None and damaged.keys() & set(manifest.merge.replaced):
        damaged = _without_merged(folder, manifest, damaged)
    manifest.parts = {name: part for name, part in manifest.parts.items() if name not in damaged}
    return manifest, damaged


def _without_merged(folder: Path, manifest: Manifest, damaged: dict[str, str]) -> dict[str, str]:
    """Put the merged part into the manifest where a run was killed in the middle of merging."""
    merge = manifest.merge
    name = None if merge is None else merged_file(folder, merge)
    if merge is None or name is None:
        return damaged
    for replaced in merge.replaced:
        manifest.parts.pop(replaced, None)
    manifest.parts[name] = merge.part
    return {name: wrong for name, wrong in damaged.items() if name not in merge.replaced}


def merged_file(folder: Path, merge: Merge) -> str | None:
    """Return the name that a merged part has on the disk, its own or the hidden one; None where it is not whole."""
    names = (merge.name, hidden_name(merge.name))
    return next((name for name in names if not wrong_content(folder / name, merge.part)), None)


def damaged_parts(folder: Path, manifest: Manifest, *, read_parts: bool) -> dict[str, str]:
    """Compare parts with what the manifest says of them.

    Returns
    -------
    dict
        What is wrong with those that are not as they should be, in words; by file name.
    """
    check = wrong_content if read_parts else wrong_size
    # Checksums are computed without the interpreter's lock, so threads read and compute at once.
    with ThreadPoolExecutor(max_workers=min(8, os.cpu_count() or 1)) as pool:
        found = pool.map(lambda name: check(folder / name, manifest.parts[name]), manifest.parts)
        return {name: wrong for name, wrong in zip(manifest.parts, found, strict=True) if wrong}


def wrong_size(path: Path, part: Part) -> str:
    """Say how the size of a file differs from what it should be; empty if it does not."""
    try:
        size = path.stat().st_size
    except OSError:
        return "gone"
    if size == part.bytes:
        return ""
    kind = "truncated" if size < part.bytes else "longer than written"
    return f"{kind}: {size:,} bytes instead of {part.bytes:,}"


def wrong_content(path: Path, part: Part) -> str:
    """Say how a file differs from what it should be, by its checksum; empty if it does not."""
    wrong = wrong_size(path, part)
    if wrong:
        return wrong
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as problem:
        return f"cannot be read: {problem.strerror}"
    return "" if digest == part.sha256 else "changed: its checksum differs"
