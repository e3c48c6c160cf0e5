"""Six worked sites: settings files of the repository, the answer to each in two sentences, and its picture."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from boulder_sweep import load, need, read, run, simulate, uncertainty
from boulder_sweep.views.verdict_map import draw_verdict_map
from boulder_sweep.views.wording import terms_line

MPH = 0.44704
FOOT = 0.3048
FILL_ONLY = "soil.layers=[{from: 1 m, density: 1900 kg/m^3, friction_angle: 38 deg, subgrade_reaction: 60 MN/m^3}]"
"""The terrace as it would be if its fill reached to the foot of the boulder."""


@dataclass(frozen=True)
class Site:
    """One site of the gallery.

    Attributes
    ----------
    name : str
        Of its settings file and its picture.
    answer : Callable[[Path, Path], str]
        Takes its settings file and the picture to draw, returns the answer.
    """

    name: str
    answer: Callable[[Path, Path], str]

    def settings(self, root: Path) -> Path:
        """Return its settings file in the folder of the repository."""
        return root / "configs" / f"{self.name}.yaml"

    def words(self, root: Path) -> str:
        """Return the answer in two sentences."""
        with tempfile.TemporaryDirectory() as scratch:
            return self.answer(self.settings(root), Path(scratch) / "picture.png")


def embassy_street(file: Path, picture: Path) -> str:
    """Return the boulder that is recommended, and what the narrower ones lack."""
    found = need(load(file))
    found.plot(picture)
    assert found.recommendation is not None
    assert found.recommendation.design is not None
    best, blocked = found.recommendation.design.sizes, found.frame[found.frame.found == "blocked_by_overlap"]
    narrow = blocked[blocked.boulder_width_m == blocked.boulder_width_m.min()]
    width, height, depth = (best[name] for name in ("boulder_width_m", "boulder_height_m", "embedment_depth_m"))
    return (
        "The lightest boulder that is robust with a quarter to spare has "
        f"{best['boulder_mass_kg'] / 1e3:.1f} t: {width:.1f} m wide, {height:.1f} m high and {depth:.2f} m deep; "
        f"{height - depth:.2f} m stand above the ground. Of those {narrow.boulder_width_m.min():.1f} m wide, heights "
        f"up to {narrow.boulder_height_m.max():.1f} m are blocked: buried deep enough, they no longer reach the bumper."
    )


def wet_backfill(file: Path, picture: Path) -> str:
    """Return which share of the boulders passes at each speed, and the lowest of them."""
    sweep = load(file)
    with tempfile.TemporaryDirectory() as scratch:
        run(sweep, Path(scratch) / "out.sweep")
        table = read(Path(scratch) / "out.sweep")
    draw_verdict_map(table, picture, title=sweep.name, terms=terms_line(sweep.resolved(), "us"), units="us")
    shares, lowest = [], []
    for speed, rows in table.groupby("impact_speed_m_s"):
        passes = rows[rows.verdict == "pass"]
        shares.append(f"{len(passes) / len(rows):.0%} at {speed / MPH:.0f} mph")
        least = passes.boulder_height_m.min()
        ratio = passes[passes.boulder_height_m == least].eval("embedment_depth_m / boulder_height_m").min()
        lowest.append(f"{least / FOOT:g} ft high, {ratio:.0%} of it buried, at {speed / MPH:.0f} mph")
    return f"Of the boulders {' and '.join(shares)} pass. The lowest that do are {' and '.join(lowest)}."


def clayey_terrace(file: Path, picture: Path) -> str:
    """Return how far the boulder turns in its layers, and how far if the fill reached to its foot."""
    impact = simulate(load(file))
    impact.plot(picture)
    layered, fill = impact.summary(), simulate(load(file, [FILL_ONLY])).summary()
    return (
        f"The boulder {'passes' if layered['verdict'] == 'pass' else 'does not pass'}: it turns by "
        f"{layered['max_rotation_deg']:.1f}°, {20.0 - layered['max_rotation_deg']:.1f}° less than the limit, and the "
        f"truck moves {layered['max_vehicle_displacement_m']:.2f} m after first touch. If the fill reached down to its "
        f"foot, it would turn by {fill['max_rotation_deg']:.1f}°."
    )


def embankment(file: Path, picture: Path) -> str:
    """Return the lowest boulders that stop the truck at the speed of the file, and what the slope takes."""
    found = need(load(file), most="speed", margin=0.0)
    found.plot(picture)
    level = need(load(file, ["soil.slope=0 deg"]), most="speed", margin=0.0, robust=False).frame.most_impact_speed_m_s
    rows = found.frame
    lost = 1.0 - rows.most_impact_speed_m_s / level
    at = 30.0 * MPH
    stop = [
        f"{own[own.most_impact_speed_m_s >= at].boulder_height_m.min():.1f} m high where they are {width:.1f} m wide"
        for width, own in rows.groupby("boulder_width_m")
    ]
    return (
        f"At 30 mph ({at:.1f} m/s) boulders must be {' and '.join(stop)}. The slope takes {lost.min():.0%} to "
        f"{lost.max():.0%} off the speed that the same boulders withstand on level ground."
    )


def quarry_stone(file: Path, picture: Path) -> str:
    """Return the least depths in the weakest and the strongest soil of the file."""
    found = need(load(file))
    found.plot(picture)
    rows = found.frame.sort_values("friction_angle_deg")
    weak, strong = rows.iloc[0], rows.iloc[-1]
    return (
        f"To stay a quarter below every limit, the stone must be {weak.least_embedment_depth_m:.3f} m deep in soil of "
        f"{weak.friction_angle_deg:.0f}° and {strong.least_embedment_depth_m:.3f} m in soil of "
        f"{strong.friction_angle_deg:.0f}°. A stone with a profile has no second opinion yet, so keep the margin."
    )


def uncertain_site(file: Path, picture: Path) -> str:
    """Return the probability of passing and the depth for 95 %."""
    found = uncertainty(load(file))
    found.plot(picture)
    row = found.frame.iloc[0]
    deep = need(load(file), probability=0.95).frame.iloc[0]
    driver = row.p_pass_driver.rpartition(".")[2].replace("_", " ")
    return (
        f"At {row.embedment_depth_m:.1f} m the boulder passes with a probability of {row.p_pass:.0%} "
        f"({row.p_pass_low:.1%} to {row.p_pass_high:.1%}), and the {driver} decides. "
        f"A probability of 95% needs {deep.least_embedment_depth_m:.2f} m."
    )


SITES = tuple(
    Site(answer.__name__, answer)
    for answer in (embassy_street, wet_backfill, clayey_terrace, embankment, quarry_stone, uncertain_site)
)


def draw_sites(root: Path, folder: Path) -> list[Path]:
    """Draw the picture of every site into a folder; return the pictures."""
    drawn = [folder / f"{site.name}.png" for site in SITES]
    for site, picture in zip(SITES, drawn, strict=True):
        site.answer(site.settings(root), picture)
    return drawn
