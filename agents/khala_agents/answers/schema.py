"""An agent's choices → a JSON schema of its answer, which `khala_protocol.speech.whole` reads.

The schema keeps to what strict endpoints take: every property is required, there are no others, and one object is told
from another by `anyOf`.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_agents.answers.choices import Argument, Choices
    from khala_protocol.messages import Point

Schema = dict[str, Any]

TEXT_CHARACTERS: Final = 300
"""Of an analysis, and of each message in JSON: a small model that goes on with one reaches its limit of tokens."""
MOST_LINES: Final = 4
"""Messages in an answer, or as many as there are recipients; and notes."""
NO_FIELDS: Final[Mapping[str, Schema]] = MappingProxyType({})
ANY_TAG: Final[Schema] = {"type": "string", "pattern": "^0x[0-9a-f]{1,16}$"}
TEXT: Final[Schema] = {
    "type": "string",
    "maxLength": TEXT_CHARACTERS,
    "description": f"at most {TEXT_CHARACTERS} characters",
}
NUMBER: Final[Schema] = {"type": "integer"}
UNTIL: Final[Schema] = {
    "type": ["string", "null"],
    "maxLength": 40,
    "description": "null for an order that is given once; else the end of a standing order: a time of the game's clock "
    "such as 4:30, 22 and a type of units, an upgrade, 'attacked', 'minerals 400', or 'revoked'",
}


def answer_schema(choices: Choices) -> Schema:
    """Return the schema of an answer: an object with an analysis and lists of what is said."""
    definitions: dict[str, Schema] = {}
    fields: dict[str, Schema] = {"analysis": TEXT}
    if choices.options:
        orders = [_order(choices, *alike, definitions) for alike in _alike(choices)]
        fields["orders"] = _list({"anyOf": orders}, choices.most * len(choices.teams))
    if choices.recipients:
        message = object_with({"to": one_of(choices.recipients), "text": TEXT})
        fields["messages"] = _list(message, max(MOST_LINES, len(choices.recipients)))
    if choices.channels:
        fields["listen"] = _list(one_of(choices.channels), len(choices.channels))
    if choices.keeps_notes:
        fields |= {"notes": _list(TEXT, MOST_LINES), "forget": _list(NUMBER, MOST_LINES)}
    if choices.stands:
        fields["revoke"] = _list(NUMBER, MOST_LINES)
    return {**object_with(fields), "$defs": definitions} if definitions else object_with(fields)


def object_with(fields: Mapping[str, Schema], optional: Mapping[str, Schema] = NO_FIELDS) -> Schema:
    """Return the schema of an object with these fields, perhaps the optional ones, and no others."""
    properties = {**fields, **optional}
    return {"type": "object", "properties": properties, "required": list(fields), "additionalProperties": False}


def one_of(words: Iterable[str]) -> Schema:
    """Return the schema of a text that is one of these."""
    return {"type": "string", "enum": list(words)}


def argument_schema(argument: Argument) -> Schema:
    """Return the schema of an argument of an action."""
    if argument.bounds is None:
        return one_of(argument.tags) if argument.tags else ANY_TAG
    if argument.points:
        return one_of(map(written_point, argument.points))
    x0, y0, x1, y1 = argument.bounds
    across, down = ({"type": "number", "minimum": low, "maximum": high} for low, high in ((x0, x1), (y0, y1)))
    if across == down:
        return {"type": "array", "items": across, "minItems": 2, "maxItems": 2}
    return object_with({"x": across, "y": down})


def written_point(point: Point) -> str:
    """Return a point as it is written in a text, `[3, 4.5]`."""
    return f"[{point[0]:g}, {point[1]:g}]"


def _alike(choices: Choices) -> Iterable[tuple[list[str], tuple[str, ...], tuple[Argument, ...]]]:
    """Return the names of actions that the same teams can do with the same arguments, with both."""
    found: dict[tuple[tuple[str, ...], tuple[Argument, ...]], list[str]] = {}
    for option in choices.options:
        found.setdefault((option.teams, option.arguments), []).append(option.action.name)
    return [(names, teams, arguments) for (teams, arguments), names in found.items()]


def _order(
    choices: Choices,
    names: Sequence[str],
    teams: Sequence[str],
    arguments: Iterable[Argument],
    definitions: dict[str, Schema],
) -> Schema:
    fields = {"team": one_of(teams), "action": one_of(names)}
    fields |= {argument.name: _refer(argument_schema(argument), definitions) for argument in arguments}
    if choices.stands:
        fields["until"] = UNTIL
    return object_with(fields)


def _refer(schema: Schema, definitions: dict[str, Schema]) -> Schema:
    """Return a reference to the schema of many tags, which stands in several orders: endpoints count each value."""
    if len(schema.get("enum", ())) < len("AB"):
        return schema
    name = next((name for name, known in definitions.items() if known == schema), f"list{len(definitions) + 1}")
    definitions[name] = schema
    return {"$ref": f"#/$defs/{name}"}


def _list(items: Schema, most: int) -> Schema:
    return {"type": "array", "items": items, "maxItems": most}
