"""Merging small parts into one, in steps that are safe against a power cut at any point."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep.store.files import flush_folder
from boulder_sweep.store.manifest import Manifest, hidden_name
from boulder_sweep.store.verify import merged_file


def finish_merge(manifest: Manifest, folder: Path) -> None:
    """Let the merged part, complete under its temporary name, replace the small ones.

    Parameters
    ----------
    manifest
        Announces the merge; updated in place, and the caller must save it.
    folder
        The output folder.
    """
    merge = manifest.merge
    if merge is None:
        return
    # The small ones are removed first: a reader in between misses rows for a moment, but never sees any twice.
    for name in merge.replaced:
        (folder / name).unlink(missing_ok=True)
    hidden = folder / hidden_name(merge.name)
    if hidden.exists():
        hidden.rename(folder / merge.name)
    flush_folder(folder)
    for name in merge.replaced:
        manifest.parts.pop(name, None)
    manifest.parts[merge.name] = merge.part
    manifest.merge = None


def recover_merge(manifest: Manifest, folder: Path) -> None:
    """Finish a merge during which a run was killed, or drop it if it had only been announced.

    Parameters and effect are those of `finish_merge`.
    """
    merge = manifest.merge
    if merge is None:
        return
    if merged_file(folder, merge) is not None:
        finish_merge(manifest, folder)
    else:
        manifest.merge = None
