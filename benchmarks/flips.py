"""Which verdicts have changed since they were frozen: ``python -m benchmarks.flips``.

100 000 random designs over every law and every reading, and the grids of ``configs/``, are run as a user would run them
and compared with the frozen verdicts, reasons and largest rotations in ``flips.parquet``. Changes on the unsafe side,
from fail or undecided to pass, are counted apart. ``--record`` freezes what the code gives now; it is renewed only
where a change of the model is meant, with the reason in the commit.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from .report import FOLDER

RECORD = FOLDER / "flips.parquet"
CONFIGS = ("m30_sizing", "site", "abg", "rwg", "crash_tests")
"""Files of ``configs/`` without distributions, which `sweep run` refuses."""
DEGREES_PER_UNIT = 1e-4
"""Resolution of the frozen rotations: finer than any printed one, and small in the file [deg]."""
NOTABLE_DEG = 1e-3
"""Changes of a largest rotation from which it counts as changed [deg]."""
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
    """

    designs: int
    settings: str = ""


SWITCHES = ("inertia", "impact_arm", "contact", "restoring", "separation")
CORRECTED_WORDS = ("box", "geometric", "left_face", "gravity", "released")
LAYERS = (
    "soil: {layers: [{from: 0.5 m, density: 2000 kg/m^3, friction_angle: 36 deg, subgrade_reaction: 40 MN/m^3, "
    "cohesion: 2 kPa}, {from: 1.2 m, density: 2100 kg/m^3, friction_angle: 40 deg, subgrade_reaction: 80 MN/m^3}]}"
)
STIFFENING = "vehicle: {second_spring: 9000 kN/m, second_spring_from: 0.5 m}"
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
    "plastic": Case(300, "model: {unloading: plastic, soil: {elements: 50}}"),
    "plastic, gap": Case(300, "model: {unloading: plastic_with_gap, soil: {elements: 50}}"),
    "plastic, broms": Case(150, "model: {unloading: plastic, resistance: broms, soil: {elements: 50}}"),
    "second spring": Case(3_000, STIFFENING),
    "second spring, as printed": Case(750, f"{STIFFENING}\nmodel: {{readings: as_printed}}"),
    "layers": Case(2_000, LAYERS),
    "layers, broms": Case(750, f"{LAYERS}\nmodel: {{resistance: broms}}"),
    "cohesion": Case(1_000, "soil: {cohesion: 5 kPa}"),
    "water at the soil line": Case(1_500, "soil: {water_table: 0 m}"),
    "water below": Case(1_500, "soil: {water_table: 0.8 m}"),
    "slope": Case(1_500, "soil: {slope: 10 deg}"),
    "limit of 30 degrees": Case(1_250, "criterion: {max_rotation: 30 deg}"),
}
"""Names and models of the random designs, 100 000 together."""
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


def drawn(name: str, count: int) -> pd.DataFrame:
    """Draw the designs of a case, always the same ones."""
    rng = np.random.default_rng(int.from_bytes(sha256(name.encode()).digest()[:8], "big"))
    return pd.DataFrame({column: rng.uniform(low, high, count) for column, (low, high) in RANGES.items()})


def outcomes(cases: Mapping[str, Case], configs: tuple[str, ...] = CONFIGS) -> Iterator[tuple[str, pd.DataFrame]]:
    """Run every case and every file; yield its name and its result with inputs.

    Parameters
    ----------
    cases
        Models and numbers of random designs.
    configs
        Names of files in ``configs/``.
    """
    from boulder_sweep import load, read, run

    with tempfile.TemporaryDirectory(prefix="sweep-flips-") as name:
        folder = Path(name)
        files = {f"configs/{config}.yaml": FOLDER.parent / "configs" / f"{config}.yaml" for config in configs}
        for number, (title, case) in enumerate(cases.items()):
            drawn(title, case.designs).to_parquet(folder / f"{number}.parquet")
            files[title] = folder / f"{number}.yaml"
            files[title].write_text(f"name: flips\ntable: {number}.parquet\n{case.settings}\n")
        for title, file in files.items():
            out = folder / f"{file.stem}.sweep"
            run(load(file), out)
            yield title, read(out)


def frozen(found: Iterator[tuple[str, pd.DataFrame]]) -> pd.DataFrame:
    """Return what is kept of results: case, verdict, reason, and the largest rotation as a whole number of units."""
    kept = []
    for title, frame in found:
        units = (frame["max_rotation_deg"] / DEGREES_PER_UNIT).round().astype("Int32")
        kept.append(
            pd.DataFrame(
                {"case": title, "verdict": frame["verdict"], "reason": frame["reason"], "max_rotation": units}
            ).astype({"verdict": str, "reason": str})
        )
        print(f"{title}: {len(frame)} designs", flush=True)
    return pd.concat(kept, ignore_index=True)


