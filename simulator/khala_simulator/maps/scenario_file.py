"""Scenario files: YAML text to ``Scenario``, with errors that name file, line and field.

A file may extend another one and may hold variants of itself:

* ``extends: bases/smac`` takes a shipped file as the beginning;
* ``variants: {3m: {...}, 8m: {...}}`` makes one map of each entry, which holds only its differences.

Later values override earlier ones: mappings are merged key by key; ``units``, ``triggers`` and ``estimates`` are
joined, where a trigger replaces one of the same name; all else is replaced. This happens on the nodes of YAML, which
keep their lines, so that an error points at the written line.

Above: ``maps``. Below: ``scenario``, ``nodes``.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Any

import yaml
from pydantic import ValidationError

from khala_simulator.maps.nodes import ScenarioError, compose, not_yaml, shown, text_of, wrong
from khala_simulator.maps.places import UnknownNameError
from khala_simulator.maps.scenario import Scenario, names_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

JOINED = ("units", "triggers", "estimates")
EXTENDS, VARIANTS = "extends", "variants"
TEXT = "tag:yaml.org,2002:str"
DEEPEST = 4  # files that extend each other
_PLAIN = re.compile(r"[A-Za-z0-9_]{1,64}(/[A-Za-z0-9_]{1,64})?")  # names of shipped files


@dataclass(frozen=True)
class Sheet:
    """One scenario's text, as nodes: the file, its base and its variant together."""

    node: yaml.MappingNode
    source: str

    def scenario(self) -> Scenario:
        """Return the scenario.

        Raises:
            ScenarioError: the text breaks the language.
        """
        raw = self.data()
        try:
            return Scenario.model_validate(raw, context=names_of(raw))
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            mark, field = _locate(self.node, first["loc"], missing=first["type"] == "missing")
            fault = first.get("ctx", {}).get("error")
            hint = fault.hint() if isinstance(fault, UnknownNameError) else ""
            message = first["msg"].removeprefix("Value error, ") + hint
            raise ScenarioError(f"{mark.name}:{mark.line + 1}: {shown(field) or 'the file'}: {message}") from error

    @property
    def title(self) -> str:
        """What the map is called, without looking at the rest."""
        return _scalar(self.node, "title")

    def data(self) -> Any:
        """Return the plain data."""
        try:
            return yaml.constructor.SafeConstructor().construct_document(self.node)
        except yaml.MarkedYAMLError as error:  # such as a list that says it is a text
            raise not_yaml(error, self.source) from error

    def canonical(self) -> str:
        """Return the data as one text, the same for the same content."""
        return json.dumps(self.data(), sort_keys=True, default=str)


