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


def html_of(result: Need | Uncertainty | Reserves) -> str:
    """Return what a command prints as HTML: the sentences of a recommendation, and a table of a screen."""
    units, sentences = result.sweep.units, ""
    if isinstance(result, Need):
        sentences = "".join(f"<p>{escape(words)}</p>" for words in advice(result, units))
        lines = screen_lines(result, units)
    else:
        lines = uncertainty_lines(result, units) if isinstance(result, Uncertainty) else reserve_lines(result, units)
    return "<div>{}<pre>{}</pre></div>".format(sentences, escape("\n".join(lines)))
