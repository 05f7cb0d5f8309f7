"""A YAML file ↔ a pydantic model, with errors that name file, line and field.

One page for every package that is configured by files. It is no configuration system: it has no
defaults (the model has them), no interpolation, no environment. A file may extend another file:

    extends: pvz_task1_level1  # the file beside this one, a shipped one, or a path from here that ends in .yaml
    map: pvz_task1_level2      # a given field replaces the whole field of the other file
    agents: [{name: Scout}]    # but an entry of a list takes what it leaves out from the entry of its name there

Whatever a file holds, it is read in a fraction of a second or refused with a sentence: see
`khala_protocol.document` for the limits. Above it are the modules `config` of the packages; below it pydantic.
"""

from __future__ import annotations

import difflib
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar

from pydantic import BaseModel, ValidationError

from khala_protocol.document import Document, place_text, shown
from khala_protocol.errors import ConfigError
from khala_protocol.files import MB, check_regular, read_limited

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from pydantic_core import ErrorDetails

    from khala_protocol.document import Place

M = TypeVar("M", bound=BaseModel)
EXTENDS = "extends"
"""Field at the top of a file that names the file to extend."""
ELSEWHERE = "ELSEWHERE"
"""Class variable of a model: fields that users look for in it, and a sentence without its subject about each."""
MAX_BYTES = MB
"""Size of a file; the largest shipped one has 6 kB."""
LONGEST_GUESSED = 100
"""Characters of a wrong name in which the meant one is looked for."""
MAX_CHAIN = 16
"""Files that extend each other."""


class UnknownName(ValueError):
    """A validator's error: a name is none of the known ones.

    The nearest one takes 20 ms to find among 1300 names, so it is looked for when the error is shown: one of them is,
    and a file may hold thousands.
    """

    def __init__(self, what: str, name: str, known: Collection[str]) -> None:
        super().__init__(f"there is no {what} {shown(name)}")
        self._name, self._known = name, known

    def hint(self) -> str:
        """Return what follows the sentence: the nearest name, if there is one."""
        close = difflib.get_close_matches(self._name[:LONGEST_GUESSED], self._known, n=1)
        return f", did you mean '{close[0]}'?" if close else ""


def load(path: Path | str, model: type[M], *, shipped: Mapping[str, Path] = MappingProxyType({})) -> M:
    """Return the model that the YAML file at `path` describes.

    Args:
        path: of the file.
        model: of its fields.
        shipped: by name, files that any file may extend if there is none of this name beside it.

    Raises:
        ConfigError: the file cannot be read, is not YAML, or does not fit the model; the text says where.
    """
    return _fit(_open(Path(path), shipped), model)


def loads(text: str, model: type[M], *, source: str) -> M:
    """Return the model that a YAML text describes; `source` is its name in errors.

    Raises:
        ConfigError: it is not YAML, or does not fit the model.
    """
    return _fit(Document(text, source), model)


def _fit(document: Document, model: type[M]) -> M:
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        raise _explain(document, model, error) from None


def _open(path: Path, shipped: Mapping[str, Path], *users: Path) -> Document:
    """Return the document at a path, over the one that it extends; `users` are the files that extend it."""
    document = Document(_text_of(path), str(path))
    if isinstance(document.data, dict) and isinstance(name := document.data.get(EXTENDS), str):
        other = path.parent / (name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
        if name in shipped and not other.exists():
            other = shipped[name]
        if fault := _unfit_to_extend(other, (*users, path)):
            raise ConfigError(fault, source=str(path), line=document.lines[(EXTENDS,)], field=EXTENDS)
        document.lay_over(_open(other, shipped, *users, path), but=EXTENDS)
    return document


def _text_of(path: Path) -> str:
    try:
        return read_limited(path, MAX_BYTES).decode()
    except FileNotFoundError:
        raise ConfigError("there is no such file", source=str(path)) from None
    except IsADirectoryError:
        raise ConfigError("this is a directory: name a YAML file", source=str(path)) from None
    except UnicodeDecodeError:
        raise ConfigError("this is not UTF-8 text", source=str(path)) from None
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", source=str(path)) from None


def _unfit_to_extend(other: Path, users: Sequence[Path]) -> str:
    """Return why a file cannot be extended; "" if it can."""
    try:
        check_regular(other)
        if any(other.samefile(user) for user in users):
            return "this file extends itself"
    except FileNotFoundError:
        return f"there is no file {other.name} for it"
    except OSError as error:
        return f"the file for it cannot be read: {error.strerror}"
    return f"more than {MAX_CHAIN} files extend each other here" if len(users) >= MAX_CHAIN else ""


def _explain(document: Document, model: type[BaseModel], error: ValidationError) -> ConfigError:
    faults = error.errors(include_url=False)
    placed = [(_known_place(document, fault), fault) for fault in faults]
    place, fault = min(placed, key=lambda item: (document.origin(item[0])[0] != document.source, _line(document, item)))
    text = _sentence(fault, model)
    if len(faults) > 1:
        text += f" (and {len(faults) - 1} more)"
    source, line = document.origin(place)
    return ConfigError(text, source=source, line=line, field=place_text(place) or None)


def _line(document: Document, placed: tuple[Place, ErrorDetails]) -> int:
    return document.origin(placed[0])[1] or 0


def _known_place(document: Document, fault: ErrorDetails) -> Place:
    """Return the place of a fault without pydantic's additions: names of union members, of validators."""
    place: Place = ()
    for part in fault["loc"]:
        if document.knows((*place, part)):
            place = (*place, part)
    return (*place, fault["loc"][-1]) if fault["type"] == "missing" else place


def words_of(fault: ErrorDetails) -> str:
    """Return what a validator said, with the nearest name if a name is unknown; pydantic's words for other faults."""
    error = fault.get("ctx", {}).get("error")
    if not isinstance(error, ValueError):
        return fault["msg"]
    return str(error) + (error.hint() if isinstance(error, UnknownName) else "")


def _sentence(fault: ErrorDetails, model: type[BaseModel]) -> str:
    context = fault.get("ctx", {})
    match fault["type"]:
        case "missing":
            return "is required and not given"
        case "extra_forbidden":  # the value is not shown: it may be a key in the wrong place
            return _unknown(fault, model)
        case "literal_error" | "enum":
            return f"{shown(fault['input'])} is none of {context['expected']}"
        case "value_error":
            return words_of(fault)
        case "model_type" | "model_attributes_type" | "dict_type":
            return f"fields are wanted here, not {shown(fault['input'])}"
    message = fault["msg"]
    return f"{message[0].lower()}{message[1:]}, not {shown(fault['input'])}"


def _unknown(fault: ErrorDetails, model: type[BaseModel]) -> str:
    *place, name = fault["loc"]
    elsewhere: Mapping[str, str] = {} if place else getattr(model, ELSEWHERE, {})
    return elsewhere.get(str(name)) or "no such field" + _did_you_mean(str(name), _fields_at(model, tuple(place)))


def _did_you_mean(word: str, known: list[str]) -> str:
    if close := difflib.get_close_matches(word[:LONGEST_GUESSED], known, n=1):
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
