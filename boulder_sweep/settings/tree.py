"""The file as a tree of plain text with positions, before it is interpreted.

ruamel.yaml parses the text (YAML 1.2); its events are put together here. Every scalar keeps its text, so YAML's
guesses (``no`` is false, ``1:30`` is 90, ``010`` is 8) never happen. Tags construct nothing, and the depth and the
number of values are bounded: neither nesting nor aliases can exhaust stack or memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.scanner import Scanner

from boulder_sweep.settings.problems import Position, Problems, SettingsError, shorten

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
    ("expected '<document start>'", "a key is needed here; check quotation marks and indentation"),
    ("expected chomping or indentation indicators", "'>' begins a text of several lines; put it in quotation marks"),
    ("expected a comment or a line break", "'>' begins a text of several lines; put it in quotation marks"),
    ("cannot start any token", "unexpected character; put the text in quotation marks"),
    ("mapping values are not allowed here", "unexpected ':'; check the indentation and the quotation marks"),
    ("could not find expected ':'", "a key without ':' after it"),
    ("found unexpected end of stream", "quotation marks are not closed"),
    ("expected <block end>", "the indentation does not match the lines above"),
)
"""Messages of the parser, and plain words for them."""
_TOO_DEEP = f"lists and blocks are nested more than {MAX_DEPTH} deep"


@dataclass(slots=True)
class Scalar:
    """One piece of text."""

    position: Position
    text: str
    quoted: bool = False  # whether it stood in quotation marks
    needs_unit: bool = False  # whether a number with a dimension must have its unit here


@dataclass(slots=True)
class Sequence:
    """A list; `unit` is the unit written behind its bracket, as in ``[36, 40] deg``."""

    position: Position
    items: list[Node] = field(default_factory=list)
    unit: Scalar | None = None


@dataclass(slots=True)
class Entry:
    """One key of a mapping with its value."""

    key: str
    position: Position
    value: Node


@dataclass(slots=True)
class Mapping:
    """Keys and values in the order of the file; `unit` as for lists."""

    position: Position
    entries: dict[str, Entry] = field(default_factory=dict)
    unit: Scalar | None = None

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries.values())

    def get(self, key: str) -> Node | None:
        """Return the value of a key, None where it is missing."""
        entry = self.entries.get(key)
        return None if entry is None else entry.value

    def blocks(self, section: str) -> Iterator[Mapping]:
        """Yield the block of a section, or each of its named sets."""
        node = self.get(section)
        for one in node.items if isinstance(node, Sequence) else [node]:
            if isinstance(one, Mapping):
                yield one

    @property
    def label(self) -> dict[str, str]:
        """The name of a named set, as plain data; empty for any other block."""
        name = self.get("name")
        return {"name": name.text.strip()} if isinstance(name, Scalar) else {}

    def replace(self, key: str, new: list[Entry]) -> None:
        """Put entries in the place of one."""
        entries: dict[str, Entry] = {}
        for entry in self:
            entries |= {one.key: one for one in new} if entry.key == key else {entry.key: entry}
        self.entries = entries


Node = Scalar | Sequence | Mapping


def block_of(position: Position, texts: dict[str, str]) -> Mapping:
    """Return a block of plain texts by key, all of them at one position."""
    return Mapping(position, {key: Entry(key, position, Scalar(position, text)) for key, text in texts.items()})


def parse(text: str, label: str, problems: Problems) -> Mapping:
    """Return the tree of a YAML text whose top level is a block of keys; `label` names the file in messages.

    Mistakes after which reading can go on, such as duplicate keys and tags, go to `problems`. SettingsError is raised
    where it cannot: the text is not YAML or something other than keys, nested too deep or too large.
    """
    root = parse_node(text, label, problems)
    if isinstance(root, Mapping):
        return root
    if root is None:
        problems.add(Position(label), "is empty; it needs at least the blocks boulder, site, soil and vehicle")
    else:
        problems.add(root.position, "a settings file consists of blocks such as 'boulder: {length: 1.65 m}'")
    raise SettingsError(problems)


def parse_node(text: str, label: str, problems: Problems) -> Node | None:
    """Return the tree of any YAML text, None if it is empty; otherwise as `parse`."""
    try:
        return _TreeReader(text, label, problems).read_document()
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        position = Position(label) if mark is None else Position(label, mark.line + 1, mark.column + 1)
        problems.add(position, _explained(error))
        raise SettingsError(problems) from None


def _events(yaml: YAML, text: str) -> Iterator[Any]:
    """Yield the events of the parser; any failure is a YAMLError."""
    try:
        yield from yaml.parse(text)
    except YAMLError:
        raise
    except Exception:  # of bad escapes and directives, ruamel.yaml lets a bare IndexError or ValueError through
        raise _OwnError(problem="the text cannot be read as YAML") from None


class _TreeReader:
    """Puts the events of one text together. It recurses, no deeper than `MAX_DEPTH`."""

    def __init__(self, text: str, label: str, problems: Problems) -> None:
        self.label = label
        self.problems = problems
        self.anchors: dict[str, tuple[Node, int] | None] = {}  # None: not read to its end yet
        self.depth = 0
        self.yaml = YAML(typ="safe", pure=True)
        self.yaml.Scanner = _UnitScanner
        self.events = _events(self.yaml, text)

    def read_document(self) -> Node | None:
        """Return the first document; what follows is read for its mistakes only."""
        root: Node | None = None
        documents = 0
        for event in self.events:
            if isinstance(event, DocumentStartEvent):
                documents += 1
                if documents == 1:
                    root, _ = self.read_node(next(self.events), ())
                elif documents == 2:
                    self.report(event, "a second document begins here; a file may hold only one")
        return root

    def read_node(self, event: Any, path: tuple[str, ...]) -> tuple[Node, int]:
        """Return the node that begins with `event`, and its number of values; `path` holds the keys above it."""
        if isinstance(event, AliasEvent):
            return self.read_alias(event)
        if event.tag is not None:
            tag = shorten(str(event.tag).replace("tag:yaml.org,2002:", "!!"))
            self.report(event, f"the tag {tag} is not accepted: only plain text, numbers and lists are read")
        node: Node
        if isinstance(event, ScalarEvent):
            node, size = Scalar(self.position(event), event.value, event.style in ("'", '"')), 1
        else:
            if self.depth >= MAX_DEPTH:
                raise _OwnError(problem=_TOO_DEEP, problem_mark=event.start_mark)
            if event.anchor is not None:
                self.anchors[event.anchor] = None
            self.depth += 1
            read = self.read_sequence if isinstance(event, SequenceStartEvent) else self.read_mapping
            node, size = read(self.position(event), path)
            self.depth -= 1
        if event.anchor is not None:
            self.anchors[event.anchor] = node, size
        return node, size

    def read_alias(self, event: Any) -> tuple[Node, int]:
        """Return the node that an alias stands for."""
        name = shorten(str(event.anchor))
        meant = self.anchors.get(event.anchor)
        if meant is not None:
            return meant
        if event.anchor in self.anchors:
            self.report(event, f"*{name} refers to itself")
        else:
            self.report(event, f"*{name} is not defined: there is no &{name} before it")
        return Scalar(self.position(event), ""), 1

    def read_sequence(self, position: Position, path: tuple[str, ...]) -> tuple[Node, int]:
        """Return a list of nodes, and their number."""
        sequence, size = Sequence(position), 1
        while not isinstance(event := next(self.events), SequenceEndEvent):
            item, values = self.read_node(event, path)
            size = _bounded(size + values)
            sequence.items.append(item)
        sequence.unit = self.unit_behind(event)
        return sequence, size

    def read_mapping(self, position: Position, path: tuple[str, ...]) -> tuple[Node, int]:
        """Return a block of keys; a key that is given twice keeps its first value."""
        mapping, size = Mapping(position), 1
        while not isinstance(event := next(self.events), MappingEndEvent):
            key, values = self.read_node(event, path)
            size = _bounded(size + values)
            word = key.text if isinstance(key, Scalar) else None
            if word is None:
                self.problems.add(key.position, "a key must be one word")
            value, values = self.read_node(next(self.events), (*path, word or ""))
            size = _bounded(size + values)
            if word is None or _joined(mapping, key, value):
                continue
            first = mapping.entries.get(word)
            if first is not None:
                name = ".".join(shorten(part) for part in (*path, word))
                self.problems.add(key.position, f"is given twice (first on line {first.position.line})", name)
                continue
            if isinstance(value, Scalar) and not value.text and not value.quoted:
                value = Scalar(key.position, "")  # YAML places an empty value where the next token begins
            mapping.entries[word] = Entry(word, key.position, value)
        mapping.unit = self.unit_behind(event)
        return mapping, size

    def unit_behind(self, end: Any) -> Scalar | None:
        """Return the unit behind the bracket that closes a list or a block, None where there is none."""
        mark = end.start_mark
        unit = self.yaml.scanner.units.get((mark.line, mark.column))
        if unit is None or end.end_mark.index == mark.index:  # closed by indentation
            return None
        text, column = unit
        return Scalar(Position(self.label, mark.line + 1, column + 1), text)

    def position(self, event: Any) -> Position:
        return Position(self.label, event.start_mark.line + 1, event.start_mark.column + 1)

    def report(self, event: Any, message: str) -> None:
        self.problems.add(self.position(event), message)


def _joined(mapping: Mapping, key: Node, value: Node) -> bool:
    """Put a number that a comma has cut in two together again, ``{mass: 15,000 lb}``; its reader says what is wrong."""
    last = next(reversed(mapping.entries.values()), None)
    if last is None or not isinstance(key, Scalar) or not isinstance(last.value, Scalar):
        return False
    is_alone = isinstance(value, Scalar) and not value.text and not value.quoted
    is_behind = key.text[:1].isdigit() and last.value.text[-1:].isdigit() and key.position.line == last.position.line
    if is_alone and is_behind and not last.value.quoted:
        last.value = Scalar(last.value.position, f"{last.value.text},{key.text}")
        return True
    return False


def _bounded(size: int) -> int:
    """Return a number of values, if a file may hold so many."""
    if size > MAX_NODES:
        raise _OwnError(problem=f"the file holds more than {MAX_NODES} values once its aliases are expanded")
    return size


class _OwnError(MarkedYAMLError):
    """A refusal in plain words already."""


class _UnitScanner(Scanner):
    """Scanner that also takes a unit behind a closing bracket, for which plain YAML has no place: ``[36, 40] deg``.

    It is read up to the next comma, bracket, comment or end of the line and kept under the position of the bracket.
    """

    def __init__(self, loader: Any = None) -> None:
        self.units: dict[tuple[int, int], tuple[str, int]] = {}
        super().__init__(loader)

    def fetch_flow_collection_start(self, TokenClass: Any, to_push: str) -> None:
        """Refuse deep nesting as soon as it is seen, before the parser looks at it."""
        if self.flow_level >= MAX_DEPTH:
            raise _OwnError(problem=_TOO_DEEP, problem_mark=self.reader.get_mark())
        super().fetch_flow_collection_start(TokenClass, to_push)

    def fetch_flow_collection_end(self, TokenClass: Any) -> None:
        """Take the unit that may stand behind the bracket."""
        super().fetch_flow_collection_end(TokenClass)
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


def _explained(error: Any) -> str:
    """Return a YAML syntax error in plain words."""
    if isinstance(error, _OwnError):
        return str(error.problem)
    problem = " ".join(str(getattr(error, "problem", None) or error).split())
    for technical, plain in _PLAIN_WORDS:
        if technical in problem:
            return f"not valid YAML: {plain}"
    if "special characters are not allowed" in str(error):
        return "contains control characters; a plain text file in UTF-8 is needed"
    return f"not valid YAML: {shorten(problem, 120)}"
