"""Fuzz a reader, guided by coverage: ``python -m tests.fuzz NAME --seconds N``.

It needs atheris (pip install atheris). An input that fails is written into the corpus, where it is a test from then on.
With ``--into FOLDER`` the inputs that reached something new are kept there; ``--merge FOLDER`` takes into the corpus
those that reach what it does not.
"""

from __future__ import annotations

import argparse
import importlib
import os
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import atheris

CORPUS = Path(__file__).parents[1] / "corpus"
LIMITS = ("-rss_limit_mb=1000", "-timeout=20", "-max_len=16384")


def main() -> int:
    """Read the command line; fuzz in another process, which ends without clearing up."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("name", choices=sorted(path.name for path in CORPUS.iterdir()))
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--into", type=Path)
    parser.add_argument("--merge", type=Path)
    asked = parser.parse_args()
    corpus = CORPUS / asked.name
    with tempfile.TemporaryDirectory() as scratch:
        program, known = Path(scratch, "fuzz"), Path(scratch, "known")  # libFuzzer starts the program again to merge
        program.write_text(
            f'#!/bin/sh\nexec {sys.executable} -c "from tests.fuzz.__main__ import fuzz; fuzz()" "$0" "$@"\n'
        )
        program.chmod(0o755)
        known.write_bytes(b"\n".join(sorted(dictionary(corpus))))
        options = [*LIMITS, f"-artifact_prefix={corpus}/", f"-dict={known}", "-print_final_stats=1"]
        if asked.merge:
            options += ["-merge=1", str(corpus), str(asked.merge)]
        else:
            into = asked.into or Path(scratch, "new")
            into.mkdir(parents=True, exist_ok=True)
            options += [f"-max_total_time={asked.seconds}", str(into), str(corpus)]
        environment = {**os.environ, "TMPDIR": scratch, "FUZZED": asked.name}
        return subprocess.run([program, *options], env=environment, check=False).returncode


def dictionary(corpus: Path) -> set[bytes]:
    """Return the words in a corpus, as libFuzzer reads them."""
    found = {word for file in corpus.iterdir() for word in re.findall(rb"[A-Za-z_][\w./^*]{2,30}", file.read_bytes())}
    return {b'"' + word + b'"' for word in found}


def fuzz() -> None:
    """Fuzz until the time is over or an input fails."""
    with atheris.instrument_imports(include=["boulder_sweep"]):
        target = importlib.import_module("tests.fuzz.targets").TARGETS[os.environ["FUZZED"]]

        def attempt(data: bytes) -> None:
            target.attempt(data)

        def changed(data: bytes, most: int, seed: int) -> bytes:
            found = target.changed(data, most, atheris.Mutate, random.Random(seed))
            return found if len(found) <= most else atheris.Mutate(data, most)

        atheris.Setup(sys.argv[1:], attempt, **({"custom_mutator": changed} if target.changed else {}))
        atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
