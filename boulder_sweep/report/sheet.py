"""The first page of a report, which can be signed: question, recommendation, drawing, limits, inputs, what is assumed.

Sentences that hold units are made in both systems; numbers are `Measure`, which the page shows in either.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from boulder_kernels.rules import ISLAND_RATIO, ISLAND_SLIDE
from boulder_sweep.answers.advice import MODELS, advice, mass_is_least, question
from boulder_sweep.answers.need import Need
from boulder_sweep.answers.outputs import UNCERTAINTY, AnswerFile
from boulder_sweep.answers.printing import Screen, cases_screen, withstood
from boulder_sweep.answers.recommendation import Design
from boulder_sweep.answers.reserves import Reserves
from boulder_sweep.columns import BOULDER_MASS, SHAPES, TO_BUILD
from boulder_sweep.judge.robustness import meaning_of
from boulder_sweep.judge.validity import BY_FLAG
from boulder_sweep.judge.verdict import PENETRATION_LIMITS_M
from boulder_sweep.report.answers import Answer, Measure
from boulder_sweep.report.figures import Sketch, sketch_of
from boulder_sweep.report.rows import DEPTH, ResultRows, inputs_of
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import Distribution, Ground, ProfilePoint
from boulder_sweep.settings.soil_readings import log_title
from boulder_sweep.settings.units import SYSTEMS, quantity_text
from boulder_sweep.stones.taped import taped_profiles
from boulder_sweep.text import NO_BREAK_SPACE
from boulder_sweep.views.wording import ground_words, sized

SOIL = {
    "friction_angle_deg": "friction angle φ′",
    "soil_density_kg_m3": "density ρ",
    "subgrade_reaction_MN_m3": "subgrade reaction β",
    "strain_rate_factor": "strain rate factor",
}
VEHICLE = {
    "vehicle_mass_kg": "mass",
    "impact_speed_m_s": "speed",
    "vehicle_spring_N_m": "spring of the front",
    "vehicle_damper_N_s_m": "damper of the front",
    "bumper_height_m": "bumper above ground",
    "hood_height_m": "hood above ground",
    "bed_offset_m": "bumper to cargo bed",
}
USUAL_RATE = 1.0
"""Strain rate factor of soil that is no stronger under a fast load."""
UP_TO_THE_END = ("max_rotation_deg", "max_displacement_m", "penetration_m", "peak_force_kN")
"""Outcomes that might be more after the end of a run."""
OPEN_IN_WORDS = "no study says what a second opinion is worth here; the design is judged by its margin alone"
"""Note on a design without a grade."""
NOT_ASKED = "not asked", "no second opinion was asked of the designs that were drawn at random"
"""Grade and note of a design with a probability, whose draws have no second opinion."""
DRAWN = (
    "a probability",
    "asked of every design that was drawn at random; the share of robust passes stands among loads and limits",
)
"""Grade and note of a design with a probability of a robust pass."""
WITHSTANDS = "Which speed, which truck and which soil does the boulder withstand?"
WITHSTAND = "Which of {:,} designs is to be built, and which speed, truck and soil does it withstand?"
"""What `sweep capacity` asks, of one design and of several."""
Cell = str | Measure | Mapping[str, str]
"""A cell of a table: words, a number with its unit, or words by system of units."""


class Words(NamedTuple):
    """Sentences in one system of units."""

    question: str
    recommendation: tuple[str, ...]
    """What to build; where nothing qualifies, what comes nearest."""
    others: tuple[str, ...]
    untested: str
    ground: str
    governs: str
    """The case that the numbers are of; empty where there is one."""


class Sheet(NamedTuple):
    """What the first page shows."""

    words: dict[str, Words]
    """Sentences by system of units."""
    qualifies: bool
    title: str
    sketch: Sketch
    checks: tuple[tuple[str, Cell, Cell, str], ...]
    """Name, computed, limit, and how much of it is used."""
    build: tuple[tuple[str, Cell], ...]
    soil: tuple[tuple[str, Cell, Cell], ...]
    """Name, value and source of each input; of soil in layers the uppermost one's."""
    vehicle: tuple[tuple[str, Cell, Cell], ...]
    """Name, value and source of each input."""
    grade: tuple[str, str]
    """Grade of the recommended design over all cases, and its meaning."""
    cases: dict[str, Screen]
    """The recommended design in every soil and before every vehicle, by system of units; empty where there is one."""


