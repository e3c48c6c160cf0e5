"""The page: one self-contained file with the plotting library, the kernel, the script and the data."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
from bokeh.document import Document
from bokeh.embed.util import standalone_docs_json_and_render_items
from bokeh.resources import INLINE

from boulder_kernels import Control, Readings
from boulder_sweep.report.contents import held_at, page_data, reading_words, table_data, thinned
from boulder_sweep.report.export import setting_lines
from boulder_sweep.report.figures import curves, verdict_map
from boulder_sweep.report.log_chart import log_charts
from boulder_sweep.settings.model import Shape
from boulder_sweep.settings.units import shown_settings
from boulder_sweep.text import script_data
from boulder_sweep.views.wording import LAW_WORDS, ground_words

if TYPE_CHECKING:
    from boulder_sweep.report.asked import AnswerTable, Sentence
    from boulder_sweep.report.rows import ResultRows
    from boulder_sweep.report.sheet import Sheet

ASSETS = Path(__file__).with_name("assets")
SCRIPTS = ("kernel", "verdict", "simulator", "texts", "plots", "scene", "maps", "controls", "page")
"""Our own script, in this order."""
NOTHING: Mapping[str, str] = {}
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


def assembled(
    *,
    settings: Mapping[str, Any],
    control: Control,
    readings: Readings,
    start: Mapping[str, float],
    sheet: Sheet | None = None,
    sentences: Sequence[Sentence] = (),
    answers: AnswerTable | None = None,
    rows: ResultRows | None = None,
    chosen: Sequence[Mapping[str, Any]] = (),
    facts: Sequence[tuple[str, str]],
    notes: Sequence[str] = (),
    heading: Mapping[str, str] = NOTHING,
    units: str = "si",
) -> str:
    """Put the page together.

    Parameters
    ----------
    settings
        Resolved settings of the sweep, whose name is the title of the page.
    control, readings
        How its designs are simulated.
    start
        The design with which the simulator starts, by the input columns of the table.
    sheet
        The first page, of a result.
    sentences
        What else there is to say of it.
    answers
        The answers one by one, of a file of them.
    rows
        Rows of a result; None for a single design.
    chosen
        Designs that are shown in full: ``title``, ``number`` and ``inputs`` of each.
    facts
        Names and values that describe the origin of the results.
    notes
        Notes on these particular results.
    heading
        Project, client and so on, as far as given.
    units
        Units shown first, ``si`` or ``us``.

    Returns
    -------
    str
        HTML.
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
        said=rows is None or sheet is None or not mapped or _is_listed(rows, sheet, answers),
        facts=facts,
        notes=notes,
        heading=heading,
        logs=log_charts(settings),
        settings=settings,
        lines=setting_lines(shown_settings(settings, units)),
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


def _is_listed(rows: ResultRows, sheet: Sheet, answers: AnswerTable | None) -> bool:
    """Whether every row of a result is in a table, so that a map of them says nothing on paper."""
    if answers is not None:
        return not answers.left_out
    return sheet.cases is not None and len(sheet.cases.rows) == len(rows.codes)


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
