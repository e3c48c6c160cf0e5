"""What a result says, in sentences: what passes, the least depth and the least mass with their margin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from boulder_sweep.judge.validity import BY_FLAG
from boulder_sweep.report.rows import NOT_YET, SOIL, Rows
from boulder_sweep.views.wording import REASON_WORDS

SAFE = 0.95
"""Probability of passing from which on a design is called safe here."""


class Quantity(NamedTuple):
    """A number in a sentence, in a unit of the table; the page shows it in the reader's."""

    value: float
    unit: str


Sentence = tuple[str | Quantity, ...]


@dataclass(frozen=True)
class Named:
    """A design worth naming."""

    title: str
    number: int
    """Its row."""


@dataclass(frozen=True)
class Answer:
    """What the page says first.

    Attributes
    ----------
    sentences
        The most important first.
    named
        The designs that they speak of.
    """

    sentences: tuple[Sentence, ...]
    named: tuple[Named, ...]


def answer_of(rows: Rows) -> Answer:
    """Describe the result of a sweep in sentences."""
    counts, total = rows.counts(), len(rows.codes)
    passing = rows.having("pass")
    n = int(passing.sum())
    uncertain = _uncertain(rows)
    means = ", at the means of their uncertain inputs" if uncertain else ""
    sentences: list[Sentence] = [*(sentence for sentence, _ in uncertain)]
    sentences.append((f"{n:,} of {total:,} designs pass ({_share(n, total)}){means}.",))
    if NOT_YET in counts:
        sentences.append((f"The run is not finished: {counts[NOT_YET]:,} designs are not computed yet.",))
    others = [f"{count:,} {_in_words(name)}" for name, count in counts.items() if name not in ("pass", NOT_YET)]
    if others:
        sentences.append((f"The others: {'; '.join(others)}.",))
    flagged = n - rows.flags.get("", 0)
    if flagged:
        commonest = sorted(((count, name) for name, count in rows.flags.items() if name), reverse=True)
        most = "; ".join(f"{count:,} with {BY_FLAG[name].meaning}" for count, name in commonest[:3])
        sentences.append((f"{flagged:,} of those that pass lie outside what the model was tested on: {most}.",))
    if n == 0:
        none = "No design passes at the means." if uncertain else "No design passes."
        return Answer((*sentences, (none,)), tuple(own for _, own in uncertain if own))
    soils = tuple(place for place, name in enumerate(rows.axes) if name in SOIL and rows.shape[place] > 1)
    found = [_least(rows, passing, soils, what) for what in ("mass", "depth")]
    if soils and not passing.all(axis=soils).any():
        number = int(np.prod([rows.shape[place] for place in soils]))
        sentences.append((f"No boulder passes in all {number} soils; the least ones below pass in their own.",))
    for sentence, _ in found:
        sentences.append(sentence)
    named = {own.number: own for _, own in uncertain if own}
    for _, one in found:
        known = named.get(one.number)
        named[one.number] = (
            one if known is None else Named(f"{known.title}, {one.title[0].lower()}{one.title[1:]}", one.number)
        )
    return Answer(tuple(sentences), tuple(named.values()))


def _uncertain(rows: Rows) -> list[tuple[Sentence, Named | None]]:
    """Say how probable it is that designs pass, and name the lightest of the safe ones; nothing of a run."""
    chances = rows.chances()
    if chances is None:
        return []
    if len(chances) == 1:
        row = rows.row(0)
        driver = row["p_pass_driver"]
        most = f", decided most by {driver.replace('.', ' ').replace('_', ' ')}" if driver else ""
        interval = f"{row['p_pass_low']:.1%} to {row['p_pass_high']:.1%}"
        return [((f"The probability of passing is {row['p_pass']:.1%} ({interval}){most}.",), Named("The design", 0))]
    safe = chances >= SAFE
    first = f"{int(safe.sum()):,} of {len(chances):,} designs pass with a probability of {SAFE:.0%} or more"
    if not safe.any():
        best = int(chances.argmax())
        largest = f"{first}; the largest is {chances[best]:.1%} (design {best:,})."
        return [((largest,), Named("Design with the largest probability of passing", best))]
    mass = np.where(safe, np.broadcast_to(rows.mass(), rows.shape).ravel(), np.inf)
    number = int(mass.argmin())
    depth = float(np.broadcast_to(rows.depth(), rows.shape).ravel()[number])
    sentence: Sentence = (
        f"{first}. The lightest of them: ",
        *(Quantity(float(mass[number]), "kg"), " of rock, "),
        *(Quantity(depth, "m"), f" deep (design {number:,}, P(pass) = {chances[number]:.1%})."),
    )
    return [(sentence, Named(f"Lightest boulder that passes with a probability of {SAFE:.0%}", number))]


def _in_words(name: str) -> str:
    """Verdict and reason for a sentence."""
    verdict, _, reason = name.partition(": ")
    return f"{verdict} ({REASON_WORDS.get(reason, reason)})" if reason else verdict


def _share(n: int, total: int) -> str:
    """Share of a total in per cent; never rounded to 0 % or 100 % unless exact."""
    return f"{n / total if n in (0, total) else min(max(n / total, 0.001), 0.999):.1%}"


def _least(rows: Rows, passing: np.ndarray, soils: tuple[int, ...], what: str) -> tuple[Sentence, Named]:
    """Find the design of least mass or depth, passing in every soil if any boulder does."""
    values, other = (rows.mass(), rows.depth()) if what == "mass" else (rows.depth(), rows.mass())
    everywhere = passing.all(axis=soils, keepdims=True) if soils else passing
    robust = bool(everywhere.any())
    eligible = np.broadcast_to(everywhere, rows.shape) if robust else passing
    least = np.where(eligible, values, np.inf)
    # Ties are broken by the other quantity.
    ties = least <= least.min() * (1.0 + 1e-9)
    first = int(np.argmin(np.where(ties, other, np.inf)))
    number, where = first, "in every soil of the sweep" if soils and robust else "among them"
    if soils and robust:
        number = _weakest(rows, first, soils)
    row = rows.row(number)
    mass, depth = (float(np.broadcast_to(value, rows.shape).flat[number]) for value in (rows.mass(), rows.depth()))
    title = "Lightest boulder that passes" if what == "mass" else "Shallowest embedment that passes"
    margin = row["margin"]
    held = f", margin {margin:.1%}" if margin is not None else ""
    weakest = " in the soil that is worst for it" if soils and robust else ""
    sentence: Sentence = (
        f"{'The lightest boulder' if what == 'mass' else 'The shallowest embedment'} that passes {where}: ",
        *(Quantity(mass, "kg"), " of rock, ", Quantity(depth, "m"), f" deep (design {number:,}{held}{weakest})."),
    )
    return sentence, Named(f"{title} {where}" if soils and robust else title, number)


def _weakest(rows: Rows, first: int, soils: tuple[int, ...]) -> int:
    """Return the row of the least margin among the soils of one boulder."""
    place = [np.array(k) for k in np.unravel_index(first, rows.shape)]
    lines = np.meshgrid(*(np.arange(rows.shape[axis]) for axis in soils), indexing="ij")
    for axis, line in zip(soils, lines, strict=True):
        place[axis] = line.ravel()
    numbers = np.sort(np.ravel_multi_index(np.broadcast_arrays(*place), rows.shape).ravel())
    margins = rows.margins(numbers)
    return int(numbers[np.nanargmin(np.where(np.isnan(margins), np.inf, margins))])
