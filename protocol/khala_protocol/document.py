"""A YAML text → plain data, and the line of each value; within limits, whatever the text is.

libyaml makes events, this module makes values of them. PyYAML's own composer calls itself for each level and unfolds
aliases without end: 500 bytes of them kept it busy for more than 20 s. Above it is `khala_protocol.configfile`.
"""

from __future__ import annotations

from typing import Any

import yaml

from khala_protocol.errors import ConfigError

Place = tuple[str | int, ...]
"""Keys and indices from the top of the document to a value."""

MAX_DEPTH = 32
MAX_VALUES = 5_000
"""Values of a document, those of aliases included; the largest shipped file has some 300."""
MAX_NUMBER_CHARACTERS = 64
"""Characters of a value that is no text; Python converts long numbers in quadratic time."""
MAX_KEY_CHARACTERS = 200

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the one in Python is 20 times slower
_MERGE = "tag:yaml.org,2002:merge"
_TEXT = "tag:yaml.org,2002:str"
_UNREADABLE = (ValueError, LookupError, AttributeError, TypeError, ArithmeticError)
"""Errors that PyYAML raises on `!!bool 7`, `!!int ""`, `2026-02-31` and their like; found by mutating files."""


class Document:
    """A YAML document as plain data, and the line on which each of its values begins.

    Attributes:
        data: the data; an empty document is an empty mapping, so that a model can say what is missing.
        lines: by place.
        source: its name in errors.

    Raises:
        ConfigError: it is not YAML, or beyond the limits.
    """

    def __init__(self, text: str, source: str) -> None:
        self.source = source
        self.lines: dict[Place, int] = {(): 1}
        self._below: Document | None = None
        self._same: dict[Place, Place] = {}
        self._values = 0
        self.data = self._read(text)

    def lay_over(self, other: Document, but: str) -> None:
        """Take the fields of another document that this one does not have; leave out the field `but`.

        An entry of a list takes the fields that it does not have from the entry of the same `name` there.
        """
        if isinstance(self.data, dict) and isinstance(other.data, dict):
            self._below = other
            own = {key: self._complete(key, value, other.data.get(key)) for key, value in self.data.items()}
            self.data = other.data | {key: value for key, value in own.items() if key != but}

    def origin(self, place: Place) -> tuple[str, int | None]:
        """Return file and line of the value at `place`, or of the nearest one around it."""
        if below := self._known_below(place):
            return below[0].origin(below[1])
        while place not in self.lines and place:
            place = place[:-1]
        return self.source, self.lines.get(place)

    def knows(self, place: Place) -> bool:
        """Return whether there is a value at `place`."""
        return place in self.lines or self._known_below(place) is not None

    def _complete(self, key: str | int, entries: object, others: object) -> object:
        """Return a value; a list with its entries completed from those of the same name in another list."""
        if not isinstance(entries, list) or not isinstance(others, list):
            return entries
        named = {_name_of(other): index for index, other in enumerate(others) if _name_of(other) is not None}
        found = {index: named[name] for index, entry in enumerate(entries) if (name := _name_of(entry)) in named}
        self._same |= {(key, index): (key, other) for index, other in found.items()}
        return [others[found[i]] | entry if i in found else entry for i, entry in enumerate(entries)]

    def _known_below(self, place: Place) -> tuple[Document, Place] | None:
        """Return the document below and the place in it, if the value at `place` comes from there."""
        same = self._same.get(place[:2])
        field = place[: 1 if place[:2] not in self._same else 3]
        there = (*same, *place[2:]) if same else place
        if self._below is None or field in self.lines or not self._below.knows(there[: len(field)]):
            return None
        return self._below, there

    def _read(self, text: str) -> object:
        try:
            loader = _Loader(text)
            try:
                root = _Composer(loader, self.source).compose()
                self._loader = loader
                return {} if root is None else self._value(root, ())
            finally:
                loader.dispose()
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark
            line = None if mark is None else min(mark.line, text.rstrip().count("\n")) + 1  # the end is a line further
            raise ConfigError(f"this is not YAML: {error.problem}", source=self.source, line=line) from None
        except yaml.reader.ReaderError as error:
            fault = f"this is not YAML: the character U+{_code(error.character):04X} is not allowed"
            raise ConfigError(fault, source=self.source, line=_line_at(text, error)) from None
        except (yaml.YAMLError, UnicodeError):
            raise ConfigError("this is not YAML: it has characters that no text has", source=self.source) from None

    def _value(self, node: yaml.Node, place: Place) -> object:
        self.lines.setdefault(place, node.start_mark.line + 1)
        self._count(place)
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, place)
        if isinstance(node, yaml.SequenceNode):
            return [self._value(item, (*place, index)) for index, item in enumerate(node.value)]
        return self._scalar(node)

    def _count(self, place: Place) -> None:
        self._values += 1
        if len(place) > MAX_DEPTH:
            raise ConfigError("nested too deep", source=self.source, line=self.lines[place])
        if self._values > MAX_VALUES:
            fault = f"there are more than {MAX_VALUES} values here, those of aliases included"
            raise ConfigError(fault, source=self.source, line=self.lines[place])

    def _mapping(self, node: yaml.MappingNode, place: Place) -> dict[str | int, object]:
        found: dict[str | int, object] = {}
        for key, (key_node, value_node) in self._fields(node, place).items():
            self.lines[(*place, key)] = key_node.start_mark.line + 1
            found[key] = self._value(value_node, (*place, key))
        return found

    def _fields(
        self, node: yaml.MappingNode, place: Place, depth: int = 0
    ) -> dict[str | int, tuple[yaml.Node, yaml.Node]]:
        """Return the nodes of a mapping by key: those merged into it by `<<`, then its own."""
        if depth > MAX_DEPTH:
            raise ConfigError("nested too deep", source=self.source, line=node.start_mark.line + 1)
        merged: dict[str | int, tuple[yaml.Node, yaml.Node]] = {}
        own: dict[str | int, tuple[yaml.Node, yaml.Node]] = {}
        for key_node, value_node in node.value:
            self._count(place)
            if key_node.tag == _MERGE:
                for other in reversed(self._merge_nodes(value_node)):
                    merged |= self._fields(other, place, depth + 1)
                continue
            key = self._key(key_node)
            if key in own:
                self._refuse_double((*place, key), own[key][0], key_node)
            own[key] = key_node, value_node
        return merged | own

    def _merge_nodes(self, node: yaml.Node) -> list[yaml.MappingNode]:
        nodes = node.value if isinstance(node, yaml.SequenceNode) else [node]
        if not all(isinstance(other, yaml.MappingNode) for other in nodes):
            raise ConfigError("only fields can be merged by <<", source=self.source, line=node.start_mark.line + 1)
        return list(nodes)

    def _refuse_double(self, place: Place, first: yaml.Node, second: yaml.Node) -> None:
        raise ConfigError(
            f"is given a second time, the first is on line {first.start_mark.line + 1}",
            source=self.source,
            line=second.start_mark.line + 1,
            field=place_text(place),
        )

    def _key(self, node: yaml.Node) -> str | int:
        line = node.start_mark.line + 1
        if not isinstance(node, yaml.ScalarNode):
            raise ConfigError("write the name of a field here, not a list or fields", source=self.source, line=line)
        if len(node.value) > MAX_KEY_CHARACTERS:
            fault = f"the name of a field has at most {MAX_KEY_CHARACTERS} characters, this has {len(node.value)}"
            raise ConfigError(fault, source=self.source, line=line)
        key = self._scalar(node)
        # `yes`, `1.5` and dates are written as names here, but YAML 1.1 reads them as something else
        return key if isinstance(key, str | int) and not isinstance(key, bool) else str(node.value)

    def _scalar(self, node: yaml.Node) -> object:
        kind = node.tag.rpartition(":")[2]
        line = node.start_mark.line + 1
        if node.tag != _TEXT and len(node.value) > MAX_NUMBER_CHARACTERS:
            raise ConfigError(f"{shown(node.value)} is too long for {kind}", source=self.source, line=line)
        try:
            value: object = self._loader.construct_object(node, deep=True)
        except _UNREADABLE:
            fault = f"{shown(node.value)} is no {kind}; put it in quotes if it is a text"
            raise ConfigError(fault, source=self.source, line=line) from None
        return value


