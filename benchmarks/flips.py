"""Which verdicts have changed since they were frozen: ``python -m benchmarks.flips``.

Random designs over every law, reading, shape and ground, and the grids of ``configs/``, are run as a user would run
them. Verdicts, reasons, grades and largest rotations are compared with those frozen in ``flips.parquet``; changes on
the unsafe side, from fail or undecided to pass or to a better grade, are counted apart. Exit code 1 if anything has
changed. ``--tenth`` takes every tenth random design, ``--record`` freezes what the code gives now, ``--file`` names
another record: one made on another commit tells what a change of the code does.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from boulder_sweep import Sweep, load, read, run
from boulder_sweep.columns import GRADES
from boulder_sweep.designs import SIDES
from boulder_sweep.judge.verdict import PENETRATION_LIMITS_M

from .report import FOLDER

RECORD = FOLDER / "flips.parquet"
DEPTH = "site.embedment_depth=1.9 m"
"""Of a file that leaves it to be found."""
CONFIGS = ("m30_sizing", "site", "abg", "rwg", "crash_tests")
"""Files of ``configs/`` without distributions, which `sweep run` refuses."""
DEGREES_PER_UNIT = 1e-4
"""Resolution of the frozen rotations: finer than any printed one, and small in the file [deg]."""
NOTABLE_DEG = 1e-3
"""Changes of a largest rotation from which it counts as changed [deg]."""
EDGE_DEG, EDGE_M = NOTABLE_DEG, 1e-5
"""Where a rotation or a length, with or without its error, is so close to a limit, rounding may decide the verdict:
processors differ in the last bits [deg], [m]."""
REACHED = 1e-9
"""A rotation or length this close to a limit is the limit itself: degrees come from radians [deg], [m]."""
MOST_ROUNDED = 1e-4
"""Fraction of the designs, or one of them, whose verdict rounding may have changed."""
MOST_UNSETTLED = 1e-3
"""Fraction of the designs whose rotation may move within its stated error: of some that rock, the last bits of another
processor settle it."""
SETTLED_BY = ["verdict", "reason", "robustness", "stands_under"]
"""Columns of words that are frozen; empty where a row has none."""
TENTH = 10
SHOWN = 10


@dataclass(frozen=True)
class Case:
    """Random designs under one model.

    Parameters
    ----------
    designs
        How many.
    settings
        Lines of the settings file beside the table of designs.
    ranges
        Ranges that replace `RANGES`.
    outlined
        Whether the settings give the boulder's outline, and with it the sides, in place of the table.
    """

    designs: int
    settings: str = ""
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    outlined: bool = False


SWITCHES = ("inertia", "impact_arm", "contact", "restoring", "separation")
CORRECTED_WORDS = ("box", "geometric", "left_face", "gravity", "released")
LAYERS = (
    "layers: [{from: 0.5 m, density: 2000 kg/m^3, friction_angle: 36 deg, subgrade_reaction: 40 MN/m^3, "
    "cohesion: 2 kPa}, {from: 1.2 m, density: 2100 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 80 MN/m^3}]"
)
WATER = "water_table: 0.8 m"
PROFILE = (
    "boulder: {profile: [{height: 0 m, width: 1.3 m, near: 0.65 m, far: 0.65 m}, "
    "{height: 0.5 m, width: 1.6 m, near: 1.05 m, far: 0.7 m}, {height: 1.6 m, width: 1.7 m, near: 1 m, far: 0.6 m}, "
    "{height: 3 m, width: 1.5 m, near: 1.05 m, far: 0.55 m}, {height: 3.4 m, width: 0.5 m, near: 0.7 m, far: -0.2 m}]}"
)
"""A stone that leans towards the vehicle and ends in a tip."""
LOW = {
    "boulder_length_m": (1.0, 3.0),
    "boulder_height_m": (1.2, 3.0),
    "embedment_ratio": (0.1, 0.45),
    "impact_speed_m_s": (3.0, 15.0),
}
"""Shallow boulders, which slide, rock, and are decided late."""
SECOND_OPINIONS = "model: {second_opinion: [broms, width_capped]}"
CASES: dict[str, Case] = {
    "corrected, balanced": Case(35_000),
    "corrected, fast": Case(10_000, "solver: {accuracy: fast}"),
    "corrected, fine": Case(5_000, "solver: {accuracy: fine}"),
    "as printed": Case(8_000, "model: {readings: as_printed}"),
    **{
        f"corrected but {switch}": Case(1_500, f"model: {{readings: {{preset: corrected, {switch}: printed}}}}")
        for switch in SWITCHES
    },
    **{
        f"as printed but {switch}": Case(1_500, f"model: {{readings: {{preset: as_printed, {switch}: {word}}}}}")
        for switch, word in zip(SWITCHES, CORRECTED_WORDS, strict=True)
    },
    "broms": Case(6_000, "model: {resistance: broms}"),
    "width_capped": Case(6_000, "model: {resistance: width_capped}"),
    "elements": Case(1_000, "model: {soil: {elements: 50}}"),
    "layers": Case(2_000, f"soil: {{{LAYERS}}}"),
    "layers, broms": Case(750, f"soil: {{{LAYERS}}}\nmodel: {{resistance: broms}}"),
    "cohesion": Case(1_000, "soil: {cohesion: 5 kPa}"),
    "water at the soil line": Case(1_500, "soil: {water_table: 0 m}"),
    "water below": Case(1_500, "soil: {water_table: 0.8 m}"),
    "slope": Case(1_500, "soil: {slope: 10 deg}"),
    "limit of 30 degrees": Case(1_250, "criterion: {max_rotation: 30 deg}"),
    "layers, water": Case(1_000, f"soil: {{{LAYERS}, {WATER}}}"),
    "layers, water, slope, width_capped": Case(
        1_000, f"soil: {{{LAYERS}, {WATER}, slope: 10 deg}}\nmodel: {{resistance: width_capped}}"
    ),
    "taper": Case(2_000, "boulder: {taper: 0.7}"),
    "taper, wider at the top": Case(1_000, "boulder: {taper: 1.25}"),
    "taper, layers, water": Case(1_000, f"boulder: {{taper: 0.7}}\nsoil: {{{LAYERS}, {WATER}}}"),
    "taper, shallow": Case(1_000, "boulder: {taper: 0.7}", LOW),
    "profile": Case(1_000, PROFILE, outlined=True),
    "profile, as printed": Case(300, f"{PROFILE}\nmodel: {{readings: as_printed}}", outlined=True),
    "profile, layers": Case(500, f"{PROFILE}\nsoil: {{{LAYERS}}}", outlined=True),
    "profile, layers, water, slope": Case(500, f"{PROFILE}\nsoil: {{{LAYERS}, {WATER}, slope: 10 deg}}", outlined=True),
    "shallow": Case(5_000, ranges=LOW),
    "shallow, fast": Case(1_000, "solver: {accuracy: fast}", LOW),
    "shallow, as printed": Case(500, "model: {readings: as_printed}", LOW),
    "shallow, broms": Case(1_000, "model: {resistance: broms}", LOW),
    "shallow, water": Case(1_000, "soil: {water_table: 0 m}", LOW),
    "second opinions": Case(1_500, SECOND_OPINIONS),
    "second opinions, shallow": Case(500, SECOND_OPINIONS, LOW),
}
"""Names and models of the random designs."""
RANGES = {
    "boulder_length_m": (0.6, 2.0),
    "boulder_width_m": (0.8, 2.5),
    "boulder_height_m": (1.5, 4.0),
    "boulder_density_kg_m3": (2400.0, 3074.0),
    "embedment_ratio": (0.25, 0.8),
    "soil_density_kg_m3": (1520.0, 2240.0),
    "friction_angle_deg": (27.0, 49.0),
    "subgrade_reaction_MN_m3": (2.0, 110.0),
    "strain_rate_factor": (1.0, 1.2),
    "vehicle_mass_kg": (4000.0, 12000.0),
    "impact_speed_m_s": (6.0, 20.0),
    "vehicle_spring_N_m": (1.0e6, 8.0e6),
    "vehicle_damper_N_s_m": (0.04e6, 0.4e6),
    "bumper_height_m": (0.45, 0.55),
    "hood_height_m": (1.3, 1.6),
    "bed_offset_m": (2.5, 3.2),
}
"""Least and largest value of each column; all drawn evenly."""


def drawn(name: str, case: Case, every: int = 1) -> pd.DataFrame:
    """Draw the designs of a case, always the same ones, and return one of `every` of them."""
    rng = np.random.default_rng(int.from_bytes(sha256(name.encode()).digest()[:8], "big"))
    ranges = {column: case.ranges.get(column, usual) for column, usual in RANGES.items()}
    designs = pd.DataFrame({column: rng.uniform(*ends, case.designs) for column, ends in ranges.items()})
    return designs.drop(columns=list(SIDES) if case.outlined else []).iloc[::every]


def outcomes(cases: Mapping[str, Case], configs: tuple[str, ...], every: int = 1) -> Iterator[tuple[str, pd.DataFrame]]:
    """Run every case and every file; yield its name and what is compared.

    Parameters
    ----------
    cases
        Models and numbers of random designs.
    configs
        Names of files in ``configs/``; of their grids no design is left out, which takes a second.
    every
        Of the random designs of a case the first is run, and every so many after it.

    Yields
    ------
    str, DataFrame
        Name; for each design its number ``row``, the words of `SETTLED_BY`, the largest rotation ``max_rotation`` as a
        whole number of units, null for none, whether it is ``at_edge``, see `is_at_edge`, and the estimated error
        ``error_deg`` of the rotation, NaN for none, which is not frozen.
    """
    with tempfile.TemporaryDirectory(prefix="sweep-flips-") as name:
        folder = Path(name)
        files = {f"configs/{config}.yaml": FOLDER.parent / "configs" / f"{config}.yaml" for config in configs}
        for number, (title, case) in enumerate(cases.items()):
            drawn(title, case, every).to_parquet(folder / f"{number}.parquet", index=False)
            files[title] = folder / f"{number}.yaml"
            files[title].write_text(f"name: flips\ntable: {number}.parquet\n{case.settings}\n")
        for title, file in files.items():
            # The other cases freeze what passes are worth without being asked.
            asked = SECOND_OPINIONS in cases[title].settings if title in cases else False
            chosen = [] if asked else ["model.second_opinion=none"]
            out, sweep = folder / f"{file.stem}.sweep", load(file, chosen)
            if sweep.depth_sought:
                sweep = load(file, [*chosen, DEPTH])
            run(sweep, out)
            frame = read(out)
            found = frame[SETTLED_BY].astype("string").fillna("").astype(str)
            found["row"] = np.arange(len(frame)) * (every if title in cases else 1)
            found["max_rotation"] = (frame["max_rotation_deg"] / DEGREES_PER_UNIT).round().astype("Int32")
            found["at_edge"] = is_at_edge(frame, sweep)
            found["error_deg"] = frame["rotation_error_deg"].astype(float)
            yield title, found


def is_at_edge(frame: pd.DataFrame, sweep: Sweep) -> np.ndarray:
    """Return where the last bits may decide which rule applies to a row of a result, bool, shape (n,).

    A rotation that is the limit itself has reached it, nobody knows how clearly, and counts as none.
    """
    criterion = sweep.criterion
    distances = (
        (criterion.max_rotation_deg - frame["max_rotation_deg"], frame["rotation_error_deg"], EDGE_DEG),
        (PENETRATION_LIMITS_M[criterion.rating] - frame["penetration_m"], frame["displacement_error_m"], EDGE_M),
        (frame["bed_offset_m"] - frame["vehicle_crush_m"], frame["displacement_error_m"], EDGE_M),
    )
    edges = [
        (room.abs() > REACHED) & ((room.abs() < edge) | ((room - error).abs() < edge))
        for room, error, edge in distances
    ]
    return np.logical_or.reduce([edge.to_numpy(bool) for edge in edges])


def write(found: Mapping[str, pd.DataFrame], path: Path = RECORD) -> None:
    """Write what `outcomes` gave of whole cases as one small Parquet file."""
    kept = [frame.assign(case=case)[["case", *SETTLED_BY, "max_rotation", "at_edge"]] for case, frame in found.items()]
    table = pa.Table.from_pandas(pd.concat(kept, ignore_index=True), preserve_index=False)
    names = ["case", *SETTLED_BY]
    pq.write_table(table, path, compression="zstd", compression_level=19, use_dictionary=names)


def recorded(path: Path) -> dict[str, pd.DataFrame]:
    """Read a record: the rows of each case, in their order."""
    record = pq.read_table(path).to_pandas()
    return {str(case): rows.reset_index(drop=True) for case, rows in record.groupby("case", sort=False)}


@dataclass(frozen=True)
class Changes:
    """What differs in one case between the record and now.

    Attributes
    ----------
    case : str
        Its name.
    designs : int
        How many were compared.
    verdicts, reasons, grades, unsafe, rotations, unsettled, rounded : int
        Designs with another verdict; with the same one for another reason; with another grade of a pass; among
        them all that pass now and did not, or have a better grade; with a largest rotation that moved by at least
        `NOTABLE_DEG` and more than its error, or not more. Where a verdict or reason may have changed by rounding
        alone, it is counted as rounded only.
    largest_deg : float
        Largest change of a largest rotation [deg].
    flips : DataFrame
        Designs with another verdict, reason or grade: row, was, now, was_deg, now_deg, unsafe, rounded.
    """

    case: str
    designs: int
    verdicts: int
    reasons: int
    grades: int
    unsafe: int
    rotations: int
    unsettled: int
    rounded: int
    largest_deg: float
    flips: pd.DataFrame


def compared(case: str, record: pd.DataFrame, now: pd.DataFrame) -> Changes:
    """Compare the rows of a case with its record.

    Parameters
    ----------
    case
        Its name.
    record
        All of its rows.
    now
        What `outcomes` gives of all or some of them.

    Raises
    ------
    ValueError
        The record has fewer designs, or others.
    """
    if now["row"].max() >= len(record):
        raise ValueError(f"{case}: design {now['row'].max()} is not among the {len(record)} of the record")
    now = now.reset_index(drop=True)
    before = record.iloc[now["row"]].reset_index(drop=True)
    was_deg, now_deg = (
        frame["max_rotation"].astype("Float64").to_numpy(float, na_value=np.nan) * DEGREES_PER_UNIT
        for frame in (before, now)
    )
    change = np.abs(now_deg - was_deg)
    moved = (np.isnan(was_deg) != np.isnan(now_deg)) | (change > NOTABLE_DEG - 0.5 * DEGREES_PER_UNIT)
    unsettled = moved & (change <= now["error_deg"].to_numpy())
    other = {name: (before[name] != now[name]).to_numpy() for name in SETTLED_BY}
    verdict = other["verdict"]
    reason = ~verdict & other["reason"]
    grade = ~verdict & (other["robustness"] | other["stands_under"])
    rounded = (verdict | reason) & ~moved & (before["at_edge"] | now["at_edge"]).to_numpy()
    better = before["robustness"].map(RANKS).to_numpy() < now["robustness"].map(RANKS).to_numpy()
    unsafe = ~rounded & ((verdict & (now["verdict"] == "pass").to_numpy()) | (grade & better))
    shown = verdict | reason | grade
    flips = pd.DataFrame(
        {
            "row": now["row"][shown],
            "was": _words(before[shown]),
            "now": _words(now[shown]),
            "was_deg": was_deg[shown],
            "now_deg": now_deg[shown],
            "unsafe": unsafe[shown],
            "rounded": rounded[shown],
        }
    )
    return Changes(
        case=case,
        designs=len(now),
        verdicts=int((verdict & ~rounded).sum()),
        reasons=int((reason & ~rounded).sum()),
        grades=int((grade & ~rounded).sum()),
        unsafe=int(unsafe.sum()),
        rotations=int((moved & ~unsettled).sum()),
        unsettled=int(unsettled.sum()),
        rounded=int(rounded.sum()),
        largest_deg=float(np.nanmax(change, initial=0.0)),
        flips=flips,
    )


RANKS = {"": -1} | {grade: rank for rank, grade in enumerate(("sensitive", "open", "robust"))}
"""Grades from the worst to the best."""
assert set(RANKS) == {"", *GRADES}


def _words(rows: pd.DataFrame) -> list[str]:
    """Return verdict, reason and grade of each row as one text."""
    return [", ".join(filter(None, words)) for words in rows[SETTLED_BY].itertuples(index=False)]


def is_held(changes: list[Changes]) -> bool:
    """Whether the record holds: nothing has changed, but for a few verdicts by rounding and rotations within errors."""
    designs = sum(each.designs for each in changes)
    changed = sum(each.verdicts + each.reasons + each.grades + each.rotations for each in changes)
    rounded, unsettled = (sum(getattr(each, name) for each in changes) for name in ("rounded", "unsettled"))
    return not changed and rounded <= max(1.0, MOST_ROUNDED * designs) and unsettled <= MOST_UNSETTLED * designs


COUNTED = ("designs", "verdicts", "reasons", "grades", "unsafe", "rotations", "unsettled", "rounded")


def report(changes: list[Changes]) -> str:
    """Return the tables that the command prints."""
    lines = [f"{'case':<34} {' '.join(f'{name:>9}' for name in COUNTED)}  largest [deg]"]
    for each in changes:
        counts = " ".join(f"{getattr(each, name):9d}" for name in COUNTED)
        lines.append(f"{each.case:<34} {counts}  {each.largest_deg:.4f}")
    sums = " ".join(f"{sum(getattr(each, name) for each in changes):9d}" for name in COUNTED)
    lines.append(f"{'together':<34} {sums}")
    every = pd.concat([each.flips.assign(case=each.case) for each in changes], ignore_index=True)
    every["moved"] = (every["now_deg"] - every["was_deg"]).abs()
    unsafe, rounded = every["unsafe"].to_numpy(bool), every["rounded"].to_numpy(bool)
    for title, flips in (
        ("unsafe changes: fail or undecided before, pass now, or a better grade", every[unsafe]),
        ("other changes of verdict, reason or grade", every[~unsafe & ~rounded]),
        ("changes that rounding alone may have made", every[rounded]),
    ):
        lines.append(f"\n{title}: {len(flips)}" + (f"; the {SHOWN} largest" if len(flips) > SHOWN else ""))
        for flip in flips.sort_values("moved", ascending=False).head(SHOWN).itertuples():
            angles = f"{flip.was_deg:.4f} -> {flip.now_deg:.4f} deg"
            lines.append(f"  {flip.case}, row {flip.row}: {flip.was} -> {flip.now}, {angles}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flips", description=__doc__)
    parser.add_argument("--record", action="store_true", help="freeze what the code gives now")
    parser.add_argument("--tenth", action="store_true", help="compare every tenth random design, and the grids whole")
    parser.add_argument("--file", type=Path, default=RECORD, help="the record (default %(default)s)")
    arguments = parser.parse_args()
    if arguments.record and arguments.tenth:
        parser.error("--record freezes every design, without --tenth")
    known = {} if arguments.record else recorded(arguments.file)
    if not arguments.record and known.keys() != (expected := {*CASES, *(f"configs/{name}.yaml" for name in CONFIGS)}):
        parser.error(f"{arguments.file} holds other cases ({sorted(known.keys() ^ expected)}): freeze it with --record")
    found = {}
    for case, frame in outcomes(CASES, CONFIGS, TENTH if arguments.tenth else 1):
        print(f"{case}: {len(frame)} designs", flush=True)
        found[case] = frame
    if arguments.record:
        write(found, arguments.file)
        return 0
    changes = [compared(case, known[case], frame) for case, frame in found.items()]
    print(report(changes))
    return 0 if is_held(changes) else 1


if __name__ == "__main__":
    sys.exit(main())
