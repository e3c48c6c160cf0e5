"""What a notebook shows of an answer."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from boulder_sweep.answers.advice import advice
from boulder_sweep.answers.printing import screen_lines

if TYPE_CHECKING:
    from boulder_sweep.answers.need import Need


def need_html(need: Need) -> str:
    """Return the recommendation and the table of a screen as HTML."""
    sentences = "".join(f"<p>{escape(words)}</p>" for words in advice(need, need.sweep.units))
    table = "\n".join(screen_lines(need, need.sweep.units))
    return f"<div>{sentences}<pre>{escape(table)}</pre></div>"
