"""The answer of `need` in words: which boulder to bury how deep, why, what else there is, and what to ask next."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from boulder_sweep.answers.keys import sweep_ranges
from boulder_sweep.answers.recommendation import OF_A_DESIGN, Design, Nearest, Recommendation
from boulder_sweep.answers.search import ALWAYS, FAULTY, WORDS
from boulder_sweep.answers.trials import DEPTH, HEIGHT, RATIO, USUALLY
from boulder_sweep.columns import BOULDER_MASS
from boulder_sweep.designs import SIDES
from boulder_sweep.judge.quantities import EXCAVATED
from boulder_sweep.judge.robustness import MEANINGS, can_be_asked
from boulder_sweep.judge.validity import BY_FLAG, UNSTUDIED
from boulder_sweep.settings.fields import BY_NAME, EMBEDMENT
from boulder_sweep.settings.units import quantity_text, shown_unit
from boulder_sweep.text import NO_BREAK_SPACE

if TYPE_CHECKING:
    from boulder_sweep.answers.need import Need
    from boulder_sweep.settings import Sweep

MODELS = "under the weakest of three soil models"
"""What second opinions are, in the words of an answer."""
NOT_ASKED = "no second opinion was asked for"
"""Why designs of a run may have no grade."""
ALONG = dict(zip(SIDES, ("long", "wide", "high"), strict=True))
BETTER = {"mass": "lighter", "depth": "shallower", "excavation": "less to dig"}
"""What the best design by a preference is, compared with the recommended one."""
BEST = {"mass": "the lightest", "depth": "the shallowest", "excavation": "the one with the least to dig"}
"""What the recommended design is, by preference."""
MOST_NAMED = 6
"""Most boulders that are named one by one because they will not do."""
SIZES = 7
"""Values of a side that are suggested where no boulder of the file qualifies."""
ROUNDED = 0.01
"""Share by which rounding may make a side smaller than the usual one."""


class Again(NamedTuple):
    """How a question was asked on the command line, so that the next one can be suggested as a whole command.

    Parameters
    ----------
    file
        The settings file.
    options
        The options that were given and decide the answer, each with its values: ``("--units", "us")``.
    """

    file: str
    options: tuple[tuple[str, ...], ...] = ()

    def asking(self, *options: tuple[str, ...], without: tuple[str, ...] = ()) -> str:
        """Return the command that asks with other options. Options of the same name, and some more, are left out.

        Of entries of the file, all remain that are not set anew. The boulder's embedment is one entry by two names.
        """
        fresh = {name for name, *_ in options if name != "--set"} | {*without}
        entries = {_entry(value) for name, *values in options if name == "--set" for value in values}
        kept = [
            option
            for option in self.options
            if option[0] not in fresh and not (option[0] == "--set" and _entry(option[1]) in entries)
        ]
        return shlex.join(["sweep", "need", self.file, *(word for option in (*kept, *options) for word in option)])


def _entry(assignment: str) -> str:
    """Return which entry of a file an assignment sets; depth and ratio are one."""
    path = assignment.partition("=")[0].strip()
    return "site.embedment" if path.startswith("site.embedment") else path


def advice(need: Need, units: str = "si") -> list[str]:
    """Return the recommendation as sentences, one or several to a paragraph, the most important first.

    Parameters
    ----------
    need
        The answers.
    units
        ``si`` or ``us``.
    """
    found = need.recommendation
    if found is None:
        return []
    words = _Words(need, found, units)
    if found.design is None:
        return [words.none(), *([words.nearest(found.nearest)] if found.nearest else [])]
    will_not_do = words.will_not_do() if need.key.name in EMBEDMENT and not found.of_run else []
    return [words.recommendation(found.design), *words.others(found.design), *will_not_do, words.tested(found.design)]


def question(need: Need, units: str = "si") -> str:
    """Return what was asked, as a question: of which boulder, before which truck, by which limits."""
    words = _Words(need, need.recommendation or Recommendation("mass", None, {}, 1, 0, 0, 1), units)
    return words.question()


def next_questions(need: Need, again: Again, units: str = "si") -> list[tuple[str, str]]:
    """Return what to ask next where no boulder qualifies: words, and a whole command for each."""
    found = need.recommendation
    if found is None or found.design is not None:
        return []
    questions, nearest = [], found.nearest
    if nearest is not None and nearest.design is not None:
        grade = ("--robust",) if nearest.robust else ("--any",)
        less = again.asking(("--margin", f"{nearest.margin:.0%}"), grade, without=("--robust", "--any"))
        questions.append(("with less to spare", less))
    wider = _wider(need, units)
    if wider:
        questions.append(("the lightest of more boulders", again.asking(*wider, without=("--least", "--between"))))
    return questions


def _wider(need: Need, units: str) -> list[tuple[str, ...]]:
    """Return options by which a file has more boulders and depths; none if they are as many as are usual."""
    given = need.sweep.plan.given
    options: list[tuple[str, ...]] = []
    if need.sweep.table is not None or not need.sweep.model.shape.is_box or BOULDER_MASS in given:
        return []
    ranges = sweep_ranges(need.sweep)
    low, high = ranges.get(RATIO, USUALLY)
    if DEPTH in ranges or low > USUALLY[0] or high < USUALLY[1]:
        options.append(("--set", f"site.embedment_ratio=[{USUALLY[0]:g}, {USUALLY[1]:g}]"))
    for name in SIDES[1:]:
        usual, values = BY_NAME[name].usual, given[name].values
        if usual is not None and values.max() < usual.high * (1.0 - ROUNDED):
            ends = tuple(quantity_text("m", units, _down(end, units)) for end in (values.min(), usual.high))
            options.append(("--set", f"{BY_NAME[name].path}={{from: {ends[0]}, to: {ends[1]}, count: {SIZES}}}"))
    return options


def _down(length: float, units: str) -> float:
    """Return a length [m] that is written in few digits."""
    size = shown_unit("m", units).size
    return math.floor(length / size * 100.0 + 1e-6) / 100.0 * size


class _Words:
    """The sentences about a recommendation.

    Parameters
    ----------
    need, found
        The answers and their recommendation.
    units
        ``si`` or ``us``.
    """

    def __init__(self, need: Need, found: Recommendation, units: str) -> None:
        self.need, self.found, self.units = need, found, units
        given = need.sweep.plan.given
        several = [name for name, one in given.items() if name in BY_NAME and one.values.min() < one.values.max()]
        self.told_apart = [name for name in SIDES if name in several or name == need.key.name] or [*SIDES]
        self.rocks = "boulder_density_kg_m3" in several
        self.conditions = [name for name in several if name not in OF_A_DESIGN]
        self.kind = "designs" if found.of_run else "boulders"

    def value(self, name: str, value: float, digits: str = ".4g") -> str:
        """Return the value of an input with its unit."""
        return self.quantity(BY_NAME[name].unit, value, digits)

    def quantity(self, unit: str, value: float, digits: str = ".4g") -> str:
        """Return a value with its unit, which no line break parts."""
        text = quantity_text(unit, self.units, value, digits=digits).replace("^3", "³").replace(" deg", "°")
        return text.replace(" ", NO_BREAK_SPACE)

    def length(self, metres: float) -> str:
        """Return a length with its unit."""
        return self.quantity("m", metres)

    def mass(self, row: Mapping[str, Any]) -> str:
        """Return the mass of the boulder of a row, tonnes or pounds; of one taken at its low end that it is no less."""
        least = "at least " * mass_is_least(self.need.sweep)
        if self.units == "us":
            return least + self.quantity("kg", row[BOULDER_MASS], ",.0f")
        return f"{least}{row[BOULDER_MASS] / 1000:.1f}{NO_BREAK_SPACE}t"

    def depth(self, design: Design) -> str:
        """Return the depth of a design."""
        return self.deep(design.sizes[DEPTH])

    def deep(self, metres: float) -> str:
        """Return how deep a boulder is buried."""
        unit, size = shown_unit("m", self.units)
        return f"{depth_text(metres / size)}{NO_BREAK_SPACE}{unit} deep"

    def dug(self, design: Design) -> str:
        """Return what is excavated for a design."""
        return self.quantity("m^3", design.excavated_m3, ".1f")

    def boulder(self, row: Mapping[str, Any], rock: str = "") -> str:
        """Return what tells a boulder from the others of the file: its own name, or its kind of rock, and its sides."""
        label = self.label(row)
        if self.told_apart == [HEIGHT] and not label:
            named = f"{self.length(row[HEIGHT])} {rock}boulder"
        else:
            sides = (f"{self.length(row[name])} {ALONG[name]}" for name in self.told_apart)
            named = f"{'' if label else rock}boulder {label}{listed(tuple(sides))}".strip()
        rock = self.value("boulder_density_kg_m3", row["boulder_density_kg_m3"])
        return f"the {named} of {rock}" if self.rocks else f"the {named}"

    def label(self, row: Mapping[str, Any]) -> str:
        """Return what a list of weighed boulders calls one, before its sides; empty of other files."""
        yard = self.need.sweep.table
        if yard is None or BOULDER_MASS not in yard.columns or self.found.conditions > 1:
            return ""
        names = " ".join(row[name] for name in self.need.sweep.plan.labels if row.get(name))
        return f"{names}, " if names else ""

    def everywhere(self) -> str:
        """Return in which soils and before which vehicles; empty where there is one of each."""
        n, sections = self.found.conditions, {BY_NAME[name].section for name in self.conditions}
        if n == 1:
            return ""
        if self.need.sweep.table is not None:
            return " in every row of the list that has it"
        every = "both" if n == 2 else f"all {n}"
        if self.conditions == ["impact_speed_m_s"]:
            return f" at {every} speeds"
        if sections == {"soil"}:
            return f" in {every} soils"
        return f" before {every} vehicles" if sections == {"vehicle"} else f" in {every} cases of soil and vehicle"

    def taken(self) -> str:
        """Return at which values uncertain inputs are taken; empty where there are none, or a probability is asked."""
        at = next(iter(self.need.sweep.taken_at.values()), "").partition(" ")[0]
        if not at:
            return ""
        return f" at the {'means' if at == 'mean' else f'{at[1:]}{NO_BREAK_SPACE}% ends'} of its uncertain inputs"

    def here(self, row: Mapping[str, Any]) -> str:
        """Return in which soil and before which vehicle a row is; empty where there is one of each."""
        labels = [row[name] for name in self.need.sweep.plan.labels]
        values = [f"{BY_NAME[name].key.replace('_', ' ')} {self.value(name, row[name])}" for name in self.conditions]
        return f" at {listed(tuple(labels or values))}" if self.found.conditions > 1 else ""

    def question(self) -> str:
        """Return what was asked."""
        need, found = self.need, self.found
        stops = f"{self.truck()}{self.everywhere()}{self.terms()}"
        if need.key.most or need.key.name not in OF_A_DESIGN:
            words = f"{'largest' if need.key.most else 'least'} {BY_NAME[need.key.name].path.replace('.', ' ')}"
            return f"What is the {words.replace('_', ' ')} at which the boulder stops {stops}?"
        if found.of_run:
            which = f"Which of {found.boulders:,} boulders and depths" if found.boulders > 1 else "Does the boulder"
            return f"{which} {'stops' if found.boulders > 1 else 'stop'} {stops}?"
        if need.key.name not in EMBEDMENT:
            return f"How {ALONG.get(need.key.name, 'dense')} must the boulder be to stop {stops}?"
        if found.boulders == 1:
            return f"How deep must the boulder be buried to stop {stops}?"
        return f"Which of {found.boulders:,} boulders, buried how deep, stops {stops}?"

    def truck(self) -> str:
        """Return the vehicles and their speeds, without what is asked for."""
        given, words = self.need.sweep.plan.given, "a truck"
        for name, before, digits in (("vehicle_mass_kg", "of", ",.0f"), ("impact_speed_m_s", "at", ".4g")):
            if name != self.need.key.name:
                values = given[name].values
                text = quantity_text(BY_NAME[name].unit, self.units, values.min(), values.max(), digits=digits)
                words += f" {before} {text.replace(' ', NO_BREAK_SPACE)}"
        return words

    def terms(self) -> str:
        """Return what is asked for beside passing."""
        need = self.need
        how = f", with {percent(need.least_margin)} to spare" if need.least_margin else ""
        how += f" {MODELS}" if need.robust else ""
        if need.probability is not None:
            how += f", with a probability of {100.0 * need.probability:.4g}{NO_BREAK_SPACE}%"
        return how

    def recommendation(self, design: Design) -> str:
        """Return what to build, and why it is this one."""
        row, margin = design.rows[0], self.need.least_margin
        rock = "".join(f"{kind['name']} " for kind in self.need.sweep.derived.get("rock", ()))
        build = f"ury {self.boulder(row, rock)} ({self.mass(row)}) {self.depth(design)}: it passes"
        build += self.everywhere() + self.taken()
        if design.chance is not None:
            chance = design.chance_robust if self.need.robust and design.chance_robust is not None else design.chance
            holds = f" {MODELS}" if self.need.robust else ""
            holds += f" with a probability of {100.0 * chance:.1f}{NO_BREAK_SPACE}%"
            holds += f" and {percent(margin)} to spare" if margin else ""
        else:
            holds = f" with {percent(design.margin)} to spare{self.opinions(design)}"
        begin, open_ = "B", self.not_graded(design)
        if open_ and not design.stands:
            begin, open_ = f"{open_} By the margin alone, b", ""
        return f"{begin}{build}{holds}.{self.not_asked(design)}{self.why(design)}{open_ and ' '}{open_}"

    def not_asked(self, design: Design) -> str:
        """Return what nobody asked of a design: margin and second opinions with a probability, and lesser depths."""
        words, missing = "", {"margin": self.need.least_margin, "second opinion": self.need.robust}
        if design.chance is not None and not all(missing.values()):
            left = " and no ".join(name for name, asked in missing.items() if not asked)
            words = f" No {left} {'was' if any(missing.values()) else 'were'} asked for."
        if self.need.key.name in EMBEDMENT and not self.found.of_run:
            where = *SIDES, DEPTH, "found"
            ends = [row for row in self.need.arrow.select(where).to_pylist() if row["found"] == WORDS[ALWAYS]]
            if any(all(row[name] == size for name, size in design.sizes.items() if name in row) for row in ends):
                words += " Lesser depths were not searched."
        return words

    def why(self, design: Design) -> str:
        """Return why it is this boulder, as a sentence that follows another."""
        found, best = self.found, BEST[self.found.prefer]
        if found.boulders == 1:
            return ""
        if found.qualified == 1:
            return f" No other of the {found.boulders:,} {self.kind} qualifies."
        if found.alike == found.qualified:
            return f" It is {best} of {found.qualified:,} {self.kind} that qualify."
        robust, one = design.grade == "robust", found.alike == 1
        these = "the only one" if one else f"{best} of the {found.alike:,}"
        are = f"that {'is' if one else 'are'} robust" if robust else "that no second opinion overturns"
        return f" {found.qualified:,} {self.kind} qualify; this is {these} {are}."

    def opinions(self, design: Design) -> str:
        """Return what second opinions say of a design."""
        margin = self.need.least_margin
        if design.stands:
            return f", and with {percent(margin)} {MODELS}" if margin and self.need.robust else f", and stands {MODELS}"
        return ", but a second opinion overturns it (sensitive)" if design.grade == "sensitive" else ""

    def not_graded(self, design: Design) -> str:
        """Return why a design has no grade; empty where it has one, or none is asked for."""
        rows = [row for row in design.rows if row["robustness"] == "open"]
        if design.grade != "open":
            return ""
        outside = [BY_FLAG[name].meaning for name in Design(rows).flags if name in UNSTUDIED]
        if not can_be_asked(self.need.sweep):
            return f"Not graded: {MEANINGS['open']}."
        if not outside:
            return f"Not graded: {NOT_ASKED}."
        some = f" in {len(rows)} of {len(design.rows)} cases" if len(rows) < len(design.rows) else ""
        says = "Its grade is open" if design.stands else "Not graded"
        return f"{says}{some}: no study of second opinions covers {' or '.join(outside)}."

    def others(self, design: Design) -> list[str]:
        """Return the designs that are better in something else."""
        sentences: dict[tuple[float, ...], tuple[str, Design]] = {}
        for name, other in self.found.others.items():
            sizes = tuple(other.sizes.values())
            words = f"{sentences[sizes][0]}, and {BETTER[name]}" if sizes in sentences else BETTER[name].capitalize()
            sentences[sizes] = (words, other)
        at_most = "up to " if len({row[EXCAVATED.name] for row in design.rows}) > 1 else ""
        return [
            f"{words}: {self.boulder(other.rows[0])}, {self.mass(other.rows[0])}, {self.depth(other)}, "
            f"{at_most}{self.dug(other)} to dig in place of {self.dug(design)}."
            for words, other in sentences.values()
        ]

    def will_not_do(self) -> list[str]:
        """Return which boulders have no depth, and where: one by one if they are few and differ by height alone."""
        found = self.found
        none = found.boulders - found.qualified - (self.need.errors if found.conditions == 1 else 0)
        if not none:
            return []
        at_no_depth = f"At no depth{self.terms().lstrip(',')}"
        if self.told_apart != [HEIGHT] or none > MOST_NAMED or self.rocks:
            failing = [row for row in self.need.arrow.to_pylist() if row["passes_at"] is None]
            failing = [row for row in failing if row["found"] != WORDS[FAULTY]]
            names = [self.label(row).removesuffix(", ") for row in failing]
            if all(names) and none <= MOST_NAMED:
                return [f"{at_no_depth}: {', '.join(names)}."]
            return [f"{at_no_depth}: {none:,} of {found.boulders:,} boulders."] if found.qualified > 1 else []
        never: dict[float, list[dict[str, Any]]] = {}
        for row in self.need.arrow.to_pylist():
            if row["passes_at"] is None:
                never.setdefault(row[HEIGHT], []).append(row)
        where: dict[str, list[str]] = {}
        for height, rows in never.items():
            some = f" in {len(rows)} of {found.conditions} cases" if len(rows) > 1 else self.here(rows[0])
            where.setdefault("" if len(rows) == found.conditions else some, []).append(self.length(height))
        parts = (f"{', '.join(heights)}{place}" for place, heights in sorted(where.items()))
        return [f"{at_no_depth}: {'; '.join(parts)}."]

    def tested(self, design: Design) -> str:
        """Return in what a design lies outside the crash tests."""
        if not design.flags:
            return (
                "It lies inside what the model was tested on, and is a simulation all the same, not a rating by test."
            )
        return f"No crash test covers it: {'; '.join(BY_FLAG[name].meaning for name in design.flags)}."

    def none(self) -> str:
        """Return that nothing qualifies."""
        need, of = self.need, "design of the run" if self.found.of_run else "boulder of the file"
        who = f"No {of} passes" if self.found.boulders > 1 else "The boulder does not pass"
        how = f" with {percent(need.least_margin)} to spare" if need.least_margin else ""
        how += f" {MODELS}" if need.robust else ""
        if need.probability is not None:
            how = f" with a probability of {100.0 * need.probability:.4g}{NO_BREAK_SPACE}%{' and' if how else ''}{how}"
        return f"{who}{how}{self.everywhere()}."

    def nearest(self, nearest: Nearest) -> str:
        """Return what comes nearest, by how much it falls short, and which input would change that."""
        failing = [row for row in nearest.rows if row["passes_at"] is None]
        failing.sort(key=lambda row: row["verdict"] == "pass")  # it may pass there, but not as asked
        row, design, who = (failing or nearest.rows)[0], nearest.design, self.boulder(nearest.rows[0])
        if design is not None:
            under = f" {MODELS}" if nearest.robust else ", but not under every soil model" * self.need.robust
            has = percent(nearest.margin) if nearest.margin else "nothing"
            text = f"Nearest: {who} ({self.mass(row)}) {self.depth(design)}, with {has} to spare{under}."
        elif not failing:
            text = (
                f"Nearest: {who} ({self.mass(row)}), which passes{self.everywhere()}, but at no depth in all of them."
            )
        else:
            why = (row["reason"] or f"passes with {percent(row['margin'])} to spare").replace("_", " ")
            deep = self.deep(row[DEPTH])
            never = f"passes at no depth{self.here(row)}; {deep}"
            if self.found.of_run:
                some = f" in {len(failing):,} of {len(nearest.rows):,} cases" if len(nearest.rows) > 1 else ""
                never = f"fails{some} {deep}"
            text = f"Nearest: {who} ({self.mass(row)}), which {never}: {why}."
        changes = []
        for name, one in nearest.changes.items():
            at_most = name == "impact_speed_m_s"
            value = (min if at_most else max)(row[name] for row in one.rows)
            size = shown_unit(BY_NAME[name].unit, self.units).size
            held = size * within(value / size, math.floor if at_most else math.ceil)
            changes.append(f"{BY_NAME[name].path} {self.value(name, held)} or {'less' if at_most else 'more'}")
        either = "; or ".join(changes)
        return f"{text} It would qualify with {either}." if changes else text


def mass_is_least(sweep: Sweep) -> bool:
    """Return whether the masses of boulders are taken at their low end."""
    uncertain = BOULDER_MASS if BOULDER_MASS in sweep.plan.given else "boulder_density_kg_m3"
    return sweep.taken_at.get(uncertain, "").endswith("low")


def depth_text(depth: float) -> str:
    """Return a depth in three decimals [m, ft], rounded up, so that it is never less than what passes."""
    return f"{math.ceil(depth * 1000.0 - 1e-6) / 1000.0:.3f}"


def within(value: float, rounded: Callable[[float], int]) -> float:
    """Return a value in four digits, rounded up or down, to the side on which it still qualifies."""
    step = 10.0 ** (math.floor(math.log10(value)) - 3)
    return rounded(value / step + (1e-6 if rounded is math.floor else -1e-6)) * step


def percent(share: float) -> str:
    """Return a share in whole per cent."""
    return f"{100.0 * share:.0f}{NO_BREAK_SPACE}%"


def listed(words: tuple[str, ...]) -> str:
    """Return words as a list: ``a, b and c``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
