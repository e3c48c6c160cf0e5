"""The entries of a settings file and the columns of a result, as tables made from the registers themselves."""

from __future__ import annotations

from boulder_sweep.columns import OUTCOMES
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.settings.fields import INPUTS, SETTINGS, Field
from boulder_sweep.settings.starter import default_text
from boulder_sweep.settings.units import EXPECTED

DEFAULTS = {
    "embedment_ratio": "this or the depth",
    "embedment_depth_m": "this or the ratio",
    "impact_height_m": "Eq 9",
}
"""In words, where it is no number."""
FORMS = {
    "readings": "`corrected`, `as_printed`, or single switches ([readings](readings.md))",
    "soil_elements": "`closed_form`, or `{elements: 5000}` ([soil elements](validation.md#soil-elements))",
    "layers": "a list of layers ([soils as they lie](soil.md#soils-as-they-lie))",
    "profile": "a list of points ([boulders that are no boxes](stones.md))",
    "scan": "a file and a way to stand ([stones from scans](stones_from_scans.md#in-a-settings-file))",
    "second_opinion": "`none`, or a list of `broms` and `width_capped` ([second opinion](second_opinion.md))",
    "accuracy": "`fast`, `balanced`, `fine`, or an angle such as `0.01 deg` ([accuracy](accuracy.md))",
}
"""What a setting may be, where it is neither a quantity nor one of some words."""
PAGES = {"resistance": " ([soil](soil.md))"}
"""Where the words are explained."""


def entries_table() -> Table:
    """Return every entry that can be an axis: how it is written, what holds where it is not given."""
    table = Table(
        ("entry", "bare number in", "units, for example", "where not given", "usual, as a bare number", "meaning")
    )
    for field in INPUTS:
        usual = f"{field.usual.low:g} to {field.usual.high:g}" if field.usual else ""
        unit = "" if field.unit == "1" else field.unit
        table.add(f"`{field.path}`", unit, EXPECTED[field.unit].examples, _default(field), usual, field.meaning)
    return table


def choices_table() -> Table:
    """Return the entries that hold for all designs of a file."""
    table = Table(("entry", "may be", "where not given", "meaning"))
    for field in SETTINGS:
        if field.choices:
            form = ", ".join(f"`{word}`" for word in field.choices) + PAGES.get(field.name, "")
        else:
            form = FORMS.get(field.name) or f"{EXPECTED[field.unit].words} ({EXPECTED[field.unit].examples})"
        shown = f"`{default_text(field)}`" if isinstance(field.shown_default, str) else default_text(field)
        table.add(f"`{field.path}`", form, shown, field.meaning)
    return table


def columns_table() -> Table:
    """Return the outcomes in a table of results."""
    table = Table(("column", "unit", "meaning"))
    for spec in OUTCOMES:
        table.add(f"`{spec.name}`", spec.unit, spec.meaning)
    return table


def _default(field: Field) -> str:
    """What holds where an entry is not given."""
    if field.name in DEFAULTS:
        return DEFAULTS[field.name]
    if field.name == "boulder_density_kg_m3":
        return "required, unless `boulder.mass` is given"
    if not field.optional:
        return "required"
    return default_text(field)