def sheet_of(rows: ResultRows, answer: Answer, units: str) -> Sheet:
    """Return the first page of a result; the scale bar of the drawing is in the units that are shown first."""
    # Of the result of `sweep uncertainty` nobody asked a probability.
    need = replace(answer.need, probability=None) if rows.kind == UNCERTAINTY else answer.need
    found, row, settings = need.recommendation, answer.row, rows.settings
    near = None if found is None or found.nearest is None else found.nearest.design
    design = (found.design if found is not None and found.design is not None else near) or Design(
        [rows.to_build(answer.named.number) | row]
    )
    qualifies = found is not None and found.design is not None
    several = [name for name in (*SOIL, *VEHICLE) if len({one[name] for one in design.rows}) > 1]
    named = [name for name in need.sweep.plan.labels if name in row]
    grade = design.grade
    worst = next(one for one in design.rows if one["robustness"] == grade)
    such = sum(one["robustness"] == grade for one in design.rows)
    some = f" in {such:,} of {len(design.rows):,} cases" if such < len(design.rows) else ""
    means = meaning_of(worst) or "" if grade != "open" or worst["stands_under"] else OPEN_IN_WORDS
    opinion = f"{grade or ''}{some}", means
    return Sheet(
        words={system: _words(rows, answer, need, design, named or several, system) for system in SYSTEMS},
        qualifies=qualifies,
        title=answer.named.title,
        sketch=sketch_of(inputs_of(row), settings, units, _profile(row)),
        checks=_checks(row, settings["criterion"], need, design),
        build=_build(rows, row, design, need),
        soil=_soil(design.rows, settings),
        vehicle=_inputs(design.rows, VEHICLE, settings),
        grade=opinion if "p_pass" not in row else DRAWN if row.get("p_robust") is not None else NOT_ASKED,
        cases={one: cases_screen(design, [*named, *several], one) for one in SYSTEMS if len(design.rows) > 1},
    )


def _words(rows: ResultRows, answer: Answer, need: Need, design: Design, names: Sequence[str], units: str) -> Words:
    """Return the sentences; the need is what was asked, the names are inputs that tell cases apart."""
    found, said, asked = need.recommendation, advice(answer.need, units), question(need, units)
    ground = ground_words(rows.settings, units) or "level, the same at every depth, without cohesion"
    if rows.settings["model"].get("ground", {}).get("water_table_m") is None:
        ground += "; no ground water assumed"
    if all(case["strain_rate_factor"] == USUAL_RATE for case in design.rows):
        ground += f"; strain rate factor {USUAL_RATE:.1f}"
    derived, last = rows.settings.get("derived", {}), tuple[str, ...]()
    case = ", ".join(_named(name, answer.row[name], units) for name in names)
    governs = f"in the worst of {len(design.rows):,} cases: {case}" if case and len(design.rows) > 1 else ""
    if "p_pass" in answer.row:
        governs = f"{governs}{', ' * bool(governs)}at the means of its uncertain inputs"
    logs = dict.fromkeys(log_title(soil) for soil in derived.get("soil", ()) if "log" in soil)
    ground += "".join(f", from {title}" for title in logs)
    ground += "".join(f". Boulders: from {boulders['file']}" for boulders in derived.get("table", ()))
    if isinstance(rows.finished, AnswerFile) and isinstance(reserves := rows.finished.answers(), Reserves):
        boulders = 1 if found is None else found.boulders
        asked = WITHSTANDS if boulders == 1 else WITHSTAND.format(boulders)
        where = f"I{governs[1:].replace(': ', ' (')}) it" if governs else "It"
        last = (withstood(reserves, answer.named.number, units, where),)
    if rows.kind == UNCERTAINTY:
        one = asked.startswith("Does ")
        asked = f"With what probability d{asked[1:]}" if one else f"{asked[:-1]}, and with what probability?"
        if len(rows.codes) == 1:
            under = "" if answer.row.get("p_robust") is None else f", and of {_chance(answer.row, 'p_robust')} {MODELS}"
            said = [f"The boulder passes with a probability of {_chance(answer.row, 'p_pass')}{under}.", *said[1:]]
    if found is None:  # the worst answer, or why there is none
        said = ["".join(p if isinstance(p, str) else _measured(p, units) for p in answer.sentences[0])]
    if found is None or found.design is None:
        return Words(asked, (*said, *last), (), _untested(rows, design), ground, governs)
    return Words(asked, (said[0], *last), tuple(said[1:-1]), said[-1], ground, governs)


def _measured(part: Measure, units: str) -> str:
    """Return a number with its unit."""
    return quantity_text(part.unit, units, part.value).replace(" deg", "°").replace("^3", "³")


def _named(name: str, value: str | float, units: str) -> str:
    """Return an input with its value: the name of a set, or words and a number with its unit."""
    if isinstance(value, str):
        return value
    return f"{(SOIL | VEHICLE)[name]} {_measured(Measure(value, BY_NAME[name].unit), units)}"


