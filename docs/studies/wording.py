"""Conclusions in words, their numbers filled in from the studies."""

from __future__ import annotations

import tempfile
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from boulder_sweep.crash_tests.cases import PAPERS_N
from boulder_sweep.settings import load
from boulder_sweep.settings.model import SWITCHES
from docs.studies.example_pulse import example_pulse

if TYPE_CHECKING:
    from boulder_sweep.crash_tests.cases import Convergence
    from docs.studies.energy import Balance
    from docs.studies.readings import ReadingRow, ReadingsStudy


def convergence_words(study: Convergence) -> str:
    """What the study of soil elements shows."""
    printed, corrected = (study.difference("rwg", preset, PAPERS_N) for preset in ("as_printed", "corrected"))
    first, second = (study.order("rwg", preset) for preset in ("as_printed", "corrected"))
    hundred = abs(study.difference("rwg", "corrected", 100))
    below = max(abs(corrected), 1e-6)
    return _points(
        f"As printed, the sums approach their limit with order {first:.1f}: at the paper's N = {PAPERS_N} the rotation "
        f"of Rockville White Granite is still {printed:+.4f}° off, small enough to be called no change.",
        f"Corrected, the order is {second:.1f}: at N = {PAPERS_N} the difference is at most {below:.0e}°, and N = 100 "
        f"is already within {hundred:.4f}°.",
    )


def readings_words(study: ReadingsStudy) -> str:
    """What the readings study shows."""
    printed, corrected = study.row("as_printed"), study.row("corrected")
    deciding = study.deciding()
    (most, changes), (second, second_changes), (least, least_changes) = deciding[0], deciding[1], deciding[-1]
    gained, _ = study.changed(study.row("corrected", most))
    return _points(
        f"**`{most}` decides most verdicts.** Read as printed, everything else corrected, it changes "
        f"{changes / study.designs:.1%} of {study.designs:,} designs between standing and not, {gained / changes:.0%} "
        f"of them to standing. `{second}` comes next with {second_changes / study.designs:.1%}; `{least}` is the least "
        f"with {least_changes / study.designs:.1%}.",
        _arm_words(study),
        _preset_words(printed, corrected, study.designs),
        _strictness_words(study),
    )


def _arm_words(study: ReadingsStudy) -> str:
    """What the sign of one length does to the test that passed."""
    before = study.row("as_printed").rwg_rotation_deg
    after = study.row("as_printed", "impact_arm").rwg_rotation_deg
    return (
        f"On the crash test that passed, the sign of d₁ alone (`impact_arm: geometric` in place of printed) moves the "
        f"largest rotation from {before:.2f}° to {after:.2f}°, {after / before:.1f} times as far."
    )


def _preset_words(printed: ReadingRow, corrected: ReadingRow, designs: int) -> str:
    """How far the presets agree."""
    unsafe = int((printed.stands & ~corrected.stands).sum())
    lost = int((corrected.stands & ~printed.stands).sum())
    return (
        f"About as many designs stand by both presets, {printed.share:.1%} as printed and {corrected.share:.1%} "
        f"corrected, because the misprints partly cancel; but they are not the same designs. {unsafe / designs:.1%} "
        f"of all stand as printed and not corrected, {lost / designs:.1%} corrected and not as printed."
    )


def _strictness_words(study: ReadingsStudy) -> str:
    """Which misprints are on the safe side."""
    rows = {switch: study.changed(study.row("corrected", switch)) for switch in SWITCHES}
    safe = [f"`{switch}`" for switch, (gained, _) in rows.items() if gained == 0]
    lax = [f"`{switch}`" for switch, (gained, lost) in rows.items() if gained > lost]
    return (
        f"Seen from `corrected`, with the printed reading only fewer designs stand for {', '.join(safe) or 'none'}; "
        f"more stand than fall for {', '.join(lax) or 'none'}: the unsafe side."
    )


def balance_words(found: list[Balance]) -> str:
    """Where the energy of the crash tests goes."""
    white, black = ({b.test: b for b in found}[test] for test in ("rwg", "abg"))
    crush, soil = ("crush_damper_J", "crush_spring_J"), ("soil_elastic_J", "soil_drag_J")
    moving = ("boulder_linear_J", "boulder_angular_J")
    crushed, into_soil, lifted = (f"{_share(white, *parts):.0%}" for parts in (crush, soil, ("gravity_J",)))
    held_back, in_motion, left = (f"{_share(black, *parts):.0%}" for parts in (crush, moving, ("vehicle_kinetic_J",)))
    drags = " and ".join(f"{_share(balance, 'soil_drag_J'):.1%}" for balance in (white, black))
    return _points(
        f"The boulder that held spends the vehicle's energy on the vehicle itself: {crushed} goes into its crush, "
        f"{into_soil} into the soil, {lifted} into lifting the boulder's weight.",
        f"The boulder that overturned gave way before the vehicle could crush: as it passes 20°, {held_back} has gone "
        f"into crush, {in_motion} is motion of the boulder, and the vehicle still has {left}.",
        f"The drag of the soil takes {drags}: at these speeds the springs of the soil matter, its drag hardly.",
    )


def _share(balance: Balance, *parts: str) -> float:
    return sum(balance.parts_J[part] for part in parts) / balance.initial_J


def _points(*texts: str) -> str:
    return "\n".join(f"- {text}" for text in texts)


def caution_text(root: Path) -> str:
    """Which caution ``sweep check`` prints of a heavy truck on a lighter one's spring, and at which speeds none."""

    def caution(override: str) -> list[str]:
        notes = (str(note) for note in load(root / "configs" / "rwg.yaml", [override]).notes)
        return [note.partition(": ")[2] for note in notes if "against a rigid wall" in note]

    (heavy,) = caution("vehicle.mass=65000 lb")
    speeds = [mph for mph in range(10, 61) if not caution(f"vehicle.speed={mph} mph")]
    return (
        f"```text\n{textwrap.fill(heavy, 100)}\n```\n\nThat is `configs/rwg.yaml` with a truck of 65,000 lb on the "
        "spring and damper of one of 15,000 lb. With its own mass that truck has no caution "
        f"from {speeds[0]} to {speeds[-1]} mph."
    )


def fit_text() -> str:
    """What ``sweep fit-vehicle`` prints for the example."""
    from boulder_sweep.cli.quality import fit_lines
    from boulder_sweep.crash_tests.fitting import fit_pulse
    from boulder_sweep.crash_tests.measured import read_pulse

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "pulse.csv"
        file.write_text(example_pulse(), encoding="utf-8")
        fit = fit_pulse(read_pulse(file), 6800.0)
    return "```text\n" + "\n".join(fit_lines(fit)) + "\n```"
