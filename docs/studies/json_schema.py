"""The JSON Schema of a settings file, made from the register of its entries: for completion and checks in editors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from boulder_sweep.settings.entries import (
    LAYER_FIELDS,
    MOST_LAYERS,
    MOST_POINTS,
    NAME,
    NAMED_SETS,
    PROFILE_FIELDS,
    SCAN_KEYS,
    SIDES,
)
from boulder_sweep.settings.fields import (
    ALLOW_UNUSUAL,
    BY_NAME,
    EMBEDMENT,
    EVERYTHING,
    FIELDS,
    HELD,
    INPUTS,
    MAX_ELEMENTS,
    SECTIONS,
    TO_BE_FOUND,
    Field,
)
from boulder_sweep.settings.model import (
    CLOSED_FORM,
    NO_OPINION,
    PRESETS,
    PRINTED,
    SECOND_OPINIONS,
    SWITCHES,
)
from boulder_sweep.settings.soil_readings import (
    BLOW_KEYS,
    ENERGY,
    HOLE,
    LEAST_KEYS,
    LOG,
    METHODS,
    READING_FIELDS,
    RELATIVE_DENSITY,
    SOIL_KEYS,
    TOPSOIL,
)
from boulder_sweep.settings.sweep import SECTION, UNITS, Heading
from boulder_sweep.settings.units import EXPECTED, SYSTEMS
from boulder_sweep.settings.values import MAX_AXIS, NEEDED
from boulder_sweep.settings.vehicle import APPROACH, APPROACH_FIELDS, SPEED

FILE = Path("docs/sweep.schema.json")
_NUMBER = r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"
_QUANTITY = rf"^\s*{_NUMBER}\s*([^\d\s.,;\[\]][^,;\[\]]*)?$"
"""A number and perhaps a unit. Which units fit is left to the program: their products are too many to list."""
_AT_LEAST = rf"^\s*((>=?|≥)\s*{_NUMBER}.*|{_NUMBER}\s*\+[^\d]*)$"
_REFUSAL = r"^\s*(\d+\s*(/|(blows? )?(for|in)\s)\s*[\d.].*|[Rr]|[Rr]ef\.?|[Rr]efusal)\s*$"
"""Readings beyond the range of a test: ``>50`` and ``50+``; ``50/75mm`` and ``R``."""

Schema = dict[str, Any]


def schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of a settings file."""
    units = sorted({field.unit for field in FIELDS if field.unit})
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Settings of boulder-sweep",
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "name": {"type": "string", "pattern": f"^({NAME.pattern})$", "description": "name of the sweep"},
            **{section: _block(section, words) for section, words in SECTIONS.items()},
            SECTION: {
                "type": "object",
                "description": "heading of a report",
                "additionalProperties": False,
                "properties": {key: {"type": ["string", "number"]} for key in Heading._fields},
            },
            UNITS: {"description": "units in which results are shown", **_words(*SYSTEMS)},
            ALLOW_UNUSUAL: {
                "description": "entries whose values may be far from usual",
                "anyOf": [_words(EVERYTHING, *HELD), _list(_words(*HELD))],
            },
            "table": {"type": "string", "pattern": r"\.([cC][sS][vV]|[pP][aA][rR][qQ][uU][eE][tT]|[xX][lL][sS][xX])$"},
        },
        **_what_is_required(),
        "$defs": {
            "count": {"type": "integer", "minimum": 1, "maximum": MAX_AXIS},
            "list_as_text": {"type": "string", "pattern": r"^\s*\[.*\]\s*[^\[\],]*$"},
            **{_named(unit): _quantity(unit) for unit in units},
            **{f"{_named(field.unit)}_mean": _mean(field.unit) for field in INPUTS},
            **{f"{_named(field.unit)}_distribution": _distribution(field.unit) for field in INPUTS},
            **{field.path: _value(field) for field in FIELDS if field.admitted is not None},
        },
    }


def text() -> str:
    """Return the text of the schema file."""
    return json.dumps(schema(), indent=1) + "\n"


