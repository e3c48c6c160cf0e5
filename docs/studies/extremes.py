"""The admitted box of inputs and the named refusals, as tables made from the settings and the rules themselves."""

from __future__ import annotations

from boulder_kernels import Status
from boulder_sweep.crash_tests.tables import Table
from boulder_sweep.judge.verdict import STATUS_REASONS
from boulder_sweep.settings.fields import FIELDS, MAX_ELEMENTS


def admitted_table() -> Table:
    """Return every bound of the settings with its reason."""
    table = Table(("entry", "least", "most", "unit", "why there is an end"))
    for field in FIELDS:
        if field.admitted is not None:
            low, high, reason = field.admitted
            table.add(f"`{field.path}`", f"{low:g}", f"{high:g}", field.unit, reason)
    table.add("soil elements", "1", f"{MAX_ELEMENTS:g}", "1", "the closed form is the limit of infinitely many")
    return table


def refusal_table() -> Table:
    """Return every reason for which a design of the box may have no result."""
    table = Table(("status", "reason in the table"))
    for status, reason in STATUS_REASONS.items():
        table.add(f"`{Status(status).name}`", reason)
    return table
