"""The one way from a result to its pictures.

Views stand above everything that they draw, so a result cannot import them. They are loaded here when a picture is
asked for, which also keeps matplotlib, an extra that takes long to import, out of everything else.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def draw(view: str, function: str, *args: Any, **options: Any) -> Any:
    """Call a function of a module of `boulder_sweep.views`.

    Raise `PictureError` where the picture cannot be drawn, or matplotlib is not installed.
    """
    return getattr(import_module(f"boulder_sweep.views.{view}"), function)(*args, **options)
