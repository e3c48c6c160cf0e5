"""What is wrong with a text that is no YAML, for people who do not write YAML every day."""

from __future__ import annotations

from typing import Any

from ruamel.yaml.error import YAMLError

from boulder_sweep.settings.problems import shorten

_PLAIN_WORDS = (
    ("expected ',' or ']'", "a list is not closed: ',' or ']' is missing"),
    ("expected ',' or '}'", "a {...} block is not closed, or a ',' is missing in it"),
    (r"found character '\t'", "indent with spaces, not with tabs"),
    (
        "expected '<document start>'",
        "text stands where a key should begin; check quotation marks and indentation",
    ),
    ("cannot start any token", "this character cannot stand here; put the text into quotation marks"),
    (
        "mapping values are not allowed here",
        "a ':' where none can stand; check the indentation and the quotation marks",
    ),
    ("could not find expected ':'", "a key without ':' behind it"),
    ("found unexpected end of stream", "quotation marks are not closed"),
    ("expected <block end>", "the indentation does not fit the lines above"),
)


def explain(error: Any) -> str:
    """Return a YAML syntax error in words for people who do not write YAML every day."""
    problem = " ".join(str(getattr(error, "problem", None) or error).split())
    for technical, plain in _PLAIN_WORDS:
        if technical in problem:
            return f"not valid YAML: {plain}"
    if type(error) is YAMLError:  # one of our own
        return problem
    if "special characters are not allowed" in str(error):
        return "contains control characters; a plain text file in UTF-8 is needed"
    return f"not valid YAML: {shorten(problem, 120)}"
