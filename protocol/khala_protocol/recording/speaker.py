"""Who said what is recorded: the key says it, and a message that names another is none.

Over TLS a router lets an agent write under its own keys alone. What stands in the message it writes itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_protocol.recording.recorder import KINDS

if TYPE_CHECKING:
    from khala_protocol.keys import Address
    from khala_protocol.messages import Wire


def is_said_by(address: Address, message: Wire) -> bool:
    """Return whether a message may stand under a key: it is of its topic, and names its run, side and agent."""
    named = (message.run, getattr(message, "side", None), getattr(message, "agent", None))
    return type(message) is KINDS.get(address.topic) and fits(address, *named)


def fits(address: Address, run: object, side: object, agent: object) -> bool:
    """Return whether a key is one of this run, side and agent; None is said by messages that name none."""
    if run not in (None, address.run):
        return False
    return address.agent is None or (side in (None, address.side) and agent in (None, address.agent))
