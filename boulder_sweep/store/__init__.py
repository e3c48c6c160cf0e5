"""Results on disk: a folder of Parquet parts that is one table at any time, during and after a run."""

from .errors import StoreError
from .reader import read
from .status import RunStatus, status

__all__ = ["RunStatus", "StoreError", "read", "status"]
