"""What the reference pages hold that is made from the code: commands, entries, columns, equations, docstrings."""

from __future__ import annotations

from pathlib import Path

import click

import boulder_kernels
import boulder_sweep
from boulder_sweep.cli.main import cli
from boulder_sweep.columns import OUTCOMES
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.validity import FLAGS
from boulder_sweep.settings.fields import INPUTS, SETTINGS, Field, default_text
from boulder_sweep.settings.units import EXPECTED

DEFAULTS = {
    "embedment_ratio": "this or the depth",
    "embedment_depth_m": "this or the ratio",
    "impact_height_m": "Eq 9",
}
"""In words, where it is no number."""
FORMS = {
    "readings": "`corrected`, `as_printed`, or single switches ([readings](model.md#readings))",
    "soil_elements": "`closed_form`, or `{elements: 5000}` ([the model](model.md))",
    "layers": "a list of layers ([my site](site.md#water-table-layers-cohesion-slope))",
    "profile": "a list of points ([my boulder](stones.md#a-profile-or-a-taper))",
    "scan": "a file and a way to stand ([my boulder](stones.md#a-scan))",
    "second_opinion": "`none`, or a list of `broms` and `width_capped` ([how sure](confidence.md#second-opinion))",
}
"""What a setting may be, where it is neither a quantity nor one of some words."""
PAGES = {"resistance": " ([soil models](site.md#soil-models))", "accuracy": " ([accuracy](accuracy.md))"}
"""Where the words are explained."""
EQUATIONS = Path(__file__).parents[1] / "equations.tsv"


def command_help() -> str:
    """Return the help of every command, a section each."""
    parts = []
    with click.Context(cli, info_name="sweep", terminal_width=100) as context:
        for name in cli.list_commands(context):
            command = cli.get_command(context, name)
            assert command is not None
            with click.Context(command, info_name=name, parent=context, terminal_width=100) as inner:
                parts.append(f"## sweep {name}\n\n```text\n{command.get_help(inner)}\n```")
    return "\n\n".join(parts) + "\n"


def all_entries() -> str:
    """Return the entries of a settings file: those that may be axes, and those that hold for a whole file."""
    return f"{entries_table().markdown()}\n\n{choices_table().markdown()}\n"


def flags_and_columns() -> str:
    """Return the flags of `validity`, and the outcomes of a result."""
    return f"{flags_table().markdown()}\n\n## Outcomes\n\n{columns_table().markdown()}\n"


def register() -> str:
    """Return the register of equations."""
    return f"{equations_table(EQUATIONS.read_text(encoding='utf-8')).markdown()}\n"


def public_names() -> str:
    """Return the public names of `boulder_sweep`, for mkdocstrings to fill in."""
    found = []
    for name in boulder_sweep.__all__:
        value = getattr(boulder_sweep, name)
        if not name.startswith("_"):
            found.append(f"::: {value.__module__}.{value.__qualname__}")
    return "\n\n".join(found) + "\n"


def kernel_page() -> str:
    """Return a page of all modules of `boulder_kernels`, for mkdocstrings to fill in."""
    from pkgutil import iter_modules

    names = sorted(module.name for module in iter_modules(boulder_kernels.__path__) if not module.name.startswith("_"))
    intro = (
        "Plain numbers in SI, the paper's symbols. The [register](../model.md#register-of-equations) maps equations."
    )
    return "\n\n".join(["# Kernels", intro, *(f"::: boulder_kernels.{name}" for name in names)]) + "\n"


def entries_table() -> Table:
    """Return every entry that can be an axis: how it is written, what holds where it is not given."""
    table = Table(
        (
            "entry",
            "bare number in",
            "units, for example",
            "where not given",
            "usual, as a bare number",
            "admitted",
            "meaning",
        )
    )
    for field in INPUTS:
        usual = f"{field.usual.low:g} to {field.usual.high:g}" if field.usual else ""
        unit = "" if field.unit == "1" else field.unit
        table.add(
            f"`{field.path}`",
            unit,
            EXPECTED[field.unit].examples,
            _default(field),
            usual,
            _admitted(field),
            field.meaning,
        )
    return table


def choices_table() -> Table:
    """Return the entries that hold for all designs of a file."""
    table = Table(("entry", "may be", "where not given", "admitted", "meaning"))
    for field in SETTINGS:
        if field.choices:
            form = ", ".join(f"`{word}`" for word in field.choices) + PAGES.get(field.name, "")
        else:
            form = FORMS.get(field.name) or f"{EXPECTED[field.unit].words} ({EXPECTED[field.unit].examples})"
        shown = f"`{default_text(field)}`" if isinstance(field.shown_default, str) else default_text(field)
        table.add(f"`{field.path}`", form, shown, _admitted(field), field.meaning)
    return table


def columns_table() -> Table:
    """Return the outcomes in a table of results."""
    table = Table(("column", "unit", "meaning"))
    for spec in OUTCOMES:
        table.add(f"`{spec.name}`", spec.unit, spec.meaning)
    return table


def flags_table() -> Table:
    """Return every flag of the column `validity`: where it is raised, and why."""
    table = Table(("flag", "passes with", "raised where", "why"))
    for flag in FLAGS:
        table.add(f"`{flag.name}`", flag.meaning, flag.raised_where, flag.why)
    return table


def bounds_of_flags() -> Table:
    """Return every flag of the column `validity`, and where it is raised."""
    table = Table(("flag", "raised where"))
    for flag in FLAGS:
        table.add(f"`{flag.name}`", flag.raised_where)
    return table


def equations_table(register: str) -> Table:
    """Return the register of equations as a table.

    Parameters
    ----------
    register
        Text of ``docs/equations.tsv``: a line for each equation, cells between tabs, several names between blanks.
    """
    head, *rows = (line.split("\t") for line in register.splitlines())
    table = Table(tuple(head))
    for number, meaning, way, functions, tests, reading in rows:
        named = ("<br>".join(f"`{name}`" for name in names.split()) for names in (functions, tests))
        table.add(number, meaning, way, *named, reading)
    return table


def _admitted(field: Field) -> str:
    """Bounds outside which a value is refused, as bare numbers."""
    return f"{field.admitted.low:g} to {field.admitted.high:g}" if field.admitted else ""


def _default(field: Field) -> str:
    """What holds where an entry is not given."""
    if field.name in DEFAULTS:
        return DEFAULTS[field.name]
    if field.name == "boulder_density_kg_m3":
        return "required, unless `boulder.mass` is given"
    if not field.optional:
        return "required"
    return default_text(field)
