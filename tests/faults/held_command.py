"""The command line, held for ever where what it writes is almost whole.

Run as ``python -m tests.faults.held_command FILE WORDS...``: the file appears at that moment.
"""

from __future__ import annotations

import os
import sys
import threading
import zipfile
from pathlib import Path
from typing import NoReturn


def _held(*_: object) -> NoReturn:
    Path(sys.argv[1]).touch()
    while True:
        threading.Event().wait()


if __name__ == "__main__":
    from boulder_sweep.cli.main import main

    os.fsync = _held
    zipfile.ZipFile.write = _held  # of a spreadsheet, whose parts are in temporary files then
    main(sys.argv[2:])
