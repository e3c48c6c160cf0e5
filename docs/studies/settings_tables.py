"""The entries of a settings file and the columns of a result, as tables made from the registers themselves."""

from __future__ import annotations

from boulder_sweep.columns import BY_NAME, OUTCOMES
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.settings.bounds import REALISTIC
from boulder_sweep.settings.fields import FIELDS, OPTIONAL, Field
from boulder_sweep.settings.schema import CriterionBlock, SolverBlock
from boulder_sweep.settings.units import EXPECTED

MEANINGS = {"embedment_ratio": "buried part of the boulder's height, d / H"}
"""Of the quantities that have no column of their own."""
DEFAULTS = {
    "embedment_ratio": "this or the depth",
    "embedment_depth_m": "this or the ratio",
    "impact_height_m": "Eq 9",
}
"""In words, where it is no number."""


def entries_table() -> Table:
    """Return every entry that can be an axis: how it is written, what holds where it is not given."""
    table = Table(
        ("entry", "bare number in", "units, for example", "where not given", "usual, as a bare number", "meaning")
    )
    for field in FIELDS:
        realistic = REALISTIC.get(field.name)
        usual = f"{realistic.low:g} to {realistic.high:g}" if realistic else ""
        meaning = MEANINGS.get(field.name) or BY_NAME[field.name].meaning
        unit = "" if field.unit == "1" else field.unit
        table.add(f"`{field.path}`", unit, EXPECTED[field.unit].examples, _default(field), usual, meaning)
    return table


def choices_table() -> Table:
    """Return the entries that hold for all designs of a file."""
    criterion, solver = CriterionBlock.model_fields, SolverBlock.model_fields
    table = Table(("entry", "may be", "where not given"))
    table.add("`criterion.max_rotation`", "an angle", f"{criterion['max_rotation'].default:g} deg")
    table.add("`criterion.rating`", "`P1`, `P2`, `P3`", f"`{criterion['rating'].default}`")
    table.add(
        "`model.readings`", "`corrected`, `as_printed`, or single switches ([readings](readings.md))", "`corrected`"
    )
    table.add("`model.soil`", "`closed_form`, or `{elements: 5000}` ([soil elements](convergence.md))", "`closed_form`")
    table.add(
        "`solver.accuracy`",
        "`fast`, `balanced`, `fine`, or the error admitted, `0.01 deg` ([accuracy](accuracy.md))",
        "`balanced`",
    )
    table.add("`solver.step`", "in place of an accuracy, a time step: no error is estimated", "")
    table.add("`solver.horizon`", "a time: how long an impact is simulated", f"{solver['horizon'].default:g} s")
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
    if field.name not in OPTIONAL:
        return "required"
    return f"{field.default:g}{'' if field.unit == '1' else ' ' + field.unit}"