class _Composer:
    """Events → nodes, no deeper and no more than allowed."""

    def __init__(self, loader: Any, source: str) -> None:
        self._loader = loader
        self._source = source
        self._anchors: dict[str, yaml.Node] = {}
        self._nodes = 0

    def compose(self) -> yaml.Node | None:
        """Return the root of the only document of a text; None if it is empty."""
        self._loader.get_event()  # the stream starts
        if self._loader.check_event(yaml.StreamEndEvent):
            return None
        self._loader.get_event()  # the document starts
        root = self._node(self._loader.get_event(), 0)
        self._loader.get_event()  # the document ends
        if not self._loader.check_event(yaml.StreamEndEvent):
            line = self._loader.get_event().start_mark.line + 1
            raise ConfigError("this is not YAML: a second document begins here", source=self._source, line=line)
        return root

    def _node(self, event: Any, depth: int) -> yaml.Node:
        self._nodes += 1
        if fault := self._fault(event, depth):
            raise ConfigError(fault, source=self._source, line=event.start_mark.line + 1)
        if isinstance(event, yaml.AliasEvent):
            return self._anchors[str(event.anchor)]
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event)
        return self._collection(event, depth)

    def _fault(self, event: Any, depth: int) -> str:
        if isinstance(event, yaml.AliasEvent) and event.anchor not in self._anchors:
            return f"this is not YAML: found undefined alias {event.anchor!r}"
        if self._nodes > 2 * MAX_VALUES:  # names of fields are nodes as well
            return f"there are more than {MAX_VALUES} values here"
        return "nested too deep" if depth > MAX_DEPTH else ""

    def _scalar(self, event: Any) -> yaml.Node:
        tag = event.tag
        if tag is None or tag == "!":
            tag = self._loader.resolve(yaml.ScalarNode, event.value, event.implicit)
        node = yaml.ScalarNode(tag, event.value, event.start_mark, event.end_mark, event.style)
        return self._anchor(event, node)

    def _collection(self, event: Any, depth: int) -> yaml.Node:
        kind = yaml.SequenceNode if isinstance(event, yaml.SequenceStartEvent) else yaml.MappingNode
        parts: list[yaml.Node] = []
        node = self._anchor(event, kind(event.tag, [], event.start_mark, None))
        while not isinstance(part := self._loader.get_event(), yaml.CollectionEndEvent):
            parts.append(self._node(part, depth + 1))
        node.value = parts if kind is yaml.SequenceNode else list(zip(parts[::2], parts[1::2], strict=True))
        return node

    def _anchor(self, event: Any, node: yaml.Node) -> yaml.Node:
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node


def _name_of(entry: object) -> str | None:
    """Return the name of an entry of a list, if it has one."""
    name = entry.get("name") if isinstance(entry, dict) else None
    return name if isinstance(name, str) else None


def shown(value: object) -> str:
    """Return a value as an error quotes it."""
    text = "nothing" if value is None else repr(value[:60] if isinstance(value, str) else value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def place_text(place: Place) -> str:
    """Return a place as an error names it."""
    return ".".join(str(part) for part in place)


def _code(character: object) -> int:
    return character if isinstance(character, int) else ord(str(character)[0])


def _line_at(text: str, error: yaml.reader.ReaderError) -> int:
    found = text.find(chr(_code(error.character)))
    return text.count("\n", 0, max(found, 0)) + 1
