"""Small parts become one part, in steps of which each can be the last before a power cut."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep.store.files import flush_folder
from boulder_sweep.store.manifest import Manifest, hidden_name
from boulder_sweep.store.verify import merged_file


def finish_merge(manifest: Manifest, folder: Path) -> None:
    """Let the merged part, whole under its hidden name, take the place of the small ones.

    Parameters
    ----------
    manifest
        With the merge announced; the merge is done in it afterwards, which the caller must save.
    folder
        The output folder.
    """
    merge = manifest.merge
    if merge is None:
        return
    # The small ones go first: a reader in between misses rows for an instant, but never sees any twice.
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
    """Finish a merge in the middle of which a run was killed, or forget it if it had only been announced.

    Parameters and effect are those of `finish_merge`.
    """
    merge = manifest.merge
    if merge is None:
        return
    if merged_file(folder, merge) is not None:
        finish_merge(manifest, folder)
    else:
        manifest.merge = None
