"""Repeat the studies: ``python -m docs.studies [--check] [--write] [BLOCK ...]``, in the folder of the repository."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from docs.studies.contents import CONTENTS, compute
from docs.studies.documents import differences, write
from docs.studies.example_pulse import example_pulse
from docs.studies.example_rock import example_rock
from docs.studies.json_schema import FILE as SCHEMA
from docs.studies.json_schema import text as schema_text
from docs.studies.pictures import draw_all, opened_chromium

PULSE = Path("docs/examples/rigid_wall_pulse.csv")
ROCK = Path("docs/examples/rock.ply")
WRITTEN = {PULSE: example_pulse, ROCK: example_rock, SCHEMA: schema_text}
"""Whole files, and what writes them."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.studies", description=__doc__)
    parser.add_argument("blocks", nargs="*", metavar="BLOCK", help=f"print these blocks: {', '.join(CONTENTS)}")
    parser.add_argument("--write", action="store_true", help="write the blocks named into their pages")
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a number has drifted")
    parser.add_argument("--no-pictures", action="store_true", help="leave the pictures as they are")
    asked = parser.parse_args(arguments)
    root = Path.cwd()
    if not (root / "docs").is_dir():
        parser.error("run it in the folder of the repository: there is no docs here")
    unknown = [name for name in asked.blocks if name not in CONTENTS]
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}; there are {', '.join(CONTENTS)}")
    if asked.blocks:
        computed = compute(root, asked.blocks)
        if asked.write:
            print("\n".join(str(path) for path in write(root, computed, CONTENTS)) or "nothing changed")
        else:
            print("\n\n".join(computed.values()))
        return 0
    if asked.check:
        found = differences(root, compute(root))
        for path, text in WRITTEN.items():
            if not (root / path).exists() or (root / path).read_text(encoding="utf-8") != text():
                found.append(f"{path}: differs from what is computed")
        print("\n".join(found) or "every number in the documentation is what the commands give")
        return 1 if found else 0
    for path, text in WRITTEN.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text(), encoding="utf-8")
    changed = write(root, compute(root))
    if not asked.no_pictures:
        with opened_chromium() as chromium:
            changed += draw_all(root, chromium)
    print("\n".join(str(path) for path in changed) or "nothing changed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
