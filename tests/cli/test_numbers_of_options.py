"""Every number of an option that has a dimension needs its unit, whatever ``--units`` says; ``--set`` reads as a file.

The options are found from the commands themselves: one that is new has to be listed here, on one side or the other.
"""

import re
from pathlib import Path

import click
import pytest

from boulder_sweep.cli.main import COMMANDS
from boulder_sweep.cli.options import Quantity
from boulder_sweep.settings import SettingsError, load_text
from boulder_sweep.settings.fields import BY_PATH

SITE = "configs/site.yaml"
BARE = {
    ("need", "--between"): (["need", SITE, "--between", "5", "9", "--units", "us"], "--between '5 ft' '9 ft'"),
    ("stone", "--mass"): (["stone", "rock.ply", "--mass", "18.2"], "--mass '18.2 kg' or --mass '18.2 lb'"),
    ("plot", "--at"): (["plot", "out.sweep", "--at", "width=1.8"], "--at width='1.8 m' or --at width='1.8 ft'"),
    ("fit-vehicle", "--mass"): (["fit-vehicle", "pulse.csv", "--mass", "6800"], "--mass '6800 lb'"),
    ("fit-vehicle", "--speed"): (
        ["fit-vehicle", "pulse.csv", "--mass", "6800 kg", "--speed", "30"],
        "--speed '30 m/s' or --speed '30 mph'",
    ),
}
"""Every such option: a command with a bare number, and a part of what is to be written in its place."""
PLAIN = {
    *("--set", "--at", "--least", "--most", "--across", "--up", "--facing", "--columns", "--rows", "--case", "--class"),
    *("--unit", "--scheduler", "--project", "--client", "--site", "--date", "--revision"),
    *("--author", "--checked-by", "--accuracy"),
    *("--margin", "--probability", "--half-width", "--confidence"),
}
"""Options that take words, or numbers without a dimension."""


def _options():
    for command in COMMANDS:
        for one in command.params:
            if isinstance(one, click.Option) and not one.is_flag:
                yield command.name, one


def test_every_option_that_takes_text_is_on_one_side():
    found = {(command, one.opts[0]) for command, one in _options() if isinstance(one.type, Quantity)}
    assert found == set(BARE)
    text = {one.opts[0] for _, one in _options() if isinstance(one.type, click.types.StringParamType)}
    assert text <= PLAIN
    numbers = {one.opts[0] for _, one in _options() if isinstance(one.type, click.types.FloatParamType)}
    assert numbers <= {"--seconds"}, "its name says the unit"


@pytest.mark.parametrize("option", BARE, ids=" ".join)
def test_a_bare_number_is_refused(sweep, option):
    words, remedy = BARE[option]
    code, out, err = sweep(*words)
    assert (code, out) == (2, "")
    assert f"{option[1]} " in err
    assert "write the unit too (" in " ".join(err.split())
    assert remedy in err


def table_of(out):
    """Return what stands between the recommendation and the next questions, which repeat the options as typed."""
    return out.partition("\n\n")[2].partition("More:")[0]


def test_what_has_no_dimension_has_no_unit(sweep):
    code, out, _ = sweep("need", SITE, "-q", "--least", "embedment_ratio", "--between", "0.4", "0.6", "--margin", "0.1")
    assert code == 0
    as_per_cent = sweep(*f"need {SITE} -q --least embedment_ratio --between 40% 60% --margin 10%".split())[1]
    assert table_of(out) == table_of(as_per_cent)


def test_feet_are_feet(sweep):
    feet, metres = (sweep("need", SITE, "-q", "--between", *ends) for ends in (("4ft", "7ft"), ("1.2192m", "2.1336m")))
    assert feet[0] == metres[0] == 0
    assert table_of(feet[1]) == table_of(metres[1])


FILE = """\
boulder: {length: 1.65, width: 1.68, height: 3.4, density: 2600}
site: {embedment_depth: 2}
soil: {density: 1860, friction_angle: 40, subgrade_reaction: 60}
vehicle: {mass: 6800, speed: 13, spring: 3e6, damper: 1.4e5}
"""
READ = ("{}", "{} UNIT", "[{}, {}]", "{{mean: {}, sd: 0.01}}", "{{from: {} UNIT, to: {} UNIT, count: 1}}")
REFUSED = ("{},5", "{} s^2")
PATHS = ("boulder.height", "soil.density", "soil.friction_angle", "vehicle.speed", "vehicle.mass")


@pytest.mark.parametrize("form", [*READ, *REFUSED])
@pytest.mark.parametrize("path", PATHS)
def test_set_reads_as_the_file_does(path, form):
    """A number without a unit is in the unit of the table in both, and what one refuses the other refuses."""
    field = BY_PATH[path]
    before = re.search(rf"{field.section}: {{.*?\b{field.key}: ([\d.e]+)", FILE)
    value = form.replace("UNIT", field.unit).format(*[before[1]] * 2)
    text = FILE[: before.start(1)] + value + FILE[before.end(1) :]
    outcomes = []
    for given in ((text, ()), (FILE, (f"{path}={value}",))):
        try:
            outcomes.append(load_text(given[0], Path("grid.yaml"), given[1]).resolved())
        except SettingsError as refused:
            outcomes.append([(one.key, one.message) for one in refused.problems])
    assert outcomes[0] == outcomes[1]
    assert isinstance(outcomes[0], list) == (form in REFUSED)
