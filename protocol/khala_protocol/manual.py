"""How to write what is no action: the sentences of every prompt.

Prompts are made of them, and a reply that repeats them does not mean it (`khala_protocol.speech.echoes`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_protocol.messages import ActionSpec

MESSAGE: Final = "<MessageTo(name, '''text''')> sends a text to one of them; it arrives with their next observation."
LISTEN: Final = "<ListenTo(channel)> lets you hear a channel from the next observation on."
NOTE: Final = "<Note('''text''')> keeps a note for yourself, of at most 200 characters."
FORGET: Final = "There is room for {notes} notes; then the oldest one goes.\n<Forget(2)> removes note 2."
VERDICT: Final = "Nothing of this answer can be carried out:"
"""First line of a verdict, on the answer before it."""
STANDING: Final = """\
<Standing({call}, until 4:30)> under the heading of a team has the host give this action again and again.
It is given to idle units of the team; for a team without units, once a step whenever it is possible.
It ends at 4:30 of the game's clock. Other ends: until 22 Probe (so many, with those in production), until \
WarpGateResearch (an upgrade), until attacked, until minerals 400. Without an end it goes on until you revoke it.
<Revoke(1)> ends standing order 1. A team has at most {most}; they do not count as actions of a step."""


def list_actions(actions: Iterable[ActionSpec]) -> str:
    """Return the actions of an agent, one a line, each with what it does."""
    return "\n".join(f"- {action.form}: {action.description}".removesuffix(": ") for action in actions)


def standing_orders(actions: Iterable[ActionSpec], most: int) -> str:
    """Return how to give a standing order, with an action of the agent's own as the example."""
    plain = next((action.name for action in actions if not action.args), None)
    return STANDING.format(call=f"{plain}()" if plain else "Action(arguments)", most=most)


def manual(actions: tuple[ActionSpec, ...]) -> str:
    """Return all sentences about calls that may stand in the prompt of an agent with these actions."""
    return "\n".join([list_actions(actions), MESSAGE, LISTEN, NOTE, FORGET, standing_orders(actions, 0)])
