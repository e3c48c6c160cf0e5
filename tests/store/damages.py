"""Ways in which a part is damaged, and a command that damages parts again and again.

Each time a part of a finished table is damaged at random. A reader then has to refuse it in words, or to give the rows
of the other parts alone. A resumed run has to make the same files again, or to refuse in words. Prints one JSON object.
Run from the root of the repository as ``python -m tests.store.damages FOLDER DAMAGES SEED``.
"""

from __future__ import annotations

import json
import random
import shutil
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq

from boulder_sweep.errors import BoulderSweepError
from boulder_sweep.runner.run import run
from boulder_sweep.store import read
from boulder_sweep.store.folder import PartFile
from tests.runner.grids import grid, plausible
from tests.store.folders import PARTS, ROWS, finished_folder, part_of, parts_of, put, rewrite

Chance = random.Random
_FOOTER = 8
"""Bytes at the end of a Parquet file that hold the length of its footer."""


def flip(out: Path, chance: Chance) -> None:
    """Flip one bit, often within the footer."""
    path, content = _content(out, chance)
    first = chance.choice([0, len(content) * 3 // 4, len(content) - _FOOTER])
    content[chance.randrange(first, len(content))] ^= 1 << chance.randrange(8)
    path.write_bytes(content)


def scribble(out: Path, chance: Chance) -> None:
    """Replace many bytes."""
    path, content = _content(out, chance)
    start = chance.randrange(len(content) - 1)
    stop = min(start + chance.randint(2, 4096), len(content))
    content[start:stop] = bytes(byte ^ 0xFF for byte in content[start:stop])
    path.write_bytes(content)


def cut(out: Path, chance: Chance) -> None:
    """Keep only the beginning, or nothing."""
    path, content = _content(out, chance)
    path.write_bytes(content[: chance.choice([0, chance.randrange(len(content))])])


def longer(out: Path, chance: Chance) -> None:
    """Add bytes at the end, before the footer or before everything."""
    path, content = _content(out, chance)
    at = chance.choice([0, len(content) - _FOOTER, len(content)])
    content[at:at] = chance.randbytes(chance.randint(1, 2000))
    path.write_bytes(content)


def renamed(out: Path, chance: Chance) -> None:
    """Give the rows of one range the name of another."""
    which, another = chance.sample(range(PARTS), 2)
    part, other = part_of(out, which), part_of(out, another)
    (out / other.name).unlink()
    (out / part.name).rename(out / part._replace(first=other.first, stop=other.stop).name)


def other_rows(out: Path, chance: Chance) -> None:
    """Let a name say a range that the table does not have."""
    part = _part(out, chance)
    (out / part.name).rename(out / part._replace(stop=part.stop + chance.randint(1, 200)).name)


def other_hash(out: Path, chance: Chance) -> None:
    """Let a name say another hash."""
    part = _part(out, chance)
    (out / part.name).rename(out / part._replace(hash=f"{chance.getrandbits(64):016x}").name)


def of_another_run(out: Path, chance: Chance) -> None:
    """Take a part from a table of other settings."""
    rewrite(out, lambda said: said["settings"].update(name="another"), chance.randrange(1, PARTS))


def of_a_longer_table(out: Path, chance: Chance) -> None:
    """Take a part from a table of more rows."""
    rewrite(out, lambda said: said.update(rows=chance.randint(2, 99) * ROWS), chance.randrange(1, PARTS))


def other_columns(out: Path, chance: Chance) -> None:
    """Leave a column out."""
    part, table = _taken(out, chance)
    put(out, part, table.drop_columns([chance.choice(table.column_names[1:])]))


def fewer_rows(out: Path, chance: Chance) -> None:
    """Leave rows out."""
    part, table = _taken(out, chance)
    put(out, part, table.slice(chance.randint(1, len(table) - 1)))


def twice(out: Path, chance: Chance) -> None:
    """Put a second, different result for the same rows beside the first."""
    part = _part(out, chance)
    table = pq.read_table(out / part.name)
    column = table["max_displacement_m"].combine_chunks().fill_null(chance.uniform(0.0, 1.0))
    put(out, part, table.set_column(table.column_names.index("max_displacement_m"), "max_displacement_m", column))


def overlapping(out: Path, chance: Chance) -> None:
    """Put rows beside the others that two ranges hold already."""
    part = _part(out, chance)
    table = pq.read_table(out / part.name)
    put(out, part._replace(stop=part.stop - chance.randint(1, 50)), table)


def a_folder(out: Path, chance: Chance) -> None:
    """Put a folder in the place of a part."""
    path = out / _part(out, chance).name
    path.unlink()
    path.mkdir()


def a_link_to_nothing(out: Path, chance: Chance) -> None:
    """Put a link that leads nowhere in the place of a part."""
    path = out / _part(out, chance).name
    path.unlink()
    path.symlink_to(out / "nowhere")


def gone(out: Path, chance: Chance) -> None:
    """Remove a part: the others are the rows that are there."""
    (out / _part(out, chance).name).unlink()


DAMAGES: dict[str, Callable[[Path, Chance], None]] = {
    damage.__name__: damage
    for damage in (
        flip,
        scribble,
        cut,
        longer,
        renamed,
        other_rows,
        other_hash,
        of_another_run,
        of_a_longer_table,
        other_columns,
        fewer_rows,
        twice,
        overlapping,
        a_folder,
        a_link_to_nothing,
        gone,
    )
}


def _part(out: Path, chance: Chance) -> PartFile:
    return part_of(out, chance.randrange(PARTS))


def _content(out: Path, chance: Chance) -> tuple[Path, bytearray]:
    path = out / _part(out, chance).name
    return path, bytearray(path.read_bytes())


def _taken(out: Path, chance: Chance) -> tuple:
    part = _part(out, chance)
    table = pq.read_table(out / part.name)
    (out / part.name).unlink()
    return part, table


def main() -> None:
    """Damage as often as asked for, and print the outcome."""
    folder, damages, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    chance, kinds = random.Random(seed), list(DAMAGES)
    finished = finished_folder(folder / "whole")
    whole, rows = parts_of(finished), read(finished)
    told, faults = Counter[str](), list[str]()
    for number in range(damages):
        kind, out = kinds[number % len(kinds)], folder / "damaged"
        shutil.copytree(finished, out)
        DAMAGES[kind](out, chance)
        try:
            found = read(out)
            told["read: the intact rows"] += 1
            if kind != "gone" or not found.equals(
                rows[rows["design_id"].isin(found["design_id"])].reset_index(drop=True)
            ):
                faults.append(f"{number}, {kind}: read without a word")
        except BoulderSweepError as refused:
            told["read: refused"] += 1
            if not str(refused).isprintable():
                faults.append(f"{number}, {kind}: {refused!r}")
        except Exception as problem:
            faults.append(f"{number}, {kind}: reading ends in {problem!r}")
        try:
            run(grid(), out, resume=True, simulate=plausible)
            told["resumed: the same files"] += 1
            if parts_of(out) != whole:
                faults.append(f"{number}, {kind}: other files after a resumed run")
        except BoulderSweepError as refused:
            told["resumed: refused"] += 1
            if not str(refused).replace("\n", " ").isprintable():
                faults.append(f"{number}, {kind}: {refused!r}")
        except Exception as problem:
            faults.append(f"{number}, {kind}: resuming ends in {problem!r}")
        shutil.rmtree(out)
    print(json.dumps({"damages": damages, "told": told, "faults": faults}))


if __name__ == "__main__":
    main()
