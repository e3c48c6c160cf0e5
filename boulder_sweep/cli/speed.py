"""``sweep speed``: the largest speed with which a vehicle reaches the boulder, by the street."""

from __future__ import annotations

import json
import textwrap
from typing import TYPE_CHECKING

import click

from boulder_sweep.cli.options import json_option
from boulder_sweep.cli.output import show

if TYPE_CHECKING:
    from boulder_sweep.settings.tree import Mapping

MPH = 0.44704
EXAMPLES = """\b
Examples:
  sweep speed --length '80 m' --from '0 mph' --acceleration '1.2 m/s^2'
  sweep speed --length 260ft --curve-radius 60ft --acceleration '4 ft/s^2'
  sweep speed --length 80m --from 20mph --acceleration 1m/s^2 --grade=-4%

\b
In a settings file, in place of vehicle.speed:
  approach: {length: 80 m, from: 0 mph, acceleration: 1.2 m/s^2}
"""


@click.command("speed", short_help="Speed with which a vehicle reaches the boulder.", epilog=EXAMPLES)
@click.option("--length", metavar="'80 m'", help="Run-up: from its beginning or last curve to the boulder.")
@click.option("--from", "start", metavar="'0 mph'", help="Speed at the beginning of the run-up.")
@click.option("--acceleration", metavar="'1.2 m/s^2'", help="Of the vehicle, at full throttle on level ground.")
@click.option("--curve-radius", metavar="'25 m'", help="Of the curve that ends where the run-up begins.")
@click.option("--friction", metavar="MU", help="Coefficient of friction of the tyres in that curve [1].")
@click.option("--grade", metavar="'-4 %'", help="Rise over run towards the boulder, negative downhill [0].")
@json_option
def speed(as_json: bool, **given: str | None) -> int:
    """Work out the largest speed with which a vehicle reaches the boulder: v² = v₀² + 2 a s, √(μ g r) out of a curve.

    Every choice is on the safe side: the acceleration lasts up to the boulder, a curve is left at the speed at which
    the vehicle skids, and no largest speed of the vehicle is known. Where there are several ways to the boulder, the
    fastest counts.
    """
    from boulder_sweep.settings.problems import LeafError
    from boulder_sweep.settings.tree import Scalar
    from boulder_sweep.settings.vehicle import APPROACH, approach_data, approach_words, read_approach

    block = _as_block({"from" if key == "start" else key: text for key, text in given.items() if text is not None})
    try:
        data = approach_data(read_approach(block))
    except LeafError as error:
        raise click.UsageError("; ".join(mistake.message for mistake in error.mistakes)) from None
    if as_json:
        show(json.dumps(data))
        return 0
    entry = ", ".join(f"{entry.key}: {entry.value.text.strip()}" for entry in block if isinstance(entry.value, Scalar))
    yaml = textwrap.wrap(f"vehicle: {{{APPROACH}: {{{entry}}},", 80, subsequent_indent=" " * 21)
    show(*speed_lines(data["impact_speed_m_s"]), "", *textwrap.wrap(approach_words(data), 80), "", *yaml)
    show("          ...}")
    return 0


def _as_block(given: dict[str, str]) -> Mapping:
    """Return the options as the block of a settings file; each needs its unit here, zero too."""
    from boulder_sweep.settings.problems import Position
    from boulder_sweep.settings.tree import Entry, Mapping, Scalar
    from boulder_sweep.settings.units import EXPECTED
    from boulder_sweep.settings.values import NumberError, split_number
    from boulder_sweep.settings.vehicle import APPROACH_FIELDS

    here = Position("sweep speed")
    for key, text in given.items():
        unit = APPROACH_FIELDS[key.replace("-", "_")].unit
        try:
            bare = unit != "1" and not split_number(text, unit)[1]
        except NumberError:
            continue  # the reader says what is wrong
        if bare:
            examples = EXPECTED[unit].examples
            raise click.UsageError(f"--{key.replace('_', '-')} '{text}': write the unit too ({examples})")
    return Mapping(here, {key: Entry(key, here, Scalar(here, text)) for key, text in given.items()})


def speed_lines(speed_m_s: float) -> list[str]:
    """Return a speed in the units in use, and the nominal speed of a test that covers it."""
    from boulder_sweep.settings.starter import CLASSES

    nominal = {name: mph for name, (code, mph) in CLASSES.items() if code == "M"}
    covered = next((name for name, mph in nominal.items() if mph * MPH >= speed_m_s - 0.005), None)
    what = f"{covered} ({nominal[covered]} mph)" if covered else f"none (M goes up to {max(nominal.values())} mph)"
    return [
        f"speed at the boulder       {speed_m_s:.2f} m/s = {3.6 * speed_m_s:.1f} km/h = {speed_m_s / MPH:.1f} mph",
        f"class of ASTM F2656 for it {what}, by its nominal speed",
    ]