def read_scenario(path: Path) -> Scenario:
    """Read one scenario file.

    Raises:
        ScenarioError: it can't be read, is no YAML, or breaks the language.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ScenarioError(f"{path}: can't be read: {error.strerror}") from error
    return parse_scenario(text_of(data, str(path)), str(path))


def parse_scenario(text: str, source: str) -> Scenario:
    """Return the scenario in ``text``, which must be a single one; ``source`` names it in errors."""
    return single_sheet(text, source).scenario()


def single_sheet(text: str, source: str) -> Sheet:
    """Return the only scenario of a text.

    Raises:
        ScenarioError: it is no YAML, extends a missing file, or has several variants.
    """
    found = list(sheets(text, source))
    if len(found) != 1:
        raise ScenarioError(f"{source}: {VARIANTS}: only one map can be played, and there are {len(found)}")
    return found[0][1]


def sheets(text: str, source: str) -> Iterator[tuple[str, Sheet]]:
    """Yield every scenario of a text with its name, in the order of the file."""
    node = _with_bases(compose(text, source), source)
    variants = _take(node, VARIANTS)
    if variants is None:
        name = _scalar(node, "name")
        yield name, Sheet(node, source)
        return
    if not isinstance(variants, yaml.MappingNode):
        raise wrong(variants, f"{VARIANTS}: give a name and what is its own for each")
    for key, own in variants.value:
        if not isinstance(own, yaml.MappingNode):
            raise wrong(own, f"{VARIANTS}.{shown(key.value)}: give a mapping")
        pair = tuple(yaml.ScalarNode(TEXT, text, key.start_mark, key.end_mark) for text in ("name", key.value))
        named = yaml.MappingNode(own.tag, [pair, *own.value], own.start_mark, own.end_mark)
        yield key.value, Sheet(_laid_over(node, named), source)


def base_text(name: str) -> str | None:
    """Return the text of a shipped file below ``data/maps``, or None."""
    path = resources.files("khala_simulator.data") / "maps" / f"{name}.yaml"
    return path.read_text(encoding="utf-8") if _PLAIN.fullmatch(name) and path.is_file() else None


def _with_bases(node: yaml.MappingNode, source: str, depth: int = 0) -> yaml.MappingNode:
    """Return the node merged over the files that it extends."""
    base = _take(node, EXTENDS)
    if base is None:
        return node
    text = base_text(str(base.value)) if isinstance(base, yaml.ScalarNode) and depth < DEEPEST else None
    if text is None:
        raise wrong(base, f"{EXTENDS}: there is no shipped scenario {shown(base.value)}")
    return _laid_over(_with_bases(compose(text, f"{base.value}.yaml"), source, depth + 1), node)


def _take(node: yaml.MappingNode, name: str) -> yaml.Node | None:
    """Take a field out of a mapping and return its value, if it is there."""
    found = next((pair for pair in node.value if pair[0].value == name), None)
    if found is not None:
        node.value = [pair for pair in node.value if pair is not found]
    return None if found is None else found[1]


def _scalar(node: yaml.MappingNode, name: str) -> str:
    return next((str(value.value) for key, value in node.value if key.value == name), "")


def _laid_over(base: yaml.MappingNode, own: yaml.MappingNode, field: str = "") -> yaml.MappingNode:
    """Return a new mapping: ``own`` merged over ``base``. ``field`` is "" at the top of the file."""
    said = {key.value: (key, value) for key, value in own.value}
    pairs = []
    for key, value in base.value:
        if key.value not in said:
            pairs.append((key, value))
            continue
        own_key, own_value = said.pop(key.value)
        if isinstance(value, yaml.MappingNode) and isinstance(own_value, yaml.MappingNode):
            own_value = _laid_over(value, own_value, key.value)
        elif not field and key.value in JOINED and isinstance(own_value, yaml.SequenceNode):
            own_value = _join(value, own_value)
        pairs.append((own_key, own_value))
    return yaml.MappingNode(own.tag, [*pairs, *said.values()], own.start_mark, own.end_mark)


def _join(base: yaml.SequenceNode, own: yaml.SequenceNode) -> yaml.SequenceNode:
    """Return both lists in one; entries of the same name replace the earlier one."""
    entries = list(base.value)
    places = {_entry_name(entry): i for i, entry in enumerate(base.value)}
    for entry in own.value:
        name = _entry_name(entry)
        if name and name in places:
            entries[places[name]] = entry
        else:
            entries.append(entry)
    return yaml.SequenceNode(own.tag, entries, own.start_mark, own.end_mark)


def _entry_name(entry: yaml.Node) -> str:
    return _scalar(entry, "name") if isinstance(entry, yaml.MappingNode) else ""


def _locate(root: yaml.Node, where: tuple[int | str, ...], *, missing: bool) -> tuple[Any, str]:
    """Return the mark of the innermost part of ``where`` that the text has, and the field's name.

    Parts that are no key of the text are the validator's own names of alternatives; the last one may be ``missing``.
    """
    node = root
    mark = root.start_mark
    field = ""
    for part in where:
        if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
            node, field = node.value[part], f"{field}[{part}]"
            mark = node.start_mark
        elif isinstance(node, yaml.MappingNode):
            found = next(((key, value) for key, value in node.value if key.value == str(part)), None)
            if found is not None:
                node, field, mark = found[1], f"{field}.{part}".lstrip("."), found[0].start_mark
            elif missing and part == where[-1]:
                field = f"{field}.{part}".lstrip(".")
    return mark, field