def _block(section: str, words: str) -> Schema:
    """Return the schema of one block."""
    entries: Schema = {}
    for field in FIELDS:
        if field.section == section:
            entry = {"description": _described(field), **_entry(field)}
            default = field.shown_default
            entries[field.key] = entry if default is None else {**entry, "default": default}
    entries |= _SITE_DATA.get(section, {})
    block: Schema = {"description": words, "additionalProperties": False, "properties": entries}
    if section not in NAMED_SETS:
        return {"type": ["object", "null"], **block}
    inputs = {
        field.key: {"anyOf": [_ref(field.path), _ref(f"{_named(field.unit)}_distribution")]}
        for field in INPUTS
        if field.section == section
    }
    named = _object(
        {"name": {"type": "string", "pattern": f"^({NAME.pattern})$"}, **inputs, **_SITE_DATA.get(section, {})},
        ("name",),
    )
    return {"type": ["object", "array", "null"], **block, "minItems": 1, "items": named}


def _described(field: Field) -> str:
    if field.unit in ("", "1"):
        return field.meaning
    unit = EXPECTED[field.unit]
    return f"{field.meaning}; {unit.words} ({unit.examples}), a bare number is in {field.unit}"


def _entry(field: Field) -> Schema:
    """Return what an entry may be."""
    if field.choices:
        return _words(*field.choices)
    if field.name in _FORMS:
        return _FORMS[field.name]
    value = _ref(field.path)
    if field not in INPUTS:
        return value
    step = _object({"from": value, "to": value, "step": _ref(_named(field.unit))}, ("from", "to", "step"))
    count = _object({"from": value, "to": value, "count": _ref("count")}, ("from", "to", "count"))
    spread = _ref(f"{_named(field.unit)}_distribution")
    to_be_found = [_words(TO_BE_FOUND)] if field.name == EMBEDMENT[1] else []
    return {"anyOf": [value, _list(value), _ref("list_as_text"), step, count, spread, *to_be_found]}


def _mean(unit: str) -> Schema:
    """Return the means of a distribution: one value, a list or a range."""
    value = _ref(_named(unit))
    ranges = [_object({"from": value, "to": value, key: {}}, ("from", "to", key)) for key in ("step", "count")]
    return {"anyOf": [value, _list(value), _ref("list_as_text"), *ranges]}


def _distribution(unit: str) -> Schema:
    """Return the forms of a distribution of quantities in some unit, one for each kind."""
    mean = _ref(f"{_named(unit)}_mean")
    keys = {"mean": mean, "characteristic": mean, "cov": _ref(_named("1"))}
    forms = []
    for kind, groups in NEEDED.items():
        taken = ("low", "high", *(key for group in groups for key in group))
        entries: Schema = {"distribution": {"const": kind}, **{key: keys.get(key, _ref(_named(unit))) for key in taken}}
        needed = [key for group in groups if len(group) == 1 for key in group]
        either = [{"oneOf": [{"required": [key]} for key in group]} for group in groups if len(group) > 1]
        form = _object(entries, (*(() if kind == "normal" else ("distribution",)), *needed))
        forms.append({**form, "allOf": either} if either else form)
    return {"anyOf": forms}


def _value(field: Field) -> Schema:
    """Return one number within its bounds, or text with a number and a unit."""
    assert field.admitted is not None
    bounds = {"minimum": field.admitted.low, "maximum": field.admitted.high}
    return {"anyOf": [{"type": "number", **bounds}, {"type": "string", "pattern": _QUANTITY}]}


def _quantity(unit: str) -> Schema:
    """Return any number, or text with a number and a unit."""
    words = f"{EXPECTED[unit].words} ({EXPECTED[unit].examples})"
    return {"anyOf": [{"type": "number"}, {"type": "string", "pattern": _QUANTITY}], "description": words}


def _named(unit: str) -> str:
    """Return the name of the definition for a unit."""
    return EXPECTED[unit].words.partition(" (")[0].removeprefix("a ").removeprefix("an ").replace(" ", "_")


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _list(items: Schema) -> Schema:
    return {"type": "array", "minItems": 1, "maxItems": MAX_AXIS, "items": items}


def _object(entries: Schema, required: tuple[str, ...]) -> Schema:
    return {"type": "object", "additionalProperties": False, "properties": entries, "required": list(required)}


def _words(*words: str) -> Schema:
    return {"enum": list(words)}


