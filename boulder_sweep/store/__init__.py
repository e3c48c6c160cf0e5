"""Results on disk: a folder of Parquet parts that reads as one table at any time, during and after a run."""

from boulder_sweep.store.failures import StoreError
from boulder_sweep.store.reading import read

__all__ = ["StoreError", "read"]
