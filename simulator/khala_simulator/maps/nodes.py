"""A scenario's text → nodes of YAML that are safe to walk, with errors that name file, line and field.

A map may come from a client, so its text is checked before anything trusts it. Four things would stop the process:

* deep nesting: libyaml's composer calls itself for each level, and 50 000 brackets overflow the stack of the process;
* aliases of aliases: 500 bytes of them unfold to millions of values;
* names of fields that are lists or mappings, which no dictionary takes;
* scalars that PyYAML cannot convert, such as ``!!int ""`` or ``2026-02-31``: it raises whatever comes to its mind.

Above: ``scenario_file``.
"""

from __future__ import annotations

import io
from typing import Any, Final

import yaml

from khala_simulator.tables.loader import LOADER

DEEPEST: Final = 32
"""Levels of a file; the shipped ones have 10."""
MOST_VALUES: Final = 10_000
"""Values of a file, those of aliases included; the largest shipped one has 511."""
LONGEST_SCALAR: Final = 2_000
"""Characters of a text or a number; Python converts long numbers in quadratic time."""
_SHOWN: Final = 60
_MERGE: Final = "tag:yaml.org,2002:merge"
_UNREADABLE: Final = (ValueError, LookupError, AttributeError, TypeError, ArithmeticError)
"""Errors that PyYAML raises for scalars that it cannot convert."""


class ScenarioError(ValueError):
    """A scenario file can't be used; the text names the file, the line and the field."""


def compose(text: str, source: str) -> yaml.MappingNode:
    """Return the nodes of a text; ``source`` names it in their marks.

    Raises:
        ScenarioError: it is no YAML, no mapping, or beyond the limits.
    """
    try:
        _check_depth(text, source)
        node = yaml.compose(_Source(text, source), Loader=LOADER)
    except yaml.MarkedYAMLError as error:
        raise not_yaml(error, source) from error
    except (yaml.YAMLError, UnicodeError) as error:  # characters that no YAML text has
        line = text.count("\n", 0, getattr(error, "position", 0)) + 1
        raise ScenarioError(f"{source}:{line}: the file: it has characters that no text has") from error
    if not isinstance(node, yaml.MappingNode):
        raise ScenarioError(f"{source}:1: the file: a scenario is a mapping of fields")
    _check_values(node)
    return node


def text_of(data: bytes, source: str) -> str:
    """Return the text in the bytes of a file.

    Raises:
        ScenarioError: it is no UTF-8.
    """
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ScenarioError(f"{source}:{line}: the file: it is no UTF-8 text") from error


def not_yaml(error: yaml.MarkedYAMLError, source: str) -> ScenarioError:
    """Return the error for a text that YAML refuses."""
    line = error.problem_mark.line + 1 if error.problem_mark else 1
    return ScenarioError(f"{source}:{line}: not YAML: {error.problem}")


def wrong(node: yaml.Node, text: str) -> ScenarioError:
    """Return an error that names the place of a node."""
    return ScenarioError(f"{node.start_mark.name}:{node.start_mark.line + 1}: {text}")


def shown(text: object) -> str:
    """Return a value from a file for a message: its beginning, without control characters."""
    plain = "".join(letter if letter.isprintable() else "?" for letter in str(text)[: _SHOWN + 1])
    return plain if len(plain) <= _SHOWN else f"{plain[:_SHOWN]}…"


class _Source(io.StringIO):
    """A text with the name that YAML puts into its marks."""

    def __init__(self, text: str, name: str) -> None:
        super().__init__(text)
        self.name = name


def _check_depth(text: str, source: str) -> None:
    """Refuse what the composer would not survive; events come without recursion."""
    depth = 0
    for count, event in enumerate(yaml.parse(_Source(text, source), Loader=LOADER)):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        line = 1 if event.start_mark is None else event.start_mark.line + 1
        if depth > DEEPEST:
            raise ScenarioError(f"{source}:{line}: the file: nested too deep")
        if count > 2 * MOST_VALUES:  # names of fields are events as well
            raise ScenarioError(f"{source}:{line}: the file: there are more than {MOST_VALUES} values")


def _check_values(root: yaml.MappingNode) -> None:
    """Refuse nodes beyond the limits; an alias is walked wherever it stands, so the limits hold for it too."""
    left: list[tuple[yaml.Node, str, int]] = [(root, "", 0)]
    seen = 0
    while left:
        node, field, depth = left.pop()
        seen += 1
        if depth > DEEPEST:
            raise wrong(node, f"{shown(field)}: nested too deep")
        if seen > MOST_VALUES:
            raise wrong(node, f"{shown(field)}: there are more than {MOST_VALUES} values, those of aliases included")
        if isinstance(node, yaml.MappingNode):
            left += [(value, f"{field}.{name}".lstrip("."), depth + 1) for name, value in _fields(node, field)]
        elif isinstance(node, yaml.SequenceNode):
            left += [(value, f"{field}[{index}]", depth + 1) for index, value in enumerate(node.value)]
        else:
            _check_scalar(node, field)


def _fields(node: yaml.MappingNode, field: str) -> list[tuple[str, yaml.Node]]:
    """Return the fields of a mapping by name, each of which has one."""
    found: dict[str, yaml.Node] = {}
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise wrong(key, f"{shown(field) or 'the file'}: write the name of a field here, not a list or fields")
        if key.tag != _MERGE:
            _check_scalar(key, field)
        if key.value in found:
            raise wrong(key, f"{shown(f'{field}.{key.value}'.lstrip('.'))}: is given a second time")
        found[key.value] = value
    return list(found.items())


def _check_scalar(node: yaml.Node, field: str) -> None:
    place = shown(field) or "the file"
    if len(node.value) > LONGEST_SCALAR:
        raise wrong(node, f"{place}: {shown(node.value)} is longer than {LONGEST_SCALAR} characters")
    constructor: Any = yaml.constructor.SafeConstructor()
    try:
        constructor.construct_document(node)
    except (yaml.YAMLError, *_UNREADABLE) as error:
        kind = node.tag.rpartition(":")[2]
        raise wrong(node, f"{place}: {shown(node.value)} is no {kind}; put it in quotes if it is a text") from error
