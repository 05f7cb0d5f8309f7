"""A YAML file ↔ a pydantic model, with errors that name file, line and field.

One page for every package that is configured by files. It is no configuration system: it has no
defaults (the model has them), no interpolation, no environment. A file may extend another file:

    extends: pvz_task1_level1  # the file beside this one, or a path from here that ends in .yaml
    map: pvz_task1_level2      # map: pvz_task1_level2      # a given field replaces the whole field of the other file

Above it are the modules `config` of the packages; below it are PyYAML, read with its safe loader, and pydantic.
"""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic_core import ErrorDetails

M = TypeVar("M", bound=BaseModel)
Place = tuple[str | int, ...]
"""Keys and indices from the top of the document to a value."""

EXTENDS = "extends"
"""Field at the top of a file that names the file to extend."""
ELSEWHERE = "ELSEWHERE"
"""Class variable of a model: fields that users look for in it, and a sentence without its subject about each."""
_MAX_DEPTH = 32  # an alias that contains itself would be followed for ever


def load(path: Path | str, model: type[M]) -> M:
    """Return the model that the YAML file at `path` describes.

    Raises:
        ConfigError: the file cannot be read, is not YAML, or does not fit the model; the text says where.
    """
    return _fitted(_opened(Path(path)), model)


def loads(text: str, model: type[M], *, source: str) -> M:
    """Return the model that a YAML text describes; `source` is its name in errors.

    Raises:
        ConfigError: it is not YAML, or does not fit the model.
    """
    return _fitted(_Document(text, source), model)


def _fitted(document: _Document, model: type[M]) -> M:
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        raise _explain(document, model, error) from None


def _opened(path: Path, *users: Path) -> _Document:
    """Return the document at a path, over the one that it extends; `users` are the files that extend it."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError("there is no such file", source=str(path)) from None
    except IsADirectoryError:
        raise ConfigError("this is a directory, a YAML file is wanted", source=str(path)) from None
    except UnicodeDecodeError:
        raise ConfigError("this is no UTF-8 text", source=str(path)) from None
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", source=str(path)) from None
    document = _Document(text, str(path))
    if isinstance(document.data, dict) and isinstance(name := document.data.get(EXTENDS), str):
        other = path.parent / (name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
        if other in (path, *users):
            raise ConfigError(
                "this file extends itself", source=str(path), line=document.lines[(EXTENDS,)], field=EXTENDS
            )
        if not other.is_file():
            fault = f"there is no file {other.name} for it"
            raise ConfigError(fault, source=str(path), line=document.lines[(EXTENDS,)], field=EXTENDS)
        document.lay_over(_opened(other, path, *users))
    return document


class _Document:
    """A YAML document as plain data, and the line on which each of its values begins."""

    def __init__(self, text: str, source: str) -> None:
        self.source = source
        self.lines: dict[Place, int] = {(): 1}
        self._below: _Document | None = None
        self._loader = yaml.SafeLoader(text)
        self.data = self._read()

    def lay_over(self, other: _Document) -> None:
        """Take the fields of another document that this one does not have."""
        if isinstance(self.data, dict) and isinstance(other.data, dict):
            self._below = other
            self.data = other.data | {key: value for key, value in self.data.items() if key != EXTENDS}

    def origin(self, place: Place) -> tuple[str, int | None]:
        """Return file and line of the value at `place`."""
        if self._below is not None and place[:1] not in self.lines and self._below.knows(place[:1]):
            return self._below.origin(place)
        return self.source, self.line_of(place)

    def knows(self, place: Place) -> bool:
        """Return whether there is a value at `place`."""
        return place in self.lines or (self._below is not None and self._below.knows(place))

    def _read(self) -> object:
        """Return the data; an empty document is an empty mapping, so that a model can say what is missing."""
        try:
            root = self._loader.get_single_node()
            return {} if root is None else self._value(root, ())
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark
            line = None if mark is None else mark.line + 1
            raise ConfigError(f"this is no YAML: {error.problem}", source=self.source, line=line) from None
        except yaml.YAMLError as error:
            raise ConfigError(f"this is no YAML: {error}", source=self.source) from None
        finally:
            self._loader.dispose()

    def line_of(self, place: Place) -> int | None:
        """Return the line of the value at `place`, or of the nearest one around it."""
        while place not in self.lines and place:
            place = place[:-1]
        return self.lines.get(place)

    def _value(self, node: yaml.Node, place: Place) -> object:
        self.lines.setdefault(place, node.start_mark.line + 1)
        if len(place) > _MAX_DEPTH:
            raise ConfigError("nested too deep", source=self.source, line=self.lines[place])
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, place)
        if isinstance(node, yaml.SequenceNode):
            return [self._value(item, (*place, index)) for index, item in enumerate(node.value)]
        value: object = self._loader.construct_object(node, deep=True)
        return value

    def _mapping(self, node: yaml.MappingNode, place: Place) -> dict[str | int, object]:
        self._refuse_doubles(node, place)
        self._loader.flatten_mapping(node)
        found: dict[str | int, object] = {}
        for key_node, value_node in node.value:
            key = self._key(key_node)
            self.lines[(*place, key)] = key_node.start_mark.line + 1
            found[key] = self._value(value_node, (*place, key))
        return found

    def _refuse_doubles(self, node: yaml.MappingNode, place: Place) -> None:
        seen: dict[str | int, int] = {}
        for key_node, _ in node.value:
            key, line = self._key(key_node), key_node.start_mark.line + 1
            if key in seen:
                raise ConfigError(
                    f"stands here a second time, the first is on line {seen[key]}",
                    source=self.source,
                    line=line,
                    field=_dotted((*place, key)),
                )
            seen[key] = line

    def _key(self, node: yaml.Node) -> str | int:
        if node.tag == "tag:yaml.org,2002:merge":
            return "<<"
        key = self._loader.construct_object(node, deep=True)
        # `yes`, `1.5` and dates are written as names here, but YAML 1.1 reads them as something else
        return key if isinstance(key, str | int) and not isinstance(key, bool) else str(getattr(node, "value", key))


def _explain(document: _Document, model: type[BaseModel], error: ValidationError) -> ConfigError:
    faults = error.errors(include_url=False)
    placed = [(_known_place(document, fault), fault) for fault in faults]
    place, fault = min(placed, key=lambda item: (document.origin(item[0])[0] != document.source, _line(document, item)))
    text = _sentence(fault, model)
    if len(faults) > 1:
        text += f" (and {len(faults) - 1} more)"
    source, line = document.origin(place)
    return ConfigError(text, source=source, line=line, field=_dotted(place) or None)


def _line(document: _Document, placed: tuple[Place, ErrorDetails]) -> int:
    return document.origin(placed[0])[1] or 0


def _known_place(document: _Document, fault: ErrorDetails) -> Place:
    """Return the place of a fault without pydantic's additions: names of union members, of validators."""
    place: Place = ()
    for part in fault["loc"]:
        if document.knows((*place, part)):
            place = (*place, part)
    return (*place, fault["loc"][-1]) if fault["type"] == "missing" else place


