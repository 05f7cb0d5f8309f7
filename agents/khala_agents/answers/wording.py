"""What a prompt says of the form of an answer other than text, and an example of it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from khala_agents.answers.choices import argument_names

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_protocol.messages import ActionSpec, Briefing, Call

GOES_ON = "A team that you do not mention goes on with what it is doing."
EXAMPLE_POINTS = {"screen": [14.5, 9], "minimap": [31, 22]}


def how_to_answer_in_json(briefing: Briefing) -> str:
    """Return how to answer with an object of JSON."""
    lines = [
        "Answer with one object of JSON, with nothing before it and nothing behind it. It has:",
        '- "analysis": a few sentences on what matters now.',
    ]
    if briefing.teams:
        lines.append(f'- "orders": a list of orders, such as {_sample_order(briefing)}.')
        if any(action.actors for action in briefing.actions):
            lines.append('  The first tag of an action whose name begins with Select_Unit_ is called "unit".')
        if briefing.standing_orders:
            lines.append('  "until": null gives an order once; "until": "4:30" makes it a standing order.')
    if briefing.correspondents or briefing.channels:
        lines.append('- "messages": a list of messages, such as {"to": "name", "text": "words"}.')
    if briefing.channels:
        lines.append('- "listen": the channels that you want to hear from now on.')
    if briefing.memory.notes:
        lines.append('- "notes": texts to keep for yourself; "forget": numbers of notes to remove.')
    if briefing.standing_orders:
        lines.append('- "revoke": numbers of standing orders to end.')
    return "\n".join([*lines, *([GOES_ON] if briefing.teams else [])])


def how_to_answer_with_tools(briefing: Briefing) -> str:
    """Return how to answer with calls of tools."""
    orders = " Each order is a call of its action's tool; give all of them in this answer." if briefing.teams else ""
    talk = " MessageTo sends a message." if briefing.correspondents or briefing.channels else ""
    goes_on = f"\n{GOES_ON}" if briefing.teams else ""
    return f"Write a few sentences on what matters now, and call tools.{orders}{talk}{goes_on}"


def in_json(reply: str, actions: Iterable[ActionSpec]) -> str:
    """Return a reply in the text language as an object of JSON that means the same.

    Args:
        reply: the text.
        actions: that may occur in it.
    """
    from khala_protocol.speech import Forget, Note, Revoke, Standing, parse, thought_of  # noqa: PLC0415  # slow to load

    known = {action.name: action for action in actions}
    speech = parse(reply)
    standing = [said for said in speech.standing if isinstance(said, Standing)]
    orders: list[dict[str, Any]] = [_order(call, known) for call in speech.calls]
    orders += [_order(said.call, known) | {"until": said.until or "revoked"} for said in standing]
    lists = {
        "orders": orders,
        "messages": [{"to": message.recipient, "text": message.text} for message in speech.messages],
        "listen": [listen.channel for listen in speech.listens],
        "notes": [note.text for note in speech.notes if isinstance(note, Note)],
        "forget": [note.number for note in speech.notes if isinstance(note, Forget)],
        "revoke": [said.number for said in speech.standing if isinstance(said, Revoke)],
    }
    said = {name: items for name, items in lists.items() if items or name == "orders"}
    return json.dumps({"analysis": thought_of(reply), **said}, ensure_ascii=False)


def _order(call: Call, known: Mapping[str, ActionSpec]) -> dict[str, Any]:
    action = known.get(call.name)
    names = [name for name, _ in argument_names(action)] if action else []
    values = [list(value) if isinstance(value, tuple) else value for value in call.args]
    team = {"team": call.team} if call.team else {}
    return {**team, "action": call.name, **dict(zip(names, values, strict=False))}


def _sample_order(briefing: Briefing) -> str:
    samples = {"tag": "0x…", "unit": "0x…", "second_unit": "0x…", **EXAMPLE_POINTS}
    action = next((action for action in briefing.actions if action.args), briefing.actions[0])
    given = {name: samples[name] for name, _ in argument_names(action)}
    return json.dumps({"team": briefing.teams[0].name, "action": action.name, **given}, ensure_ascii=False)
