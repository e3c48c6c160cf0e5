"""The page: one self-contained file with the plotting library, the kernel, the script and the data.

The words and numbers of the data come from the package's registers.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np
from bokeh.document import Document
from bokeh.embed.util import standalone_docs_json_and_render_items
from bokeh.resources import INLINE

from boulder_kernels import Control, Readings, Status, rules
from boulder_kernels.pieces import PRESSURE_SLOPE
from boulder_kernels.rules import OF_CRITERION, RULES
from boulder_kernels.table import is_paired
from boulder_sweep.columns import INPUTS, OPTIONAL_INPUTS, OUTCOMES, TO_BUILD
from boulder_sweep.designs import LEAST_SOLIDITY, LEAST_TAPED, MOST_SOLIDITY, REASONS
from boulder_sweep.investigation import family_bounds
from boulder_sweep.judge.accuracy import finer_controls, reported_step_s
from boulder_sweep.judge.inputs import SOURCES
from boulder_sweep.judge.validity import FLAGS, has_odd_layers, largest_tested_rotation, tested_of
from boulder_sweep.judge.verdict import NOT_FINITE, PENETRATION_LIMITS_M, STATUS_REASONS
from boulder_sweep.report import page_records
from boulder_sweep.report.build import kernel
from boulder_sweep.report.export import setting_lines
from boulder_sweep.report.figures import COLOURS, PARTS, curves, log_charts, verdict_map
from boulder_sweep.report.rows import MOST_ELEMENTS, NOT_YET, ResultRows, label_of
from boulder_sweep.settings.checks import FLOATS, SLIDES, uppermost_is_wet
from boulder_sweep.settings.entries import LAYER_FIELDS
from boulder_sweep.settings.fields import BY_NAME, fields_of
from boulder_sweep.settings.model import FEET, RESISTANCES, WATER_KG_M3, Ground, Shape
from boulder_sweep.settings.sweep import derived_words
from boulder_sweep.settings.units import SYSTEMS, needed, quantity_text, shown_settings, shown_unit
from boulder_sweep.settings.values import EMPTY, NOT_A_NUMBER, OUTSIDE, sample_of
from boulder_sweep.soils import SLICES, ground_of, is_layered, layers_count, profile_of
from boulder_sweep.text import script_data
from boulder_sweep.views.wording import LAW_WORDS, REASON_WORDS, ground_words

if TYPE_CHECKING:
    from boulder_sweep.answers.printing import Screen
    from boulder_sweep.report.answers import Sentence
    from boulder_sweep.report.sheet import Sheet

ASSETS = Path(__file__).with_name("assets")
SCRIPTS = ("kernel", "simulator", "controls", "plots", "scene", "page")
"""Our own script, in this order."""
NOTHING: Mapping[str, Any] = {}
UNPRINTED = ("derived", "judged_at", "report")
"""Parts of the settings that are not printed: the document says them in words, or draws them."""
MAIN = (
    "embedment_depth_m",
    "friction_angle_deg",
    "subgrade_reaction_MN_m3",
    "impact_speed_m_s",
    "vehicle_mass_kg",
    "boulder_length_m",
    "boulder_width_m",
    "boulder_height_m",
)
"""Inputs shown at first; the others are one click away."""
OUTCOME_WORDS = {
    "max_rotation_deg": "largest rotation",
    "max_displacement_m": "boulder moves",
    "max_vehicle_displacement_m": "vehicle moves",
    "peak_force_kN": "peak force",
    "penetration_m": "penetration",
    "vehicle_crush_m": "vehicle's front crushed",
    "overlap_m": "overlap with the bumper",
    "rating": "penetration rating",
    "time_to_limit_s": "limit reached after",
    "rotation_error_deg": "numerical error of the rotation",
}
"""Outcomes of a design that the page shows."""


REFUSED_AT = ("", "embedment_depth_m", "hood_height_m", "impact_height_m", "boulder_mass_kg", "")
"""The inputs beside which the page says why a design cannot be computed, in the order of `REASONS`; of an unusual value
it says so in its note."""
TAPED = (
    "by its mass the boulder is no box, and this page does not know the shapes that it may have: sweep simulate and "
    "sweep need judge it by the worst of them; map and tables here are theirs"
)
"""Why the page simulates no boulder as taped and weighed; the last of its refusals."""
FIXED_SIDES = ["boulder_length_m", "boulder_width_m", "boulder_height_m"]
"""Sides that the reader cannot change where the boulder has a profile of its own."""
OF_THE_PAGE = {"L": "reach_m", "bed_offset": "bed_offset_m"}
"""Where the page has its own names for what the verdict takes: a boulder reaches from where it is struck."""
MOST_CELLS = 1_500_000
"""Most designs of a grid whose verdicts go into the page; of larger grids, some values of the longest axes are left
out."""
MOST_POINTS = 20_000
"""Most designs of a list that go into the page; each carries its own inputs."""
OF_FLAGS = {"rock": "boulder_density_kg_m3", "phi_deg": "friction_angle_deg"}
"""Columns of what the flags take under names of their own."""
ANGLES = np.arange(20.0, 61.0)
"""Friction angles [deg] at which the page knows which soil constants belong together."""


def assembled(
    *,
    settings: Mapping[str, Any],
    control: Control,
    readings: Readings,
    start: Mapping[str, float],
    sheet: Sheet | None = None,
    sentences: Sequence[Sentence] = (),
    answers: Mapping[str, Screen] = NOTHING,
    rows: ResultRows | None = None,
    chosen: Sequence[Mapping[str, Any]] = (),
    facts: Sequence[tuple[str, str]],
    notes: Sequence[str] = (),
    heading: Mapping[str, str] = NOTHING,
    units: str = "si",
) -> str:
    """Return the page as HTML; its title is the name in the settings.

    Parameters
    ----------
    start
        The design with which the simulator starts, by the input columns of the table.
    sheet, sentences
        The first page, of a result, and what else there is to say of it.
    answers
        The answers by system of units, of a file of them.
    rows
        Rows of a result; None for a single design.
    chosen
        Designs that are shown in full: ``title``, ``number`` and ``inputs`` of each.
    facts, notes
        Names and values that describe the origin of the results, and notes on these particular ones.
    """
    kept, table = None, None
    if rows is not None:
        kept = thinned(rows)
        table = {**table_data(rows, kept), "held": held_at(rows, kept, chosen[0]["number"])}
    mapped = table is not None and table["mapped"]
    # The simulator of the page knows one profile for all designs, and none of those that a weighed boulder may have.
    chosen = [one for one in chosen if one.get("shape") is None]
    panels = ["live", *(f"chosen{k}" for k in range(len(chosen)))]
    document = Document()
    curved = [plot for panel in panels for plot in curves(panel)]
    for plot in [*curved, *map(verdict_map, ["live", "sweep"] if mapped else ["live"])]:
        document.add_root(plot)
    docs, items = standalone_docs_json_and_render_items(list(document.roots))
    elements = {plot.id: f"figure-{plot.name}" for plot in document.roots}
    data = page_data(settings=settings, control=control, readings=readings, start=start, chosen=chosen, units=units)
    data["rows"] = table
    data["bokeh"] = {"docs": docs, "items": [{**item.to_json(), "roots": elements} for item in items]}
    known = dict(facts)
    origin = (f"boulder-sweep {known['version of boulder-sweep']}", f"settings {known['hash of the settings'][:12]}")
    revision = f"revision {heading['revision']}" if "revision" in heading else ""
    footer = (heading.get("project"), data["title"], revision, heading.get("date"), *origin)
    listed = shown_settings(settings, units)
    derived = {name: listed.pop(name) for name in UNPRINTED if name in listed}
    script = "\n".join((ASSETS / f"{name}.js").read_text(encoding="utf-8") for name in SCRIPTS)
    library = "\n".join(INLINE.clone(components=["bokeh"]).js_raw)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(ASSETS),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template("page.html").render(
        title=data["title"],
        units=units,
        footer=_css_text(" · ".join(filter(None, footer))),
        sheet=sheet,
        sentences=sentences,
        answers=answers,
        panels=panels,
        inputs=data["inputs"],
        main=MAIN,
        chosen=data["chosen"],
        thinned=kept.words if kept is not None else None,
        mapped=mapped,
        said=not mapped or rows is None or sheet is None or _is_listed(rows, sheet, answers.get("si")),
        facts=facts,
        notes=[*notes],
        heading=heading,
        logs=log_charts(settings, units),
        sources=[words[0].upper() + words[1:] for words in derived_words(settings.get("derived", {}), units)],
        settings=settings,
        lines=setting_lines(listed),
        derived_lines=setting_lines(derived),
        readings=reading_words(settings),
        ground=ground_words(settings, units),
        shape=Shape.of_model(settings["model"]).words,
        fixed=data["boulder"]["fixed"],
        uncertain="distributions" in settings,
        law=LAW_WORDS.get(settings["model"].get("resistance", ""), ""),
        data=script_data(data),
        style=(ASSETS / "page.css").read_text(encoding="utf-8"),
        script=script,
        library=library,
        policy=_policy(library, script),
    )


def _is_listed(rows: ResultRows, sheet: Sheet, answers: Screen | None) -> bool:
    """Whether the designs are a list, or every row is in a table, so that a map of them says nothing on paper."""
    if rows.settings["order"] == "table":
        return True
    if answers is not None:
        return answers.has_each and not answers.part
    return "si" in sheet.cases and len(sheet.cases["si"].rows) == len(rows.codes)


def _css_text(text: str) -> str:
    """Return a text as a string of a style sheet, within HTML."""
    return "".join(one if one.isalnum() or one in " .,·-" else f"\\{ord(one):x} " for one in text)


def _policy(*scripts: str) -> str:
    """Content-Security-Policy of the page: its own scripts, no connections."""
    digests = [hashlib.sha256(script.encode()).digest() for script in scripts]
    hashes = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {hashes} 'wasm-unsafe-eval'; style-src 'unsafe-inline'; "
        "img-src data: blob:; font-src data:; connect-src 'none'; form-action 'none'; base-uri 'none'"
    )


def page_data(
    *,
    settings: Mapping[str, Any],
    control: Control,
    readings: Readings,
    start: Mapping[str, float],
    chosen: Sequence[Mapping[str, Any]],
    units: str,
) -> dict[str, Any]:
    """Return the data of every page; see `boulder_sweep.report.page.assembled`."""
    ground, shape = Ground.of_dict(settings["model"].get("ground", {})), Shape.of_model(settings["model"])
    law = settings["model"].get("resistance", RESISTANCES[0])
    simulated = control._replace(elements=min(control.elements, MOST_ELEMENTS))
    simulated = simulated._replace(paired=is_paired(readings, simulated, layered=is_layered(law, ground, shape)))
    controls = [simulated, *finer_controls(simulated)]
    return {
        "title": str(settings["name"]),
        "units": units,
        "unit": {unit: {system: shown_unit(unit, system) for system in SYSTEMS} for unit in _units()},
        "layout": _layout(),
        "controls": [[float(value) for value in (*readings, *one)] for one in controls],
        "steps_s": [reported_step_s(one) for one in controls],
        "rules": _rules(control.theta_limit, settings),
        "inputs": [
            _input(spec.name, start, settings, ground) for spec in (*INPUTS, *OPTIONAL_INPUTS) if spec.name in start
        ],
        "outcomes": [
            {"name": spec.name, "unit": spec.unit, "label": OUTCOME_WORDS[spec.name]}
            for spec in OUTCOMES
            if spec.name in OUTCOME_WORDS
        ],
        "start": dict(start),
        "soil": _soil(law, ground, shape),
        "face": isinstance(settings["inputs"]["impact_height_m"], str),
        "refusals": [*zip(REASONS, REFUSED_AT, strict=True), (TAPED, "boulder_mass_kg")],
        "refused": {"outside": OUTSIDE, "empty": EMPTY, "not_a_number": NOT_A_NUMBER},
        "boulder": {
            "flat_foot": float(settings["model"]["foot"] == FEET[0] and shape.stands_flat),
            "profile": [] if shape.is_box else [astuple(point) for point in shape.points],
            "filled": shape.filled,
            "fixed": FIXED_SIDES if shape.taper is None else [],
            "rock_assumed": settings["model"].get("rock_assumed", False),
            "least_solidity": LEAST_SOLIDITY,
            "least_taped": LEAST_TAPED,
            "most_solidity": MOST_SOLIDITY,
        },
        "words": REASON_WORDS,
        "parts": list(PARTS),
        "colours": COLOURS,
        "yaml": {system: _yaml(settings, ground, system) for system in SYSTEMS},
        "chosen": [dict(one) for one in chosen],
        "kernel": _packed(kernel()),
    }


@dataclass(frozen=True, eq=False)
class Selection:
    """The part of a grid or list that goes into the page."""

    indices: tuple[np.ndarray, ...]
    """Indices kept along each axis; for a list, the rows."""
    words: str
    """What is left out; empty if nothing is."""


def thinned(rows: ResultRows, most_cells: int = MOST_CELLS, most_points: int = MOST_POINTS) -> Selection:
    """Choose the rows that go into the page: all, or values spread evenly along the longest axes."""
    if not rows.axes:
        computed = np.flatnonzero(~rows.having(NOT_YET))  # the inputs of the others are in no file yet
        n, kept = len(computed), min(len(computed), most_points)
        words = f"{kept:,} of the {n:,} designs of the list, spread evenly" if kept < n else ""
        return Selection((computed[np.round(np.linspace(0, n - 1, kept)).astype(np.int64)],), words)
    lengths = list(rows.shape)
    while np.prod(lengths, dtype=float) > most_cells:
        longest = int(np.argmax(lengths))
        lengths[longest] = -(-lengths[longest] // 2)
    indices = tuple(
        np.round(np.linspace(0, whole - 1, kept)).astype(np.int64)
        for whole, kept in zip(rows.shape, lengths, strict=True)
    )
    left = [
        f"{kept:,} of {whole:,} values of {name}"
        for name, whole, kept in zip(rows.axes, rows.shape, lengths, strict=True)
        if kept < whole
    ]
    return Selection(indices, f"{', '.join(left)}, spread evenly" if left else "")


def table_data(rows: ResultRows, kept: Selection) -> dict[str, Any]:
    """Return the data of the map: codes of the designs kept, values along the axes or of the list."""
    codes = rows.codes.reshape(rows.shape)[np.ix_(*kept.indices)].ravel()
    if rows.axes:
        lines = zip(rows.axes.items(), kept.indices, strict=True)
        values = {name: along[indices].tolist() for (name, along), indices in lines}
    else:
        listed = {name: column for name, column in rows.inputs.items() if column.shape == rows.codes.shape}
        values = {name: column[kept.indices[0]].tolist() for name, column in listed.items()}
    return {
        **map_of(rows),
        "names": rows.names,
        "grades": rows.robustness,
        "grid": bool(rows.axes),
        "mapped": any(len(set(along)) > 1 for along in values.values()),
        "values": values,
        "given": {name: float(value) for name, value in rows.inputs.items() if value.shape == ()},
        "labels": {name: label_of(name) for name in values},
        "units": {name: "" if name in rows.sets else BY_NAME[name].unit for name in values},
        "sets": {
            axis: {"names": named.names, "inputs": {name: along.tolist() for name, along in named.inputs.items()}}
            for axis, named in rows.sets.items()
        },
        "codes": _packed(codes.tobytes()),
    }


def map_of(rows: ResultRows) -> dict[str, Any]:
    """Return what the map of answers adds to the map of a list: the axes it starts with, and the input asked for."""
    if rows.need is None:
        return {"first": [], "asked": ""}
    key, varying = rows.need.key, rows.varying()
    others = [name for name in varying if name not in (key.name, *rows.need.derived)]
    asked = [key.name] if key.name in varying else []
    return {"first": [*others, *asked][:2], "asked": "".join(asked)}


def held_at(rows: ResultRows, kept: Selection, number: int) -> dict[str, int]:
    """Return the index of a design along each axis of the map; the nearest one kept where its own is left out."""
    if not rows.axes:
        return {}
    index = np.unravel_index(number, rows.shape)
    lines = zip(rows.axes.items(), kept.indices, index, strict=True)
    return {name: int(np.abs(along[indices] - along[here]).argmin()) for (name, along), indices, here in lines}


def reading_words(settings: Mapping[str, Any]) -> str:
    """Return which formulas are read as printed, in words."""
    model = settings["model"]
    if model["preset"] != "mixed":
        return str(model["preset"]).replace("_", " ")
    return ", ".join(f"{name}: {value}" for name, value in model["readings"].items())


def _packed(content: bytes) -> str:
    """Return bytes as text that takes little of a page."""
    return base64.b64encode(gzip.compress(content, 6, mtime=0)).decode()


def _soil(law: str, ground: Ground, shape: Shape) -> dict[str, Any]:
    """The soil as it lies, as the kernel takes it."""
    lies, profile = ground_of(law, ground), profile_of(shape)
    numbers = [float(value) for value in lies[:-1]]
    return {
        "ground": [
            *(value if math.isfinite(value) else None for value in numbers),
            float(not ground.is_proportional),
            float(SLICES),
        ],
        "below": lies.below.ravel().tolist(),
        "profile": profile.ravel().tolist(),
        "deeper": len(lies.below),
        "points": len(profile),
        "layers": layers_count(law, ground, shape),
    }


def _layout() -> dict[str, Any]:
    """Order of the kernel's numbers, and the table column of each input."""
    return {
        "design": page_records.DESIGN,
        "settings": page_records.SETTINGS,
        "outcome": page_records.OUTCOME,
        "history": page_records.HISTORY,
        "sizes": [(SOURCES | OF_THE_PAGE).get(name, name) for name in rules.Sizes._fields],
        "flag_inputs": [(SOURCES | OF_FLAGS).get(name, name) for name in rules.FlagInputs._fields],
        "course": rules.Course._fields,
        "layer": PRESSURE_SLOPE + 1,  # the last of its columns
        "piece_room": page_records.PIECE_ROOM,
        "element_room": page_records.ELEMENT_ROOM,
        "sums_room": page_records.SUMS_ROOM,
        "columns": SOURCES,
    }


