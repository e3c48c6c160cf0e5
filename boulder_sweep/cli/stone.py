"""``sweep stone``: volume, mass, foot and profile of a scanned boulder."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from boulder_sweep.cli.options import (
    OUTPUT,
    Quantity,
    at_option,
    json_option,
    margin_option,
    quantity_of,
    quiet_option,
    refuse_unwritable,
    say_notes,
    set_option,
)
from boulder_sweep.cli.output import say, show, working
from boulder_sweep.stones.rock import ROCK_KG_M3
from boulder_sweep.text import counted

if TYPE_CHECKING:
    from boulder_sweep.answers.placing import Placing, Way
    from boulder_sweep.answers.printing import Cell
    from boulder_sweep.settings import Sweep
    from boulder_sweep.stones.standing import Standing
    from boulder_sweep.stones.weighing import ScannedStone

T = TypeVar("T")
EXAMPLES = """\b
Examples:
  sweep stone rock.ply --mass '18.2 t'
  sweep stone rock.ply --mass '18.2 t' --up a --facing b
  sweep stone rock.stl --unit mm
  sweep stone rock.glb --plot rock.png
  sweep stone rock.ply configs/site.yaml --mass '18.2 t' --plot rock.png
"""


@click.command("stone", short_help="Volume, mass, foot and profile of a scanned boulder.", epilog=EXAMPLES)
@click.argument("rock", type=click.Path())
@click.argument("site", type=click.Path(), required=False)
@click.option(
    "--mass",
    type=Quantity("kg"),
    metavar="'18.2 t'",
    help=f"Mass of the whole boulder [default: rock of {ROCK_KG_M3:g} kg/m³].",
)
@click.option("--unit", default="m", metavar="UNIT", help="Unit of the scan: m, mm, cm, in or ft [m].")
@click.option("--up", metavar="END", help="End that is up, for a block of settings: a, -a, b, -b, c, -c, x, ...")
@click.option("--facing", metavar="END", help="End that faces the vehicle, with --up.")
@click.option("--plot", type=OUTPUT, metavar="F.png", help="Draw it with each end up; with SITE the best ways.")
@margin_option
@at_option
@set_option
@quiet_option
@json_option
def stone(
    rock: str,
    site: str | None,
    mass: str | None,
    unit: str,
    up: str | None,
    facing: str | None,
    plot: str | None,
    margin: str,
    at: str | None,
    overrides: tuple[str, ...],
    quiet: bool,
    as_json: bool,
) -> int:
    """Weigh and measure ROCK, a scan of a boulder (.ply, .stl, .obj or .glb).

    The scan is closed where it is open. Every way to stand gets a flat foot by the least cut, and a profile: width
    and distances of the near and the far face over the height. The ends a, b and c belong to the long, the middle and
    the short axis of the boulder, a the slimmer end and -a the other; x, y and z are the axes of the scan.

    With SITE, a settings file, the scan takes the place of its boulder. For each of the 24 ways to stand, the command
    finds the depth from which on it passes in all soils and before all vehicles of the file.
    """
    if (up is None) != (facing is None):
        raise click.UsageError("--up and --facing belong together; give both")
    if site is None and (overrides or at is not None or margin != "0"):
        raise click.UsageError("--set, --at and --margin belong to a SITE")
    if site is not None and mass is None:
        raise click.UsageError("at a site the boulder must be weighed: give --mass")
    mass_kg = None if mass is None else quantity_of("--mass", mass, "kg")
    metres = quantity_of("--unit", f"1 {unit}", "m")
    refuse_unwritable(None, plot)
    from boulder_sweep.stones.weighing import scanned

    scan = scanned(rock, metres=metres, mass_kg=mass_kg)
    for caution in scan.cautions:
        say(f"caution: {caution}")
    chosen = None if up is None or facing is None else (scan.stone.standing(up, facing),)
    if site is not None:
        result = _find_placing(scan, site, chosen, margin, at, overrides, quiet)
        text = [*stone_lines(scan), "", *placing_lines(result, rock, unit, site)]
        show(*([json.dumps(result.to_dict())] if as_json else text))
    elif as_json:
        show(json.dumps(scan.to_dict(chosen)))
    else:
        ways = standing_lines(scan) if chosen is None else settings_lines(scan, *chosen)
        show(*stone_lines(scan), "", *ways)
    if plot is not None:
        (scan if site is None else result).plot(plot)
    return 0


def _find_placing(
    scan: ScannedStone,
    site: str,
    standings: tuple[Standing, ...] | None,
    margin: str,
    at: str | None,
    overrides: tuple[str, ...],
    quiet: bool,
) -> Placing:
    """Find the best ways to stand at a site, among all or among some."""
    from boulder_sweep.answers.placing import placed
    from boulder_sweep.judge.quantiles import at_values
    from boulder_sweep.settings import load

    said = False

    def with_boulder(block: str) -> Sweep:
        """Return the site with a boulder; what is to be said of it is said once."""
        nonlocal said
        sweep = load(site, (*overrides, block))
        sweep = sweep if at is None else at_values(sweep, at)
        if not (quiet or said):
            say_notes(sweep)
        said = True
        return sweep

    if not any(standing.has_foot for standing in standings or scan.standings):
        raise click.UsageError("no way to stand has a flat foot; bed the boulder in concrete")
    with working(quiet, "placing", "ways") as progress:
        return placed(scan, with_boulder, standings, margin=margin, progress=progress)


def placing_lines(result: Placing, rock: str, unit: str, site: str) -> list[str]:
    """Return the ways to stand at a site, the one of least depth first, and a block of settings for that one."""
    from boulder_sweep.answers.placing import SIGNS
    from boulder_sweep.answers.printing import answer_cell, flag_lines, grade_lines

    passing = result.passing
    cases = "" if result.cases == 1 else f", in the worst of {result.cases} combinations of soil and vehicle"
    nothing = Counter(way.why_not for way in result.ways if way.depth_m is None)
    rest = [f"{counted(count, 'way')} to stand: {why}" for why, count in nothing.items()]
    if result.rounded:
        rest.append(f"{counted(result.rounded, 'way')} without a flat foot, not computed")
    if not passing:
        return [f"at {site} there is no depth from which on it passes{cases}", *rest]

    def depth(way: Way) -> float:
        return way.depth_m or 0.0

    answer = answer_cell(result.key, result.key.answer, "found", "si")

    columns: list[tuple[tuple[str, str], Callable[[Way], str]]] = [
        (("up", ""), lambda way: way.standing.up),
        (("facing", ""), lambda way: way.standing.facing),
        (("depth", "m"), lambda way: answer(way.row)),
        (("above", "m"), lambda way: f"{way.standing.profile.height[-1] - depth(way):.2f}"),
        (("turns", "deg"), lambda way: f"{way.row['max_rotation_deg']:.1f}"),
        (("slides", "m"), lambda way: f"{way.row['max_displacement_m']:.2f}"),
        (("foot", "m"), lambda way: foot_text(way.standing)),
        (("cut", "m"), lambda way: f"{way.standing.cut_m:.2f}"),
        (("mass", "t"), lambda way: f"{result.found.density_kg_m3 * way.standing.volume / 1e3:.1f}"),
    ]
    best = passing[0]
    kinds = {way.row["found"] for way in passing}
    words = "" if unit == "m" else f", unit: {unit}"
    return [
        f"at {site}, depth from which on it passes{cases}:",
        *_table(columns, passing),
        "up, facing: the end that is up, and the one that faces the vehicle",
        "above: height over the ground; mass: of what is left after the cut",
        *(words for kind, words in SIGNS.items() if kind in kinds),
        *rest,
        *grade_lines(way.row for way in passing),
        *flag_lines([way.row["validity"] for way in passing]),
        "",
        "# the first of these, for the settings file in place of its boulder",
        "boulder:",
        f"  scan: {{file: {_beside(rock, site)}, up: {best.standing.up}, facing: {best.standing.facing}{words}}}",
        f"  mass: {result.found.mass_kg / 1e3:.12g} t",
        "site:",
        f"  embedment_depth: {depth(best):.3f} m",
    ]


def _beside(rock: str, site: str) -> str:
    """Return the name of a scan from the folder of a settings file, in quotation marks where YAML needs them."""
    name = os.path.relpath(rock, Path(site).parent)
    return name if re.fullmatch(r"[\w./+][\w./+-]*", name) else json.dumps(name, ensure_ascii=False)


def stone_lines(scan: ScannedStone) -> list[str]:
    """Return volume, mass, sides and inertia of a scan as lines."""
    shape = scan.stone
    density = f"{scan.density_kg_m3:,.0f} kg/m³"
    mass = {
        "mass": f"{scan.mass_kg / 1e3:.2f} t as given, {density}",
        "density": f"{scan.mass_kg / 1e3:.2f} t, at {density} as given",
        "assumed": f"{scan.mass_kg / 1e3:.2f} t, if its density is {density}; weigh it and give --mass",
    }
    a, b, c = (f"{side:.2f}" for side in shape.sides_m)
    moments = shape.axes @ shape.solid.inertia @ shape.axes.T * scan.density_kg_m3 / 1e3
    turning = ", ".join(f"{moments[k, k]:.2f}" for k in range(3))
    return [
        f"{scan.file}: {counted(len(shape.solid.faces), 'face')}{'' if shape.solid.repairs else ', closed as it is'}",
        *(f"  repaired    {words}" for words in shape.solid.repairs),
        f"  volume      {shape.solid.volume:.3f} m³",
        f"  mass        {mass[scan.density_from]}",
        f"  sides       a {a}, b {b}, c {c} m: the smallest box around it",
        f"  solidity    {shape.solidity:.2f} of that box, {shape.hull_share:.2f} of the convex hull",
        f"  inertia     {turning} t·m² about a, b, c",
    ]


def standing_lines(scan: ScannedStone) -> list[str]:
    """Return how it can stand: a line for each end up and each pair of opposite faces to the road."""
    columns: list[tuple[tuple[str, str], Callable[[Standing], str]]] = [
        (("up", ""), lambda standing: standing.up),
        (("facing", ""), lambda standing: f"±{standing.facing}"),
        (("height", "m"), lambda standing: f"{standing.profile.height[-1]:.2f}"),
        (("length", "m"), lambda standing: f"{standing.profile.length.max():.2f}"),
        (("width", "m"), lambda standing: f"{standing.profile.width.max():.2f}"),
        (("foot", "m"), foot_text),
        (("cut", "m"), lambda standing: f"{standing.cut_m:.2f}"),
        (("cut", "of mass"), lambda standing: f"{standing.cut_share:.1%}"),
        (("rests", "uncut"), lambda standing: f"{standing.rests:.0%}"),
        (("fit", "m"), lambda standing: f"{standing.profile.error:.3f}"),
    ]
    lines = [
        *_table(columns, [one for one in scan.standings if not one.facing.startswith("-")]),
        "up, facing: the end that is up, and the one that faces the vehicle",
        "cut: cut off below, for a flat foot under the centre of mass",
        "rests: section of the uncut boulder just above the ground over its largest one",
        "fit: error of the profile, root mean square over the volume",
    ]
    if any(not standing.has_foot for standing in scan.standings):
        lines.append("rounded: no cut of a quarter of the height makes a foot; bed it in concrete")
    return lines


def _table(columns: Iterable[tuple[tuple[str, str], Callable[[T], str]]], ways: Iterable[T]) -> list[str]:
    """Return ways to stand as a table; of each column its name and unit, and what it says of one of them."""
    from boulder_sweep.answers.printing import table_lines

    def cell(text: Callable[[T], str]) -> Cell:
        return lambda row: text(row["way"])

    return table_lines([(head, cell(text)) for head, text in columns], [{"way": way} for way in ways])


def settings_lines(scan: ScannedStone, standing: Standing) -> list[str]:
    """Return one way to stand as a block of settings."""
    profile = standing.profile
    points = zip(profile.height, profile.width, profile.near, profile.far, strict=True)
    cut = f", {standing.cut_m:.2f} m cut off for a foot" if standing.cut_m else ""
    return [
        f"# {scan.file}: {standing.up} up, {standing.facing} to the vehicle{cut}",
        "boulder:",
        f"  mass: {scan.density_kg_m3 * standing.volume / 1e3:.3f} t",
        *([f"  density: {scan.density_kg_m3:.0f} kg/m^3"] if scan.density_from != "assumed" else []),
        "  profile:",
        *(f"    - {{height: {z:.3f} m, width: {w:.3f} m, near: {n:.3f} m, far: {f:.3f} m}}" for z, w, n, f in points),
        *([] if standing.has_foot else ["  foot: rounded"]),
    ]


def foot_text(standing: Standing) -> str:
    """Return length and width of a foot, or that there is none."""
    return f"{standing.profile.length[0]:.2f} × {standing.profile.width[0]:.2f}" if standing.has_foot else "rounded"