def _checks(
    row: Mapping[str, Any], criterion: Mapping[str, Any], need: Need, design: Design
) -> tuple[tuple[str, Cell, Cell, str], ...]:
    """Return loads and limits of the row that governs, with the largest force of all cases.

    A boulder that is hardly buried may not slide far.
    """
    forces = [case["peak_force_kN"] for case in design.rows if case["peak_force_kN"] is not None]
    row = {**row, "peak_force_kN": max(forces, default=None)}
    overturned = row["time_to_limit_s"] is not None  # the run ended there
    slides = ISLAND_SLIDE if row[DEPTH] < ISLAND_RATIO * row["boulder_height_m"] else None
    limit, overlap = PENETRATION_LIMITS_M[criterion["rating"]], criterion["min_overlap_m"]
    of: list[tuple[str, str, str, float | None]] = [
        ("rotation", "max_rotation_deg", "deg", criterion["max_rotation_deg"]),
        ("displacement", "max_displacement_m", "m", slides),
        (f"penetration, rating {criterion['rating']}", "penetration_m", "m", limit),
        ("overlap, at least", "overlap_m", "m", overlap),
        ("largest peak force" if len(design.rows) > 1 else "peak force of the truck", "peak_force_kN", "kN", None),
        ("acting above ground at", "impact_height_m", "m", None),
    ]
    lines: list[tuple[str, Cell, Cell, str]] = []
    for words, name, unit, allowed in of:
        value = row[name]
        used, bound = "–", "≥ " * (overturned and name in UP_TO_THE_END)
        if value and allowed and not (bound and value < 0.0):
            used = f"{bound}{100.0 * max(allowed / value if name == 'overlap_m' else value / allowed, 0.0):.0f} %"
        none = "no limit" if name == "max_displacement_m" else "–"
        computed = _outcome(row, name, unit, bound)
        lines.append((words, computed, none if allowed is None else Measure(allowed, unit), used))
    if "p_pass" not in row and (design.stands or design.grade == "sensitive"):
        # A second opinion tells whether the boulder stays below a limit, not how far it turns.
        found, limit = need.recommendation, criterion["max_rotation_deg"]
        share = 1.0 - need.least_margin * (need.robust and (found is None or found.design is design))
        computed, used = "fails", "–"
        if design.stands:
            computed, used = Measure(share * limit, "deg", "at most "), f"≤ {100.0 * share:.0f} %"
        lines.insert(1, ("rotation, weakest model", computed, Measure(limit, "deg"), used))
    if "p_pass" in row:
        least = "–" if need.probability is None else f"≥ {100.0 * need.probability:.4g} %"
        chances = [("probability of passing", "p_pass"), ("and of a robust pass", "p_robust")]
        for words, name in reversed(chances):
            if row.get(name) is not None:
                own = need.robust == (name == "p_robust")
                ends = [("its interval", _interval(row, name), "–", "–")] * (_interval(row, name) != "")
                lines = [(words, f"{row[name]:.1%}", least if own else "–", "–"), *ends, *lines]
    return tuple(lines)


def _chance(row: Mapping[str, Any], name: str) -> str:
    """Return a probability with its interval, if there is one."""
    ends = _interval(row, name)
    return f"{row[name]:.1%}" + (f" ({ends})" if ends else "")


def _interval(row: Mapping[str, Any], name: str) -> str:
    """Return the interval of a probability; empty where there is none."""
    low, high = row.get(f"{name}_low"), row.get(f"{name}_high")
    return "" if low is None or high is None else f"{100.0 * low:.1f} to {high:.1%}"


def _untested(rows: ResultRows, design: Design) -> str:
    """Return in what a design with a probability lies outside the crash tests, where none is recommended."""
    if rows.kind != UNCERTAINTY or not design.flags:
        return ""
    return f"No crash test covers it: {'; '.join(BY_FLAG[name].meaning for name in design.flags)}."


def _outcome(row: Mapping[str, Any], name: str, unit: str, bound: str) -> Cell:
    """Return an outcome of a row; of a cargo bed that stays before the boulder, that it does not penetrate."""
    value = row[name]
    if name == "penetration_m" and value is not None and value <= 0.0:
        return "none so far" if bound else "none"
    return "–" if value is None else Measure(value, unit, bound)


