"""Parse YAML 1.2 text into a tree with positions: plain data only, bounded in depth and size.

ruamel.yaml does the parsing; its events are assembled here without recursion. So tags never construct anything,
aliases cannot multiply without bound, and no nesting exhausts the stack.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.scanner import Scanner
from ruamel.yaml.tokens import FlowMappingEndToken, FlowSequenceEndToken

from boulder_sweep.settings.problems import Position, ProblemList, shorten
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence

MAX_DEPTH = 20
"""Deepest nesting of lists and blocks; the format itself needs four levels."""
MAX_NODES = 100_000
"""Most values in a file once its aliases are expanded."""

MAX_UNIT = 100
"""Longest unit behind a bracket, in characters."""

_PLAIN_WORDS = (
    ("expected ',' or ']'", "a list is not closed: ',' or ']' is missing"),
    ("expected ',' or '}'", "a {...} block is not closed, or a ',' is missing in it"),
    (r"found character '\t'", "indent with spaces, not with tabs"),
    (
        "expected '<document start>'",
        "a key is needed here; check quotation marks and indentation",
    ),
    ("cannot start any token", "unexpected character; put the text in quotation marks"),
    (
        "mapping values are not allowed here",
        "unexpected ':'; check the indentation and the quotation marks",
    ),
    ("could not find expected ':'", "a key without ':' after it"),
    ("found unexpected end of stream", "quotation marks are not closed"),
    ("expected <block end>", "the indentation does not match the lines above"),
)
"""Messages of the parser, and plain words for them."""


class _TooDeepError(YAMLError):
    def __init__(self, mark: Any) -> None:
        super().__init__()
        self.problem_mark = mark
        self.problem = f"lists and blocks are nested more than {MAX_DEPTH} deep"


class _UnitScanner(Scanner):
    """Scanner that also takes a unit behind a closing bracket: ``[36, 40, 43.2] deg``.

    Plain YAML has no place for such a word. It is read up to the next comma, bracket, comment or end of the
    line and kept in `units` under the position of the bracket.
    """

    def __init__(self, loader: Any = None) -> None:
        self.units: dict[tuple[int, int], tuple[str, int]] = {}
        super().__init__(loader)

    def fetch_flow_collection_start(self, TokenClass: Any, to_push: str) -> None:
        """Refuse deep nesting as soon as it is seen, before the parser looks at it."""
        if self.flow_level >= MAX_DEPTH:
            raise _TooDeepError(self.reader.get_mark())
        super().fetch_flow_collection_start(TokenClass, to_push)

    def fetch_flow_collection_end(self, TokenClass: Any) -> None:
        """Take the unit that may stand behind the bracket."""
        super().fetch_flow_collection_end(TokenClass)
        if TokenClass not in (FlowSequenceEndToken, FlowMappingEndToken):
            return
        reader = self.reader
        skip = 0
        while reader.peek(skip) == " ":
            skip += 1
        first = reader.peek(skip)
        if not (first.isalpha() or first in "%°"):
            return
        length = skip
        while length < skip + MAX_UNIT and reader.peek(length) not in ",[]{}\r\n\x00":
            if reader.peek(length) == " " and reader.peek(length + 1) == "#":
                break
            length += 1
        bracket = self.tokens[-1].start_mark
        self.units[bracket.line, bracket.column] = (reader.prefix(length).strip(), reader.column + skip)
        reader.forward(length)


@dataclass(slots=True)
class _Open:
    """A list or block whose end has not come yet."""

    node: Sequence | Mapping
    anchor: str | None
    size: int = 1
    key: Scalar | None = None
    skip_value: bool = False


def parse(text: str, label: str, problems: ProblemList) -> Mapping | None:
    """Return the tree of a YAML text whose top level is a block of keys.

    Parameters
    ----------
    text : str
        The whole file.
    label : str
        Name of the file in messages.
    problems : ProblemList
        Receives duplicate keys, tags and other mistakes after which reading can go on.

    Returns
    -------
    Mapping or None
        None where the file holds something other than keys; a problem says so.

    Raises
    ------
    SettingsError
        The text is not YAML, nested too deep or too large: reading cannot go on.
    """
    root = parse_node(text, label, problems)
    if isinstance(root, Mapping):
        return root
    if root is None:
        problems.add(Position(label), "", "is empty; it needs at least the blocks boulder, site, soil and vehicle")
    else:
        problems.add(root.position, "", "a settings file consists of blocks such as 'boulder: {length: 1.65 m}'")
    return None


def parse_node(text: str, label: str, problems: ProblemList) -> Node | None:
    """Return the tree of any YAML text, None if it is empty; otherwise as `parse`."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Scanner = _UnitScanner
    builder = _Builder(label, problems)
    try:
        for event in _events(yaml, text):
            builder.take(event, yaml.scanner.units)
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        at = Position(label) if mark is None else Position(label, mark.line + 1, mark.column + 1)
        reason = str(error.problem) if isinstance(error, _TooDeepError) else _explained(error)
        problems.add(at, "", reason)
        problems.raise_if_any()
    return builder.root


