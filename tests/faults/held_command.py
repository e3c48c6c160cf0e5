"""The command line, held for ever where what it writes is almost whole.

Run as ``python -m tests.faults.held_command FILE WORDS...``: the file appears at that moment.
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path


def _held(descriptor: int) -> None:
    Path(sys.argv[1]).touch()
    threading.Event().wait()


if __name__ == "__main__":
    from boulder_sweep.cli.main import main

    os.fsync = _held
    main(sys.argv[2:])
