"""Pydantic models → tables of their fields, in the words of JSON and YAML."""

from __future__ import annotations

import ast
import inspect
import io
import json
import re
import tokenize
import types
import typing
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeGuard, Union, get_args, get_origin

from pydantic import BaseModel, JsonValue
from pydantic_core import PydanticUndefined, to_jsonable_python

from docs.pages.markdown import anchor, code, prose, table
from khala_protocol.field_words import field_words

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from types import ModuleType

    from pydantic.fields import FieldInfo

WORDS: dict[object, str] = {
    str: "text",
    int: "integer",
    float: "number",
    bool: "true or false",
    object: "any value",
    Any: "any value",
    JsonValue: "any JSON value",
    tuple[float, float]: "`[x, y]`",
    type(None): "null",
}
BOUNDS = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}
"""Attributes of pydantic's constraints, as a reader knows them."""


OR_NULL = " or null"


class Describer:
    """The descriptions of what a field holds.

    Args:
        names: words for types that a reader knows by another name, such as an annotated string.
    """

    def __init__(self, names: Mapping[object, str] | None = None) -> None:
        self._words = {**(names or {}), **WORDS}

    def fields(self, model: type[BaseModel], *, without: Iterable[str] = ()) -> str:
        """Return a table of the fields of a model."""
        hints = typing.get_type_hints(model, include_extras=True)
        words = field_words(model)
        left_out = set(without)
        rows = [
            (
                code(field.alias or name),
                self._field(hints[name], field),
                _default(field),
                _null(field.description or words.get(name, "")),
            )
            for name, field in model.model_fields.items()
            if name not in left_out
        ]
        return table(("field", "holds", "default", "meaning"), rows)

    def _field(self, hint: object, field: FieldInfo) -> str:
        bounds = [
            f"{sign} {value:g}"
            for constraint in field.metadata
            for name, sign in BOUNDS.items()
            if (value := getattr(constraint, name, None)) is not None
        ]
        shape, null, _ = self.shape(hint).partition(OR_NULL)
        return f"{shape} {', '.join(bounds)}".rstrip() + null

    def shape(self, hint: object) -> str:  # noqa: PLR0911  # one answer for each kind of type
        """Return what a value of this type is."""
        if known := self._word(hint):
            return known
        origin, args = get_origin(hint), get_args(hint)
        if origin is Annotated:
            return self.shape(args[0])
        if origin is Literal:
            return " or ".join(code(value) for value in args)
        if origin in {Union, types.UnionType}:
            return " or ".join(dict.fromkeys(self.shape(part) for part in args))
        if origin is tuple and args[-1] is Ellipsis:
            return f"list of {self.shape(args[0])}"
        if origin is tuple:
            return f"list of {len(args)} {self.shape(args[0])}s"
        if origin is dict:
            keys = "" if args[0] is str else f", by {self.shape(args[0])}"
            return f"object of {self.shape(args[1])}{keys}"
        if _is_part(hint):
            return f"[{hint.__name__}]({anchor(hint.__name__)})"
        raise TypeError(f"no words for {hint!r}")

    def _word(self, hint: object) -> str | None:
        """Return the word for a type. By equality and not by hash: an annotation of a type need not be hashable."""
        return next((word for known, word in self._words.items() if known == hint), None)

    def row(self, named: type) -> str:
        """Return a table of the values of a list whose places have names."""
        hints = typing.get_type_hints(named)
        rows = [(code(name), self.shape(hints[name]), text) for name, text in attributes(named)]
        return table(("place", "holds", "meaning"), rows)


def about(model: type) -> str:
    """Return the docstring of a model as Markdown."""
    return prose(_null(inspect.cleandoc(model.__doc__ or "")))


def attributes(model: type) -> list[tuple[str, str]]:
    """Return the fields of a dataclass, in order, with the docstring under each as Markdown.

    Raises:
        LookupError: a field has none.
    """
    texts = field_words(model)
    own = [name for name in model.__annotations__ if name not in texts]
    if own:
        raise LookupError(f"{model.__name__} says nothing of {', '.join(own)}: write a docstring under each")
    return [(name, _null(text)) for name, text in texts.items()]


def parts(models: Iterable[type[BaseModel]]) -> list[type]:
    """Return the models and named tuples that these are made of, each once, in the order in which they are met."""
    found: dict[type, None] = {}

    def visit(model: type) -> None:
        for field in model.model_fields.values() if issubclass(model, BaseModel) else ():
            for inner in _parts_in(field.annotation):
                if inner not in found:
                    found[inner] = None
                    visit(inner)

    given = list(models)
    for model in given:
        visit(model)
    return [model for model in found if model not in given]


def remarks(module: ModuleType, name: str) -> list[tuple[str, str]]:
    """Return the values of a `Literal` in a module with the remark after each, where a docstring is not possible."""
    source = inspect.getsource(module)
    comments = {
        token.start[0]: token.string.lstrip("# ")
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name:
            values = [part for part in ast.walk(node.value) if isinstance(part, ast.Constant)]
            return [(str(part.value), comments.get(part.lineno, "")) for part in values]
    raise LookupError(f"{module.__name__} has no {name}")


def _parts_in(annotation: object) -> Iterator[type]:
    if _is_part(annotation):
        yield annotation
    for part in get_args(annotation):
        yield from _parts_in(part)


def _is_part(hint: object) -> TypeGuard[type]:
    """Return whether a type has a section of its own: a model, or a list whose places have names."""
    return isinstance(hint, type) and (issubclass(hint, BaseModel) or hasattr(hint, "_fields"))


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.default if field.default_factory is None else field.default_factory()  # type: ignore[call-arg]  # none of ours takes the validated data
    if value is None or value is PydanticUndefined or value in ({}, (), ""):
        return ""
    if isinstance(value, BaseModel) and value == type(value)():
        return "its defaults"
    return code(value if isinstance(value, str) else json.dumps(to_jsonable_python(value)))


def _null(text: str) -> str:
    """Return a text with the name that JSON and YAML have for Python's None."""
    return re.sub(r"\bNone\b", "null", text)
