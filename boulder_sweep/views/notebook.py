"""What a notebook shows of a result."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from boulder_sweep.answers.advice import advice
from boulder_sweep.answers.need import Need
from boulder_sweep.answers.printing import reserve_lines, screen_lines, uncertainty_lines
from boulder_sweep.answers.uncertainty import Uncertainty

if TYPE_CHECKING:
    from boulder_sweep.answers.reserves import Reserves


def text_of(result: Need | Uncertainty | Reserves) -> str:
    """Return what a command prints: the sentences of a recommendation, and a table of a screen."""
    sentences, lines = _said(result)
    return "\n".join([*sentences, *([""] if sentences else []), *lines])


def html_of(result: Need | Uncertainty | Reserves) -> str:
    """Return what a command prints as HTML."""
    sentences, lines = _said(result)
    paragraphs = "".join(f"<p>{escape(words)}</p>" for words in sentences)
    return "<div>{}<pre>{}</pre></div>".format(paragraphs, escape("\n".join(lines)))


def _said(result: Need | Uncertainty | Reserves) -> tuple[list[str], list[str]]:
    units = result.sweep.units
    if isinstance(result, Need):
        return advice(result, units), screen_lines(result, units)
    return [], uncertainty_lines(result, units) if isinstance(result, Uncertainty) else reserve_lines(result, units)
