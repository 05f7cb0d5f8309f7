"""Why a call is refused: one name for each reason."""

from __future__ import annotations

from typing import Literal

RejectionReason = Literal[
    "malformed",  # looks like a call, but is not one
    "unknown_action",  # no action of this name in the agent's catalogue
    "wrong_arguments",  # number or form of the arguments
    "unknown_team",  # a team that this agent does not have
    "unknown_target",  # a tag that names no unit in sight
    "dead_target",  # a tag of a unit that has died
    "not_yours",  # a tag of a unit that does not obey this team
    "invalid_target",  # a unit or a point that this action cannot be used on
    "friendly_target",  # a unit of one's own side, or an ally's, taken for an enemy
    "wrong_frame",  # a point that only makes sense in the other frame
    "out_of_bounds",  # a point outside of its frame or of the map
    "not_available",  # known, but not now: cost, cooldown, requirement
    "too_many_actions",  # over the number of actions a team may have in one reply
    "unknown_recipient",  # a message to nobody
    "unread",  # of the reply, or of its end, nothing could be read
    "too_late",  # the reply took effect too long after its observation
    "too_many_messages",  # over the number of messages an agent may send in one reply
    "refused_by_game",  # PySC2 or the game answered with an error
]
