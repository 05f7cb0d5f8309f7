"""JSON schemas as endpoints take them: without the keywords that they refuse, and in the dialect of Gemini."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

LIMITING: Final = frozenset({"maxLength", "pattern", "minimum", "maximum", "minItems", "maxItems"})
"""Keywords without which an answer is read as well; the host judges what it gets."""


def without(schema: Mapping[str, Any], keywords: Collection[str]) -> dict[str, Any]:
    """Return a schema without these keywords."""
    kept = {name: value for name, value in schema.items() if name not in keywords}
    return _with_inner(kept, lambda inner: without(inner, keywords))


def keywords_in(value: object) -> set[str]:
    """Return the limiting keywords that occur in a value of JSON."""
    if isinstance(value, dict):
        return (value.keys() & LIMITING).union(*map(keywords_in, value.values()))
    return set().union(*map(keywords_in, value)) if isinstance(value, list | tuple) else set()


def in_openapi(schema: Mapping[str, Any], definitions: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a schema in the part of OpenAPI that Gemini takes.

    It has no references and one type, which may be nullable. Objects name the order of their properties: they are
    written by the alphabet otherwise.
    """
    definitions = definitions or schema.get("$defs", {})
    if "$ref" in schema:
        return in_openapi(definitions[schema["$ref"].rpartition("/")[2]], definitions)
    kept = {name: value for name, value in schema.items() if name not in ("$defs", "additionalProperties")}
    match kept.get("type"):
        case [kind, "null"]:
            kept |= {"type": kind, "nullable": True}
        case "object":
            kept["propertyOrdering"] = list(kept.get("properties", ()))
    return _with_inner(kept, lambda inner: in_openapi(inner, definitions))


def _with_inner(schema: dict[str, Any], change: Callable[[Mapping[str, Any]], dict[str, Any]]) -> dict[str, Any]:
    """Return a schema with the schemas in it changed."""
    for name in ("properties", "$defs"):
        if name in schema:
            schema[name] = {field: change(inner) for field, inner in schema[name].items()}
    if "anyOf" in schema:
        schema["anyOf"] = [change(inner) for inner in schema["anyOf"]]
    if "items" in schema:
        schema["items"] = change(schema["items"])
    return schema