_READINGS = {name: _words(PRINTED, corrected, "corrected") for name, corrected in SWITCHES.items()}
_FORMS: dict[str, Schema] = {
    "readings": {"anyOf": [_words(*PRESETS), _object({"preset": _words(*PRESETS), **_READINGS}, ())]},
    "soil_elements": {
        "anyOf": [
            _words(CLOSED_FORM),
            _object({"elements": {"type": "integer", "minimum": 1, "maximum": MAX_ELEMENTS}}, ("elements",)),
        ]
    },
    "layers": {
        "type": "array",
        "minItems": 1,
        "maxItems": MOST_LAYERS,
        "items": _object(
            {key: _value(field) for key, field in LAYER_FIELDS.items()},
            tuple(key for key in LAYER_FIELDS if key != "cohesion"),
        ),
    },
    "profile": {
        "type": "array",
        "minItems": 2,
        "maxItems": MOST_POINTS,
        "items": {
            **_object({key: _value(field) for key, field in PROFILE_FIELDS.items()}, ("height", "width")),
            "oneOf": [{"required": ["length"]}, {"required": ["near", "far"]}],
        },
    },
    "scan": _object({key: {"type": "string"} for key in SCAN_KEYS}, SCAN_KEYS[:3]),
    "second_opinion": {
        "anyOf": [
            _words(NO_OPINION, *SECOND_OPINIONS),
            {"type": "array", "items": _words(*SECOND_OPINIONS), "maxItems": len(SECOND_OPINIONS)},
        ]
    },
}
"""Entries that are more than a quantity."""


def _reading(field: Field) -> Schema:
    """Return what an entry of a reading may be."""
    patterns = [_AT_LEAST] * (field.key in LEAST_KEYS) + [_REFUSAL] * (field.key in BLOW_KEYS)
    value = _value(field)
    return {"anyOf": [*value["anyOf"], *({"type": "string", "pattern": pattern} for pattern in patterns)]}


_BY_TEST = {
    method: {"anyOf": [reading, {"type": "array", "minItems": 1, "items": reading}]}
    for method, reading in (
        (method, _object({key: _reading(field) for key, field in known.items()}, ()))
        for method, known in READING_FIELDS.items()
    )
}
_SITE_DATA: dict[str, Schema] = {
    "soil": {
        **{method: {**form, "description": f"readings ({method})"} for method, form in _BY_TEST.items()},
        **{field.key: {**_value(field), "description": field.meaning} for field in (RELATIVE_DENSITY, TOPSOIL)},
        LOG: {"type": "string", "description": "file of a borehole or a cone: .csv, .xlsx, .ags, .gef or .xml"},
        HOLE: {"type": ["string", "number"], "description": "its hole, where the file has several"},
        ENERGY: {
            **_value(READING_FIELDS["spt"][ENERGY]),
            "description": "energy of the hammer, where the file does not give it",
        },
    },
    "vehicle": {
        APPROACH: {
            **_object({key: _value(field) for key, field in APPROACH_FIELDS.items()}, ("length", "acceleration")),
            "description": "the street to the boulder, in place of the speed",
            "anyOf": [{"required": ["from"]}, {"required": ["curve_radius"]}],
        }
    },
}
"""Entries that stand for others."""


DENSITY, BOULDER_MASS = "boulder_density_kg_m3", "boulder_mass_kg"
"""One of these suffices."""


def _what_is_required() -> Schema:
    """Return what must be there; beside a table, its columns may hold any of it."""
    sections: Schema = {}
    for field in INPUTS:
        if not field.optional:
            needed = sections.setdefault(field.section, {"required": []})["required"]
            needed += [] if field.section == "boulder" else [field.key]
    sections["vehicle"]["required"].remove(SPEED)
    sections["vehicle"]["anyOf"] = [{"required": [SPEED]}, {"required": [APPROACH]}]
    constants = {"required": sections["soil"].pop("required")}
    assert set(constants["required"]) == set(SOIL_KEYS)
    sections["soil"]["anyOf"] = [constants, *({"required": [method]} for method in METHODS)]
    for section in set(NAMED_SETS) & set(sections):
        sections[section]["items"] = dict(sections[section])
    embedment = [field for field in INPUTS if field.name in EMBEDMENT]
    sections[embedment[0].section] = {"oneOf": [{"required": [field.key]} for field in embedment]}
    density_or_mass = [BY_NAME[name].key for name in (DENSITY, BOULDER_MASS)]
    sections["boulder"] = {
        "anyOf": [{"required": [key]} for key in density_or_mass],
        "oneOf": [{"required": ["profile"]}, {"required": ["scan"]}, {"required": list(SIDES)}],
    }
    whole = {"required": list(sections), "properties": sections}
    return {"if": {"not": {"required": ["table"]}}, "then": whole}
