"""Merging small parts into one, in steps that are safe against a power cut at any point."""

from __future__ import annotations

from boulder_sweep.locations import Location
from boulder_sweep.store.files import hidden_name
from boulder_sweep.store.manifest import Manifest
from boulder_sweep.store.storage import Storage
from boulder_sweep.store.verify import merged_file


def finish_merge(manifest: Manifest, folder: Location, storage: Storage) -> None:
    """Let the merged part, complete under its temporary name, replace the small ones.

    Parameters
    ----------
    manifest
        Announces the merge; updated in place, and the caller must save it.
    folder, storage
        The output folder, and how it is written.
    """
    merge = manifest.merge
    if merge is None:
        return
    # The small ones are removed first: a reader in between misses rows for a moment, but never sees any twice.
    storage.remove(merge.replaced)
    if (folder / hidden_name(merge.name)).exists():
        storage.publish({hidden_name(merge.name): merge.name})
    for name in merge.replaced:
        manifest.parts.pop(name, None)
    manifest.parts[merge.name] = merge.part
    manifest.merge = None


def recover_merge(manifest: Manifest, folder: Location, storage: Storage) -> None:
    """Finish a merge during which a run was killed, or drop it if it had only been announced.

    Parameters and effect are those of `finish_merge`.
    """
    merge = manifest.merge
    if merge is None:
        return
    if merged_file(folder, merge) is not None:
        finish_merge(manifest, folder, storage)
    else:
        manifest.merge = None