def write(record: pd.DataFrame, path: Path = RECORD) -> None:
    """Write a frozen record as one small Parquet file."""
    table = pa.Table.from_pandas(record, preserve_index=False)
    names = ["case", "verdict", "reason"]
    pq.write_table(table, path, compression="zstd", compression_level=19, use_dictionary=names)


@dataclass(frozen=True)
class Changes:
    """What differs in one case between the frozen record and now.

    Attributes
    ----------
    case : str
        Its name.
    designs : int
        How many there are.
    verdicts, unsafe, reasons, rotations : int
        Designs with another verdict; those of them that pass now and did not; with the same verdict for another reason;
        with a largest rotation that moved by at least `NOTABLE_DEG`.
    largest_deg : float
        Largest change of a largest rotation [deg].
    flips : DataFrame
        Designs with another verdict: row, was, now, was_deg, now_deg, unsafe.
    """

    case: str
    designs: int
    verdicts: int
    unsafe: int
    reasons: int
    rotations: int
    largest_deg: float
    flips: pd.DataFrame


def compared(case: str, before: pd.DataFrame, now: pd.DataFrame) -> Changes:
    """Compare the frozen rows of a case with those of now.

    Raises
    ------
    ValueError
        There are more or fewer designs than in the record.
    """
    if len(before) != len(now):
        raise ValueError(f"{case}: {len(now)} designs now, {len(before)} in the record")
    before, now = before.reset_index(drop=True), now.reset_index(drop=True)
    was_deg, now_deg = (
        frame["max_rotation"].astype("Float64").to_numpy(float, na_value=np.nan) * DEGREES_PER_UNIT
        for frame in (before, now)
    )
    moved = np.abs(now_deg - was_deg)
    appeared = np.isnan(was_deg) != np.isnan(now_deg)
    other = (before["verdict"] != now["verdict"]).to_numpy()
    unsafe = other & (now["verdict"] == "pass").to_numpy()
    flips = pd.DataFrame(
        {
            "row": np.flatnonzero(other),
            "was": (before["verdict"] + ", " + before["reason"])[other].str.removesuffix(", "),
            "now": (now["verdict"] + ", " + now["reason"])[other].str.removesuffix(", "),
            "was_deg": was_deg[other],
            "now_deg": now_deg[other],
            "unsafe": unsafe[other],
        }
    )
    return Changes(
        case,
        len(now),
        int(other.sum()),
        int(unsafe.sum()),
        int((~other & (before["reason"] != now["reason"]).to_numpy()).sum()),
        int((appeared | (moved >= NOTABLE_DEG)).sum()),
        float(np.nanmax(moved, initial=0.0)),
        flips,
    )


def report(changes: list[Changes]) -> str:
    """Return the tables that the command prints."""
    lines = [f"{'case':<28} {'designs':>8} {'verdict':>8} {'unsafe':>7} {'reason':>7} {'rotation':>9}  largest [deg]"]
    for each in changes:
        counts = f"{each.designs:8d} {each.verdicts:8d} {each.unsafe:7d} {each.reasons:7d} {each.rotations:9d}"
        lines.append(f"{each.case:<28} {counts}  {each.largest_deg:.4f}")
    sums = [sum(getattr(each, name) for each in changes) for name in ("designs", "verdicts", "unsafe", "reasons")]
    lines.append(f"{'together':<28} {sums[0]:8d} {sums[1]:8d} {sums[2]:7d} {sums[3]:7d}")
    every = pd.concat([each.flips.assign(case=each.case) for each in changes], ignore_index=True)
    every["moved"] = (every["now_deg"] - every["was_deg"]).abs()
    for title, flips in (
        ("unsafe changes: fail or undecided before, pass now", every[every["unsafe"]]),
        ("other changed verdicts", every[~every["unsafe"]]),
    ):
        lines.append(f"\n{title}: {len(flips)}" + (f"; the {SHOWN} largest" if len(flips) > SHOWN else ""))
        for flip in flips.sort_values("moved", ascending=False).head(SHOWN).itertuples():
            angles = f"{flip.was_deg:.4f} -> {flip.now_deg:.4f} deg"
            lines.append(f"  {flip.case}, row {flip.row}: {flip.was} -> {flip.now}, {angles}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flips", description=__doc__)
    parser.add_argument("--record", action="store_true", help="freeze what the code gives now")
    parser.add_argument("--file", type=Path, default=RECORD, help="the record (default %(default)s)")
    arguments = parser.parse_args()
    now = frozen(outcomes(CASES))
    if arguments.record:
        write(now, arguments.file)
        return
    record = pq.read_table(arguments.file).to_pandas()
    known = dict(list(record.groupby("case", sort=False)))
    print(report([compared(case, known[case], rows) for case, rows in now.groupby("case", sort=False)]))


if __name__ == "__main__":
    main()
