"""Fuzz a reader, guided by coverage: ``python -m tests.fuzz NAME --seconds N``.

It needs atheris (pip install atheris). An input that fails is written into the corpus, where it is a test from then on.
With ``--into FOLDER`` the inputs that reached something new are kept there; ``--merge FOLDER`` takes into the corpus
those that reach what it does not.
"""

from __future__ import annotations

import argparse
import importlib
import random
import re
import sys
import tempfile
from pathlib import Path

import atheris

LIMITS = ("-rss_limit_mb=1000", "-timeout=20", "-max_len=16384")
AGAIN = "--"
"""Before what libFuzzer asks of the process that merges, which it starts itself."""


def main() -> None:
    """Read the command line and fuzz until the time is over or an input fails."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("name")
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--into", type=Path)
    parser.add_argument("--merge", type=Path)
    at = sys.argv.index(AGAIN) if AGAIN in sys.argv else len(sys.argv)
    asked, given = parser.parse_args(sys.argv[1:at]), sys.argv[at + 1 :]
    with atheris.instrument_imports(include=["boulder_sweep"]), tempfile.TemporaryDirectory() as scratch:
        targets = importlib.import_module("tests.fuzz.targets")
        target, corpus = targets.TARGETS[asked.name], targets.CORPUS / asked.name
        corpus.mkdir(parents=True, exist_ok=True)
        known, again = Path(scratch, "known"), Path(scratch, "again")
        known.write_bytes(b"\n".join(sorted(dictionary(corpus))))
        again.write_text(f'#!/bin/sh\nexec {sys.executable} -m tests.fuzz {asked.name} {AGAIN} "$@"\n')
        again.chmod(0o755)
        options = [*LIMITS, f"-artifact_prefix={corpus}/", f"-dict={known}", "-print_final_stats=1"]
        if given:
            options = given
        elif asked.merge:
            options += ["-merge=1", str(corpus), str(asked.merge)]
        else:
            into = asked.into or Path(scratch, "new")
            into.mkdir(parents=True, exist_ok=True)
            options += [f"-max_total_time={asked.seconds}", str(into), str(corpus)]

        def attempt(data: bytes) -> None:
            target.attempt(data)

        def changed(data: bytes, most: int, seed: int) -> bytes:
            found = target.changed(data, most, atheris.Mutate, random.Random(seed))
            return found if len(found) <= most else atheris.Mutate(data, most)

        atheris.Setup([str(again), *options], attempt, **({"custom_mutator": changed} if target.changed else {}))
        atheris.Fuzz()


def dictionary(corpus: Path) -> set[bytes]:
    """Return the words in a corpus, as libFuzzer reads them."""
    found = {word for file in corpus.iterdir() for word in re.findall(rb"[A-Za-z_][\w./^*]{2,30}", file.read_bytes())}
    return {b'"' + word + b'"' for word in found}


if __name__ == "__main__":
    main()