def _sentence(fault: ErrorDetails, model: type[BaseModel]) -> str:
    context = fault.get("ctx", {})
    match fault["type"]:
        case "missing":
            return "is required and not given"
        case "extra_forbidden":  # the value is not shown: it may be a key in the wrong place
            return _unknown(fault, model)
        case "literal_error" | "enum":
            return f"{_shown(fault['input'])} is none of {context['expected']}"
        case "value_error":
            return str(context["error"])
        case "model_type" | "model_attributes_type" | "dict_type":
            return f"fields are wanted here, not {_shown(fault['input'])}"
    message = fault["msg"]
    return f"{message[0].lower()}{message[1:]}, not {_shown(fault['input'])}"


def _unknown(fault: ErrorDetails, model: type[BaseModel]) -> str:
    *place, name = fault["loc"]
    elsewhere: Mapping[str, str] = {} if place else getattr(model, ELSEWHERE, {})
    return elsewhere.get(str(name)) or "no such field" + _did_you_mean(str(name), _fields_at(model, tuple(place)))


def _did_you_mean(word: str, known: list[str]) -> str:
    if close := difflib.get_close_matches(word, known, n=1):
        return f", did you mean '{close[0]}'?"
    return f"; known are {', '.join(sorted(known))}" if known else ""


def _fields_at(model: type[BaseModel], place: Place) -> list[str]:
    """Return the fields of the model at `place`, [] where the way there leads through more than plain nesting."""
    for part in place:
        inner = model.model_fields.get(str(part))
        if inner is None or not (isinstance(inner.annotation, type) and issubclass(inner.annotation, BaseModel)):
            return []
        model = inner.annotation
    return [field.alias or name for name, field in model.model_fields.items()]


def _shown(value: object) -> str:
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def _dotted(place: Place) -> str:
    return ".".join(str(part) for part in place)