def _rules(rotation: float, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Limits of the criterion, and the words of every verdict."""
    criterion, rating, model = settings["criterion"], settings["criterion"]["rating"], settings["model"]
    least, most = family_bounds(ANGLES)
    odd = has_odd_layers(Ground.of_dict(model.get("ground", {})))
    tested = tested_of(model["calibrated_crush_m"], largest_tested_rotation(model["preset"]), odd_layers=odd)
    limits = [rotation, PENETRATION_LIMITS_M[rating], 1.0, *(criterion[name] for name in OF_CRITERION)]
    return {
        "rotation": rotation,
        "rating": rating,
        "limits": [*limits, *tested[:3], *tested.least, *tested.most],
        "verdicts": RULES,
        "not_finite": NOT_FINITE,
        "ratings": list(PENETRATION_LIMITS_M.items()),
        "status": {status.name: status.value for status in Status},
        "why": {str(status.value): words for status, words in STATUS_REASONS.items()},
        "flags": {flag.name: flag.meaning for flag in FLAGS},
        "families": {"angle": ANGLES.tolist(), "least": least.tolist(), "most": most.tolist()},
    }


def _units() -> list[str]:
    return sorted({spec.unit for spec in (*INPUTS, *OUTCOMES, *TO_BUILD)} | {"J", "N", "kPa"})


def _input(name: str, start: Mapping[str, float], settings: Mapping[str, Any], ground: Ground) -> dict[str, Any]:
    """Description of an input: words, unit, range of its slider, admitted and usual values."""
    field, here, axis = BY_NAME[name], start[name], settings["inputs"].get(name)
    assert field.admitted is not None  # every input has a range
    ends = [here, *(axis if isinstance(axis, list) else [])]
    if field.usual is not None:
        ends += [field.usual.low, field.usual.high]
    elif name == "embedment_depth_m":
        ends += [0.3 * start["boulder_height_m"], 0.8 * start["boulder_height_m"]]
    else:
        ends += [0.5 * here, 1.5 * here]
    return {
        "name": name,
        "section": field.section,
        "key": field.key,
        "label": label_of(name),
        "unit": field.unit,
        "low": field.admitted.low,
        "high": field.admitted.high,
        "reason": field.admitted.reason,
        "needed": needed(field.unit, sample_of(field)),
        "above": _above(name, ground),
        "from": max(min(ends), field.admitted.low),
        "to": min(max(ends), field.admitted.high),
        "usual": field.usual,
    }


def _above(name: str, ground: Ground) -> tuple[float, str] | None:
    """What an input must be more than in this soil, and what is said where it is not; None for no such limit."""
    if name == "friction_angle_deg" and ground.slope_deg > 0.0:
        return ground.slope_deg, f"the slope of {ground.slope_deg:g} deg must be less, {SLIDES}"
    water = ground.water_table_m
    if name == "soil_density_kg_m3" and water is not None and uppermost_is_wet(ground.layers, water):
        return WATER_KG_M3, FLOATS
    return None


def _ground_entries(ground: Ground, system: str) -> list[str]:
    """The entries of a settings file for the soil as it lies."""
    given = [
        ("cohesion", ground.cohesion_kPa or None, "kPa"),
        ("water_table", ground.water_table_m, "m"),
        ("slope", ground.slope_deg or None, "deg"),
    ]
    entries = [f"{key}: {_quantity(value, unit, system)}" for key, value, unit in given if value is not None]
    layers = [
        ", ".join(
            f"{key}: {_quantity(value, field.unit, system)}"
            for (key, field), value in zip(LAYER_FIELDS.items(), astuple(layer), strict=True)
        )
        for layer in ground.layers
    ]
    return [*entries, f"layers: [{', '.join(f'{{{one}}}' for one in layers)}]"] if layers else entries


def _quantity(value: float, unit: str, system: str) -> str:
    """A value in a unit of the table with the unit that it is shown in, to six digits."""
    return quantity_text(unit, system, value, digits=".6g")


def _yaml(settings: Mapping[str, Any], ground: Ground, system: str) -> dict[str, list[str]]:
    """What a settings file says beside the inputs: more entries of vehicle and soil, and the lines that follow."""
    criterion, model, solver = (settings[name] for name in ("criterion", "model", "solver"))
    taper = Shape.of_model(settings["model"]).taper
    soil = model["soil"] if isinstance(model["soil"], str) else f"{{elements: {model['soil']}}}"
    readings = f"{{{reading_words(settings)}}}" if model["preset"] == "mixed" else model["preset"]
    accuracy = f"accuracy: {solver['accuracy']}" if solver["accuracy"] else f"step: {solver['step_s']} s"
    limits = [
        f"{entry.key}: {_quantity(criterion[entry.name], entry.unit, system) if entry.unit else criterion[entry.name]}"
        for entry in fields_of("criterion")
    ]
    return {
        "boulder": [f"foot: {model['foot']}", *([f"taper: {taper:.6g}"] if taper not in (None, 1.0) else [])],
        "vehicle": [f"calibrated_crush: {_quantity(model['calibrated_crush_m'], 'm', system)}"],
        "soil": _ground_entries(ground, system),
        "lines": [
            f"criterion: {{{', '.join(limits)}}}",
            f"model: {{readings: {readings}, soil: {soil}, resistance: {model.get('resistance', RESISTANCES[0])}}}",
            f"solver: {{{accuracy}, horizon: {solver['horizon_s']} s}}",
        ],
    }
