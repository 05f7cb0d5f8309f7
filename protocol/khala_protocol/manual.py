"""How to write what is no action: the sentences of every prompt.

Prompts are made of them, and a reply that repeats them does not mean it (`khala_protocol.speech.echoes`).
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from khala_protocol.messages import ActionSpec

MESSAGE: Final = "<MessageTo(name, '''text''')> sends a text to one of them; it arrives with their next observation."
LISTEN: Final = "<ListenTo(channel)> lets you hear a channel from the next observation on."
NOTE: Final = "<Note('''text''')> keeps a note for yourself, of at most 200 characters."
FORGET: Final = "There is room for {notes} notes; then the oldest one goes.\n<Forget(2)> removes note 2."
VERDICT: Final = "Nothing of this answer can be carried out:"
"""First line of a verdict, on the answer before it."""
STANDING: Final = """\
<Standing({call}, until 4:30)> under the heading of a team has the host give this action again and again until 4:30 of \
the game's clock: to idle units of the team, or once a step for a team without units.
Other ends: until attacked, until minerals 400{made}. Without an end it goes on until you revoke it.
<Revoke(1)> ends standing order 1. A team has at most {most}; they do not count as actions of a step."""
MADE: Final = ", until 22 {kind} (with those in production)"
"""An end for those who train."""


def list_actions(actions: Iterable[ActionSpec]) -> str:
    """Return the actions of an agent with what they do.

    Those that do the same share a line, and those that are carried out in the same way a heading, the part of their
    descriptions before a colon: `Train in a free Gateway:`.
    """
    lines: list[str] = []
    for way, likes in groupby(actions, _way):
        alike = list(likes)
        shared = bool(way) and len(alike) > 1
        lines += [f"{way}:"] if shared else []
        for _, same in groupby(alike, lambda action: action.description or action.name):
            first, *others = same
            forms = ", ".join(action.form for action in (first, *others))
            said = first.description.removeprefix(f"{way}: ") if shared else first.description
            lines.append(f"- {forms}: {said}".removesuffix(": "))
    return "\n".join(lines)


def _way(action: ActionSpec) -> str:
    way, colon, _ = action.description.partition(": ")
    return way if colon else ""


def standing_orders(actions: Iterable[ActionSpec], most: int) -> str:
    """Return how to give a standing order, with actions of the agent's own as examples."""
    actions = list(actions)
    trained = next((a.name.removeprefix("Train_") for a in actions if a.name.startswith("Train_") and not a.args), "")
    made = MADE.format(kind=trained) if trained else ""
    return STANDING.format(call=_worth_repeating(actions), most=most, made=made)


def _worth_repeating(actions: Sequence[ActionSpec]) -> str:
    """Return a call that makes sense again and again, of an agent's own actions: no skill, which would use units up."""
    for action in actions:
        if not action.args and action.name.startswith(("Train_", "Warp_", "All_Units_")):
            return f"{action.name}()"
    for action in actions:
        if action.args in (("minimap",), ("screen",)) and action.name.startswith(("Attack_", "Move_")):
            return f"{action.name}({'[32, 32]' if action.args[0] == 'minimap' else '[12, 12]'})"
    return "Action(arguments)"


def manual(actions: tuple[ActionSpec, ...]) -> str:
    """Return all sentences about calls that may stand in the prompt of an agent with these actions."""
    return "\n".join([list_actions(actions), MESSAGE, LISTEN, NOTE, FORGET, standing_orders(actions, 0)])
