"""Results on disk: a folder of Parquet parts that reads as one table at any time, during and after a run.

A folder contains

``rows-<first>-<stop>.parquet``
    Rows [first, stop) of the table; names sort as the rows do, and a file never changes.
``_manifest.parquet``
    Which run it is and which parts are finished, with rows and checksums; to readers a table without rows.
``_lock``
    Empty; exists while a run writes.
``_*.writing``
    A file that is not finished; exists for a moment only, or after a run was killed.
"""

from boulder_sweep.store.failures import StoreError
from boulder_sweep.store.reader import read

__all__ = ["StoreError", "read"]
