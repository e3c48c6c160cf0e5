"""Whether the parts of a result match its manifest."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from copy import deepcopy

from boulder_sweep.locations import Location
from boulder_sweep.store.failures import refuse_to_guess
from boulder_sweep.store.manifest import Manifest, Merge, Part, load

_ATTEMPTS = 20
"""More than the merges that a run can start while parts are checked."""
_CHANGED = "changed: its checksum differs"


def load_checked(folder: Location, *, read_parts: bool) -> tuple[Manifest, dict[str, str]]:
    """Read the manifest of a folder and compare the parts with it.

    Parameters
    ----------
    folder
        The output folder; a run may be writing into it.
    read_parts
        Whether to compare checksums, or only sizes.

    Returns
    -------
    manifest : Manifest
        With the undamaged parts only, by their current file names.
    damaged : dict
        What is wrong with the others, by file name.
    """
    whole: dict[str, Part] = {}
    for _ in range(_ATTEMPTS):
        manifest = load(folder)
        known = deepcopy(manifest)
        unknown = {name: part for name, part in manifest.parts.items() if whole.get(name) != part}
        damaged = damaged_parts(folder, unknown, read_parts=read_parts)
        whole |= {name: part for name, part in unknown.items() if name not in damaged}
        if manifest.merge is not None and damaged.keys() & set(manifest.merge.replaced):
            damaged = _without_merged(folder, manifest, damaged)
        # Parts may have been merged since the manifest was read: then check new and suspect parts again.
        if not damaged or load(folder) == known:
            break
    manifest.parts = {name: part for name, part in manifest.parts.items() if name not in damaged}
    return manifest, damaged


def _without_merged(folder: Location, manifest: Manifest, damaged: dict[str, str]) -> dict[str, str]:
    """Put the merged part into the manifest if a run was killed during the merge."""
    merge = manifest.merge
    name = None if merge is None else merged_file(folder, merge)
    if merge is None or name is None:
        return damaged
    for replaced in merge.replaced:
        manifest.parts.pop(replaced, None)
    manifest.parts[name] = merge.part
    return {name: wrong for name, wrong in damaged.items() if name not in merge.replaced}


def merged_file(folder: Location, merge: Merge) -> str | None:
    """Return the name of a merged part on disk, final or temporary; None if it is not intact."""
    return next((name for name in merge.names if not wrong_content(folder / name, merge.part)), None)


def damaged_parts(folder: Location, parts: Mapping[str, Part], *, read_parts: bool) -> dict[str, str]:
    """Compare parts, by file name, with their records in the manifest.

    Returns
    -------
    dict
        What is wrong with the damaged ones, by file name.
    """
    check = wrong_content if read_parts else wrong_size
    if len(parts) == 1:  # as when a slow run commits: no thread for that
        return {name: wrong for name, part in parts.items() if (wrong := check(folder / name, part))}
    from concurrent.futures import ThreadPoolExecutor  # imports logging, which a short run does without

    # Checksums are computed without the interpreter's lock, so threads work in parallel.
    with ThreadPoolExecutor(max_workers=min(8, os.cpu_count() or 1)) as pool:
        results = pool.map(lambda name: check(folder / name, parts[name]), parts)
        return {name: wrong for name, wrong in zip(parts, results, strict=True) if wrong}


def wrong_size(path: Location, part: Part) -> str:
    """Describe how the size of a file differs from its record; empty if it does not."""
    try:
        size = path.stat().st_size
    except OSError as problem:
        if not isinstance(problem, FileNotFoundError):
            refuse_to_guess(path, problem)
        return "missing"
    return _other_size(size, part)


def _other_size(size: int, part: Part) -> str:
    """Describe how a size differs from its record; empty if it does not."""
    if size == part.bytes:
        return ""
    kind = "truncated" if size < part.bytes else "longer than written"
    return f"{kind}: {size:,} bytes instead of {part.bytes:,}"


def wrong_content(path: Location, part: Part) -> str:
    """Describe how a file differs from its record, by checksum; empty if it does not."""
    if wrong := wrong_size(path, part):
        return wrong
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as problem:
        refuse_to_guess(path, problem)
        return f"cannot be read: {problem.strerror}"
    return "" if digest == part.sha256 else _CHANGED


def wrong_bytes(content: bytes, part: Part) -> str:
    """Describe how the content of a file differs from its record, by checksum; empty if it does not."""
    if wrong := _other_size(len(content), part):
        return wrong
    return "" if hashlib.sha256(content).hexdigest() == part.sha256 else _CHANGED
