"""Write `page/src/wire.ts`, the types of everything the server of `khala view` tells its page.

They come from the JSON schema of `khala_sc2.view.wire`, so that the compiler finds what the server does not send. A
named tuple becomes a labelled tuple.
"""

from __future__ import annotations

import inspect
import json
import sys
import textwrap
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from khala_protocol.messages import Terrain, UnitFlag
from khala_sc2.view import wire

TYPES = Path(__file__).parent / "src" / "wire.ts"
_HEAD = """// Made by `python -m page.typescript` from khala_sc2/view/wire.py: change it there.
"""
_SIMPLE = {"string": "string", "integer": "number", "number": "number", "boolean": "boolean", "null": "null"}

Schema = dict[str, Any]


def typescript() -> str:
    """Return the text of the file."""
    classes = [c for _, c in inspect.getmembers(wire, inspect.isclass) if c.__module__ == wire.__name__]
    models: list[type[BaseModel]] = [c for c in classes if issubclass(c, BaseModel)]
    models.append(Terrain)
    _, schema = models_json_schema([(model, "serialization") for model in models])
    parts = [_declared(name, definition) for name, definition in schema["$defs"].items()]
    return "\n".join([_HEAD, *parts, _flags(), _number("SCENES_AT_ONCE", wire.SCENES_AT_ONCE)])


def _declared(name: str, schema: Schema) -> str:
    words = _comment(schema.get("description", ""), "")
    if schema.get("type") != "object":
        return f"{words}export type {name} = {_type(schema)};\n"
    fields = [_field(field, inner) for field, inner in schema["properties"].items()]
    return f"{words}export interface {name} {{\n{''.join(fields)}}}\n"


def _field(name: str, schema: Schema) -> str:
    return f"{_comment(schema.get('description', ''), '  ')}  {name}: {_type(schema)};\n"


def _type(schema: Schema) -> str:
    """Return the type of a schema; a field with a default is there in every answer."""
    match schema:
        case {"$ref": path}:
            return str(path).removeprefix("#/$defs/")
        case {"const": value}:
            return json.dumps(value)
        case {"enum": values}:
            return " | ".join(map(json.dumps, values))
        case {"anyOf": schemas}:
            return " | ".join(map(_type, schemas))
    return _typed(schema)


def _typed(schema: Schema) -> str:
    match schema.get("type", ""):
        case "array":
            return _array(schema)
        case "object":
            return _record(schema.get("additionalProperties", True))
        case simple:
            return _SIMPLE.get(simple, "unknown")


def _array(schema: Schema) -> str:
    if "prefixItems" not in schema:
        item = _type(schema["items"])
        return f"({item})[]" if "|" in item else f"{item}[]"
    items = schema["prefixItems"]
    labels = [f"{_label(i)}: " if "title" in i else "" for i in items]
    return f"[{', '.join(label + _type(item) for label, item in zip(labels, items, strict=True))}]"


def _label(schema: Schema) -> str:
    return str(schema["title"]).lower().replace(" ", "_")


def _record(values: Schema | bool) -> str:
    return f"Record<string, {'unknown' if isinstance(values, bool) else _type(values)}>"


def _comment(words: str, indent: str) -> str:
    if not words:
        return ""
    if "\n" not in words and len(words) < 100:
        return f"{indent}/** {words} */\n"
    return f"{indent}/**\n{textwrap.indent(words, f'{indent} * ', lambda _: True)}\n{indent} */\n"


def _flags() -> str:
    flags = ", ".join(f"{flag.name}: {flag.value}" for flag in UnitFlag)
    return f"/** Properties of a unit of a scene: bits of `flags`. */\nexport const Flag = {{ {flags} }} as const;\n"


def _number(name: str, value: int) -> str:
    return f"export const {name} = {value};\n"


if __name__ == "__main__":
    TYPES.write_text(typescript(), encoding="utf-8")
    sys.stdout.write(f"wrote {TYPES}\n")
