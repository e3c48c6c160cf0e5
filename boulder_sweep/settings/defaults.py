"""What holds for an entry that a file does not give, as the file would say it."""

from __future__ import annotations

from dataclasses import asdict

from boulder_sweep.settings.fields import Field
from boulder_sweep.settings.model import CLOSED_FORM, Criterion, Model, SolverSettings
from boulder_sweep.settings.numbers import describe


def default_of(field: Field) -> float | str | None:
    """Return the default of an entry: a number in the unit of the field, a word, or None where there is none."""
    words = {"readings": Model().preset, "soil_elements": CLOSED_FORM, "correlation": 0.0, "partial_factor": 1.0}
    words |= {"layers": None}
    attributes = {**asdict(Criterion()), **asdict(Model()), **asdict(SolverSettings()), **words}
    return attributes.get(field.name, field.default)


def default_text(field: Field) -> str:
    """Return the default of an entry with its unit, empty where there is none."""
    value = default_of(field)
    if value is None or isinstance(value, str):
        return value or ""
    return describe(value, field.unit)