def _build(rows: ResultRows, row: Mapping[str, Any], design: Design, need: Need) -> tuple[tuple[str, Cell], ...]:
    """Return what the drawing does not say of the boulder, and what it takes to build in the soil that needs most."""
    found, lines = need.recommendation, list[tuple[str, Cell]]()
    if found is not None and found.design is design and not found.of_run:
        lines.append(("depth, at least", Measure(row[DEPTH], "m", up=1)))
        most = "robust to" if design.grade == "robust" else "at most"
        lines += [(f"depth, {most}", Measure(found.deepest_m, "m", up=-1))] if found.deepest_m else []
    built = zip(("excavation", "backfill"), TO_BUILD[1:], strict=True)
    mass, density = row.get(BOULDER_MASS) or float(rows.mass().flat[0]), float(row["boulder_density_kg_m3"])
    rock = "".join(kind["name"] for kind in rows.settings.get("derived", {}).get("rock", ())) or "rock"
    low = ", low end" * rows.settings.get("taken_at", {}).get("boulder_density_kg_m3", "").endswith("low")
    of_mass = ", low end" * mass_is_least(need.sweep)
    name = BOULDER_MASS if BOULDER_MASS in rows.settings["inputs"] else "boulder_density_kg_m3"
    lines.append((f"mass{of_mass}", Measure(float(mass), "kg")))
    judged = [case.get(name) for case in rows.settings.get("judged_at", ()) if of_mass]
    if high := max((other for other in judged if isinstance(other, float)), default=0.0):
        lines.append(("mass, high end", Measure(float(mass) * high / float(row.get(name) or mass), "kg")))
    lines.append((f"density of {rock}{low}", Measure(density, "kg/m^3")))
    if _is_taped(row):
        lines.append(("fills of its box", f"{row['solidity']:.0%}"))
        lines.append(("drawn: worst of its shapes", row["shape"].replace("_", " ")))
    for words, spec in built:
        if spec.name in design.rows[0]:
            lines.append((words, Measure(max(float(one[spec.name]) for one in design.rows), spec.unit)))
    return tuple(lines)


def _is_taped(row: Mapping[str, Any]) -> bool:
    """Whether a family of shapes stands for a boulder; a stored row may say anything."""
    return row["shape"] in SHAPES and isinstance(row["solidity"], float)


def _profile(row: Mapping[str, Any]) -> tuple[ProfilePoint, ...]:
    """Return the shape that decides the verdict of a boulder that is taped and weighed; none of another."""
    if not _is_taped(row):
        return ()
    points = taped_profiles(row["shape"], np.array([row["solidity"]]))[0]
    return tuple(ProfilePoint(*map(float, point)) for point in points)


def _soil(cases: Sequence[Mapping[str, Any]], settings: Mapping[str, Any]) -> tuple[tuple[str, Cell, Cell], ...]:
    """Return constants of the soil, of layers the uppermost, cohesion and water table with their sources."""
    ground, lines = Ground.of_dict(settings["model"].get("ground", {})), _inputs(cases, SOIL, settings)
    if ground.cohesion_kPa:
        lines = (*lines, ("cohesion", Measure(ground.cohesion_kPa, "kPa"), "settings"))
    if ground.water_table_m is not None:
        lines = (*lines, ("water table below ground", Measure(ground.water_table_m, "m"), "settings"))
    return lines


def _inputs(
    cases: Sequence[Mapping[str, Any]], names: Mapping[str, str], settings: Mapping[str, Any]
) -> tuple[tuple[str, Cell, Cell], ...]:
    """Return inputs with their values in all cases, and where they come from."""
    lines = []
    for name, words in names.items():
        values, field = sorted({float(one[name]) for one in cases}), BY_NAME[name]
        if name in settings.get("distributions", {}) and "p_pass" in cases[0]:
            words = f"{words}, mean"
        if name == "strain_rate_factor" and values == [USUAL_RATE]:
            continue  # it stands among the assumptions
        for value in dict.fromkeys((values[0], values[-1])):
            first = value == values[0]
            shown = f"{words}{', least' if first else ', largest'}" if len(values) > 1 else words
            lines.append((shown, Measure(value, field.unit), _source(name, values, settings) if first else ""))
    return tuple(lines)


def _source(name: str, values: Sequence[float], settings: Mapping[str, Any]) -> str | Mapping[str, str]:
    """Return where the value of an input comes from, in few words."""
    derived = settings.get("derived", {})
    read = {"density_low_kg_m3": "soil_density_kg_m3"}
    of_soil = {read.get(key, key) for data in derived.get("soil", []) for key in data}
    spread = settings.get("distributions", {}).get(name)
    if name in of_soil:
        source = "from field readings"
    elif name == "impact_speed_m_s" and "approach" in derived:
        source = "approach"
    elif BY_NAME[name].default is not None and values == [BY_NAME[name].default]:
        source = "default"
    else:
        source = "settings"
    if spread is None:
        return source
    begin = "" if source == "settings" else f"{source}; "
    return {system: begin + _spread(spread, BY_NAME[name].unit, system) for system in SYSTEMS}


def _spread(own: Mapping[str, Any], unit: str, units: str) -> str:
    """Return how an input is spread; named sets may each have a distribution of their own."""
    each = [Distribution(**one).words(*sized(unit, units)) for one in own.get("sets", [own]) if one is not None]
    each = [NO_BREAK_SPACE.join(words.replace(" deg", "°").rsplit(" ", 1)) for words in each]
    return " or ".join(dict.fromkeys(each))
