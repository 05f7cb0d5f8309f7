"""An agent's choices → tools that a model can call: one for each action, and those to speak with.

A tool is for all teams that have its action; its lists of tags are those of all of them together.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from khala_agents.answers.form import Tool
from khala_agents.answers.schema import NUMBER, TEXT, UNTIL, argument_schema, object_with, one_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_agents.answers.choices import Argument, Choices, Option


def tools_for(choices: Choices) -> tuple[Tool, ...]:
    """Return the tools that an agent can call."""
    return (*_actions(choices), *_talk(choices))


def _actions(choices: Choices) -> Iterator[Tool]:
    by_name: dict[str, list[Option]] = {}
    for option in choices.options:
        by_name.setdefault(option.action.name, []).append(option)
    for name, options in by_name.items():
        teams = dict.fromkeys(team for option in options for team in option.teams)
        fields = {"team": one_of(teams)}
        for arguments in zip(*(option.arguments for option in options), strict=True):
            fields[arguments[0].name] = argument_schema(_together(arguments))
        optional = {"until": {**UNTIL, "type": "string"}} if choices.stands else {}
        yield Tool(name, options[0].action.description, object_with(fields, optional))


def _talk(choices: Choices) -> Iterator[Tool]:
    if choices.recipients:
        fields = {"to": one_of(choices.recipients), "text": TEXT}
        yield Tool("MessageTo", "Send a text to an agent or a channel.", object_with(fields))
    if choices.channels:
        yield Tool("ListenTo", "Hear a channel from now on.", object_with({"channel": one_of(choices.channels)}))
    if choices.keeps_notes:
        yield Tool("Note", "Keep a note for yourself, of at most 200 characters.", object_with({"text": TEXT}))
        yield Tool("Forget", "Remove the note of this number.", object_with({"number": NUMBER}))
    if choices.stands:
        yield Tool("Revoke", "End the standing order of this number.", object_with({"number": NUMBER}))


def _together(arguments: Sequence[Argument]) -> Argument:
    """Return an argument that has the values of all of these."""
    tags = dict.fromkeys(tag for argument in arguments for tag in argument.tags)
    points = dict.fromkeys(point for argument in arguments for point in argument.points)
    bounds = [argument.bounds for argument in arguments if argument.bounds is not None]
    free = any(not (argument.points if argument.bounds else argument.tags) for argument in arguments)
    sides = list(zip(*bounds, strict=True))
    return replace(
        arguments[0],
        tags=() if free else tuple(tags),
        points=() if free else tuple(points),
        bounds=(min(sides[0]), min(sides[1]), max(sides[2]), max(sides[3])) if bounds else None,
    )