def _events(yaml: YAML, text: str) -> Iterator[Any]:
    """Yield the events of the parser; any failure is a YAMLError."""
    try:
        yield from yaml.parse(text)
    except YAMLError:
        raise
    except Exception as error:
        # On some malformed input (bad escapes, directives, a text that ends within a token) ruamel.yaml
        # lets a bare IndexError, ValueError or AttributeError through.
        raise YAMLError(f"the text cannot be read as YAML ({type(error).__name__})") from None


class _Builder:
    """Assembles events into a tree, with a stack of its own in place of recursion."""

    def __init__(self, label: str, problems: ProblemList) -> None:
        self.label = label
        self.problems = problems
        self.stack: list[_Open] = []
        self.anchors: dict[str, tuple[Node, int] | None] = {}
        self.root: Node | None = None
        self.documents = 0

    def take(self, event: Any, units: dict[tuple[int, int], tuple[str, int]]) -> None:
        """Take the next event; `units` are those behind brackets, by the position of the bracket."""
        if isinstance(event, DocumentStartEvent):
            self.documents += 1
            if self.documents == 2:
                self.problems.add(self.position(event), "", "a second document begins here; a file may hold only one")
        elif self.documents > 1:
            return
        elif isinstance(event, ScalarEvent):
            self.check_tag(event)
            self.close(Scalar(self.position(event), event.value, event.style in ("'", '"')), 1, event.anchor)
        elif isinstance(event, AliasEvent):
            self.alias(event)
        elif isinstance(event, SequenceStartEvent | MappingStartEvent):
            self.open(event)
        elif isinstance(event, SequenceEndEvent | MappingEndEvent):
            opened = self.stack.pop()
            mark = event.start_mark
            if event.end_mark.index > mark.index and (mark.line, mark.column) in units:
                text, column = units[mark.line, mark.column]
                opened.node.unit = Scalar(Position(self.label, mark.line + 1, column + 1), text)
            self.close(opened.node, opened.size, opened.anchor)

    def open(self, event: Any) -> None:
        """Begin a list or a block."""
        self.check_tag(event)
        if len(self.stack) >= MAX_DEPTH:
            raise _TooDeepError(event.start_mark)
        kind = Sequence if isinstance(event, SequenceStartEvent) else Mapping
        if event.anchor is not None:
            self.anchors[event.anchor] = None  # while it is open: an alias from inside would have no end
        self.stack.append(_Open(kind(self.position(event)), event.anchor))

    def position(self, event: Any) -> Position:
        return Position(self.label, event.start_mark.line + 1, event.start_mark.column + 1)

    def check_tag(self, event: Any) -> None:
        if event.tag is not None:
            tag = shorten(str(event.tag).replace("tag:yaml.org,2002:", "!!"))
            self.problems.add(
                self.position(event),
                "",
                f"the tag {tag} is not accepted: only plain text, numbers and lists are read",
            )

    def alias(self, event: Any) -> None:
        """Insert the node that an alias stands for."""
        name = shorten(str(event.anchor))
        if event.anchor not in self.anchors:
            self.problems.add(self.position(event), "", f"*{name} is not defined: there is no &{name} before it")
            node, size = None, 1
        else:
            node, size = self.anchors[event.anchor] or (None, 1)
            if node is None:
                self.problems.add(self.position(event), "", f"*{name} refers to itself")
        self.close(Scalar(self.position(event), "") if node is None else node, size, None)

    def close(self, node: Node, size: int, anchor: str | None) -> None:
        """Put a finished node into its list or block."""
        if anchor is not None:
            self.anchors[anchor] = (node, size)
        if not self.stack:
            self.root = node
            return
        parent = self.stack[-1]
        parent.size += size
        if parent.size > MAX_NODES:
            raise YAMLError(f"the file holds more than {MAX_NODES} values once its aliases are expanded")
        if isinstance(parent.node, Sequence):
            parent.node.items.append(node)
        elif parent.key is None:
            self.take_key(parent, node)
        else:
            self.take_value(parent, parent.node, node)

    def take_key(self, parent: _Open, node: Node) -> None:
        if isinstance(node, Scalar):
            parent.key = node
            return
        self.problems.add(node.position, "", "a key must be one word")
        parent.key, parent.skip_value = Scalar(node.position, ""), True

    def take_value(self, parent: _Open, mapping: Mapping, node: Node) -> None:
        assert parent.key is not None
        key, parent.key = parent.key, None
        if parent.skip_value:
            parent.skip_value = False
            return
        first = mapping.entries.get(key.text)
        if first is None:
            if isinstance(node, Scalar) and not node.text and not node.quoted:
                node = Scalar(key.position, "")  # YAML places an empty value where the next token begins
            mapping.entries[key.text] = Entry(key.text, key.position, node)
        else:
            words = [*(opened.key.text for opened in self.stack if opened.key), key.text]
            path = ".".join(shorten(word) for word in words)
            self.problems.add(key.position, path, f"is given twice (first on line {first.position.line})")


def _explained(error: Any) -> str:
    """Return a YAML syntax error in plain words."""
    problem = " ".join(str(getattr(error, "problem", None) or error).split())
    for technical, plain in _PLAIN_WORDS:
        if technical in problem:
            return f"not valid YAML: {plain}"
    if type(error) is YAMLError:  # one of our own
        return problem
    if "special characters are not allowed" in str(error):
        return "contains control characters; a plain text file in UTF-8 is needed"
    return f"not valid YAML: {shorten(problem, 120)}"
